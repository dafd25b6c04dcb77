# SPDX-License-Identifier: MIT
# active_sensing.gp - chapter "Active scanning": share of new things noticed against time.
active_sensing = data.'active_sensing.csv'
ways = '"plain by itself" "plain asked for every ping" active "active with a circle of 90 s"'
set terminal svg size 900,460 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'active_sensing.svg'
set key inside right bottom
set xlabel 'seconds until a ping goes there'
set ylabel 'share of the new things'
set xrange [0:*]
set yrange [0:1]
plot for [w = 1:4] active_sensing using (stringcolumn("way") eq word(ways, w) ? column("noticed_s") : NaN):(column("share")) with linespoints pt 7 ps 0.5 title word(ways, w)
