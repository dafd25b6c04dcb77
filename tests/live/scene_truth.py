# SPDX-License-Identifier: MIT
"""scene_truth - what sonard answers about a scene, against what the virtual sonar knows is there."""
from lib import check

TURN = 200          # pings of a full circle at 1.8 degrees
PULSE_M = 0.05      # of a ping of 10 m range, rounded up
LAYER_M = 0.05      # thinnest layer of the grid; further out a layer has 3.5 % of its range
BEAM_HALF_DEG = 1.0
CELL_HALF_DEG = 1.0


def tolerance(range_m):
    return PULSE_M + max(LAYER_M, 0.035 * range_m)


def apart(a_deg, b_deg):
    return abs((a_deg - b_deg + 180) % 360 - 180)


def beams(truth, sector, margin_deg, ned):
    """The true nearest ranges of the beams in a sector that is so much wider; listened to far enough only."""
    half = sector["width_deg"] / 2 + margin_deg
    at = [(ping["azimuth_deg"] + (ping["yaw_deg"] if ned else 0), ping) for ping in truth]
    inside = [ping for azimuth, ping in at if apart(azimuth, sector["azimuth_deg"]) <= half]
    return [ping["range_m"] for ping in inside
            if ping["range_m"] is not None and ping["range_m"] < ping["listening_m"] - PULSE_M]


def compare(sectors, truth, ned=False):
    """Faults of the sectors against the truth, and how many are blocked and clear."""
    faults, count = [], {"blocked": 0, "clear": 0, "unknown": 0}
    for sector in sectors:
        where = "sector %g" % sector["azimuth_deg"]
        core = beams(truth, sector, 0, ned)
        wide = beams(truth, sector, BEAM_HALF_DEG + 2 * CELL_HALF_DEG, ned)
        count[sector["state"]] += 1
        if core and sector["state"] == "clear":
            faults.append("%s: clear, but something is at %.2f m" % (where, min(core)))
        if core and sector["free_to_m"] > min(core) + tolerance(min(core)):
            faults.append("%s: free to %.2f m, but something is at %.2f m"
                          % (where, sector["free_to_m"], min(core)))
        if sector["state"] == "blocked" and not wide:
            faults.append("%s: blocked at %.2f m, but nothing is there" % (where, sector["range_m"]))
        elif sector["state"] == "blocked":
            lowest, highest = min(wide), min(core) if core else max(wide)
            if not lowest - tolerance(lowest) <= sector["range_m"] <= highest + tolerance(highest):
                faults.append("%s: blocked at %.2f m, true are %.2f to %.2f m"
                              % (where, sector["range_m"], lowest, highest))
        elif core and sector["state"] == "unknown":
            faults.append("%s: unknown, but something is at %.2f m" % (where, min(core)))
    return faults, count


def check_sectors(client, bench, ned=False):
    sectors = client.call("sectors", frame="ned" if ned else "body", distance_m=0)["sectors"]
    faults, count = compare(sectors, bench.truth(), ned)
    check(not faults, "; ".join(faults))
    return count


def check_blocked(bench, client, azimuth_deg, distance_m, state):
    """By the socket and by sonarctl's exit status."""
    answer = client.call("blocked", azimuth_deg=azimuth_deg, distance_m=distance_m)
    check(answer["state"] == state, "%g degrees, %g m: %s, not %s" % (azimuth_deg, distance_m, answer, state))
    status = bench.sonarctl("blocked", "%g" % azimuth_deg, "--distance", "%g" % distance_m).returncode
    wanted = {"clear": 0, "blocked": 1, "unknown": 2}[state]
    check(status == wanted, "sonarctl blocked %g --distance %g: status %d, not %d"
          % (azimuth_deg, distance_m, status, wanted))


def check_wall(client, frame, azimuth_deg, range_m):
    sector = client.call("sectors", frame=frame, distance_m=0)["sectors"][azimuth_deg // 5]
    good = sector["state"] == "blocked" and abs(sector["range_m"] - range_m) <= tolerance(range_m)
    check(good, "%s %g: %s, the wall is at %g m" % (frame, azimuth_deg, sector, range_m))


def all_unknown(client):
    return all(sector["state"] == "unknown" for sector in client.call("sectors", distance_m=0)["sectors"])
