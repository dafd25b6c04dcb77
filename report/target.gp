# SPDX-License-Identifier: MIT
# target.gp - chapter "What free water is free of": what is said and what is false, over the strength of target and bottom.
seas = data.'target_seas.csv'
waters = data.'target_waters.csv'
of(k, v) = field("knob") eq k ? v : NaN
set terminal svg size 1300,480 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'target.svg'
set multiplot layout 1,3
set yrange [0:100]
set xrange [0:30]
set key outside top center horizontal maxrows 4
do for [k in "target bottom"] {
    set xlabel k.', dB below a wall'.(k eq "target" ? ' (bottom = off)' : ' (target = wall)')
    set ylabel k eq "target" ? 'made-up sea, %' : ''
    plot seas using (of(k, column("below_wall_db"))):(column("said")) with linespoints lw 3 lc 3 title 'free water said to be free', \
         seas using (of(k, column("below_wall_db"))):(column("soft_bottom")) with linespoints lc 2 title 'beams past a soft bottom', \
         seas using (of(k, column("below_wall_db"))):(column("softer_6db")) with linespoints lc 2 dt 2 title 'past one 6 dB softer', \
         seas using (of(k, column("below_wall_db"))):(column("softer_12db")) with linespoints lc 2 dt 3 title 'past one 12 dB softer', \
         seas using (field("knob") eq k && field("default") eq "1" ? column("below_wall_db") : NaN):(column("said")) with points pt 3 ps 1.6 lw 2 lc rgb 'black' notitle
}
set xrange [0:*]
set ylabel 'drawn waters: free water said to be free, %'
set xlabel 'beams of 1e4 past a bottom or surface'
plot for [i = 1:2] waters using (of(word("target bottom", i), column("past_plane"))):(column("free")) with linespoints lc i title word("target bottom", i), \
     for [i = 1:2] waters using (of(word("target bottom", i), column("past_plane"))):(column("free")):(field("below_wall_db")) with labels offset (i == 1 ? 1.2 : -1.2),(i == 1 ? -0.6 : 0.6) textcolor lt i notitle, \
     waters using (field("default") eq "1" ? column("past_plane") : NaN):(column("free")) with points pt 3 ps 1.6 lw 2 lc rgb 'black' title 'shipped'
unset multiplot
