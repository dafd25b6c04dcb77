# SPDX-License-Identifier: MIT
# precision.gp - chapter "Float or double".
evidence = data.'precision_evidence.csv'
voxels = data.'precision_voxels.csv'
of(file, format) = "< grep -e '^format' -e '^".format.",' ".file
show(v, least) = v > least ? v : least

set terminal svg size 1100,460 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'precision.svg'
set multiplot layout 1,2 margins 0.08,0.98,0.14,0.86 spacing 0.1,0
set logscale xy
set format '%g'
set key outside top center horizontal maxrows 2
set xlabel 'updates of the cell'
set ylabel 'worst error of the log-odds'
set yrange [1e-17:1e-4]
set ytics ('1e-16' 1e-16, '1e-14' 1e-14, '1e-12' 1e-12, '1e-10' 1e-10, '1e-8' 1e-8, '1e-6' 1e-6, '1e-4' 1e-4)
set xtics (1, 10, 100, 1000, 10000, 100000)
plot for [f in '"float kept and computed" "float kept and double computed" "double kept and computed" sonard'] \
         of(evidence, f) using "updates":(show(column("error"), 2e-17)):(show(column("error"), 2e-17)):(show(column("error_max"), 2e-17)) \
         with yerrorlines pt (f eq 'sonard' ? 6 : 7) ps (f eq 'sonard' ? 1.6 : 0.7) title f
set xlabel 'distance from the origin, m'
set ylabel 'voxels wrong, of those in the beam'
set yrange [5e-5:10]
set ytics ('none' 5e-5, 0.0001, 0.001, 0.01, 0.1, 1, 10)
set xtics ('1' 1, '100' 100, '1e4' 1e4, '1e6' 1e6, '1e8' 1e8)
plot for [f in '"metres of the world in float" "metres of the world in double" sonard'] \
         of(voxels, f) using "distance_m":(show(column("wrong_share"), 5e-5)):(show(column("wrong_share"), 5e-5)):(show(column("wrong_share_max"), 5e-5)) \
         with yerrorlines pt (f eq 'sonard' ? 6 : 7) ps (f eq 'sonard' ? 1.6 : 0.7) title f
unset multiplot
