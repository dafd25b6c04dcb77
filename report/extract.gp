# SPDX-License-Identifier: MIT
# extract.gp - chapter "Range extraction": errors against cost, and against each other.
points = data.'extract_points.csv'
ordered = "window guard false_alarm min_contrast floor ring_down fixed_threshold"
named = "detector no_echo amplitude background cleanup"
knobs = ordered.' '.named
of(knob) = "< sed -n '1p;/^".knob.",/p' ".points
flag(f, c) = column(f) == 1 ? column(c) : NaN

# names where there is room for them, of knobs whose values have no order
told(s) = place(field("knob")) > 6 && column('told_'.s) == 1 ? field("value") : ""

set logscale x
set xrange [2:1000]
set xlabel 'instructions per bin (nanoseconds where these cannot be counted)'

# share of beams; what is 0 is drawn at the bottom
set logscale y
least = 3e-4
show(v) = v > least ? v : least
do for [m in "behind missed false"] {
    least = m eq "behind" ? 3e-4 : m eq "missed" ? 0.03 : 0.003
    set yrange [least*0.8:1.5]
    set ytics ("0.1 %%" 0.001, "1 %%" 0.01, "10 %%" 0.1, "100 %%" 1)
    if (m ne "behind") { set ytics add ("2 %%" 0.02, "5 %%" 0.05, "20 %%" 0.2, "50 %%" 0.5) }
    set ytics add ("0" least)
    s = m.'_share'
    set output out.'extract_'.m.'.svg'
    set ylabel m eq "behind" ? 'beams with free water claimed behind the surface' : \
               m eq "missed" ? 'surfaces missed' : 'false first echoes, of all beams'
    plot for [i = 1:words(knobs)] of(word(knobs, i)) using "cost":(show(column(s))):(show(column(s.'_low'))):(show(column(s.'_high'))) \
             with yerrorbars lc i pt 7 ps 0.6 notitle, \
         for [k in ordered] of(k) using "cost":(show(column(s))) with linespoints lc place(k) pt 7 title k, \
         for [k in named] of(k) using "cost":(show(column(s))) with points lc place(k) pt 7 title k, \
         points using "cost":(show(column(s))):(told(s)) \
             with labels left offset 0.6,0.3 font ',9' textcolor rgb '#555555' notitle, \
         points using (flag('front_'.s, "cost")):(show(column(s))) with points pt 6 ps 1.6 lw 1.5 lc rgb '#222222' title 'Pareto front', \
         points using (flag("default", "cost")):(show(column(s))) every ::0::9 with points pt 3 ps 1.8 lw 2 lc rgb 'black' title 'shipped default'
}

set output out.'extract_range.svg'
set ylabel 'range error, 95 % of the found surfaces, m'
set yrange [0.01:1]
set ytics (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1)
set format y '%g'
s = 'range_p95_m'
plot for [i = 1:words(knobs)] of(word(knobs, i)) using "cost":(column(s)):(column(s.'_low')):(column(s.'_high')) \
         with yerrorbars lc i pt 7 ps 0.6 notitle, \
     for [k in ordered] of(k) using "cost":(column(s)) with linespoints lc place(k) pt 7 title k, \
     for [k in named] of(k) using "cost":(column(s)) with points lc place(k) pt 7 title k, \
     points using "cost":(column(s)):(told(s)) \
         with labels left offset 0.6,0.3 font ',9' textcolor rgb '#555555' notitle, \
     points using (flag('front_'.s, "cost")):(column(s)) with points pt 6 ps 1.6 lw 1.5 lc rgb '#222222' title 'Pareto front', \
     points using (flag("default", "cost")):(column(s)) with points pt 3 ps 1.8 lw 2 lc rgb 'black' title 'shipped default'

set xrange [*:*]
set yrange [*:*]
stats points using (flag("default", "missed_share")) name 'M' nooutput
stats points using (flag("default", "false_share")) name 'F' nooutput
far(x, y) = abs(log(x/M_mean)) > 0.35 || abs(log(y/F_mean)) > 0.5
set output out.'extract_trade.svg'
set xlabel 'surfaces missed'
set ylabel 'false first echoes, of all beams'
least = 0.002
set xrange [0.03:1.2]
set yrange [0.0018:1.1]
set xtics ("3 %%" 0.03, "5 %%" 0.05, "10 %%" 0.1, "20 %%" 0.2, "50 %%" 0.5, "100 %%" 1)
set ytics ("0" least, "1 %%" 0.01, "2 %%" 0.02, "5 %%" 0.05, "10 %%" 0.1, "20 %%" 0.2, "50 %%" 0.5, "100 %%" 1)
plot for [k in ordered] of(k) using "missed_share":(show(column("false_share"))) with linespoints lc place(k) pt 7 title k, \
     for [k in named] of(k) using "missed_share":(show(column("false_share"))) with points lc place(k) pt 7 title k, \
     points using "missed_share":(show(column("false_share"))):(column('told_missed_share') == 1 && far(column("missed_share"), show(column("false_share"))) ? field("value") : "") \
         with labels left offset 0.6,0.4 font ',10' textcolor rgb '#555555' notitle, \
     points using (flag("default", "missed_share")):(show(column("false_share"))) with points pt 3 ps 1.8 lw 2 lc rgb 'black' title 'shipped default'

# every knob by itself
set terminal svg size 1200,760 font 'sans-serif,12' background 'white' noenhanced dynamic rounded
set output out.'extract_knobs.svg'
set multiplot layout 2,6 margins 0.06,0.99,0.21,0.93 spacing 0.02,0.15
unset logscale x
set xrange [*:*]
set offsets 0.4,0.4,0,0
unset key
curves = "2 'behind a surface' 1 missed 5 'false first echo' 3 'free water not claimed'"
do for [i = 1:4] { set label i '● '.word(curves, 2*i) at screen 0.02+0.2*i,0.025 textcolor lt int(word(curves, 2*i-1)) }
set xlabel
set ylabel
least = 5e-4
set yrange [least*0.8:1.2]
set xtics autofreq rotate by 45 right
do for [i = 1:words(knobs)] {
    k = word(knobs, i)
    set title k offset 0,-0.5
    if (k eq 'cleanup') { set xtics rotate by 90 right }
    set ytics ("0" least, "0.1 %%" 0.001, "1 %%" 0.01, "10 %%" 0.1, "100 %%" 1)
    if (i != 1 && i != 7) { set format y ""; set ytics ("" least, "" 0.001, "" 0.01, "" 0.1, "" 1) }
    plot of(k) using "place":(show(column("behind_share"))):xtic(field("value")) with linespoints lc 2 notitle, \
         of(k) using "place":(show(column("missed_share"))) with linespoints lc 1 notitle, \
         of(k) using "place":(show(column("false_share"))) with linespoints lc 5 notitle, \
         of(k) using "place":(show(column("unclaimed_share"))) with linespoints lc 3 notitle, \
         of(k) using (column("default") == 1 ? column("place") : NaN):(1) with impulses lc rgb '#999999' lw 1 dt 2 notitle
    unset label # drawn once
}
unset multiplot
