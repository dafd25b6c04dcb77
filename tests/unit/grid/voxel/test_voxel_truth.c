/* SPDX-License-Identifier: MIT */
/* test_voxel_truth - voxel maps of made-up worlds whose truth is known: no water behind a surface, ever; and the worlds
 * themselves against rays. */
#include "tests/lib/test.h"
#include "report/lib/chart.h"

#define TURNS       2
#define HEARD_TURNS 8 /* with fewer, too little is free with a threshold of 2 */

/* The first range of a beam against the nearest of many rays: never beyond, hardly short of it. */
TEST(first_range_is_the_nearest_of_all_rays)
{
    for (unsigned k = 0; k < places_n; k++) {
        struct dive *dive = dive_make(&places[k], 1, false, 0.2, DIVE_TRUTH);
        for (size_t i = 0; i < dive->n; i += 23) {
            const struct dive_look *look = &dive->look[i];
            double nearest_m = DIVE_RANGE_M;
            for (int a = -15; a <= 15; a++)
                for (int e = -90; e <= 90; e++) {
                    double in_beam[3], d[3];
                    geo_direction(geo_rad(DIVE_AZ_DEG) * a / 30, geo_rad(DIVE_EL_DEG) * e / 180, in_beam);
                    quat_rotate(look->attitude, in_beam, d);
                    nearest_m = fmin(nearest_m, place_ray(&places[k], look->at, d, DIVE_RANGE_M, look->t_s));
                }
            CHECK(look->first_m <= nearest_m + 1e-3);
            if (look->first_m < nearest_m - 0.05)
                printf("%s, look %zu: %g m, by rays %g m\n", places[k].name, i, look->first_m, nearest_m);
            CHECK(look->first_m >= nearest_m - 0.05); /* between the rays there may be a pile's edge */
        }
        dive_free(dive);
    }
}

/* A step of a millimetre never changes the clearance by more: what place_first relies on. */
TEST(clearance_is_no_more_than_the_distance)
{
    uint64_t seed = 7;
    for (int n = 0; n < 20000; n++) {
        const struct place *w = &places[(unsigned)n % places_n];
        double p[3], q[3], step2 = 0;
        for (int a = 0; a < 3; a++) {
            p[a] = w->low[a] + (w->high[a] - w->low[a]) * test_uniform(&seed);
            q[a] = p[a] + 0.2 * (test_uniform(&seed) - 0.5);
            step2 += (q[a] - p[a]) * (q[a] - p[a]);
        }
        CHECK(fabs(place_clearance(w, p, NULL, 3) - place_clearance(w, q, NULL, 3)) <= sqrt(step2) + 1e-12);
    }
}

static double false_free_m3(const struct dive *dive, double voxel_m, double tolerance_voxels, double range_error_m)
{
    const struct chart_setting set = {.voxel_m = voxel_m, .tolerance_m = tolerance_voxels * voxel_m};
    struct chart *c = chart_make(dive->world, &set);
    double behind_max_m, free_m3;
    for (size_t i = 0; i < dive->n; i++)
        chart_enter_truth(c, &dive->look[i], range_error_m);
    const double wrong_m3 = chart_false_free(c, 0, &behind_max_m, &free_m3);
    CHECK(free_m3 > 1);
    chart_free(c);
    return wrong_m3;
}

/* Whatever the voxel and however the vehicle is tilted. A world in which something moves has no one truth. */
TEST(with_true_ranges_nothing_behind_a_surface_is_free)
{
    for (unsigned k = 0; k < places_n; k++) {
        if (place_moves(&places[k].shape[1]))
            continue;
        for (int tilted = 0; tilted < 2; tilted++) {
            struct dive *dive = dive_make(&places[k], TURNS, false, 0.17 * tilted, DIVE_TRUTH);
            for (int v = 0; v < 3; v++) {
                const double wrong_m3 = false_free_m3(dive, (const double[]){0.1, 0.2, 0.5}[v], 0, 0);
                if (wrong_m3 != 0)
                    printf("%s%s, voxel %d: %g m3\n", places[k].name, tilted ? " tilted" : "", v, wrong_m3);
                CHECK(wrong_m3 == 0);
            }
            dive_free(dive);
        }
    }
}

/* As a head hears them, through the whole chain: what is free and lies in a solid, of all that is free. The box tank's
 * share hangs on the noise most. By what is known off the beams' axes more is free and less of it is not. */
TEST(as_heard_little_behind_a_surface_is_free)
{
    static const struct {
        const char *world;
        uint64_t seed;                 /* of the noise */
        double as_shipped, safe, full; /* at most; full, the paper's: at least, or the test sees little */
        double more;                   /* free as shipped, against what it is by the axis alone: at least */
    } row[] = {
        {"box tank", 1, 0.0005, 0, 0, 1.2},        {"box tank", 7, 0.0005, 0, 0.0001, 1.2},
        {"round tank", 1, 0.0005, 0, 0.0001, 1.2}, {"harbour", 1, 0.0005, 0, 0.02, 0.95},
        {"pier", 1, 0.0005, 0, 0.01, 0.95},        {"slope", 1, 0.0005, 0, 0, 1},
        {"soft bottom", 1, 0.002, 0, 0.02, 1.2},
    };
    const struct chart_setting set[] = {
        {.voxel_m = 0.2, .rule = {1, 2}, .echoes = true, .opening = 0.5, .body_m = 0.5},
        {.voxel_m = 0.2, .rule = {2, 2}, .echoes = true, .opening = 0.35, .body_m = 0.5},
        {.voxel_m = 0.2, .rule = {1, 2}, .echoes = true, .body_m = 0.5},
        {.voxel_m = 0.2, .rule = {1, 2}, .echoes = true, .opening = 0.5, .body_m = 0.5},
    };
    struct dive_ears *ears = dive_ears_make(false);
    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        struct dive *dive = dive_make(place_named(row[k].world), HEARD_TURNS, false, 0, DIVE_TRUTH | DIVE_SOUND);
        double share[4], behind_max_m, free_m3[4];
        struct chart *c[4];
        for (int s = 0; s < 4; s++)
            c[s] = chart_make(dive->world, &set[s]);
        dive_begin(ears);
        for (size_t i = 0; i < dive->n; i++) {
            struct beam_echoes heard;
            dive_hear(ears, dive, i, row[k].seed, &heard);
            for (int s = 0; s < 4; s++) {
                heard.off_axis = s < 3;
                chart_enter(c[s], &dive->look[i], dive->look[i].at, &heard);
            }
        }
        for (int s = 0; s < 4; s++) {
            const double wrong_m3 = chart_false_free(c[s], 0, &behind_max_m, &free_m3[s]);
            share[s] = free_m3[s] > 0 ? wrong_m3 / free_m3[s] : 0;
            chart_free(c[s]);
        }
        CHECK(share[0] <= row[k].as_shipped);
        CHECK(share[1] <= row[k].safe);
        CHECK(share[2] >= row[k].full);
        CHECK(free_m3[0] >= row[k].more * free_m3[3]);
        if (test_case_failed)
            printf("(%s, seed %u: as shipped %g, safe %g, full %g; %g times as much)\n", row[k].world,
                   (unsigned)row[k].seed, share[0], share[1], share[2], free_m3[0] / free_m3[3]);
        dive_free(dive);
    }
    dive_ears_free(ears);
}

/* The measure sees what it is for. */
TEST(a_range_too_long_or_a_wide_tolerance_is_seen)
{
    struct dive *dive = dive_make(place_named("box tank"), TURNS, false, 0, DIVE_TRUTH);
    CHECK(false_free_m3(dive, 0.1, 0, 0.2) > 0.5);
    CHECK(false_free_m3(dive, 0.1, 3, 0) > 0.1);
    dive_free(dive);
}

int main(void)
{
    RUN(first_range_is_the_nearest_of_all_rays);
    RUN(clearance_is_no_more_than_the_distance);
    RUN(with_true_ranges_nothing_behind_a_surface_is_free);
    RUN(as_heard_little_behind_a_surface_is_free);
    RUN(a_range_too_long_or_a_wide_tolerance_is_seen);
    return test_end();
}
