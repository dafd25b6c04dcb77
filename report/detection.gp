# SPDX-License-Identifier: MIT
# detection.gp - chapter "What a ping says of the water": receiver operating characteristics.
roc = data.'detection_roc.csv'
methods = "sonard threshold SOCA ping360_sonar 'knows all'"
of(m, v) = field("method") eq m ? v : NaN
shown(v, least) = v > least ? v : least
set terminal svg size 1100,520 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'detection.svg'
set multiplot layout 1,2
set logscale x
set yrange [0:100]
set ylabel 'free water said to be free, %'
set key at graph 0.5,0.7
do for [panel = 1:2] {
    key = panel == 1 ? "past" : "nothing"
    least = panel == 1 ? 0.05 : 0.01
    set xrange [least*0.8:panel == 1 ? 3000 : 100]
    set xlabel panel == 1 ? 'beams of 1e4 with free water behind what is heard like a wall' : 'first echoes of nothing, % of beams'
    plot for [i = 1:5] roc using (of(word(methods, i), shown(column(key), least))):(column("free")) with linespoints lc i pt 7 title word(methods, i), \
         roc using (field("standard") eq "1" ? shown(column(key), least) : NaN):(column("free")) with points pt 3 ps 1.6 lw 2 lc rgb 'black' notitle
    unset key
}
unset multiplot
