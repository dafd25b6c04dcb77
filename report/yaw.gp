# SPDX-License-Identifier: MIT
# yaw.gp - chapter "Fast yaw": heading error and false free volume against poses a second.
yaw = data.'yaw.csv'
methods = "shipped between last"
rates = "30 90 180"
set terminal svg size 1000,520 font 'sans-serif,13' background 'white' noenhanced dynamic rounded
set output out.'yaw.svg'
set multiplot layout 1,2 margins 0.11,0.99,0.27,0.97 spacing 0.13,0.1
set logscale xy
set xrange [4:125]
set xtics (5, 10, 20, 50, 100)
set xlabel 'poses a second'
unset key
do for [m = 1:3] { do for [r = 1:3] { set label m*10+r '● '.word(methods, m).', '.word(rates, r).' deg/s' at screen 0.08+0.3*(m-1),0.025+0.035*(3-r) textcolor rgb word("#0b66c3 #5b9de0 #a9cdf5 #2a9d5c #6cc794 #b0e3c6 #d6562b #e88b6b #f5c3b2", m*3-r+1) } }
of(m, r, v) = field("method") eq word(methods, m) && column("yaw_degps") == word(rates, r)+0 ? v : NaN
least(v, low) = v > low ? v : low
set ylabel 'heading, 95 %, degrees' offset 2,0
set yrange [1e-3:50]
set ytics ('≤ 0.001' 1e-3, 0.01, 0.1, 1, 10)
plot for [m = 1:3] for [r = 1:3] yaw using (column("pose_hz")):(of(m, r, least(column("heading_p95_deg"), 1.1e-3))) with points pt 7 ps 0.8 lc rgb word("#0b66c3 #5b9de0 #a9cdf5 #2a9d5c #6cc794 #b0e3c6 #d6562b #e88b6b #f5c3b2", m*3-r+1)
unset label # drawn once
set ylabel 'free volume that is solid, m³' offset 0,0
set yrange [1e-3:20]
plot for [m = 1:3] for [r = 1:3] yaw using (column("pose_hz")*1.05**(m-2)):(of(m, r, least(column("false_free_m3"), 1.1e-3))):(least(column("false_free_low"), 1.1e-3)):(least(column("false_free_high"), 1.1e-3)) with yerrorbars pt 7 ps 0.8 lc rgb word("#0b66c3 #5b9de0 #a9cdf5 #2a9d5c #6cc794 #b0e3c6 #d6562b #e88b6b #f5c3b2", m*3-r+1)
unset multiplot
