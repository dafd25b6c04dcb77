# SPDX-License-Identifier: MIT
# classes.gp - the first page: what is claimed behind walls and mud, over how faint they are, method by method.
of(c, m) = "< python3 -B -c \"import csv,sys,statistics as s; t={}; [t.setdefault(float(r['below_wall_db']),[]).append((100*float(r['past_share']),100*float(r['said_share']))) for r in csv.DictReader(open('".data."target_classes.csv')) if r['target']=='".c."' and r['value']=='".m."']; print('below,past,low,high,said'); [print(x, sum(p for p,_ in v)/len(v), min(p for p,_ in v), max(p for p,_ in v), sum(q for _,q in v)/len(v), sep=',') for x,v in sorted(t.items())]\""
array method[4] = ['heard, as shipped', 'minimum', 'fixed threshold', 'fixed threshold, silence unknown']
set terminal svg size 1300,480 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'classes.svg'
set multiplot layout 1,3 margins 0.06,0.99,0.13,0.80 spacing 0.07,0
set xrange [-1:31]
set xtics 0,6
set yrange [-3:103]
set xlabel 'dB less than in the scenes of the made-up sea'
unset key
set ylabel 'beams that claim water behind it, %'
set title 'a wall'
array at_x[4] = [0.06, 0.26, 0.40, 0.60]
do for [i = 1:4] { set label i '● '.method[i] at screen at_x[i],0.95 textcolor lt i }
plot for [i = 1:4] of('wall', method[i]) using "below":"past":"low":"high" with yerrorlines lc i lw 3 title method[i]
unset label
set title 'a soft bottom'

plot for [i = 1:4] of('mud', method[i]) using "below":"past":"low":"high" with yerrorlines lc i lw 3 title method[i]
unset key
set ylabel 'water before it that is said to be free, %'
unset label
set title 'a soft bottom'
plot for [i = 1:4] of('mud', method[i]) using "below":"said" with linespoints lc i lw 3
unset multiplot
