# SPDX-License-Identifier: MIT
# paper.gp - chapter "The first paper's experiments": cells from above and in depth, the harbour.
set style fill solid noborder
unset key
set size ratio -1
set xlabel 'east, m'
set ylabel 'north, m'
# a cell per row becomes an outline x,y,z; pieces of the truth get a gap between them
cells(scene, class) = "< awk -F, '$1 == ".class." {for (k = 3; k < 11; k += 2) print $k \",\" $(k+1) \",\" $2; print \"\"} END {print \"0,0,0\"}' " \
                      .data.'paper_cells_'.scene.'.csv'
truth(scene) = "< awk -F, 'NR > 1 {if ($1 != piece) print \"\"; piece = $1; print $2 \",\" $3}' ".data.'paper_model_'.scene.'.csv'
array shade[3] = ['#9db8d2', '#4a7fb5', '#123c66']

set terminal svg size 900,720 font 'sans-serif,14' background 'white' noenhanced dynamic rounded
set output out.'paper_model.svg'
plot truth('model') using 1:2 with lines lc rgb '#bbbbbb' lw 4, \
     for [i=1:3] cells('model', i) using 1:2 with filledcurves closed lc rgb shade[i], \
     data.'paper_path_model.csv' skip 1 using 1:2 with lines lc rgb '#d6562b', \
     data.'paper_path_model.csv' skip 1 using 1:2:(sprintf('%d', $3)) with labels offset 0,0.8 textcolor rgb '#d6562b'

set output out.'paper_depth.svg'
set size noratio
set xlabel 'east + 0.4 north, m'
set ylabel '3 up + 0.4 north, m'
plot for [i=1:3] cells('model', i) using ($1+0.4*$2):(3*$3+0.4*$2) with filledcurves closed lc rgb shade[i]
set xlabel 'east, m'
set ylabel 'north, m'

set terminal svg size 900,520 font 'sans-serif,14' background 'white' noenhanced dynamic rounded
set output out.'paper_harbour.svg'
set multiplot layout 1,2
set size ratio -1
set xrange [-15:20]
set yrange [-22:20]
plot truth('harbour') using 1:2 with lines lc rgb '#bbbbbb' lw 4, \
     data.'paper_echoes_harbour.csv' skip 1 using 1:2 with points lc rgb '#123c66' pt 7 ps 0.4
plot truth('harbour') using 1:2 with lines lc rgb '#bbbbbb' lw 4, \
     for [i=1:3] cells('harbour', i) using 1:2 with filledcurves closed lc rgb shade[i]
unset multiplot

clusters(kind, from, to) = "< awk -F, '$1 >= ".from." && $1 <= ".to." {for (k = 3; k < 11; k += 2) print $k \",\" $(k+1) \",\" $2; print \"\"} END {print \"0,0,0\"}' " \
                           .data.'paper_'.kind.'_harbour.csv'
array hue[3] = ['#123c66', '#d6562b', '#3f8f4f']
set output out.'paper_clusters.svg'
set multiplot layout 1,2
do for [kind in 'clusters relaxed'] {
    plot truth('harbour') using 1:2 with lines lc rgb '#bbbbbb' lw 4, \
         clusters(kind, 4, 999) using 1:2 with filledcurves closed lc rgb '#888888', \
         for [i=1:3] clusters(kind, i, i) using 1:2 with filledcurves closed lc rgb hue[i]
}
unset multiplot
