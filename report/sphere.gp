# SPDX-License-Identifier: MIT
# sphere.gp - chapter "Spherical grid: error against run time".
points = data.'sphere_points.csv'
ordered = "angular_step layer growth"
named = "sensor_model update"
knobs = ordered.' '.named
of(knob) = "< sed -n '1p;/^".knob.",/p' ".points
flag(f, c) = column(f) == 1 ? column(c) : NaN

set terminal svg size 1100,860 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'sphere_errors.svg'
set multiplot layout 2,2 margins 0.09,0.84,0.08,0.97 spacing 0.1,0.11
set logscale xy
set xlabel 'instructions per beam'
set xrange [2e4:2.5e6]
set xtics ('20 k' 2e4, '50 k' 5e4, '100 k' 1e5, '200 k' 2e5, '500 k' 5e5, '1 M' 1e6, '2 M' 2e6)
labelled(k) = k eq 'angular_step' || k eq 'sensor_model' || (k eq 'growth' && m == 3)
measures = "false_block_share range_p95_m range_median_m direction_deg"
array title_of[4] = ['open water called blocked, share', 'range error, 95 %, m', 'range error, median, m', 'a post is blocked beyond its edge, degrees']
array low[4] = [0.02, 0.05, 0.005, 1]
array high[4] = [0.3, 5, 0.5, 10]
do for [m = 1:4] {
    s = word(measures, m)
    least = low[m]
    show(v) = v > least ? v : least
    set yrange [low[m]*0.9:high[m]]
    set ylabel title_of[m]
    set ytics (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10)
    if (m == 2) { set key at screen 0.995,0.95 right top } else { unset key }
    plot for [i = 1:words(knobs)] of(word(knobs, i)) using "cost":(show(column(s))):(show(column(s.'_low'))):(show(column(s.'_high'))) \
             with yerrorbars lc i pt 7 ps 0.6 notitle, \
         for [k in ordered] of(k) using "cost":(show(column(s))) with linespoints lc place(k) pt 7 title k, \
         for [k in named] of(k) using "cost":(show(column(s))) with points lc place(k) pt 7 title k, \
         points using "cost":(show(column(s))):(labelled(field("knob")) && column('told_'.s) == 1 ? field("value") : "") with labels left offset 0.5,0.4 font ',9' textcolor rgb '#555555' notitle, \
         points using (flag('front_'.s, "cost")):(show(column(s))) with points pt 6 ps 1.6 lw 1.5 lc rgb '#222222' title 'Pareto front', \
         points using (flag("default", "cost")):(show(column(s))) with points pt 3 ps 1.8 lw 2 lc rgb 'black' title 'shipped'
}
unset multiplot
