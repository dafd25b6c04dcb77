/* SPDX-License-Identifier: MIT */
/* test_voxmap - voxmap.h, merge.h and voxpage.h: what pings leave in the map, submaps, ageing, correction, paging. */
#include "core/fault.h"
#include "grid/voxel/voxpage.h"
#include "tests/lib/voxmap_rig.h"

static const double at_origin[3] = {0.05, 0.05, 0.05};
static const int64_t nowhere[3] = {0, 0, 0};

static uint64_t cells_with(struct rig *r, bool heard)
{
    uint64_t n = 0;
    for (int64_t i = -64; i < 64; i++)
        for (int64_t j = -64; j < 64; j++)
            for (int64_t k = -40; k < 40; k++) {
                struct merge_sum s = merge_sum(&r->map, (const int64_t[3]){i, j, k});
                n += heard ? s.echoes > 0 : s.vacancy > 0;
            }
    return n;
}

TEST(settings_are_checked)
{
    static const struct {
        const char *name;
        size_t offset;
        double value;
    } row[] = {
        {"voxel 0", offsetof(struct voxmap_setting, voxel_m), 0},
        {"voxel not a number", offsetof(struct voxmap_setting, voxel_m), NAN},
        {"tolerance below 0", offsetof(struct voxmap_setting, tolerance_m), -0.1},
        {"tolerance over a voxel", offsetof(struct voxmap_setting, tolerance_m), 0.2},
        {"opening 0", offsetof(struct voxmap_setting, opening), 0},
        {"opening over 1", offsetof(struct voxmap_setting, opening), 1.1},
        {"opening not a number", offsetof(struct voxmap_setting, opening), NAN},
        {"body not a number", offsetof(struct voxmap_setting, body_radius_m), NAN},
        {"way 0", offsetof(struct voxmap_setting, submap_path_m), 0},
    };
    struct fault fault;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct voxmap_setting s = rig_setting();
        memcpy((char *)&s + row[i].offset, &row[i].value, sizeof row[i].value);
        fault.text[0] = '\0';
        CHECK_INT(voxmap_bytes(&s, &fault), 0);
        CHECK(fault.text[0] != '\0');
        if (test_case_failed)
            printf("(%s)\n", row[i].name);
    }
    struct voxmap_setting s = rig_setting();
    CHECK(voxmap_bytes(&s, &fault) > 0);
    s.weight_levels = 0;
    CHECK_INT(voxmap_bytes(&s, &fault), 0);
    s.weight_levels = 8;
    s.rule.threshold = 32;
    CHECK_INT(voxmap_bytes(&s, &fault), 0);
    s.rule.threshold = 31;
    CHECK(voxmap_bytes(&s, &fault) > 0);
    CHECK_INT(voxmap_side(5, 5, 0.1), 17);
    CHECK_INT(voxmap_side(INFINITY, 5, 0.1), 0);
    CHECK_INT(voxmap_side(NAN, 5, 0.1), 0);
}

TEST(a_ping_without_a_good_pose_leaves_nothing)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    static const struct {
        const char *name;
        unsigned has;
        double north, w;
    } row[] = {
        {"no attitude", POSE_POSITION | POSE_DEPTH, 0, 1},
        {"no position", POSE_ATTITUDE | POSE_DEPTH, 0, 1},
        {"no depth", POSE_ATTITUDE | POSE_POSITION, 0, 1},
        {"north is not a number", 7, NAN, 1},
        {"north is infinite", 7, INFINITY, 1},
        {"attitude of length 0", 7, 0, 0},
        {"attitude is not a number", 7, 0, NAN},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        rig_aim(&p, at_origin, 0, 3);
        p.echoes.pose.has = row[i].has;
        p.echoes.pose.position_m[0] = row[i].north;
        p.echoes.pose.attitude[0] = row[i].w;
        CHECK(!rig_enter(r, &p, 0));
        CHECK_INT(r->map.stats.no_pose, (int)i + 1);
        if (test_case_failed)
            printf("(%s)\n", row[i].name);
    }
    rig_aim(&p, at_origin, 0, 3);
    p.echoes.az_aperture_rad = p.echoes.el_aperture_rad = 0;
    CHECK(!rig_enter(r, &p, 0));
    CHECK_INT(r->map.stats.unfit, 1);
    CHECK_INT(r->map.stats.pings, 0);
    CHECK_INT(r->map.tiles.n_free, r->map.tiles.n);
    rig_free(r);
}

TEST(V1_nothing_claimed_nothing_changed)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    const float far[] = {0, -1, NAN, INFINITY, 0.5f};
    for (size_t i = 0; i < sizeof far / sizeof far[0]; i++) {
        rig_aim(&p, at_origin, 0, 0);
        p.beam.free_to_m = far[i];
        p.beam.blind_m = 0.75f;
        CHECK(rig_enter(r, &p, 0));
    }
    rig_aim(&p, at_origin, 0, 3);
    p.beam.state = BEAM_BLIND;
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(r->map.stats.beams, 0);
    CHECK_INT(r->map.tiles.n_free, r->map.tiles.n);
    rig_free(r);
}

TEST(V4_a_voxel_rises_once_per_ping_and_stops_at_255)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    const int64_t cell[3] = {20, 0, 0};
    rig_aim(&p, at_origin, 0, 3);
    for (int n = 1; n <= 300; n++) {
        rig_enter(r, &p, 0);
        CHECK_INT(merge_sum(&r->map, cell).vacancy, n < 255 ? n : 255);
        CHECK_INT(merge_at(&r->map, cell), n > 2 ? VOXEL_FREE : VOXEL_UNKNOWN);
    }
    rig_free(r);
}

/* A fan whose beams are wider than their spacing: no voxel twice. */
TEST(a_fan_raises_each_voxel_once)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct beam_echoes beam[60];
    struct rig_ping p;
    rig_aim(&p, at_origin, 0, 3);
    p.echoes.az_aperture_rad = (float)geo_rad(6);
    p.echoes.n_beams = 60;
    p.echoes.beam = beam;
    for (int b = 0; b < 60; b++) {
        beam[b] = p.beam;
        beam[b].az_rad = (float)geo_rad(2.03 * b - 60);
    }
    CHECK(rig_enter(r, &p, 0));
    uint64_t more = 0, one = 0;
    for (int64_t i = -5; i < 35; i++)
        for (int64_t j = -35; j < 35; j++)
            for (int64_t k = -20; k < 20; k++) {
                uint32_t v = merge_sum(&r->map, (const int64_t[3]){i, j, k}).vacancy;
                more += v > 1;
                one += v == 1;
            }
    CHECK(more <= 4); /* on the very face between two beams, near the apex */
    CHECK(one > 5000);
    rig_free(r);
}

/* Counts of free looks at places of a level beam along north, by elevation and range. */
static uint32_t looks_at(struct rig *r, double el_deg, double az_deg, double range_m)
{
    const double el = geo_rad(el_deg), az = geo_rad(az_deg), h = r->map.set.voxel_m;
    const int64_t cell[3] = {(int64_t)floor(range_m * cos(el) * cos(az) / h),
                             (int64_t)floor(range_m * cos(el) * sin(az) / h),
                             (int64_t)floor(range_m * sin(el) / h)};
    return merge_sum(&r->map, cell).vacancy;
}

/* The side is free to 2 m, the edge from 0.8 to 1.5 m; 35 degrees high, of which half is the setting. */
static void aim_off_the_axis(struct rig_ping *p)
{
    rig_aim(p, (const double[3]){0, 0, 0}, 0, 3);
    p->beam.off_axis = true;
    p->beam.side_to_m = 2;
    p->beam.surface_from_m = 0.8f;
    p->beam.surface_to_m = 1.5f;
}

static struct voxmap_setting fine_setting(double opening)
{
    struct voxmap_setting s = rig_setting();
    s.voxel_m = 0.02;
    s.height = 160;
    s.side = 32;
    s.n_tiles = 900;
    s.opening = opening;
    return s;
}

TEST(off_its_axis_a_beam_frees_less)
{
    static const struct {
        double el_deg, range_m;
        uint32_t looks;
    } row[] = {{2, 2.8, 1}, {3, 1.8, 1},  {2, 0.5, 1},  {7, 2.8, 0},  {7, 1.8, 1},  {7, 0.6, 1},
               {7, 1.2, 1}, {15, 1.8, 0}, {15, 0.6, 0}, {15, 1.2, 1}, {15, 1.4, 1}, {19, 1.2, 0}};
    const struct voxmap_setting s = fine_setting(0.5);
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    aim_off_the_axis(&p);
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(r->map.stats.beams, 1);
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        for (int down = -1; down <= 1; down += 2) {
            CHECK_INT(looks_at(r, down * row[i].el_deg, 0.5, row[i].range_m), row[i].looks);
            if (test_case_failed)
                printf("(elevation %g, range %g)\n", down * row[i].el_deg, row[i].range_m);
        }
    for (int64_t i = 0; i < 160; i++) /* no voxel twice, wherever the stretches meet */
        for (int64_t j = -10; j < 10; j++)
            for (int64_t k = -60; k < 60; k++)
                CHECK(merge_sum(&r->map, (const int64_t[3]){i, j, k}).vacancy <= 1);
    rig_free(r);
}

/* The body keeps flat surfaces so far off that none can lie along the beam near by: see ungrazed_m. */
TEST(near_the_body_the_whole_beam_is_free_as_far_as_its_edge_hears)
{
    static const struct {
        double body_m, mount_m, edge_to_m, el_deg, range_m;
        uint32_t looks;
    } row[] = {{0.3, 0, 2, 15, 0.7, 1},    {0.3, 0, 2, 15, 0.97, 1}, /* 0.3 m / sin(17.5 degrees) is 0.998 m */
               {0.3, 0, 2, 15, 1.03, 0},   {0.3, 0, 2, 7, 1.03, 1},    {0.3, 0, 0.6, 15, 0.7, 0},
               {0.3, 0, 2, 19, 0.7, 0},    {0, 0, 2, 15, 0.7, 0},      {0.5, 0.2, 2, 15, 0.97, 1},
               {0.5, 0.2, 2, 15, 1.03, 0}, {0.25, 0.25, 2, 15, 0.4, 0}};
    struct rig_ping p;

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct voxmap_setting s = fine_setting(0.5);
        struct voxmap_sensor sensor = rig_sensor;
        s.body_radius_m = row[i].body_m;
        sensor.mount.position_m[2] = row[i].mount_m;
        struct rig *r = rig_new(&s);
        aim_off_the_axis(&p);
        p.echoes.pose.position_m[2] = -row[i].mount_m; /* so that the beam starts at the same place */
        p.beam.blind_m = 0.35f;
        p.beam.edge_from_m = 0.35f;
        p.beam.edge_to_m = (float)row[i].edge_to_m;
        p.beam.surface_to_m = 0;
        CHECK(voxmap_enter(&r->map, &p.echoes, &sensor));
        CHECK_INT(looks_at(r, row[i].el_deg, 0.5, row[i].range_m), row[i].looks);
        CHECK_INT(looks_at(r, -row[i].el_deg, 0.5, row[i].range_m), row[i].looks);
        if (test_case_failed)
            printf("(row %zu)\n", i);
        rig_free(r);
    }
}

/* Where a surface would be heard it is wider still, and no voxel lies in two parts. */
TEST(near_the_body_every_range_is_in_the_widest_part_once)
{
    struct voxmap_setting s = fine_setting(0.5);
    struct rig_ping p;
    s.body_radius_m = 0.4;
    struct rig *r = rig_new(&s);
    aim_off_the_axis(&p);
    p.beam.blind_m = 0.45f;
    p.beam.edge_from_m = 0.5f;
    p.beam.edge_to_m = 1.9f;
    p.beam.surface_from_m = 0.8f;
    p.beam.surface_to_m = 1.1f; /* and the whole beam to 1.33 m */
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(looks_at(r, 15, 0.5, 0.47), 0);
    CHECK_INT(looks_at(r, 7, 0.5, 0.47), 1);
    for (double range_m = 0.52; range_m < 1.3; range_m += 0.02)
        CHECK_INT(looks_at(r, 15, 0.5, range_m), 1);
    CHECK_INT(looks_at(r, 15, 0.5, 1.36), 0);
    for (int64_t i = 0; i < 160; i++)
        for (int64_t j = -10; j < 10; j++)
            for (int64_t k = -60; k < 60; k++)
                if (i * i + j * j + k * k > 25 * 25) /* beyond the body */
                    CHECK(merge_sum(&r->map, (const int64_t[3]){i, j, k}).vacancy <= 1);
    rig_free(r);
}

/* The edge is free beside half power as well, but never in a neighbour's place. */
TEST(the_edge_is_wider_than_the_beam_where_no_other_beam_is)
{
    const struct voxmap_setting s = fine_setting(1);
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    aim_off_the_axis(&p);
    p.echoes.az_aperture_rad = (float)geo_rad(20);
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(looks_at(r, 0.5, 11.5, 1.2), 1);
    CHECK_INT(looks_at(r, 0.5, -11.5, 1.2), 1);
    CHECK_INT(looks_at(r, 0.5, 13, 1.2), 0);
    CHECK_INT(looks_at(r, 0.5, 11.5, 1.8), 0);
    rig_free(r);

    r = rig_new(&s);
    p.echoes.az_aperture_rad = (float)geo_rad(160); /* nothing abreast and behind */
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(looks_at(r, 0.5, 75, 1.2), 1);
    CHECK_INT(looks_at(r, 0.5, 84, 1.2), 0);
    CHECK_INT(looks_at(r, 0.5, 94, 1.2), 0);
    rig_free(r);

    p.echoes.az_aperture_rad = (float)geo_rad(20);
    struct beam_echoes beam[2] = {p.beam, p.beam};
    r = rig_new(&s);
    beam[1].az_rad = (float)geo_rad(21);
    p.echoes.n_beams = 2;
    p.echoes.beam = beam;
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(looks_at(r, 0.5, 10, 1.2), 1);
    CHECK_INT(looks_at(r, 0.5, 11.5, 1.2), 1);
    rig_free(r);
}

/* The pose uncertainty takes from every part; numbers that are none free nothing. */
TEST(off_the_axis_an_uncertain_pose_and_nonsense_free_less)
{
    const struct voxmap_setting s = fine_setting(0.5);
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    aim_off_the_axis(&p);
    const double uncertain_m = p.echoes.pose.uncertain_m = 0.018;
    CHECK(rig_enter(r, &p, 0));
    uint64_t edge = 0, side = 0;
    for (int64_t i = 0; i < 160; i++)
        for (int64_t j = -10; j < 10; j++)
            for (int64_t k = -60; k < 60; k++) {
                const double at[3] = {0.02 * ((double)i + 0.5), 0.02 * ((double)j + 0.5),
                                      0.02 * ((double)k + 0.5)};
                const double range_m = hypot(hypot(at[0], at[1]), at[2]), el_deg = geo_deg(asin(at[2] / range_m));
                if (merge_sum(&r->map, (const int64_t[3]){i, j, k}).vacancy == 0 || fabs(el_deg) < 5)
                    continue;
                CHECK(range_m > uncertain_m && range_m <= 2 - uncertain_m);
                CHECK(fabs(el_deg) < 8.8 ||
                      (range_m > 0.8 + uncertain_m - 1e-6 && range_m < 1.5 - uncertain_m + 1e-6));
                edge += fabs(el_deg) > 8.8;
                side += fabs(el_deg) < 8.7 && range_m > 1.6;
            }
    CHECK(edge > 500 && side > 500);
    rig_free(r);
    r = rig_new(&s);
    aim_off_the_axis(&p);
    p.echoes.pose.uncertain_m = 0.15;
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(r->map.stats.beams, 0); /* farther off than a voxel */
    aim_off_the_axis(&p);
    p.beam.side_to_m = p.beam.surface_from_m = NAN;
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(looks_at(r, 7, 0.5, 1.2), 0);
    CHECK_INT(looks_at(r, 15, 0.5, 1.2), 0);
    rig_free(r);
    r = rig_new(&s);
    aim_off_the_axis(&p);
    p.beam.free_to_m = NAN;
    CHECK(rig_enter(r, &p, 0));
    CHECK_INT(r->map.stats.beams, 0);
    rig_free(r);
}

TEST(an_echo_always_lies_in_some_voxel)
{
    uint64_t seed = test_seed();
    struct voxmap_setting s = rig_setting();
    s.voxel_m = 0.2;
    s.height = 60;
    for (int n = 0; n < 40; n++) {
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        const double at[3] = {test_uniform(&seed), test_uniform(&seed), test_uniform(&seed)};
        double az = 7 * test_uniform(&seed), range = 0.3 + 4 * test_uniform(&seed);
        rig_aim(&p, at, az, 0);
        p.echoes.el_aperture_rad = p.echoes.az_aperture_rad = (float)geo_rad(1);
        rig_hear(&p, range);
        rig_enter(r, &p, 0);
        CHECK_INT(rig_state(r, at[0] + range * cos(az), at[1] + range * sin(az), at[2]), VOXEL_OCCUPIED);
        CHECK(cells_with(r, true) < 40);
        rig_free(r);
    }
}

TEST(what_was_heard_once_outweighs_some_looks_and_is_carved_in_the_end)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    rig_aim(&p, at_origin, 0, 3);
    rig_hear(&p, 2); /* a line in the water */
    rig_enter(r, &p, 0);
    CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_OCCUPIED);
    for (int n = 0; n < 6; n++) {
        rig_aim(&p, at_origin, 0, 3);
        rig_enter(r, &p, 0);
        CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_OCCUPIED);
    }
    rig_enter(r, &p, 0); /* the seventh: it was an outlier */
    CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_FREE);
    rig_free(r);

    s.keep_echoes = false; /* carved at once: that is what keeping echoes is for */
    r = rig_new(&s);
    for (int n = 0; n < 3; n++)
        rig_enter(r, &p, 0);
    CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_FREE);
    rig_free(r);
}

TEST(an_echo_of_the_vehicles_own_is_no_place_and_frees_none)
{
    const struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    for (int az_deg = -9; az_deg <= 9; az_deg++) {
        struct rig_ping p;
        rig_aim(&p, at_origin, geo_rad(az_deg), 3);
        rig_hear(&p, 2);
        p.beam.echo[0].flags = ECHO_OWN;
        rig_enter(r, &p, 0);
    }
    CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_UNKNOWN);
    CHECK_INT(rig_state(r, 2.45, 0.05, 0.05), VOXEL_UNKNOWN);
    CHECK_INT(rig_state(r, 1.45, 0.05, 0.05), VOXEL_FREE);
    rig_free(r);
}

TEST(a_diver_passes_and_does_not_stay)
{
    struct voxmap_setting s = rig_setting();
    s.half_life_ns = 60 * SECOND;
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    uint64_t t = 0;
    for (int n = 0; n < 50; n++, t += SECOND) {
        rig_aim(&p, at_origin, 0, 3);
        rig_hear(&p, 2);
        rig_enter(r, &p, t);
    }
    CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_OCCUPIED);
    int looks = 0;
    for (; looks < 400 && rig_state(r, 2.05, 0.05, 0.05) != VOXEL_FREE; looks++, t += SECOND) {
        rig_aim(&p, at_origin, 0, 3);
        rig_enter(r, &p, t);
    }
    CHECK(looks > 50 && looks < 200); /* without ageing: 203 */
    rig_free(r);
}

TEST(time_passes_without_a_pose)
{
    struct voxmap_setting s = rig_setting();
    s.half_life_ns = 10 * SECOND;
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    rig_aim(&p, at_origin, 0, 3);
    for (int n = 0; n < 8; n++)
        rig_enter(r, &p, SECOND);
    CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_FREE);
    p.echoes.pose.has = 0;
    CHECK(!rig_enter(r, &p, 32 * SECOND));
    CHECK_INT(merge_sum(&r->map, (const int64_t[3]){20, 0, 0}).vacancy, 1);
    CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_UNKNOWN);
    rig_free(r);
}

/* Against counts halved by hand, in whole and in turn, over submaps and half-lives. */
TEST(ageing_is_halving_and_frees_nothing)
{
    uint64_t seed = test_seed(), t = 0;
    struct voxmap_setting s = rig_setting();
    s.half_life_ns = 10 * SECOND;
    s.submap_ns = 25 * SECOND;
    s.max_submaps = 16;
    struct rig *r = rig_new(&s);
    const int64_t cell[3] = {20, 0, 0};
    uint32_t vacancy[16] = {0}, echoes[16] = {0};
    uint64_t half_lives = 0, id = 0;
    for (int n = 0; n < 200; n++) {
        struct rig_ping p;
        bool hit = test_uniform(&seed) < 0.3;
        t += (uint64_t)(3 * test_uniform(&seed) * (double)SECOND);
        enum voxel_state before = rig_state(r, 2.05, 0.05, 0.05);
        rig_aim(&p, (const double[3]){0.05, 0.05, -3}, GEO_PI, 0.05); /* elsewhere: time passes */
        p.beam.state = BEAM_BLIND;
        t += n == 0;
        rig_enter(r, &p, t);
        CHECK(!(before != VOXEL_FREE && rig_state(r, 2.05, 0.05, 0.05) == VOXEL_FREE));
        for (; half_lives < (t - r->map.t0_ns) / (10 * SECOND); half_lives++)
            for (int m = 0; m < 16; m++) {
                vacancy[m] /= 2;
                echoes[m] = (echoes[m] + 1) / 2;
            }
        rig_aim(&p, at_origin, 0, 3);
        if (hit)
            rig_hear(&p, 2);
        rig_enter(r, &p, t);
        if (r->map.current->id != id)
            id = r->map.current->id;
        vacancy[id % 16] += hit ? 0 : 1;
        echoes[id % 16] += hit;
        uint32_t sum[2] = {0};
        for (int m = 0; m < 16; m++) {
            if (id >= 16)
                break;
            sum[0] += vacancy[m];
            sum[1] += echoes[m];
        }
        if (id < 16) {
            CHECK_INT(merge_sum(&r->map, cell).vacancy, sum[0]);
            CHECK_INT(merge_sum(&r->map, cell).echoes, sum[1]);
        }
    }
    CHECK(id > 8);
    rig_free(r);
}

/* Asked while no ping comes the map is as old as it is; a ping that comes then finds what it
 * would have found anyway. */
TEST(a_silent_map_ages_too)
{
    struct voxmap_setting s = rig_setting();
    s.half_life_ns = 10 * SECOND;
    struct rig *asked = rig_new(&s), *not_asked = rig_new(&s);
    struct rig_ping p;
    const int64_t water[3] = {-10, 0, 0}, wall[3] = {20, 0, 0};
    voxmap_pass(&asked->map, 100 * SECOND); /* before the first ping there is no time */
    for (int n = 0; n < 4; n++) {
        rig_turn(asked, at_origin, 1.5, SECOND);
        rig_turn(not_asked, at_origin, 1.5, SECOND);
    }
    rig_aim(&p, at_origin, 0, 0);
    rig_hear(&p, 2.05);
    rig_enter(asked, &p, SECOND);
    rig_enter(not_asked, &p, SECOND);
    const uint32_t free_looks = merge_sum(&asked->map, water).vacancy;
    CHECK_INT(voxmask_at(&asked->mask, water), VOXEL_FREE);
    voxmap_pass(&asked->map, 12 * SECOND);
    CHECK_INT(merge_sum(&asked->map, water).vacancy, free_looks / 2);
    voxmap_pass(&asked->map, 5 * SECOND); /* no way back */
    CHECK_INT(voxmask_at(&asked->mask, water), VOXEL_UNKNOWN);
    voxmap_pass(&asked->map, 1000 * SECOND);
    CHECK_INT(merge_sum(&asked->map, water).vacancy, 0);
    CHECK_INT(voxmask_at(&asked->mask, wall), VOXEL_OCCUPIED);
    rig_aim(&p, at_origin, 1, 1);
    rig_enter(asked, &p, 1003 * SECOND);
    rig_enter(not_asked, &p, 1003 * SECOND);
    CHECK(rig_hash(asked, 25, nowhere) == rig_hash(not_asked, 25, nowhere));
    rig_free(asked);
    rig_free(not_asked);
}

TEST(submaps_begin_by_way_time_and_on_request_after_their_last_beam)
{
    struct voxmap_setting s = rig_setting();
    s.submap_path_m = 5;
    s.submap_ns = 60 * SECOND;
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    static const struct {
        double path_m;
        uint64_t t_s;
        bool ask;
        uint64_t want;
    } row[] = {
        {0, 0, false, 1},   {4.9, 1, false, 1}, {5, 2, false, 1},   {5.1, 3, false, 2}, {10, 4, false, 2},
        {10, 62, false, 2}, {10, 63, false, 2}, {10, 64, false, 3}, {10, 65, true, 4},  {10, 66, false, 4},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        rig_aim(&p, at_origin, 0, 1);
        p.echoes.pose.path_m = row[i].path_m;
        if (row[i].ask)
            voxmap_new(&r->map);
        rig_enter(r, &p, row[i].t_s * SECOND);
        CHECK_INT(r->map.current->id, row[i].want);
    }
    rig_free(r);
}

TEST(V5_far_away_is_the_same_map)
{
    struct voxmap_setting s = rig_setting();
    s.voxel_m = 0.125; /* so that 1e7 m are whole voxels, exactly */
    const double far[3] = {1e7, -1e7, 5000};
    const int64_t shift[3] = {80000000, -80000000, 40000};
    uint64_t hash[2];
    for (int n = 0; n < 2; n++) {
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        for (int b = 0; b < 40; b++) {
            double at[3] = {0.25, 0.375, -0.25};
            for (int a = 0; a < 3; a++)
                at[a] += n ? far[a] : 0;
            rig_aim(&p, at, 0.3 * b, 2);
            rig_hear(&p, 1 + 0.05 * b);
            rig_enter(r, &p, 0);
        }
        hash[n] = rig_hash(r, 30, n ? shift : nowhere);
        rig_free(r);
    }
    CHECK(hash[0] == hash[1]);
    CHECK(hash[0] != 1469598103934665603u);
}

/* The same pings in one submap and in many give the same map, where nothing saturates. */
TEST(V9_merging_is_exact)
{
    uint64_t hash[3];
    for (int n = 0; n < 3; n++) {
        uint64_t seed = 7;
        struct voxmap_setting s = rig_setting();
        s.side = 12;
        s.n_tiles = 1500;
        struct rig *r = rig_new(&s);
        for (int b = 0; b < 100; b++) {
            struct rig_ping p;
            const double at[3] = {test_uniform(&seed), test_uniform(&seed), test_uniform(&seed)};
            rig_aim(&p, at, 7 * test_uniform(&seed), 3);
            if (b % 3 == 0)
                rig_hear(&p, 2);
            if (n && b % (n == 1 ? 13 : 40) == 0)
                voxmap_new(&r->map);
            rig_enter(r, &p, 0);
        }
        CHECK_INT(r->map.stats.lost, 0);
        CHECK_INT(r->map.stats.clipped, 0);
        hash[n] = rig_hash(r, 45, nowhere);
        rig_free(r);
    }
    CHECK(hash[0] == hash[1]);
    CHECK(hash[0] == hash[2]);
}

/* A solid block of free water, turned: no holes, nothing beyond. */
TEST(V10_a_corrected_submap_has_no_holes)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    double turn[4], attitude[4];
    rig_aim(&p, at_origin, 0, 0.2);
    rig_enter(r, &p, 0);
    r->map.current->map.now = ++r->map.change;
    struct lattice_place a = {{-12, 0, 0}, {0.5, 0.5, 0.5}}, b = {{12, 0, 0}, {0.5, 0.5, 0.5}};
    submap_body(&r->map.current->map, &a, &b, 8, 9); /* a capsule */

    quat_from_rpy(0, 0, geo_rad(45), turn);
    memcpy(attitude, turn, sizeof turn);
    const double to[3] = {1.05, -0.95, 0.35};
    CHECK(voxmap_move(&r->map, 1, to, attitude));
    CHECK(r->map.current == NULL);
    int holes = 0, beyond = 0, inside = 0;
    for (int64_t i = -40; i < 40; i++)
        for (int64_t j = -40; j < 40; j++)
            for (int64_t k = -30; k < 30; k++) {
                const int64_t cell[3] = {i, j, k};
                double v[3] = {(double)i + 0.5 - 10.5, (double)j + 0.5 + 9.5, (double)k + 0.5 - 3.5};
                quat_rotate_inverse(turn, v, v);
                double along = fmin(fmax(v[0], -12), 12);
                double depth = 8 - sqrt((v[0] - along) * (v[0] - along) + v[1] * v[1] + v[2] * v[2]);
                bool is_free = merge_at(&r->map, cell) == VOXEL_FREE;
                inside += is_free;
                holes += depth > 1.7321 && !is_free;
                beyond += depth < 0 && is_free;
            }
    CHECK_INT(holes, 0);
    CHECK_INT(beyond, 0);
    CHECK(inside > 3000);
    CHECK(!voxmap_move(&r->map, 9, to, attitude));
    CHECK(!voxmap_move(&r->map, 1, (const double[3]){NAN, 0, 0}, attitude));
    CHECK(!voxmap_move(&r->map, 1, to, (const double[4]){0, 0, 0, 0}));
    rig_free(r);
}

TEST(V10_moved_by_whole_voxels_is_exact)
{
    struct voxmap_setting s = rig_setting();
    s.voxel_m = 0.125;
    struct rig *r = rig_new(&s);
    const double at[3] = {0.0625, 0.0625, 0.0625}, to[3] = {0.0625 + 1.25, 0.0625 - 0.25, 0.0625 + 0.5};
    rig_turn(r, at, 2, 0);
    uint64_t before = rig_hash(r, 30, nowhere);
    CHECK(voxmap_move(&r->map, 1, to, (const double[4]){1, 0, 0, 0}));
    CHECK(rig_hash(r, 30, (const int64_t[3]){10, -2, 4}) == before);
    CHECK(rig_hash(r, 30, nowhere) != before);
    rig_free(r);
}

TEST(the_body_is_stamped_along_its_way_but_not_over_jumps)
{
    struct voxmap_setting s = rig_setting();
    s.body_radius_m = 0.4;
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    static const struct {
        double north;
        uint64_t t_ms;
    } way[] = {{0, 1000}, {0.7, 1500}, {1.4, 2000}, {2.1, 9000}, {3.9, 9100}};
    for (size_t n = 0; n < sizeof way / sizeof way[0]; n++) {
        rig_aim(&p, (const double[3]){way[n].north, 0, 0}, 0, 0);
        rig_enter(r, &p, way[n].t_ms * 1000000);
    }
    CHECK_INT(rig_state(r, 0.36, 0.3, 0), VOXEL_FREE);
    CHECK_INT(rig_state(r, 1.06, 0.3, 0), VOXEL_FREE);
    CHECK_INT(rig_state(r, 1.76, 0.3, 0), VOXEL_UNKNOWN); /* 7 s */
    CHECK_INT(rig_state(r, 3.0, 0, 0), VOXEL_UNKNOWN);    /* 1.8 m at once */
    CHECK_INT(rig_state(r, 3.9, 0, 0), VOXEL_FREE);
    rig_free(r);
}

/* Backward and forward: beside the beam of the foremost place nothing is free, and up to its sides it is. */
TEST(the_sides_of_a_blurred_beam_are_those_of_its_foremost_place)
{
    const struct voxmap_setting s = rig_setting();
    const double tan_edge = tan(geo_rad(30));
    for (int back = 0; back < 2; back++) {
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        int free = 0;
        rig_aim(&p, at_origin, 0, 4);
        p.echoes.az_aperture_rad = (float)geo_rad(60);
        p.echoes.pose.blur_m[0] = back ? -0.8 : 0.8;
        for (int n = 0; n < 5; n++)
            CHECK(rig_enter(r, &p, 1000000000));
        for (double north = 0.05; north < 4; north += 0.1)
            for (double east = -1.95; east < 2; east += 0.1) {
                const bool is_free = rig_state(r, north, east, 0.05) == VOXEL_FREE;
                CHECK(!is_free || fabs(east - at_origin[1]) <= (north - at_origin[0] - 0.8) * tan_edge + 1e-9);
                free += is_free;
            }
        CHECK(free > 150);
        CHECK_INT(rig_state(r, 3.05, 0.05, 0.05), VOXEL_FREE);
        CHECK_INT(rig_state(r, 2.55, 0.75, 0.05), VOXEL_FREE);
        rig_free(r);
    }
}

/* Within the time of a late reading it went along the beam, across it, somewhere, or turned. */
TEST(water_is_free_wherever_within_its_blur_the_ping_was_sent)
{
    static const struct {
        double m[3], any_m, turned_rad;
        double within, beyond; /* free along the beam, and not; 0: nowhere */
    } row[] = {
        {{0.4, 0, 0}, 0, 0, 2.45, 2.75},       {{0, 0.05, 0}, 0, 0, 2.85, 3.15}, {{0, 0.15, 0}, 0, 0, 0, 0.65},
        {{0, 0, 0}, 0.09, 0, 2.75, 3.05},      {{0, 0, 0}, 0.15, 0, 0, 0.65},    {{0, 0, 0}, 0, 0.05, 1.95, 2.25},
        {{0.4, 0.05, 0}, 0, 0.05, 0.85, 1.25},
    };
    const struct voxmap_setting s = rig_setting();
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        rig_aim(&p, at_origin, 0, 3);
        memcpy(p.echoes.pose.blur_m, row[i].m, sizeof row[i].m);
        p.echoes.pose.blur_any_m = row[i].any_m;
        p.echoes.pose.blur_rad = row[i].turned_rad;
        for (int n = 0; n < 5; n++)
            CHECK(rig_enter(r, &p, 1000000000));
        CHECK(row[i].within == 0 || rig_state(r, row[i].within, 0.05, 0.05) == VOXEL_FREE);
        CHECK_INT(rig_state(r, row[i].beyond, 0.05, 0.05), VOXEL_UNKNOWN);
        if (test_case_failed)
            printf("(row %zu)\n", i);
        rig_free(r);
    }
}

/* Since the pose was told the vehicle may have gone and turned: a voxel is 0.1 m. */
TEST(water_is_free_where_its_place_is_known_to_a_voxel)
{
    static const struct {
        double uncertain_m, uncertain_rad, free_m;
        double within, beyond; /* free along the beam, and not; 0: nowhere */
        bool body;
    } row[] = {
        {0, 0, 3, 2.95, 3.25, true},           {0.09, 0, 3, 2.85, 3.25, true},    {0.11, 0, 3, 0, 0.65, false},
        {0, 0.05, 3, 1.95, 2.25, true},        {0.05, 0.05, 3, 0.95, 1.25, true}, {0.11, 0.05, 3, 0, 0.65, false},
        {0, 0.05, (double)NAN, 0, 0.65, true},
    };
    struct voxmap_setting s = rig_setting();
    s.body_radius_m = 0.4;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        rig_aim(&p, at_origin, 0, row[i].free_m);
        p.echoes.pose.uncertain_m = row[i].uncertain_m;
        p.echoes.pose.uncertain_rad = row[i].uncertain_rad;
        for (int n = 0; n < 5; n++)
            CHECK(rig_enter(r, &p, 1000000000));
        CHECK(row[i].within == 0 || rig_state(r, row[i].within, 0.05, 0.05) == VOXEL_FREE);
        CHECK_INT(rig_state(r, row[i].beyond, 0.05, 0.05), VOXEL_UNKNOWN);
        CHECK_INT(rig_state(r, 0.05, 0.35, 0.05) == VOXEL_FREE, row[i].body);
        if (test_case_failed)
            printf("(row %zu)\n", i);
        rig_free(r);
    }
}

TEST(an_echo_reaches_farther_by_the_slack)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    rig_aim(&p, at_origin, 0, 3);
    rig_hear(&p, 3);
    p.echoes.pose.uncertain_m = 0.5;
    rig_enter(r, &p, 0);
    CHECK_INT(rig_state(r, 2.65, 0.05, 0.05), VOXEL_OCCUPIED);
    CHECK_INT(rig_state(r, 3.45, 0.05, 0.05), VOXEL_OCCUPIED);
    CHECK_INT(rig_state(r, 2.35, 0.05, 0.05), VOXEL_UNKNOWN);
    rig_free(r);
}

/*
 * A thin pole 4 m ahead, and a vehicle that turned on to one side since each of its poses, as far as its slack says and
 * water is freed for: the beams pass the pole where the map takes them to have met it.
 */
TEST(what_looks_beside_it_heard_free_is_no_pole)
{
    const double off_rad = 0.095 / 4;
    for (double phase_deg = 0; phase_deg < 3; phase_deg += 0.25)
        for (int side = -1; side <= 1; side += 2) {
            struct voxmap_setting s = rig_setting();
            struct rig *r = rig_new(&s);
            for (int turn = 0; turn < 4; turn++)
                for (double az_deg = phase_deg - 30; az_deg < 30; az_deg += 3) {
                    const bool meets = fabs(geo_rad(az_deg) + side * off_rad) <= geo_rad(1.5);
                    struct rig_ping p;
                    rig_aim(&p, at_origin, geo_rad(az_deg), 6);
                    if (meets)
                        rig_hear(&p, 4);
                    p.echoes.pose.uncertain_rad = off_rad;
                    rig_enter(r, &p, 0);
                }
            CHECK(rig_state(r, 4, 0.01, 0.05) != VOXEL_FREE);
            CHECK_INT(rig_state(r, 3.5, 1.5, 0.05), VOXEL_FREE);
            if (test_case_failed)
                printf("(beams from %g degrees, side %d)\n", phase_deg, side);
            rig_free(r);
        }
}

/* With levels, a look along the axis weighs m, one at the edge at least 1; one level is the plain map. */
TEST(angle_weighted_vacancy)
{
    for (int levels = 1; levels <= 8; levels += levels < 4 ? 1 : 4) {
        struct voxmap_setting s = rig_setting();
        s.weight_levels = (uint8_t)levels;
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        rig_aim(&p, at_origin, 0, 3);
        p.echoes.az_aperture_rad = (float)geo_rad(40);
        rig_enter(r, &p, 0);
        int wrong = 0, cells = 0;
        for (int64_t i = 1; i < 32; i++)
            for (int64_t j = -15; j < 15; j++)
                for (int64_t k = -12; k < 12; k++) {
                    uint32_t v = merge_sum(&r->map, (const int64_t[3]){i, j, k}).vacancy;
                    double u = fabs(atan2((double)j, (double)i)) / geo_rad(20);
                    double w = fabs(atan2((double)k, hypot((double)i, (double)j))) / geo_rad(17.5);
                    double pattern = exp(-2 * log(2) * fmax(u, w) * fmax(u, w));
                    cells += v > 0;
                    wrong += v > 0 && fabs((double)v - ceil(levels * pattern)) > 0 &&
                             fabs(levels * pattern - rint(levels * pattern)) > 1e-6;
                }
        CHECK_INT(wrong, 0);
        CHECK(cells > 500);
        CHECK_INT(merge_sum(&r->map, (const int64_t[3]){20, 0, 0}).vacancy, levels);
        rig_aim(&p, at_origin, 0, 3);
        p.echoes.az_aperture_rad = (float)geo_rad(40);
        rig_enter(r, &p, 0);
        CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_UNKNOWN);
        rig_enter(r, &p, 0);
        CHECK_INT(rig_state(r, 2.05, 0.05, 0.05), VOXEL_FREE); /* the threshold is scaled along */
        rig_free(r);
    }
}

/* Silence all along: free only as far as silence is worth, whatever the sensor reaches. */
/* Free water through the middle of a beam only, echoes through all of it: of a wedge's height,
 * of a cone's both ways. */
TEST(an_opening_narrows_free_water_and_no_echo)
{
    static const struct {
        const char *name;
        enum cast_shape shape;
        double el_deg, az_deg; /* where, off the axis */
        enum voxel_state full, half;
    } row[] = {
        {"wedge, axis", CAST_WEDGE, 0, 0, VOXEL_FREE, VOXEL_FREE},
        {"wedge, within half the height", CAST_WEDGE, 8, 0, VOXEL_FREE, VOXEL_FREE},
        {"wedge, above half the height", CAST_WEDGE, 9.5, 0, VOXEL_FREE, VOXEL_UNKNOWN},
        {"wedge, near its side", CAST_WEDGE, 0, 14, VOXEL_FREE, VOXEL_FREE},
        {"cone, within half", CAST_CONE, 5, 5, VOXEL_FREE, VOXEL_FREE},
        {"cone, beyond half", CAST_CONE, 0, 9, VOXEL_FREE, VOXEL_UNKNOWN},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        for (int half = 0; half < 2; half++) {
            struct voxmap_setting s = rig_setting();
            struct voxmap_sensor sensor = rig_sensor;
            struct rig_ping p;
            double d[3];
            s.opening = half ? 0.5 : 1;
            s.rule.threshold = 0;
            sensor.shape = row[i].shape;
            struct rig *r = rig_new(&s);
            rig_aim(&p, (const double[3]){0.05, 0.05, 0.05}, 0, 3);
            p.echoes.az_aperture_rad = (float)geo_rad(row[i].shape == CAST_CONE ? 35 : 30);
            rig_hear(&p, 4);
            voxmap_enter(&r->map, &p.echoes, &sensor);
            geo_direction(geo_rad(row[i].az_deg), geo_rad(row[i].el_deg), d);
            CHECK_INT(rig_state(r, 0.05 + 3 * d[0], 0.05 + 3 * d[1], 0.05 + 3 * d[2]),
                      half ? row[i].half : row[i].full);
            CHECK_INT(rig_state(r, 0.05 + 4 * d[0], 0.05 + 4 * d[1], 0.05 + 4 * d[2]), VOXEL_OCCUPIED);
            if (test_case_failed)
                printf("(%s, %s)\n", row[i].name, half ? "half" : "full");
            rig_free(r);
        }
}

TEST(V12_without_an_echo_free_only_to_the_minimum)
{
    uint64_t seed = test_seed();
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    for (int n = 0; n < 400; n++) {
        rig_aim(&p, at_origin, 7 * test_uniform(&seed), 0.75);
        quat_from_rpy(test_uniform(&seed), 7 * test_uniform(&seed), test_uniform(&seed), p.echoes.pose.attitude);
        p.echoes.range_max_m = 50;
        p.echoes.az_aperture_rad = 0.5f;
        rig_enter(r, &p, 0);
    }
    int free = 0, beyond = 0;
    for (int64_t i = -30; i < 30; i++)
        for (int64_t j = -30; j < 30; j++)
            for (int64_t k = -30; k < 30; k++) {
                bool is_free = merge_at(&r->map, (const int64_t[3]){i, j, k}) == VOXEL_FREE;
                free += is_free;
                beyond += is_free && (double)(i * i + j * j + k * k) > 7.5 * 7.5 + 1e-6;
            }
    CHECK(free > 500);
    CHECK_INT(beyond, 0);
    rig_free(r);
}

/* A mount's arm and turn, and the vehicle's attitude, put the beam where it belongs. */
TEST(mount_and_attitude_place_the_beam)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    struct voxmap_sensor sensor = {.mount = {.position_m = {1, 0, 0.5}}, .shape = CAST_WEDGE};
    quat_from_rpy(0, 0, geo_rad(90), sensor.mount.attitude); /* looks to starboard, */
    rig_aim(&p, at_origin, 0, 1.5);
    quat_from_rpy(0, 0, geo_rad(90), p.echoes.pose.attitude); /* of a vehicle that heads east: south */
    for (int n = 0; n < 3; n++)
        CHECK(voxmap_enter(&r->map, &p.echoes, &sensor));
    CHECK_INT(rig_state(r, 0.05 - 1.0, 1.05, 0.55), VOXEL_FREE);
    CHECK_INT(rig_state(r, 0.05 + 1.0, 1.05, 0.55), VOXEL_UNKNOWN);
    CHECK_INT(rig_state(r, 0.05 - 1.0, 0.05, 0.05), VOXEL_UNKNOWN);
    rig_free(r);
}

/* A beam that looks 40 degrees up frees what lies above and hears there; what lies below as far is not touched. */
TEST(an_elevation_is_upward)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    const double up = geo_rad(40), free_m = 2, heard_m = 3;
    rig_aim(&p, at_origin, 0, heard_m);
    p.beam.el_rad = (float)up;
    p.echoes.el_aperture_rad = (float)geo_rad(10);
    rig_hear(&p, heard_m);
    for (int n = 0; n < 3; n++)
        rig_enter(r, &p, 0);
    CHECK_INT(rig_state(r, 0.05 + free_m * cos(up), 0.05, 0.05 - free_m * sin(up)), VOXEL_FREE);
    CHECK_INT(rig_state(r, 0.05 + free_m * cos(up), 0.05, 0.05 + free_m * sin(up)), VOXEL_UNKNOWN);
    CHECK_INT(rig_state(r, 0.05 + heard_m * cos(up), 0.05, 0.05 - heard_m * sin(up)), VOXEL_OCCUPIED);
    CHECK_INT(rig_state(r, 0.05 + heard_m * cos(up), 0.05, 0.05 + heard_m * sin(up)), VOXEL_UNKNOWN);
    rig_free(r);
}

/* The same where the submap's box does not reach: an echo that is clipped stays in the residual. */
TEST(an_elevation_is_upward_beyond_the_box)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    const double up = geo_rad(60), heard_m = 7;
    rig_aim(&p, at_origin, 0, heard_m);
    p.beam.el_rad = (float)up;
    p.echoes.el_aperture_rad = (float)geo_rad(10);
    rig_hear(&p, heard_m);
    rig_enter(r, &p, 0);
    CHECK(heard_m * sin(up) > s.height * s.voxel_m / 2);
    const int64_t north = (int64_t)floor((0.05 + heard_m * cos(up)) / s.voxel_m);
    const int64_t above = (int64_t)floor((0.05 - heard_m * sin(up)) / s.voxel_m);
    CHECK(merge_sum(&r->map, (const int64_t[3]){north, 0, above}).residual > 0);
    CHECK_INT(merge_sum(&r->map, (const int64_t[3]){north, 0, -above}).residual, 0);
    rig_free(r);
}

/* ---- memory ---- */

/* Eight looks of 3 m from the origin in the first submap, which is closed then. The ping is blind from then on. */
static void look_and_close(struct rig *r, const double at[3], struct rig_ping *p)
{
    rig_aim(p, at, 0, 3);
    for (int n = 0; n < 8; n++)
        rig_enter(r, p, SECOND);
    voxmap_new(&r->map);
    p->beam.state = BEAM_BLIND;
    rig_enter(r, p, SECOND);
}

/* The bytes of the first submap; of the heap. */
static uint8_t *packed(const struct rig *r, size_t *size)
{
    *size = voxpage_bytes(&r->map, 1);
    uint8_t *bytes = rig_memory(*size);
    CHECK_INT(voxpage_pack(&r->map, 1, 0, bytes, *size), *size);
    return bytes;
}

TEST(a_submap_in_another_map_is_the_same)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s), *other = rig_new(&s);
    struct rig_ping p;
    struct fault fault;
    size_t size;
    rig_turn(r, at_origin, 2, 0);
    rig_turn(r, at_origin, 2, 0);
    rig_turn(r, at_origin, 2, 0);
    rig_aim(&p, at_origin, 0, 3);
    rig_hear(&p, 1.5);
    rig_enter(r, &p, 0);
    CHECK_INT(voxmap_oldest(&r->map), 0);
    CHECK(!voxmap_drop(&r->map, 1)); /* the current one */
    voxmap_new(&r->map);
    rig_aim(&p, (const double[3]){0, 0, 2}, 0, 0);
    rig_enter(r, &p, 0);
    CHECK_INT(voxmap_oldest(&r->map), 1);
    uint8_t *bytes = packed(r, &size), *sliced = rig_memory(size);
    for (size_t at = 0, n; (n = voxpage_pack(&r->map, 1, at, sliced + at, 7777)) > 0; at += n)
        ;
    CHECK(memcmp(bytes, sliced, size) == 0);
    CHECK(!voxpage_add(&other->map, bytes, size - 1, &fault));
    CHECK_STR(fault.text, "cut or damaged: its length is not what it says");
    CHECK_INT(voxpage_add(&other->map, bytes, size, &fault), 1);
    CHECK(rig_hash(r, 25, nowhere) == rig_hash(other, 25, nowhere));
    uint32_t had = r->map.tiles.n_free;
    CHECK(voxmap_drop(&r->map, 1) && !voxmap_drop(&r->map, 1));
    CHECK_INT(voxpage_tiles(bytes, size), r->map.tiles.n_free - had);
    CHECK_INT(voxpage_bytes(&r->map, 1), 0);
    CHECK_INT(voxmap_oldest(&r->map), 0);
    rig_free(other);
    free(bytes);
    free(sliced);
    rig_free(r);
}

/* Far from the origin on every axis, with offsets within a voxel. */
TEST(a_packed_submap_lies_where_it_lay)
{
    const double at[3] = {-312.34, 47.77, 23.31};
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s), *other = rig_new(&s);
    struct rig_ping p;
    struct fault fault;
    size_t size;
    look_and_close(r, at, &p);
    uint8_t *bytes = packed(r, &size);
    CHECK_INT(voxpage_add(&other->map, bytes, size, &fault), 1);
    for (int k = 0; k < 30; k++) {
        const double north = at[0] + 0.1 * k;
        CHECK_INT(rig_state(other, north, at[1], at[2]), rig_state(r, north, at[1], at[2]));
    }
    CHECK_INT(rig_state(other, at[0] + 2, at[1], at[2]), VOXEL_FREE);
    CHECK_INT(rig_state(other, 2, 0, 0), VOXEL_UNKNOWN);
    free(bytes);
    rig_free(other);
    rig_free(r);
}

/* What is packed is as old as the submap is by then. */
TEST(what_is_packed_has_aged)
{
    struct voxmap_setting s = rig_setting();
    s.half_life_ns = 10 * SECOND;
    struct rig *r = rig_new(&s), *other = rig_new(&s);
    const int64_t cell[3] = {20, 0, 0};
    struct rig_ping p;
    struct fault fault;
    size_t size;
    look_and_close(r, at_origin, &p);
    rig_enter(r, &p, 32 * SECOND);
    uint8_t *bytes = packed(r, &size);
    CHECK(voxpage_add(&other->map, bytes, size, &fault) > 0);
    CHECK_INT(merge_sum(&other->map, cell).vacancy, 1);
    free(bytes);
    rig_free(other);
    rig_free(r);
}

/* 10 m to the east: so it is packed. */
TEST(what_is_packed_lies_where_it_was_moved_to)
{
    struct voxmap_setting s = rig_setting();
    s.voxel_m = 0.125;
    struct rig *r = rig_new(&s), *other = rig_new(&s);
    const double at[3] = {0.0625, 0.0625, 0.0625}, to_m[3] = {0.0625, 10.0625, 0.0625}, turn[4] = {1, 0, 0, 0};
    const int64_t old_cell[3] = {20, 0, 0}, cell[3] = {20, 80, 0};
    struct rig_ping p;
    struct fault fault;
    size_t size;
    look_and_close(r, at, &p);
    CHECK(voxmap_move(&r->map, 1, to_m, turn));
    uint8_t *bytes = packed(r, &size);
    CHECK(voxpage_add(&other->map, bytes, size, &fault) > 0);
    CHECK_INT(merge_sum(&other->map, cell).vacancy, 8);
    CHECK_INT(merge_sum(&other->map, old_cell).vacancy, 0);
    free(bytes);
    rig_free(other);
    rig_free(r);
}

TEST(submaps_without_tiles_are_submaps_and_fill_no_memory)
{
    struct voxmap_setting s = rig_setting();
    s.max_submaps = 8;
    struct rig *r = rig_new(&s), *other = rig_new(&s);
    struct rig_ping p;
    struct fault fault;
    rig_aim(&p, at_origin, 0, 3);
    p.beam.state = BEAM_BLIND;
    for (int n = 0; n < 8; n++, voxmap_new(&r->map))
        rig_enter(r, &p, SECOND);
    CHECK(voxmap_part(&r->map, 8) && !voxmap_low(&r->map)); /* paging would win nothing */
    size_t size = voxpage_bytes(&r->map, 1);
    uint8_t *bytes = rig_memory(size);
    CHECK_INT(voxpage_pack(&r->map, 1, 0, bytes, size), size);
    CHECK_INT(voxpage_tiles(bytes, size), 0);
    CHECK(voxpage_add(&other->map, bytes, size, &fault) > 0);
    bytes[0] ^= 1;
    CHECK_INT(voxpage_tiles(bytes, size), TILE_NONE);
    free(bytes);
    rig_free(other);
    rig_free(r);
}

/* Damaged bytes never crash and never read beyond; refused ones change nothing. */
TEST(damaged_bytes_are_refused_or_harmless)
{
    uint64_t seed = test_seed();
    struct voxmap_setting s = rig_setting();
    s.height = 16;
    struct rig *r = rig_new(&s), *other = rig_new(&s);
    struct fault fault;
    rig_turn(r, at_origin, 0.5, 0);
    size_t size = voxpage_bytes(&r->map, 1);
    uint8_t *bytes = rig_memory(size), *bad = rig_memory(size);
    voxpage_pack(&r->map, 1, 0, bytes, size);
    for (int n = 0; n < 2000; n++) {
        size_t cut = n % 2 ? size : (size_t)(test_uniform(&seed) * (double)size);
        memcpy(bad, bytes, size);
        bad[(size_t)(test_uniform(&seed) * 260)] ^= (uint8_t)(1u << test_random(&seed) % 8);
        uint8_t *exact = malloc(cut ? cut : 1);
        memcpy(exact, bad, cut);
        uint64_t id = voxpage_add(&other->map, exact, cut, &fault);
        if (id)
            CHECK(voxmap_drop(&other->map, id));
        free(exact);
    }
    CHECK_INT(other->map.tiles.n_free, other->map.tiles.n);
    free(bytes);
    free(bad);
    rig_free(r);
    rig_free(other);
}

TEST(without_room_the_oldest_is_forgotten_and_said)
{
    struct voxmap_setting s = rig_setting();
    s.n_tiles = 40;
    s.submap_path_m = 1;
    s.max_submaps = 4;
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    for (int n = 0; n < 200; n++) {
        rig_aim(&p, (const double[3]){0.5 * n, 0, 0}, 0.1 * n, 1);
        p.echoes.pose.path_m = 0.5 * n;
        CHECK(rig_enter(r, &p, (uint64_t)n * SECOND));
    }
    CHECK(r->map.stats.lost > 50);
    CHECK_INT(r->map.stats.starved, 0);
    CHECK_INT(rig_state(r, 0.5, 0, 0), VOXEL_UNKNOWN);
    for (int n = 0; n < 3; n++)
        rig_enter(r, &p, 200 * SECOND);
    CHECK_INT(rig_state(r, 99.5 + 0.5 * cos(19.9), 0.5 * sin(19.9), 0), VOXEL_FREE);
    voxmap_clear(&r->map);
    CHECK_INT(r->map.tiles.n_free, 40);
    CHECK_INT(rig_state(r, 99.5 + 0.5 * cos(19.9), 0.5 * sin(19.9), 0), VOXEL_UNKNOWN);
    CHECK(rig_enter(r, &p, 201 * SECOND));
    rig_free(r);
}

/* What a forgotten submap heard is in the way of the looks of others until they outweigh all its echoes; what it found
 * free is unknown; what it neither heard nor found free is as if it had never been. */
TEST(what_a_forgotten_submap_heard_stays_in_the_way)
{
    struct voxmap_setting s = rig_setting();
    s.rule = (struct voxel_rule){.threshold = 1, .echo_weight = 2};
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    struct merge_sum sum;
    const int64_t wall[3] = {20, 0, 0}, water[3] = {-20, 0, 0}, above[3] = {20, 0, -35};

    for (int n = 0; n < 2; n++)
        rig_turn(r, at_origin, 2.5, 0);
    rig_aim(&p, at_origin, 0, 0);
    rig_hear(&p, 2.05);
    for (int n = 0; n < 20; n++)
        rig_enter(r, &p, 0);
    CHECK_INT(merge_at(&r->map, wall), VOXEL_OCCUPIED);
    CHECK_INT(merge_at(&r->map, water), VOXEL_FREE);
    voxmap_new(&r->map);
    rig_aim(&p, at_origin, 0, 0);
    rig_enter(r, &p, 0);
    const uint32_t n_free = r->map.tiles.n_free;
    CHECK(voxmap_drop(&r->map, 1));
    CHECK(!voxmap_drop(&r->map, 1));
    CHECK(r->map.tiles.n_free > n_free); /* its memory is there for others */
    CHECK_INT(r->map.stats.lost, 1);
    CHECK_INT(merge_at(&r->map, water), VOXEL_UNKNOWN);
    CHECK_INT(merge_at(&r->map, wall), VOXEL_UNKNOWN);
    sum = merge_sum(&r->map, wall);
    CHECK(sum.lost && sum.residual == 20 && sum.echoes == 0);
    CHECK_INT(merge_sum(&r->map, above).residual, 0); /* of the same tile, far above what was heard */
    for (int n = 1; n <= 44; n++) {
        rig_turn(r, at_origin, 2.5, 0);
        CHECK_INT(merge_at(&r->map, water), n > 1 ? VOXEL_FREE : VOXEL_UNKNOWN);
        CHECK_INT(merge_at(&r->map, wall), n > 41 ? VOXEL_FREE : VOXEL_UNKNOWN);
        CHECK_INT(voxmask_at(&r->mask, wall), n > 41 ? VOXEL_FREE : VOXEL_UNKNOWN);
    }
    rig_free(r);
}

TEST(a_map_that_is_held_frees_nothing_and_takes_nothing)
{
    struct voxmap_setting s = rig_setting();
    s.rule.threshold = 0;
    struct rig *r = rig_new(&s);
    for (int n = 0; n < 3; n++)
        rig_turn(r, at_origin, 2, 0);
    const uint64_t before = rig_hash(r, 25, nowhere), pings = r->map.stats.pings;
    CHECK_INT(voxmask_at(&r->mask, (const int64_t[3]){10, 0, 0}), VOXEL_FREE);
    voxmap_hold(&r->map, true, 0);
    CHECK_INT(voxmask_at(&r->mask, (const int64_t[3]){10, 0, 0}), VOXEL_UNKNOWN);
    rig_turn(r, at_origin, 2, 0);
    CHECK_INT(r->map.stats.pings, pings);
    CHECK(rig_hash(r, 25, nowhere) == before);
    voxmap_hold(&r->map, false, r->map.last_ns + 1000000000);
    CHECK_INT(voxmask_at(&r->mask, (const int64_t[3]){10, 0, 0}), VOXEL_FREE);
    rig_turn(r, at_origin, 2, 0); /* heard before, and entered late */
    CHECK_INT(r->map.stats.pings, pings);
    rig_free(r);
}

/* A ping of a random walk. */
static void random_ping(struct rig_ping *p, uint64_t *seed, int n)
{
    const double at[3] = {3 * test_uniform(seed), 3 * test_uniform(seed), 2 * test_uniform(seed) - 1};
    rig_aim(p, at, 6 * test_uniform(seed), 3 * test_uniform(seed));
    p->echoes.az_aperture_rad = 1;
    p->echoes.pose.path_m = 0.03 * n;
    if (n % 8 == 1)
        rig_hear(p, 0.5 + 3 * test_uniform(seed));
}

/* Cells that are free in the one and not in the other, and *free: in the one. */
static uint64_t freer(struct rig *one, struct rig *other, uint64_t *free)
{
    uint64_t wrong = 0;
    for (int c = 0; c < 90 * 90 * 80; c++) {
        const int64_t cell[3] = {c / 80 / 90 - 30, c / 80 % 90 - 30, c % 80 - 40};
        if (voxmask_at(&one->mask, cell) != VOXEL_FREE)
            continue;
        ++*free;
        wrong += merge_at(&other->map, cell) != VOXEL_FREE;
    }
    return wrong;
}

/* Whatever is forgotten, moved to other places in memory, beyond the box or without memory: nothing is free
 * but what a map that kept all of it finds free. */
TEST(too_little_memory_frees_nothing)
{
    uint64_t seed = test_seed(), free = 0;
    for (int round = 0; round < 8; round++) {
        struct voxmap_setting all = rig_setting(), little = rig_setting();
        all.rule = little.rule = (struct voxel_rule){.threshold = 1, .echo_weight = 2};
        all.side = 16;
        all.height = 200;
        little.side = round % 3 ? 8 : 3;
        little.height = round % 2 ? 80 : 24;
        little.n_tiles = round % 4 ? 120 : 9;
        little.max_submaps = round % 5 ? 8 : 3;
        little.submap_path_m = 1.5;
        struct rig *kept = rig_new(&all), *r = rig_new(&little);
        for (int n = 0; n < 400; n++) {
            struct rig_ping p;
            random_ping(&p, &seed, n);
            CHECK(rig_enter(kept, &p, 0) && rig_enter(r, &p, 0));
            if (n % 30 == 17 || n % 40 == 35)
                voxmap_drop(&r->map, voxmap_oldest(&r->map));
        }
        CHECK(kept->map.stats.clipped + kept->map.stats.starved + kept->map.stats.lost == 0);
        CHECK(r->map.stats.clipped + r->map.stats.starved + r->map.stats.lost > 0);
        CHECK_INT(freer(r, kept, &free), 0);
        rig_free(kept);
        rig_free(r);
    }
    CHECK(free > 500);
}

/* Cells free in r whose looks, of all that `kept` still has by submap, do not outweigh their echoes as one submap
 * counts them; *free: those in r, *apart: those of them that are not free in `kept`. */
static uint64_t too_early(struct rig *r, struct rig *kept, struct rig *one, uint64_t *free, uint64_t *apart)
{
    uint64_t wrong = 0;
    for (int c = 0; c < 90 * 90 * 80; c++) {
        const int64_t cell[3] = {c / 80 / 90 - 30, c / 80 % 90 - 30, c % 80 - 40};
        if (voxmask_at(&r->mask, cell) != VOXEL_FREE)
            continue;
        ++*free;
        *apart += merge_at(&kept->map, cell) != VOXEL_FREE;
        wrong += voxel_judge(&r->map.rule, merge_sum(&kept->map, cell).vacancy,
                             merge_sum(&one->map, cell).echoes) != VOXEL_FREE;
    }
    return wrong;
}

/* As too_little_memory_frees_nothing while the map forgets and the body is stamped. Several submaps that heard the same
 * round their halves up each, the residual rounds up their sum:
 * it keeps to what one submap that heard all of it would hold. */
TEST(too_little_memory_frees_nothing_while_it_forgets)
{
    uint64_t seed = test_seed(), free = 0, apart = 0, half_lives = 0;
    for (int round = 0; round < 6; round++) {
        struct voxmap_setting all = rig_setting(), little, whole;
        all.rule = (struct voxel_rule){.threshold = 1, .echo_weight = 2};
        all.half_life_ns = (round % 2 ? 30 : 80) * SECOND;
        all.body_radius_m = round % 3 ? 0.4 : 0;
        all.side = 16;
        all.n_tiles = 1500;
        all.max_submaps = 100;
        whole = little = all;
        little.side = round % 3 ? 8 : 3;
        little.height = round % 2 ? 80 : 24;
        little.n_tiles = round % 4 ? 120 : 9;
        little.max_submaps = round % 5 ? 8 : 3;
        little.submap_path_m = 1.5;
        struct rig *kept = rig_new(&all), *one = rig_new(&whole), *r = rig_new(&little);
        for (int n = 0; n < 400; n++) {
            const uint64_t t_ns = (uint64_t)n * SECOND / 2, next = r->map.next_id;
            struct rig_ping p;
            random_ping(&p, &seed, n);
            CHECK(rig_enter(r, &p, t_ns));
            if (r->map.next_id != next)
                voxmap_new(&kept->map);
            CHECK(rig_enter(kept, &p, t_ns) && rig_enter(one, &p, t_ns));
            if (n % 30 == 17 || n % 40 == 35)
                voxmap_drop(&r->map, voxmap_oldest(&r->map));
            if (n % 80 == 79)
                CHECK_INT(too_early(r, kept, one, &free, &apart), 0);
        }
        CHECK(kept->map.stats.clipped + kept->map.stats.starved + kept->map.stats.lost == 0);
        CHECK(one->map.stats.clipped + one->map.stats.starved + one->map.stats.lost == 0);
        CHECK(r->map.stats.lost > 0 && r->map.residual.any);
        half_lives += r->map.half_lives;
        rig_free(kept);
        rig_free(one);
        rig_free(r);
    }
    printf("# %llu free cells after %llu half-lives, %llu not where all submaps were kept\n",
           (unsigned long long)free, (unsigned long long)half_lives, (unsigned long long)apart);
    CHECK(free > 500);
}

/* Echoes that reach beyond the box above and below leave nothing in the residual for what lies in
 * the box: that is kept. */
TEST(what_a_submap_keeps_is_in_no_residual)
{
    struct voxmap_setting s = rig_setting();
    s.side = 16;
    s.height = 32;
    s.n_tiles = 3000; /* and a table so large that cubes hardly meet in it */
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    uint64_t seed = test_seed(), inside = 0, beyond = 0;
    for (int n = 0; n < 300; n++) {
        rig_aim(&p, at_origin, 6 * test_uniform(&seed), 0);
        rig_hear(&p, 4 + 4 * test_uniform(&seed));
        rig_enter(r, &p, 0);
    }
    const struct lattice_box *box = &r->map.current->map.box;
    for (int c = 0; c < 26 * 26 * 10; c++) {
        const int64_t cell[3] = {(c / 10 / 26 - 13) * RESIDUAL_CUBE, (c / 10 % 26 - 13) * RESIDUAL_CUBE,
                                 (c % 10 - 5) * RESIDUAL_CUBE};
        const int64_t far[3] = {cell[0] + RESIDUAL_CUBE - 1, cell[1] + RESIDUAL_CUBE - 1,
                                cell[2] + RESIDUAL_CUBE - 1};
        bool known;
        residual_echoes(&r->map.residual, cell, &known);
        if (lattice_holds(box, cell) && lattice_holds(box, far))
            inside += known;
        else
            beyond += known;
    }
    CHECK_INT(r->map.stats.starved, 0);
    CHECK_INT(inside, 0);
    CHECK(beyond > 100);
    rig_free(r);
}

/* A place told a voxel off puts an echo so much farther aside, of a beam whose side faces a corner of the lattice's
 * cubes, too: where the box does not reach it is in the residual as far. */
TEST(an_echo_beyond_the_box_is_in_the_residual_as_far_aside)
{
    struct voxmap_setting all = rig_setting(), little = rig_setting();
    all.side = 12;
    all.height = 160;
    little.side = 3;
    little.height = 24;
    uint64_t echoes = 0, missing = 0;
    for (int n = 0; n < 5; n++) {
        struct rig *kept = rig_new(&all), *r = rig_new(&little);
        struct rig_ping p;
        rig_aim(&p, (const double[3]){0.037 * n, 0.041 * n, 0.053 * n}, 0, 0);
        rig_hear(&p, 8);
        p.beam.echo[0].near_m = 3;
        quat_from_rpy(geo_rad(35.3), 0, geo_rad(46.5), p.echoes.pose.attitude);
        p.echoes.pose.uncertain_m = all.voxel_m;
        CHECK(rig_enter(kept, &p, 0) && rig_enter(r, &p, 0));
        CHECK_INT(kept->map.stats.clipped, 0);
        for (int c = 0; c < 100 * 100 * 120; c++) {
            const int64_t cell[3] = {c / 120 / 100 - 5, c / 120 % 100 - 5, c % 120 - 60};
            if (merge_sum(&kept->map, cell).echoes == 0)
                continue;
            const struct merge_sum sum = merge_sum(&r->map, cell);
            echoes++;
            missing += sum.echoes + sum.residual == 0;
        }
        rig_free(kept);
        rig_free(r);
    }
    CHECK_INT(missing, 0);
    CHECK(echoes > 10000);
}

/* A submap that was corrected leaves its residual where it lay at last. */
TEST(a_moved_submap_is_forgotten_where_it_lies)
{
    uint64_t seed = test_seed(), free = 0;
    for (int round = 0; round < 4; round++) {
        struct voxmap_setting s = rig_setting();
        s.rule = (struct voxel_rule){.threshold = 1, .echo_weight = 2};
        struct rig *kept = rig_new(&s), *r = rig_new(&s);
        const double to[3] = {test_uniform(&seed), test_uniform(&seed), 0.3};
        double turn[4], yaw = 3 * test_uniform(&seed);
        quat_from_rpy(0, 0.1, yaw, turn);
        for (int n = 0; n < 80; n++) {
            struct rig_ping p;
            random_ping(&p, &seed, n);
            if (n == 30) {
                voxmap_new(&kept->map);
                voxmap_new(&r->map);
            }
            CHECK(rig_enter(kept, &p, 0) && rig_enter(r, &p, 0));
        }
        CHECK(voxmap_move(&kept->map, 1, to, turn) && voxmap_move(&r->map, 1, to, turn));
        CHECK(voxmap_drop(&r->map, 1));
        CHECK_INT(freer(r, kept, &free), 0);
        rig_free(kept);
        rig_free(r);
    }
    CHECK(free > 500);
}

/* Moved far, and by another way on each axis: blocks and cells answer alike there, and what it heard stays in the way
 * there when it is forgotten. */
TEST(a_submap_moved_far_is_answered_and_forgotten_there)
{
    static const double places[][3] = {{0.05, 60.05, 20.05}, {70.05, 3.05, -40.05}, {-30.05, -60.05, 90.05}};
    for (int i = 0; i < 3; i++) {
        const double *to = places[i];
        struct voxmap_setting s = rig_setting();
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        rig_aim(&p, at_origin, 0, 3);
        rig_hear(&p, 2);
        for (int n = 0; n < 8; n++)
            rig_enter(r, &p, SECOND);
        voxmap_new(&r->map);
        p.beam.state = BEAM_BLIND;
        rig_enter(r, &p, SECOND);
        CHECK(voxmap_move(&r->map, 1, to, (const double[4]){1, 0, 0, 0}));
        const int64_t free[3] = {(int64_t)floor((to[0] + 1.2) * 10), (int64_t)floor(to[1] * 10),
                                 (int64_t)floor(to[2] * 10)};
        const int64_t wall[3] = {(int64_t)floor((to[0] + 2) * 10), free[1], free[2]};
        CHECK_INT(merge_at(&r->map, free), VOXEL_FREE);
        CHECK_INT(voxmask_at(&r->mask, free), VOXEL_FREE);
        CHECK_INT(merge_at(&r->map, wall), VOXEL_OCCUPIED);
        CHECK_INT(voxmask_at(&r->mask, wall), VOXEL_OCCUPIED);
        CHECK(voxmap_drop(&r->map, 1));
        CHECK(merge_sum(&r->map, wall).residual > 0);
        CHECK_INT(merge_sum(&r->map, (const int64_t[3]){20, 0, 0}).residual, 0);
        CHECK_INT(merge_sum(&r->map, (const int64_t[3]){wall[0], wall[1], wall[2] + 20}).residual, 0);
        CHECK_INT(merge_sum(&r->map, (const int64_t[3]){wall[0], wall[1], wall[2] - 20}).residual, 0);
        rig_free(r);
    }
}

/* A block's bits are the answers for its cells, whatever submaps there are. */
TEST(blocks_equal_cells)
{
    uint64_t seed = test_seed();
    struct voxmap_setting s = rig_setting();
    s.half_life_ns = 20 * SECOND;
    struct rig *r = rig_new(&s);
    for (int n = 0; n < 60; n++) {
        struct rig_ping p;
        const double at[3] = {2 * test_uniform(&seed), 2 * test_uniform(&seed), 4 * test_uniform(&seed)};
        rig_aim(&p, at, test_uniform(&seed), 3);
        p.echoes.az_aperture_rad = 1;
        if (n % 3 == 0)
            rig_hear(&p, 2);
        if (n % 20 == 19)
            voxmap_new(&r->map);
        rig_enter(r, &p, (uint64_t)n * SECOND);
        if (n == 50)
            CHECK(voxmap_drop(&r->map, 1) && voxmap_drop(&r->map, 2) && !voxmap_drop(&r->map, 2));
        if (n == 55)
            voxmap_move(&r->map, 2, (const double[3]){0.33, 0.5, 1}, (const double[4]){1, 0, 0.1, 0});
        if (n % 15 < 14 && n != 52)
            continue;
        struct merge_walk walk = {0};
        struct block_key key;
        uint64_t free = 0, wrong = 0, blocks = 0;
        while (merge_next(&r->map, &walk, &key)) {
            struct merge_block bits;
            merge_block(&r->map, &key, &bits);
            blocks++;
            for (int c = 0; c < 16 * 16 * 64; c += 1 + (n > 55) * 6) {
                const int64_t cell[3] = {key.at[0] * 16 + c / 64 / 16, key.at[1] * 16 + c / 64 % 16,
                                         key.at[2] * 64 + c % 64};
                enum voxel_state want = merge_at(&r->map, cell);
                wrong += merge_block_at(&bits, cell) != want;
                wrong += voxmask_at(&r->mask, cell) != want;
                free += want == VOXEL_FREE;
            }
        }
        CHECK_INT(wrong, 0);
        CHECK(blocks > (n >= 50 ? 10 : 20)); /* what was forgotten is no block of its own */
        CHECK(n >= 50 || free > 100);        /* later most of it is forgotten */
    }
    rig_free(r);
}

/* Blocks of submaps that were corrected in any way and aged equal their cells;
 * and the walk misses none of them. */
TEST(blocks_of_corrected_submaps_equal_cells)
{
    uint64_t seed = test_seed(), free = 0, heard = 0;
    for (int n = 0; n < 4; n++) {
        struct voxmap_setting s = rig_setting();
        s.keep_echoes = n != 1;
        s.half_life_ns = n == 2 ? 10 * SECOND : VOXMAP_NEVER;
        struct rig *r = rig_new(&s);
        for (int b = 0; b < 120; b++) {
            struct rig_ping p;
            rig_aim(&p, at_origin, 0.3 * test_uniform(&seed), 2.5);
            p.echoes.az_aperture_rad = 1;
            if (b % 8 == 0)
                rig_hear(&p, 1.5);
            if (b % 40 == 39)
                voxmap_new(&r->map);
            rig_enter(r, &p, (uint64_t)b * SECOND / 4);
        }
        for (uint64_t id = 1; id < 3;
             id++) { /* the first by any turn, the second level and by whole voxels along two axes */
            double turn[4];
            const double to[3] = {id > 1 ? 0.3 : test_uniform(&seed), id > 1 ? -0.2 : test_uniform(&seed), 0.3};
            quat_from_rpy(id > 1 ? 0 : 2 * test_uniform(&seed) - 1, id > 1 ? 0 : test_uniform(&seed),
                          7 * test_uniform(&seed), turn);
            CHECK(voxmap_move(&r->map, id, to, turn));
        }
        uint64_t wrong = 0, known = 0, walked = 0;
        struct merge_walk walk = {0};
        struct merge_block bits;
        struct block_key key;
        while (merge_next(&r->map, &walk, &key)) {
            merge_block(&r->map, &key, &bits);
            for (int c = 0; c < 16 * 16 * 64; c++) {
                const int64_t cell[3] = {key.at[0] * 16 + c / 64 / 16, key.at[1] * 16 + c / 64 % 16,
                                         key.at[2] * 64 + c % 64};
                enum voxel_state want = merge_at(&r->map, cell);
                wrong += merge_block_at(&bits, cell) != want;
                walked += want != VOXEL_UNKNOWN;
                free += want == VOXEL_FREE;
                heard += want == VOXEL_OCCUPIED;
            }
        }
        for (int64_t i = -70; i < 70; i++)
            for (int64_t j = -70; j < 70; j++)
                for (int64_t k = -60; k < 60; k++)
                    known += merge_at(&r->map, (const int64_t[3]){i, j, k}) != VOXEL_UNKNOWN;
        CHECK_INT(wrong, 0);
        CHECK(walked >= known);
        rig_free(r);
    }
    CHECK(free > 5000 && heard > 500);
}

/* Beams that reach beyond the box are counted, ping by ping. */
TEST(V6_clipped_pings_are_counted)
{
    const struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    rig_aim(&p, (const double[3]){0}, 0, 60);
    rig_enter(r, &p, SECOND);
    const uint64_t once = r->map.stats.clipped;
    CHECK(once > 0 && once < 100);
    rig_enter(r, &p, 2 * SECOND);
    CHECK_INT(r->map.stats.clipped, 2 * once);
    rig_free(r);
}

int main(void)
{
    RUN(settings_are_checked);
    RUN(a_ping_without_a_good_pose_leaves_nothing);
    RUN(V1_nothing_claimed_nothing_changed);
    RUN(V4_a_voxel_rises_once_per_ping_and_stops_at_255);
    RUN(a_fan_raises_each_voxel_once);
    RUN(off_its_axis_a_beam_frees_less);
    RUN(near_the_body_the_whole_beam_is_free_as_far_as_its_edge_hears);
    RUN(near_the_body_every_range_is_in_the_widest_part_once);
    RUN(the_edge_is_wider_than_the_beam_where_no_other_beam_is);
    RUN(off_the_axis_an_uncertain_pose_and_nonsense_free_less);
    RUN(an_echo_always_lies_in_some_voxel);
    RUN(what_was_heard_once_outweighs_some_looks_and_is_carved_in_the_end);
    RUN(an_echo_of_the_vehicles_own_is_no_place_and_frees_none);
    RUN(a_diver_passes_and_does_not_stay);
    RUN(time_passes_without_a_pose);
    RUN(ageing_is_halving_and_frees_nothing);
    RUN(a_silent_map_ages_too);
    RUN(submaps_begin_by_way_time_and_on_request_after_their_last_beam);
    RUN(V5_far_away_is_the_same_map);
    RUN(V9_merging_is_exact);
    RUN(V10_a_corrected_submap_has_no_holes);
    RUN(V10_moved_by_whole_voxels_is_exact);
    RUN(the_body_is_stamped_along_its_way_but_not_over_jumps);
    RUN(the_sides_of_a_blurred_beam_are_those_of_its_foremost_place);
    RUN(water_is_free_wherever_within_its_blur_the_ping_was_sent);
    RUN(water_is_free_where_its_place_is_known_to_a_voxel);
    RUN(an_echo_reaches_farther_by_the_slack);
    RUN(what_looks_beside_it_heard_free_is_no_pole);
    RUN(angle_weighted_vacancy);
    RUN(an_opening_narrows_free_water_and_no_echo);
    RUN(V12_without_an_echo_free_only_to_the_minimum);
    RUN(mount_and_attitude_place_the_beam);
    RUN(an_elevation_is_upward);
    RUN(an_elevation_is_upward_beyond_the_box);
    RUN(a_submap_in_another_map_is_the_same);
    RUN(a_packed_submap_lies_where_it_lay);
    RUN(a_submap_moved_far_is_answered_and_forgotten_there);
    RUN(what_is_packed_has_aged);
    RUN(what_is_packed_lies_where_it_was_moved_to);
    RUN(submaps_without_tiles_are_submaps_and_fill_no_memory);
    RUN(damaged_bytes_are_refused_or_harmless);
    RUN(without_room_the_oldest_is_forgotten_and_said);
    RUN(what_a_forgotten_submap_heard_stays_in_the_way);
    RUN(a_map_that_is_held_frees_nothing_and_takes_nothing);
    RUN(too_little_memory_frees_nothing);
    RUN(too_little_memory_frees_nothing_while_it_forgets);
    RUN(what_a_submap_keeps_is_in_no_residual);
    RUN(an_echo_beyond_the_box_is_in_the_residual_as_far_aside);
    RUN(a_moved_submap_is_forgotten_where_it_lies);
    RUN(blocks_equal_cells);
    RUN(blocks_of_corrected_submaps_equal_cells);
    RUN(V6_clipped_pings_are_counted);
    return test_end();
}
