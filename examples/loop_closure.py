#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""loop_closure - move the submaps of the voxel map to where a SLAM framework says, after it has closed a loop.

    loop_closure.py SOCKET CORRECTIONS.csv

Each row of the file is one pose of the vehicle, as it was when sonard was told, and as the pose graph has it now:

    t_unix,north_m,east_m,down_m,yaw_deg,to_north_m,to_east_m,to_down_m,to_yaw_deg

A submap goes with the pose nearest to its start in time: it is shifted and turned about the vertical as that pose was. After
another closure the first five columns are the poses of the last one. The submap in progress is closed, so close loops while the
vehicle does not depend on the map.
"""
import csv
import math
import sys
import time

import sonard

COLUMNS = "t_unix north_m east_m down_m yaw_deg to_north_m to_east_m to_down_m to_yaw_deg".split()


def corrections(path):
    with open(path, newline="", encoding="utf-8") as f:
        return [[float(row[name]) for name in COLUMNS] for row in csv.DictReader(f)]


def moved(base_m, quaternion, correction):
    """Where the base of a submap goes, and its rotation."""
    _, north, east, down, yaw, to_north, to_east, to_down, to_yaw = correction
    turn = math.radians(to_yaw - yaw)
    n, e, d = base_m[0] - north, base_m[1] - east, base_m[2] - down
    place = [to_north + math.cos(turn) * n - math.sin(turn) * e, to_east + math.sin(turn) * n + math.cos(turn) * e, to_down + d]
    a, b = math.cos(turn / 2), math.sin(turn / 2)  # the turn as a quaternion is (a, 0, 0, b), and comes last
    w, x, y, z = quaternion
    return place, [a * w - b * z, a * x - b * y, a * y + b * x, a * z + b * w]


def main(path, file):
    rows = corrections(file)
    if not rows:
        sys.exit("loop_closure: %s has no poses" % file)
    with sonard.connect(path) as s:
        for submap in s.map_submaps()["submaps"]:
            begun = time.time() - submap["begin_age_s"]
            nearest = min(rows, key=lambda row: abs(row[0] - begun))
            place, quaternion = moved(submap["position_m"], submap["quaternion"], nearest)
            s.map_move(id=submap["id"], position_m=place, quaternion=quaternion)
            print("submap %d: %.2f m" % (submap["id"], math.dist(place, submap["position_m"])))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: loop_closure.py SOCKET CORRECTIONS.csv")
    main(*sys.argv[1:])
