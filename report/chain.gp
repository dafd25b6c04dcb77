# SPDX-License-Identifier: MIT
# chain.gp - chapter "The whole chain: error against run time".
points = data.'chain_points.csv'
ordered = "angular_step layer"
named = "threads detector no_echo marks cleanup sensor_model elevation"
knobs = ordered.' '.named
of(knob) = "< sed -n '1p;/^".knob.",/p' ".points
flag(f, c) = column(f) == 1 ? column(c) : NaN

set terminal svg size 1100,860 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'chain_errors.svg'
set multiplot layout 2,2 margins 0.08,0.83,0.08,0.97 spacing 0.1,0.13
set logscale xy
set format x '%.0s %c'
# names of what stands apart; the rest lies about the shipped point
labelled(k) = k eq 'angular_step' || (m == 4 ? k eq 'threads' : k eq 'no_echo' && m == 2 || k eq 'elevation' || k eq 'cleanup' && m != 2 || k eq 'marks' && m == 1)
measures = "false_block_share unknown_share range_median_m unknown_share"
array title_of[4] = ['open water called blocked, share', 'open water not known, share', 'range error, median, m', 'open water not known, share']
array low[4] = [0.01, 0.04, 0.02, 0.04]
array high[4] = [0.4, 1.1, 0.1, 1.1]
do for [m = 1:4] {
    s = word(measures, m)
    axis = m == 4 ? 'ns_per_bin' : 'cost'
    set xlabel m == 4 ? 'nanoseconds per ping' : 'instructions per ping (nanoseconds where these cannot be counted)'
    set xrange [m == 4 ? 1e4 : 1e5:m == 4 ? 2e6 : 5e6]
    set xtics (1e4, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6, 2e6, 5e6)
    set yrange [low[m]:high[m]]
    set ylabel title_of[m]
    set ytics (0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1)
    if (m == 2) { set key at screen 0.995,0.95 right top } else { unset key }
    plot for [i = 1:words(knobs)] of(word(knobs, i)) using axis:(column(s)):(column(s.'_low')):(column(s.'_high')) \
             with yerrorbars lc i pt 7 ps 0.6 notitle, \
         for [k in ordered] of(k) using axis:(column(s)) with linespoints lc place(k) pt 7 title k, \
         for [k in named] of(k) using axis:(column(s)) with points lc place(k) pt 7 title k, \
         points using axis:(column(s)):(column("default") == 1 || !labelled(field("knob")) || (m == 1 && column('told_'.s) != 1) ? "" : field("value")) with labels left offset 0.5,0.4 font ',9' textcolor rgb '#555555' notitle, \
         points using (m == 4 ? NaN : flag('front_'.s, axis)):(column(s)) with points pt 6 ps 1.6 lw 1.5 lc rgb '#222222' title 'Pareto front', \
         of('threads') using (flag("default", axis)):(column(s)) with points pt 3 ps 1.8 lw 2 lc rgb 'black' title 'shipped'
}
unset multiplot
