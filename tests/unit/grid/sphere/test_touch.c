/* SPDX-License-Identifier: MIT */
/*
 * test_touch - an echo is entered in every cell that its beam's opening touches, wherever the sensor sits and however
 * it is turned, and in few others. The reference knows no grid: places all over the opening, at the echo's range.
 */
#include "tests/lib/sphere_rig.h"
#include "grid/sphere/view.h"

#define PLACES 61 /* across the opening, and as many up it */

/* One beam with an echo, of a sensor somewhere. */
struct shot {
    struct mount mount;
    double az_rad, el_rad, az_ap_rad, el_ap_rad, range_m;
};

static struct shot random_shot(uint64_t *seed)
{
    struct shot shot = {.az_rad = GEO_TURN * test_uniform(seed),
                        .el_rad = (test_uniform(seed) - 0.5) * geo_rad(170),
                        .az_ap_rad = geo_rad(1 + 39 * pow(test_uniform(seed), 2)),
                        .el_ap_rad = geo_rad(1 + 39 * pow(test_uniform(seed), 2)),
                        .range_m = 0.5 + 6 * test_uniform(seed)};
    double pitch = geo_rad(180) * (test_uniform(seed) - 0.5);
    if (test_random(seed) % 4 == 0) /* along the axis of the grid */
        pitch = geo_rad(90) * (test_random(seed) % 2 ? 1 : -1);
    quat_from_rpy(GEO_TURN * test_uniform(seed), pitch, GEO_TURN * test_uniform(seed), shot.mount.attitude);
    if (test_random(seed) % 2)
        for (int i = 0; i < 3; i++)
            shot.mount.position_m[i] = test_uniform(seed) - 0.5;
    return shot;
}

static void enter(const struct shot *shot)
{
    struct beam_echoes beam = {.az_rad = (float)shot->az_rad,
                               .el_rad = (float)shot->el_rad,
                               .blind_m = 0.3f,
                               .free_to_m = (float)shot->range_m - 0.02f,
                               .state = BEAM_ECHO,
                               .n = 1,
                               .echo = {{.range_m = (float)shot->range_m, .sd_m = 0.01f, .confidence = 0.9f}}};
    struct echoes e = {.t_ns = 1000 * SECOND,
                       .n_beams = 1,
                       .range_max_m = 20,
                       .az_aperture_rad = (float)shot->az_ap_rad,
                       .el_aperture_rad = (float)shot->el_ap_rad,
                       .pose = pose_identity,
                       .max_beams = 1,
                       .beam = &beam};
    sphere_enter(sphere, &e, &shot->mount);
}

/* Marks the directions in which any of the places lies. */
static void touched(const struct shot *shot, const struct rings *rings, bool *touches)
{
    memset(touches, 0, rings->n);
    for (int i = 0; i < PLACES; i++)
        for (int k = 0; k < PLACES; k++) {
            double v[3], place[3], az, el, upward = (k / (PLACES - 1.0) - 0.5) * 0.9999 * shot->el_ap_rad;
            if (fabs(shot->el_rad + upward) > GEO_PI / 2)
                continue; /* past the sensor's own pole azimuths are others */
            geo_direction(shot->az_rad + (i / (PLACES - 1.0) - 0.5) * 0.9999 * shot->az_ap_rad,
                          shot->el_rad + upward, v);
            quat_rotate(shot->mount.attitude, v, place);
            for (int m = 0; m < 3; m++)
                place[m] = shot->mount.position_m[m] + shot->range_m * place[m];
            geo_angles(place, &az, &el);
            touches[rings_index(rings, az, el)] = true;
        }
}

static void misses_none(enum sphere_model model, double step_deg, double most_more)
{
    const struct sphere_conf conf = {.angular_step_rad = geo_rad(step_deg),
                                     .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                     .max_cells = 50000,
                                     .forget_s = 160,
                                     .blocked_above = 0.6,
                                     .recentre_m = 0.1,
                                     .model = model};
    static bool touches[50000];
    uint64_t seed = test_seed();
    unsigned wanted = 0, missed = 0, more = 0;
    for (int trial = 0; trial < 400; trial++) {
        struct shot shot = random_shot(&seed);
        rig_sphere(&conf);
        const struct rings *rings = sphere_picture(sphere)->rings;
        enter(&shot);
        touched(&shot, rings, touches);
        for (uint32_t d = 0; d < rings->n; d++) {
            struct sphere_cell cell;
            bool entered = sphere_cell(sphere, d, 0, 1000 * SECOND, &cell);
            wanted += touches[d];
            missed += touches[d] && !entered;
            more += !touches[d] && entered;
        }
    }
    printf("# model %d, cells of %g degrees: %u touched, %u missed, %u more\n", (int)model, step_deg, wanted,
           missed, more);
    CHECK_INT(missed, 0);
    CHECK(more <= most_more * wanted);
}

TEST(an_echo_raises_every_cell_that_its_opening_touches)
{
    misses_none(SPHERE_OPENING, 2, 0.05);
    misses_none(SPHERE_OPENING, 10, 0.4);
}

TEST(the_gaussian_never_reaches_less_far_than_the_opening)
{
    misses_none(SPHERE_GAUSS, 4, INFINITY);
    misses_none(SPHERE_MIDPOINT, 4, INFINITY);
}

int main(void)
{
    RUN(an_echo_raises_every_cell_that_its_opening_touches);
    RUN(the_gaussian_never_reaches_less_far_than_the_opening);
    return test_end();
}
