# SPDX-License-Identifier: MIT
# pilot.gp - chapter "A pilot in the loop": six drives seen from above.
of(drive, kind, class) = "< awk -F, '$1 == \"".drive."\" && $2 == \"".kind."\" && $3 ~ /".class."/ {print $4 \",\" $5 \",\" $6 \",\" $7} END {print \"-99,-99,0,0\"}' ".data.'pilot_tracks.csv'
title_of(drive) = system("awk -F, '$1 == \"".drive."\" && $2 == \"title\" {print $3}' ".data.'pilot_tracks.csv')
set terminal svg size 1100,1120 font 'sans-serif,12' background 'white' noenhanced dynamic rounded
set output out.'pilot_tracks.svg'
set multiplot layout 2,3
unset key
set size ratio -1
set xrange [-7:7]
set yrange [-3:15]
set xlabel 'east, m'
set ylabel 'north, m'
set title font ',11'
do for [drive = 0:5] {
    words_of = title_of(sprintf('%d', drive))
    half = strstrt(words_of, '; ') + strstrt(words_of[strstrt(words_of, '; ') + 2:], '; ') + 2
    set title words_of[1:half]."\n".words_of[half + 1:]
    d = sprintf('%d', drive)
    plot of(d, 'box', '0') using 3:1:3:4:1:2 with boxxyerror fs solid 1 noborder lc rgb '#56657a', \
         of(d, 'box', '1') using 3:1:3:4:1:2 with boxxyerror fs transparent solid 0.15 noborder lc rgb '#4a7fb5', \
         of(d, 'room', '0') using 3:1:3:4:1:2 with boxxyerror lc rgb '#56657a' fs empty, \
         of(d, 'pile', '0') using 2:1:3 with circles fs solid 1 lc rgb '#56657a', \
         of(d, 'swim', '0') using 2:1:4:3 with vectors nohead dt 2 lc rgb '#56657a', \
         of(d, 'way', '0') using 2:1 with points pt 7 ps 0.35 lc rgb '#2a9d5c', \
         of(d, 'way', '1') using 2:1 with points pt 7 ps 0.35 lc rgb '#e09f1f', \
         of(d, 'way', '2') using 2:1 with points pt 7 ps 0.35 lc rgb '#c8352b', \
         of(d, 'goal', '0') using 2:1 with points pt 6 ps 1.4 lw 3 lc rgb '#222255'
}
unset multiplot
