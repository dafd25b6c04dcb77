# SPDX-License-Identifier: MIT
# false_alarm.gp - chapter "Measured false-alarm rate": one panel per clutter.
rates = data.'false_alarm.csv'
clutters = "exact power linear sqrt log 'whole stage'"
detectors = "ca goca soca os"
set terminal svg size 1100,720 font 'sans-serif,12' background 'white' noenhanced dynamic rounded
set output out.'false_alarm.svg'
set multiplot layout 2,3 margins 0.07,0.99,0.13,0.92 spacing 0.02,0.1
set logscale xy
set xrange [3e-7:3e-2]
set yrange [0.1:10]
set ytics ("1/10" 0.1, "1/3" 0.3333, "1" 1, "3" 3, "10" 10)
set format x '1e%T'
unset key
do for [d = 1:4] { set label d '● '.word(detectors, d) at screen 0.3+0.1*d,0.025 textcolor lt d }
of(c, d, v) = field("clutter") eq c && field("detector") eq d ? v : NaN
least(v) = v > 0.1 ? v : 0.1
do for [i = 1:6] {
    clutter = word(clutters, i)
    set title clutter
    set xlabel i > 3 ? 'asked rate' : ''
    set ylabel i % 3 == 1 ? 'measured / asked' : ''
    if (i % 3 == 1) { set ytics ("1/10" 0.1, "1/3" 0.3333, "1" 1, "3" 3, "10" 10) } else { set ytics ("" 0.1, "" 0.3333, "" 1, "" 3, "" 10) }
    plot for [d = 1:4] rates using (of(clutter, word(detectors, d), column("asked")*1.2**(d-2.5))):(least(column("measured")/column("asked"))):(least(column("low")/column("asked"))):(column("high")/column("asked")) \
             with yerrorbars lc d pt 7 ps 0.6 lw 1.3 notitle, \
         1 with lines lc rgb '#999999' lw 1 notitle
    unset label # drawn once
}
unset multiplot
