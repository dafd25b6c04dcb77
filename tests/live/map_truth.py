# SPDX-License-Identifier: MIT
"""map_truth - what sonard's voxel map says of the virtual basin, against where its walls are; and the map's jobs."""
from lib import check, until

WALLS = ((-6.0, 9.0), (-5.0, 4.0))  # of the virtual basin: north, east
VOXEL = 0.2                         # as the tests configure it


def clearance(place):
    """How far a place is from the nearest wall; negative behind it."""
    return min(min(p - low, high - p) for p, (low, high) in zip(place, WALLS))


def state_of(client, method, **params):
    return client.call(method, **params)["state"]


def job(client, method, **params):
    """How a job of the map has ended."""
    client.call(method, **params)
    return until(lambda: (lambda j: j if j["state"] != "running" else None)(client.call("map")["job"]), "the job", 60)


def done(client, method, **params):
    """The file that a job has written."""
    result = job(client, method, **params)
    check(result["state"] == "done", "%s: %s" % (method, result))
    return result["path"]


def check_points(client, dice, least=300, lag_m=0.0):
    """No place behind a wall is free; more than `least` of 1500 are. lag_m: what the vehicle drives between
    a ping and the pose that is said of it."""
    found = 0
    for _ in range(1500):
        place = [dice.uniform(-8, 11), dice.uniform(-7, 6), dice.uniform(1, 3)]
        answer = client.call("point", position_m=place)
        inside = clearance(place)
        check(answer["state"] != "free" or inside > -VOXEL / 2 - lag_m, "free behind a wall: %s" % place)
        found += answer["state"] == "free" and inside > 0
        if answer["state"] == "free":
            check(answer["age_s"] is not None, str(answer))
    check(found > least, "only %d places of the basin are free" % found)
    return found
