/* SPDX-License-Identifier: MIT */
/* test_order - in which order a device reports the ranges of a ping does not matter to anything that is known after. */
#include "grid/range/extract.h"
#include "grid/range/marks.h"
#include "grid/range/order.h"
#include "grid/sphere/state.h"
#include "grid/sphere/view.h"
#include "grid/water/store.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/lib/ask_free.h"
#include "tests/lib/sphere_rig.h"

#define ENTRIES   128
#define PINGS     6
#define ASKED_DEG 7

static const struct sphere_conf grid_conf = {.angular_step_rad = 0.0349066,
                                             .layers = {.r_max_m = 12, .dr_m = 0.1, .n_const = 20, .growth = 1.05},
                                             .max_cells = 4096,
                                             .forget_s = 160,
                                             .blocked_above = 0.6,
                                             .recentre_m = 0.1};

static struct extract *extract;
static struct marks marks;
static struct ping_beam entries[ENTRIES];
static struct beam_echoes found[ENTRIES];
static struct ping ping = {.kind = PING_RANGES, .n_bins = 1, .dr_m = 9, .beam = entries, .max_beams = ENTRIES};
static struct echoes heard = {.max_beams = ENTRIES, .beam = found};

static void begin(void)
{
    static void *of_extract;
    struct extract_conf conf;
    struct fault fault;
    extract_defaults(&conf);
    conf.minimum_range_m = 8;
    of_extract = rig_memory(of_extract, extract_size(1));
    extract = extract_init(of_extract, &conf, 1, &fault);
    marks_init(&marks, 1500);
    rig_sphere(&grid_conf);
    ping.pose = pose_identity;
    ping.pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping.seq = 0;
    ping.t_ns = SECOND;
}

/* A fan, perhaps of two rows or all the way round, of a sensor that may look astern. A beam has up to three echoes. */
struct fan {
    int rows, columns;
    double first_deg, step_deg, row_deg;
};

static struct fan random_fan(uint64_t *seed)
{
    const bool round = test_uniform(seed) < 0.2;
    const int columns = round ? 24 : 2 + (int)(14 * test_uniform(seed));
    return (struct fan){.rows = 1 + (test_uniform(seed) < 0.3),
                        .columns = columns,
                        .first_deg = 360 * test_uniform(seed) - 180,
                        .step_deg = round ? 15 : 1 + 8 * test_uniform(seed),
                        .row_deg = 12};
}

static uint16_t look(const struct fan *fan, uint64_t *seed)
{
    uint16_t n = 0;
    for (int b = 0; b < fan->rows * fan->columns; b++) {
        const double az_deg = fan->first_deg + fan->step_deg * (b % fan->columns) + 0.2 * test_uniform(seed);
        const struct ping_beam axis = {.az_rad = (float)geo_wrap(geo_rad(az_deg)),
                                       .el_rad = (float)geo_rad(fan->row_deg * (b / fan->columns)),
                                       .range_sd_m = 0.02f,
                                       .confidence = 0.9f};
        double range_m = 0;
        const int echoes = (int)(4 * test_uniform(seed));
        for (int i = 0; i < (echoes ? echoes : 1); i++) {
            entries[n] = axis;
            range_m += echoes ? 0.5 + 3 * test_uniform(seed) : 0;
            entries[n++].range_m = (float)range_m;
        }
    }
    return n;
}

static void shuffle(struct ping_beam *beam, uint16_t n, uint64_t *seed)
{
    for (uint16_t i = n; i > 1; i--) {
        const uint16_t k = (uint16_t)(test_random(seed) % i);
        const struct ping_beam last = beam[i - 1];
        beam[i - 1] = beam[k];
        beam[k] = last;
    }
}

/* ---- all that is known ---- */

static uint64_t digest;
static unsigned freed, cells;

static void add(const void *bytes, size_t n)
{
    for (size_t i = 0; i < n; i++)
        digest = (digest ^ ((const uint8_t *)bytes)[i]) * UINT64_C(0x100000001b3);
}

static void add_grid(void)
{
    for (uint32_t d = 0; d < sphere->rings.n; d++) {
        struct sphere_cell c;
        add(&sphere->direction[d].t_look_ns, sizeof sphere->direction[d].t_look_ns);
        for (uint32_t k = 0; sphere_cell(sphere, d, k, ping.t_ns, &c); k++, cells++)
            add((const double[]){c.point_m[0], c.point_m[1], c.point_m[2], c.near_m, c.logodds, c.misses},
                6 * sizeof(double));
    }
}

static void add_records(void)
{
    static struct water_view view[ASK_RECORDS];
    const struct store_now at = {.now_ns = ping.t_ns, .pose = &ping.pose, .clear_for_s = 30, .move_limit_m = 20};
    const int n = store_view(store, &at, view);
    for (int az_deg = -180; az_deg < 180; az_deg += ASKED_DEG) {
        struct ask_question q = {.half_rad = geo_rad(0.1), .near_m = 1.5, .to_m = 12};
        geo_direction(geo_rad(az_deg), 0, q.axis);
        const double free_m = ask_free(view, n, &q).free_to_m;
        add(&free_m, sizeof free_m);
        freed += free_m > q.near_m;
    }
}

/* What is known after some pings of a fan whose vehicle moves, their entries in the order of the fan or in any. */
static uint64_t dive(uint64_t world, bool any_order, uint64_t *orders)
{
    uint64_t seed = world;
    const struct fan fan = random_fan(&seed);
    begin();
    ping.az_aperture_rad = (float)geo_rad(1.5 * fan.step_deg);
    ping.el_aperture_rad = (float)geo_rad(20);
    for (int i = 0; i < PINGS; i++) {
        ping.t_ns += SECOND / 10;
        ping.seq++;
        ping.n_beams = look(&fan, &seed);
        ping.pose.position_m[0] += 0.07;
        ping.pose.path_m += 0.07;
        if (any_order)
            shuffle(entries, ping.n_beams, orders);
        extract_run(extract, &ping, NULL, &heard);
        marks_run(&marks, &heard);
        rig_enter(&heard, &mount_identity);
    }
    digest = UINT64_C(0xcbf29ce484222325);
    add_grid();
    add_records();
    return digest;
}

TEST(the_order_of_a_fans_entries_does_not_matter)
{
    uint64_t worlds = test_seed(), orders = worlds + 1;
    freed = cells = 0;
    for (int world = 0; world < 12; world++) {
        const uint64_t seed = test_random(&worlds), sorted = dive(seed, false, NULL);
        for (int k = 0; k < 3; k++)
            if (dive(seed, true, &orders) != sorted) {
                printf("world %d differs\n", world);
                CHECK(false);
            }
    }
    printf("# %u directions free, %u cells\n", freed, cells);
    CHECK(freed > 200 && cells > 1000);
}

/* ---- the list ---- */

static bool in_order(const struct order *o)
{
    for (uint16_t i = 1; i < o->n; i++) {
        const struct order_entry *a = &o->entry[i - 1], *b = &o->entry[i];
        if (a->beam->el_rad > b->beam->el_rad || (a->beam->el_rad == b->beam->el_rad && a->az_rad > b->az_rad))
            return false;
    }
    return true;
}

TEST(every_entry_has_its_place)
{
    uint64_t seed = test_seed();
    struct order order;
    for (int trial = 0; trial < 50; trial++) {
        const struct fan fan = random_fan(&seed);
        ping.n_beams = look(&fan, &seed);
        shuffle(entries, ping.n_beams, &seed);
        order_ranges(&ping, &order);
        CHECK_INT(order.n, ping.n_beams);
        CHECK(in_order(&order));
        bool had[ENTRIES] = {false};
        for (uint16_t i = 0; i < order.n; i++)
            had[order.entry[i].beam - entries] = true;
        for (uint16_t i = 0; i < order.n; i++)
            CHECK(had[i]);
    }
}

/* Nearest first; no range at all is worse than silence, and an echo says more than either. */
TEST(entries_of_one_direction_stand_together)
{
    static const float range_m[] = {0, 5, NAN, 2, 5};
    struct order order;
    ping.n_beams = 10;
    for (uint16_t i = 0; i < 10; i++)
        entries[i] =
            (struct ping_beam){.az_rad = i % 2 ? 0.1f : 6.2f, .range_m = range_m[i / 2], .range_sd_m = 0.01f * i};
    order_ranges(&ping, &order);
    CHECK_INT(order_of_beam(&order, 0), 5);
    CHECK_INT(order_of_beam(&order, 5), 5);
    CHECK_NEAR(order.entry[0].az_rad, 6.2 - GEO_TURN, 0, 1e-6);
    for (uint16_t i = 0; i < 10; i += 5) {
        CHECK(order.entry[i].beam->range_m == 2 && order.entry[i + 1].beam->range_m == 5);
        CHECK(order.entry[i + 1].beam->range_sd_m > order.entry[i + 2].beam->range_sd_m);
        CHECK(isnan(order.entry[i + 3].beam->range_m) && order.entry[i + 4].beam->range_m == 0);
    }
}

int main(void)
{
    RUN(the_order_of_a_fans_entries_does_not_matter);
    RUN(every_entry_has_its_place);
    RUN(entries_of_one_direction_stand_together);
    return test_end();
}
