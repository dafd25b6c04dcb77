# SPDX-License-Identifier: MIT
# voxel_shaft.gp - chapter "Voxel map": cuts through the map of the shaft.
cuts = data.'voxel_slices.csv'
of(figure, cut, level) = "< grep -E '^".figure.",".cut.",(".level."),' ".cuts
light = '#bcd6ef'
blue = '#0b66c3'
red = '#d6562b'
truth = '#444444'
set terminal svg size 900,860 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
unset key
unset grid
set yrange [38:-3]
set ytics 5
set style fill solid noborder
set style line 1 lc rgb truth lw 1.5

# the truth: along the length, across the width
$length << END
0,0
9,0
9,12
3.5,27
3,27
3,30
10,30

10,36
-1,36

-1,30
1.5,30
1.5,27
0,27
0,0
END
$width << END
-2.5,0
2.5,0
2.5,27
1.5,27
1.5,30
2.5,30
2.5,36
-2.5,36
-2.5,30
-1.5,30
-1.5,27
-2.5,27
-2.5,0
END

set ylabel 'depth, m' offset 1
set xlabel 'along the chamber, m'
set output out.'voxel_shaft_6.svg'
set multiplot layout 1,2 margins 0.07,0.98,0.07,0.95 spacing 0.09
set xrange [-1:10]
do for [figure in "6a 6b"] {
    set title figure eq '6a' ? '10 images' : '20 images'
    plot of(figure, 'length', '1') using 4:6:4:5:6:7 with boxxyerror lc rgb light, \
         of(figure, 'length', '2|3') using 4:6:4:5:6:7 with boxxyerror lc rgb blue, \
         of(figure, 'length', '3') using 4:6:4:5:6:7 with boxxyerror lc rgb red, \
         $length with lines ls 1
}
unset multiplot

set output out.'voxel_shaft_7.svg'
set multiplot layout 1,4 margins 0.07,0.99,0.07,0.95 spacing 0.04
set xlabel 'along, m'
set title 'found free'
plot of('7', 'length', '1|2|3') using 4:6:4:5:6:7 with boxxyerror lc rgb light, $length with lines ls 1
unset ylabel
set title 'filtered'
plot of('7', 'length', '2|3') using 4:6:4:5:6:7 with boxxyerror lc rgb blue, $length with lines ls 1
set title 'surface'
plot of('7', 'length', '3') using 4:6:4:5:6:7 with boxxyerror lc rgb red, $length with lines ls 1
set xrange [-5.5:5.5]
set xlabel 'across, m'
set title 'filtered and surface'
plot of('7', 'width', '2') using 4:6:4:5:6:7 with boxxyerror lc rgb blue, \
     of('7', 'width', '3') using 4:6:4:5:6:7 with boxxyerror lc rgb red, $width with lines ls 1
unset multiplot
