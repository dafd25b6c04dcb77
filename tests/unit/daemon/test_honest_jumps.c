/* SPDX-License-Identifier: MIT */
/*
 * test_honest_jumps - no clear is false when the north of a vehicle's navigation jumps, as when its compass is
 * calibrated or disturbed: its dead reckoning goes on from where it was, in another direction. How far a jump is too
 * small to be seen: jumps.h, and POSE_LOG_JUMP_DEG; these are just greater.
 */
#include "tests/lib/honest.h"

/* Ten poses a second, with 30 degrees a second at most: 3 between two of them, 5 that are no jump, and what the vehicle
 * itself turns against the jump. */
#define SEEN_DEG 11
/* Where the configuration does not say how fast it turns, it may be 36 between two. */
#define SEEN_UNTOLD_DEG 45

static void jump_with(const struct vehicle *v, double least_deg, bool basin)
{
    run_with(&(struct trial){.vehicle = v,
                             .period_ns = SECOND / 10,
                             .late_ns = SECOND / 50,
                             .hollow_m = 4.5,
                             .north_deg = least_deg,
                             .basin = basin},
             1, worlds(2));
    USEFUL(count[CONE].clear > 4 && count[CORRIDOR].clear > 4 && count[SECTORS].clear > 10);
    USEFUL(count[FREE_TO].clear > 10);
}

TEST(a_hovering_vehicle)
{
    jump_with(&hovering, SEEN_UNTOLD_DEG, false);
    jump_with(&hovering, SEEN_UNTOLD_DEG, true);
}

TEST(a_slow_vehicle_with_a_turning_head)
{
    jump_with(&slow_head, SEEN_DEG, false);
    jump_with(&slow_head, SEEN_DEG, true);
}

TEST(a_slow_vehicle_with_a_fan_ahead)
{
    jump_with(&slow_fan, SEEN_DEG, false);
    jump_with(&slow_fan, SEEN_DEG, true);
    USEFUL(amply_told_share(CONE) > 0.5 && amply_told_share(CORRIDOR) > 0.5 && amply_told_share(SECTORS) > 0.5);
}

TEST(three_sonars_on_the_move)
{
    jump_with(&bounded[0], SEEN_DEG, false);
}

int main(void)
{
    seed = test_seed();
    RUN(a_hovering_vehicle);
    RUN(a_slow_vehicle_with_a_turning_head);
    RUN(a_slow_vehicle_with_a_fan_ahead);
    RUN(three_sonars_on_the_move);
    return test_end();
}
