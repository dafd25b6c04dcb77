# SPDX-License-Identifier: MIT
# capture_answers.gp - sonard-report: sectors by state over time, and the nearest range.
answers = data.'answers.csv'
set output out.'capture_answers.svg'
set multiplot layout 2,1
set xrange [0:*]
set yrange [0:*]
set ylabel 'sectors'
plot answers using (column("t_s")):(column("blocked")) with steps title 'blocked' lc 2, \
     answers using (column("t_s")):(column("clear")) with steps title 'clear' lc 3, \
     answers using (column("t_s")):(column("unknown")) with steps title 'unknown' lc 9
set xlabel 's since the begin of the capture'
set ylabel 'range, m'
plot answers using (column("t_s")):(column("nearest_m")) with linespoints title 'nearest' lc 1, \
     answers using (column("t_s")):(column("median_m")) with linespoints title 'median' lc 8
unset multiplot
