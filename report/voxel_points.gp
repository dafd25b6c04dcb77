# SPDX-License-Identifier: MIT
# voxel_points.gp - chapter "Voxel map: error against run time".
points = data.'voxel_points.csv'
ordered = "voxel tolerance threshold echo_weight opening"
named = "casting"
knobs = ordered.' '.named
of(knob) = "< sed -n '1p;/^".knob.",/p' ".points
flag(f, c) = column(f) == 1 ? column(c) : NaN
set logscale xy
set format x '%.0s %c'
set xlabel 'instructions per ping (nanoseconds where these cannot be counted)'
do for [m in "false_free overlap surface"] {
    s = m eq 'false_free' ? 'false_free_m3' : m eq 'overlap' ? 'not_common_share' : 'to_truth_p95_m'
    least = m eq 'false_free' ? 0.001 : m eq 'overlap' ? 0.1 : 0.2
    show(v) = v > least ? v : least
    set output out.'voxel_'.m.'.svg'
    set ylabel m eq 'false_free' ? 'volume free that is solid, m³' : m eq 'overlap' ? 'share of the free volume not in common (1 - IoU)' : \
               'from the frontier to the nearest surface, 95 %, m'
    set format y '%g'
    if (m eq 'false_free') { set yrange [least*0.8:30]; set ytics ('≤ 0.001' least, 0.01, 0.1, 1, 10) }
    if (m eq 'overlap') { set yrange [least:1.1]; set ytics (0.1, 0.2, 0.3, 0.5, 0.7, 1) }
    if (m eq 'surface') { set yrange [least*0.9:3]; set ytics ('none' least, 0.3, 0.5, 0.7, 1, 2, 3) }
    plot for [i = 1:words(knobs)] of(word(knobs, i)) using "cost":(show(column(s))):(show(column(s.'_low'))):(show(column(s.'_high'))) \
             with yerrorbars lc i pt 7 ps 0.6 notitle, \
         for [k in ordered] of(k) using "cost":(show(column(s))) with linespoints lc place(k) pt 7 title k, \
         for [k in named] of(k) using "cost":(show(column(s))) with points lc place(k) pt 7 title k, \
         points using "cost":(show(column(s))):(column('told_'.s) == 1 ? field("value") : "") with labels left offset 0.6,0.3 font ',9' textcolor rgb '#555555' notitle, \
         points using (flag('front_'.s, "cost")):(show(column(s))) with points pt 6 ps 1.6 lw 1.5 lc rgb '#222222' title 'Pareto front', \
         points using (flag("default", "cost")):(show(column(s))) every ::0::9 with points pt 3 ps 1.8 lw 2 lc rgb 'black' title 'shipped default'
}
