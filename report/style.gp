# SPDX-License-Identifier: MIT
# style.gp - what all plots share. `data` and `out` are the folders.
set terminal svg size 900,560 font 'sans-serif,14' background 'white' noenhanced dynamic rounded
set datafile separator ','
set datafile missing ''
set border 3 lc rgb '#666666'
set tics nomirror textcolor rgb '#444444'
set errorbars 0
set grid lc rgb '#e4e4e4' lw 1
set key outside right top vertical samplen 1.5 spacing 1.15 width -1
array colour[12] = ['#0b66c3', '#d6562b', '#2a9d5c', '#8a4fbf', '#c29a00', '#d0418f', '#00919c', '#7a5a3a', '#666666', '#9aa600', '#111111', '#e07a9a']
do for [i = 1:12] { set linetype i lc rgb colour[i] lw 2 pt 7 ps 0.7 }
field(name) = stringcolumn(name)
# knobs = "ordered knobs, then those whose values have no order": the former get a line, the latter points and names
place(knob) = sum [i = 1:words(knobs)] (word(knobs, i) eq knob ? i : 0)
