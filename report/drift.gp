# SPDX-License-Identifier: MIT
# drift.gp - chapter "Voxel map: submap length where poses drift".
drift = "< grep -v uncorrected ".data.'drift.csv'
least = 0.01
show(v) = v > least ? v : least
shipped(c) = column("default") == 1 ? c : NaN
length_m(i) = column("submap_m") > 100 ? 33 : column("submap_m")

set terminal svg size 1500,420 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'drift.svg'
set multiplot layout 1,3 margins 0.07,0.92,0.14,0.86 spacing 0.09,0
set logscale xy
set xlabel 'submap_distance, m'
set xrange [1.5:45]
set xtics ('2' 2, '5' 5, '10' 10, '20' 20, '1000' 33)
unset key
set ylabel "volume free that is solid, m³" offset 1,0
set yrange [least*0.8:30]
set ytics ('≤ 0.01' least, 0.1, 1, 10)
plot drift using (length_m(0)):(show(column("false_free_m3"))):(show(column("false_free_m3_low"))):(show(column("false_free_m3_high"))) with yerrorlines lc 1 pt 7, \
     drift using (length_m(0)):(shipped(show(column("false_free_m3")))) with points pt 6 ps 1.8 lw 2 lc rgb 'black'
set key inside top right vertical
set ylabel 'distance between surfaces, m'
unset logscale y
set yrange [0:5]
set ytics 0.5
plot for [i=1:3] drift using (length_m(0)):(column(word("to_truth_mean_m to_truth_p95_m to_truth_max_m", i))) with linespoints lc 1 dt i pt 7 title word("'map to truth: mean' '95 %' largest", i), \
     for [i=1:3] drift using (length_m(0)):(column(word("to_map_mean_m to_map_p95_m to_map_max_m", i))) with linespoints lc 2 dt i pt 7 title word("'truth to map: mean' '95 %' largest", i)
set key outside top center horizontal
set ylabel 'share of the free volume not in common'
unset logscale y
set yrange [0:0.8]
set ytics 0.1
set logscale y2
set y2label "nanoseconds a voxel" offset -1,0
set y2range [10:10000]
set y2tics (10, 100, 1000, 10000)
set border 11
plot drift using (length_m(0)):(column("not_common_share")):(column("not_common_share_low")):(column("not_common_share_high")) with yerrorlines lc 1 pt 7 title 'not in common (left)', \
     drift using (length_m(0)):(column("ns_merge")) axes x1y2 with linespoints lc 2 pt 7 title 'ns a voxel (right)', \
     drift using (length_m(0)):(shipped(column("not_common_share"))) with points pt 6 ps 1.8 lw 2 lc rgb 'black' notitle
unset multiplot
