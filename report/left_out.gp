# SPDX-License-Identifier: MIT
# left_out.gp - chapter "Left out": what each variant costs, as bars.
cost = data.'left_out_count.csv'
set terminal svg size 900,420 font 'sans-serif,14' background 'white' noenhanced dynamic rounded
set output out.'left_out.svg'
unset key
set border 1
set yrange [:] reverse
set offsets 0,0,0.6,0.6
set xrange [0:*]
set grid x noy
set ytics scale 0
set xlabel 'instructions per bin'
plot cost using (0):0:(0):(column("instructions")):($0-0.35):($0+0.35):ytic(field("stage")) with boxxyerror fs solid 0.8 lc 1, \
     cost using (column("instructions")):0:(sprintf("  %.0f", column("instructions"))) with labels left textcolor rgb '#444444'
