#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# cfar_numpy.py - the rows of bench_cfar as a numpy program would do them: cumulative sums of one beam, and a sort of
# all windows for OS. Nothing to say where numpy is missing.
import statistics
import sys
import time

try:
    import numpy as np
except ImportError:
    print("skip: numpy is not installed")
    sys.exit(0)

SIDE, GUARD, RANK, BEAMS = 16, 4, 24, 32
FAR = SIDE + GUARD


def sides(x):
    total = np.concatenate(([0], np.cumsum(x)))
    window = total[SIDE:] - total[:-SIDE]  # of the cells from i on
    n = len(x) - 2 * FAR
    return x[FAR:-FAR], window[:n], window[FAR + GUARD + 1:FAR + GUARD + 1 + n]


def ca(x, alpha):
    cell, lead, lag = sides(x)
    return cell * (2 * SIDE) > alpha * (lead + lag)


def goca(x, alpha):
    cell, lead, lag = sides(x)
    return cell * SIDE > alpha * np.maximum(lead, lag)


def soca(x, alpha):
    cell, lead, lag = sides(x)
    return cell * SIDE > alpha * np.minimum(lead, lag)


def os(x, alpha):
    view = np.lib.stride_tricks.sliding_window_view(x, 2 * FAR + 1)
    windows = np.concatenate((view[:, :SIDE], view[:, -SIDE:]), axis=1)
    return view[:, FAR] > alpha * np.partition(windows, RANK - 1, axis=1)[:, RANK - 1]


def median_ns(detector, beams):
    times = []
    for _ in range(11):
        begin = time.perf_counter_ns()
        for x in beams:
            detector(x, 12.0)
        times.append((time.perf_counter_ns() - begin) / beams.size)
    return statistics.median(times)


rng = np.random.default_rng(1)
print("ns per cell, cells:   " + "".join(f"{n:10d}" for n in (200, 500, 1000, 1500)))
for name, detector in (("ca", ca), ("goca", goca), ("soca", soca), ("os", os)):
    row = [median_ns(detector, rng.exponential(1e6, (BEAMS, n)).astype(np.int64)) for n in (200, 500, 1000, 1500)]
    print(f"{name + ', numpy':22s}" + "".join(f"{ns:10.3f}" for ns in row))
