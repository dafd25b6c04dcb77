/* SPDX-License-Identifier: MIT */
/*
 * test_tank - what the grid answers on recordings of a Micron whose head stands still and has no pose: sectors against
 * the tank's fitted walls, and what lies in the vehicle's shadow. Bursts and ghosts are marked, and lost echoes
 * doubted, as in the pipeline.
 */
#include "tests/lib/shots.h"
#include "tests/lib/sphere_rig.h"

#include "grid/range/lost_echo.h"
#include "grid/range/marks.h"
#include "grid/sphere/view.h"

#define QUAY DATA "micron-quay-rosbag/2014-07-18-20-59-31.csv"

static struct marks marks;
static struct lost_echo lost;

static void start(void)
{
    static const struct sphere_conf usual = {
        .angular_step_rad = 2 * GEO_PI / 180,
        .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
        .max_cells = 65536,
        .forget_s = 160,
        .blocked_above = 0.6,
        .recentre_m = 0.1};
    struct extract_conf conf;
    rig_sphere(&usual);
    extract_defaults(&conf);
    set_up(&conf);
    marks_init(&marks, 1500.0);
    lost = (struct lost_echo){.lost = 0};
    now = (struct answer_now){.now_ns = SECOND, .pose = pose_identity};
}

static void enter(struct shot *shot)
{
    run_shot(shot, &micron);
    shot->found.az_rad = (float)geo_rad(shot->bearing_deg);
    struct echoes e = {.t_ns = now.now_ns += 45000000,
                       .n_beams = 1,
                       .range_max_m = (float)shot->range_m,
                       .az_aperture_rad = (float)geo_rad(3),
                       .el_aperture_rad = (float)geo_rad(35),
                       .pose = pose_identity,
                       .max_beams = 1,
                       .beam = &shot->found};
    marks_run(&marks, &e);
    lost_echo_run(&lost, &e);
    rig_enter(&e, &mount_identity);
}

static struct answer ask_narrow(double az_deg, double distance_m)
{
    return rig_line(&(struct answer_query){
        .az_rad = geo_rad(az_deg), .distance_m = distance_m, .half_angle_rad = geo_rad(2), .near_m = RIG_NEAR_M});
}

/* What is answered about the bearings of a look at a wall, as soon as it has ended. */
struct score {
    int asked;
    int missed;  /* asked 30 cm behind the wall: called clear, which is dangerous */
    int shown;   /* there is an obstacle within 20 cm of the wall */
    int in_way;  /* asked for 80 % of the way: blocked by what is no wall, */
    int by_head; /* and these by what sounds on within 1 m of the head, as beside wall N it does */
    int beyond;  /* an obstacle stands in the way beyond that, whatever else does */
};

/* Does the grid hold an obstacle in that direction between the two ranges? */
static bool shows(double az_deg, double from_m, double to_m)
{
    const struct rings *rings = sphere_picture(sphere)->rings;
    const uint32_t d = rings_index(rings, geo_rad(az_deg), geo_rad(1));
    struct sphere_cell cell;
    for (uint32_t k = 0; sphere_cell(sphere, d, k, now.now_ns, &cell); k++) {
        const double *p = cell.point_m, range_m = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        if (range_m >= from_m && range_m <= to_m && cell.logodds > log(0.6 / 0.4))
            return true;
    }
    return false;
}

static void grade(const struct look *look, const struct wall *about, struct score *score)
{
    const struct wall wall = fitted(look, about);
    for (int i = 0; i < look->n; i++) {
        double nearest_m = INFINITY, farthest_m = 0;
        for (double off_deg = -4.5; off_deg <= 4.5; off_deg += 0.5) { /* the cone, half a beam and a cell */
            double at_m = wall.distance_m / cos(geo_rad(look->bearing_deg[i] + off_deg - wall.normal_deg));
            nearest_m = fmin(nearest_m, at_m);
            farthest_m = fmax(farthest_m, at_m);
        }
        const struct answer before = ask_narrow(look->bearing_deg[i], 0.8 * nearest_m);
        score->asked++;
        score->missed += ask_narrow(look->bearing_deg[i], farthest_m + 0.3).state == ANSWER_CLEAR;
        score->shown += shows(look->bearing_deg[i], nearest_m - 0.2, farthest_m + 0.2);
        score->in_way += before.state == ANSWER_BLOCKED;
        score->by_head += before.state == ANSWER_BLOCKED && before.range_m < 1;
        score->beyond += shows(look->bearing_deg[i], 1, 0.8 * nearest_m);
    }
}

static struct score sectors_at(const struct wall *wall, double half_width_deg)
{
    FILE *file = recording(TANK);
    static struct look look;
    struct score score = {0};
    struct shot shot;
    start();
    look.n = 0;
    while (shot_read(file, &shot)) {
        enter(&shot);
        const double off_deg = turned(shot.bearing_deg, wall->normal_deg);
        if (fabs(off_deg) <= half_width_deg && look.n < LOOK_BEAMS) {
            look.bearing_deg[look.n] = shot.bearing_deg;
            look.loudest_m[look.n++] = loudest_near(&shot, wall->distance_m / cos(geo_rad(off_deg)));
        } else if (look.n > 0) {
            grade(&look, wall, &score);
            look.n = 0;
        }
    }
    if (look.n > 0)
        grade(&look, wall, &score);
    fclose(file);
    return score;
}

TEST(sectors_of_the_tank_are_its_walls_and_none_is_clear_beyond_one)
{
    static const struct wall wall[] = {{"W", 2.21, 264}, {"S", 3.98, 175}};
    static const double half_width_deg[] = {36, 19.8};
    for (int w = 0; w < 2; w++) {
        const struct score s = sectors_at(&wall[w], half_width_deg[w]);
        printf("# tank, wall %s: of %d sectors %d show the wall, %d are clear through it; on the way to it %d are "
               "blocked, %d of them within 1 m of the head; in %d an obstacle is beyond that\n",
               wall[w].name, s.asked, s.shown, s.missed, s.in_way, s.by_head, s.beyond);
        CHECK(s.asked >= 40);
        CHECK(s.shown * 10 >= s.asked * 9);
        CHECK(s.in_way * 4 <= s.asked * 3);
        CHECK(s.beyond * 5 <= s.asked * 2);
        CHECK_INT(s.missed, 0);
    }
}

/* Counts answers up to each of some distances for bearings within half_deg of the middle,
 * after every turn's worth of pings. */
static void count_states(const char *path, double middle_deg, double half_deg, double from_m, double to_m,
                         int states[3])
{
    FILE *file = recording(path);
    struct shot shot;
    start();
    for (int ping = 1; shot_read(file, &shot); ping++) {
        enter(&shot);
        for (double off_deg = -half_deg; ping % 100 == 0 && off_deg <= half_deg; off_deg += 3)
            for (double m = from_m; m <= to_m; m += 0.5)
                states[ask_narrow(middle_deg + off_deg, m).state]++;
    }
    fclose(file);
}

/* Wall N stands within the ring-down: what comes from behind it is multipath. */
TEST(behind_the_wall_beside_the_head_nothing_is_clear)
{
    int states[3] = {0};
    count_states(TANK, 354, 45, 0.5, 8, states);
    printf("# tank, behind wall N: clear %d, blocked %d, unknown %d\n", states[ANSWER_CLEAR],
           states[ANSWER_BLOCKED], states[ANSWER_UNKNOWN]);
    CHECK(states[ANSWER_UNKNOWN] + states[ANSWER_BLOCKED] > 1000);
    CHECK_INT(states[ANSWER_CLEAR], 0);
}

/*
 * The vehicle shades the rear half: a strong echo below 0.7 m, then silence, which is no free water. In one of the
 * turns the beams at 145.8 and 147.6 degrees have no such echo, and are free to 10 m by all that a ping tells.
 */
TEST(in_the_vehicles_shadow_nothing_is_clear)
{
    int states[3] = {0};
    count_states(QUAY, 180, 60, 1, 18, states);
    printf("# quay, in the vehicle's shadow: clear %d, blocked %d, unknown %d\n", states[ANSWER_CLEAR],
           states[ANSWER_BLOCKED], states[ANSWER_UNKNOWN]);
    CHECK(states[ANSWER_UNKNOWN] + states[ANSWER_BLOCKED] > 1000);
    CHECK_INT(states[ANSWER_CLEAR], 0);
}

int main(void)
{
    RUN_WITH(TANK, sectors_of_the_tank_are_its_walls_and_none_is_clear_beyond_one);
    RUN_WITH(TANK, behind_the_wall_beside_the_head_nothing_is_clear);
    RUN_WITH(QUAY, in_the_vehicles_shadow_nothing_is_clear);
    return test_end();
}
