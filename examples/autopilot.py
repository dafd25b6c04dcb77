#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""autopilot - a loop that tells sonard where the vehicle is, asks how fast it may go, and never goes faster. Whatever goes
wrong, a daemon that is gone included, ends in speed 0.

    autopilot.py [SOCKET [TURNS]]

From the source tree, before `make install`: PYTHONPATH=python examples/autopilot.py SOCKET
"""
import sys
import time

import sonard

TURN_S = 0.2
PATIENCE_S = 0.1  # that an answer may take: what comes later is of no use to this turn
WANTED_MPS = [1.0, 0.0, 0.0]  # forward, right, down: the pilot's stick


def measure():
    """Put the vehicle's own attitude, depth and velocity here: they are its navigation's."""
    return {"attitude_deg": [0, 0, 0], "depth_m": 3.0, "velocity_mps": [0, 0, 0]}


def fly(velocity_mps, why):
    """And the motors here."""
    print("fly %.2f %.2f %.2f: %s" % (*velocity_mps, why), flush=True)


def turn(client):
    client.pose(**measure())
    ahead = client.blocked(0, distance_m=5, half_angle_deg=10)
    limit = client.limit(WANTED_MPS)
    fly(limit.velocity_mps, "%s ahead, limited by %s, %.1f m are free" % (ahead.state, limit.limited_by, limit.free_m))


def main(path=None, turns=None):
    client = None
    while turns is None or turns > 0:
        try:
            client = client or sonard.connect(path, PATIENCE_S)
            turn(client)
        except sonard.Error as error:
            fly([0, 0, 0], str(error))
            if client and isinstance(error, sonard.Lost):
                client.close()
                client = None
        turns = turns and turns - 1
        time.sleep(TURN_S)


if __name__ == "__main__":
    if len(sys.argv) > 3 or any(word.startswith("-") for word in sys.argv[1:]):
        sys.exit("usage: autopilot.py [SOCKET [TURNS]]")
    main(sys.argv[1] if len(sys.argv) > 1 else None, int(sys.argv[2]) if len(sys.argv) > 2 else None)
