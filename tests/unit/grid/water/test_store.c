/* SPDX-License-Identifier: MIT */
/* test_store - which records pings become, what of them is kept, and when their water is free no more. */
#include "tests/lib/ask_free.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/store.h"

#define SECOND  UINT64_C(1000000000)
#define TICK    (SECOND / 10)
#define MOST    64
#define START_M 0.75

static const struct store_conf conf = {.beams = {MOST, MOST}, .spare = 1};
static struct store *store;
static struct pose pose;
static struct beam_echoes beam[128];
static struct echoes ping;

static void begin(uint16_t beams, double wide_deg)
{
    static void *memory;
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping = (struct echoes){.n_beams = beams,
                           .t_ns = 100 * SECOND,
                           .range_max_m = 20,
                           .az_aperture_rad = (float)geo_rad(wide_deg),
                           .el_aperture_rad = (float)geo_rad(25),
                           .beam = beam};
    for (uint16_t i = 0; i < beams; i++)
        beam[i] = (struct beam_echoes){
            .az_rad = (float)geo_rad((i - (beams - 1) / 2.0) * wide_deg), .blind_m = 0.1f, .free_to_m = 10};
}

/* The next one, a tick later. */
static void send(void)
{
    ping.seq++;
    ping.t_ns += TICK;
    ping.pose = pose;
    store_enter(store, &ping, &mount_identity);
}

static void send_at(double az_deg)
{
    beam[0].az_rad = (float)geo_rad(az_deg);
    send();
}

static int look(struct water_view view[ASK_RECORDS])
{
    const struct store_now now = {.now_ns = ping.t_ns, .pose = &pose, .clear_for_s = 30, .move_limit_m = 20};
    return store_view(store, &now, view);
}

/* How far a thin cone is free, from from_m on. */
static double free_from(double from_m, double az_deg, double el_deg)
{
    static struct water_view view[ASK_RECORDS];
    struct ask_question q = {.half_rad = geo_rad(0.1), .near_m = from_m, .to_m = 12};
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), q.axis);
    return ask_free(view, look(view), &q).free_to_m;
}

static double free_at(double az_deg, double el_deg)
{
    return free_from(START_M, az_deg, el_deg);
}

/* The newest record but for `back`. */
static const struct water_record *newest(uint32_t back)
{
    return pool_at(&store->pool, back);
}

/* 24 columns of two degrees, of which one hears 5 m. A look at others shows nothing, however many these are. */
TEST(a_look_is_by_a_beam_that_passes_there)
{
    static struct row_room room;
    const double level[3] = {1, 0, 0};
    struct water_record record = {.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const struct water_view seen = {.record = &record};
    for (int hears = 0; hears < 24; hears++) {
        for (int x = 0; x <= 24; x++)
            room.tan_az[x] = tan(geo_rad(2 * x - 24));
        room.tan_el[0] = -0.2;
        room.tan_el[1] = 0.2;
        for (uint16_t x = 0; x < 24; x++)
            room.cell[x] =
                x == hears ? (struct water_cell){0, 500, 500, WATER_NO_END} : (struct water_cell){0, 0, 0, 100};
        record.image =
            (struct water_image){.columns = 24, .rows = 1, .tan_az = room.tan_az, .tan_el = room.tan_el};
        water_image_fill(&record.image, room.cell);
        for (int within = 1; within < 24; within += 2) { /* half a column less on both sides */
            const int half = (within + 1) / 2;
            CHECK(water_looks(&seen, level, 4, &(struct water_sought){4, geo_rad(within), 0}) ==
                  (hears >= 12 - half && hears < 12 + half));
        }
    }
}

static struct water_cell all_of(const struct water_image *image, const struct water_part *part)
{
    struct water_cell sum = {.least = UINT16_MAX, .ends = WATER_NO_END};
    for (int y = part->row[0]; y <= part->row[1]; y++)
        for (int x = part->column[0]; x <= part->column[1]; x++) {
            const struct water_cell *c = &image->cell[y * image->columns + x];
            sum.from = c->from > sum.from ? c->from : sum.from;
            sum.least = c->least < sum.least ? c->least : sum.least;
            sum.most = c->most > sum.most ? c->most : sum.most;
            sum.ends = c->ends < sum.ends ? c->ends : sum.ends;
        }
    return sum;
}

/* No row beside those of the part says anything of it, be they few or many. */
TEST(a_part_of_an_image_is_what_its_rows_say)
{
    static const struct {
        uint16_t columns, rows;
    } row[] = {{1, 512}, {8, 50}, {3, 17}, {40, 5}, {33, 37}};
    static struct row_room room;
    unsigned drawn = 1;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const int columns = row[i].columns, rows = row[i].rows;
        struct water_image image = {.columns = row[i].columns, .rows = row[i].rows};
        for (int k = 0; k < columns * rows; k++) {
            const uint16_t at = (uint16_t)((drawn = drawn * 1103515245 + 12345) >> 16 & 0x3fff);
            room.cell[k] = (struct water_cell){at, (uint16_t)(at + 7), (uint16_t)(at + 9), (uint16_t)(at + 50)};
        }
        water_image_fill(&image, room.cell);
        for (int first = 0; first < rows; first++)
            for (int last = first; last < rows; last += 1 + last % 5) {
                const int column = first % columns, wide = (columns - column < 8 ? columns - column : 8) - 1;
                const struct water_part part = {{column, column + wide}, {first, last}};
                const struct water_cell is = water_image_of(&image, &part), want = all_of(&image, &part);
                CHECK(memcmp(&is, &want, sizeof is) == 0);
            }
    }
}

TEST(memory_is_bounded)
{
    const struct store_conf head = {.beams = {1}, .spare = 20}, fan = {.beams = {512}, .spare = 20};
    CHECK(store_bytes(&head) <= 5u << 19);
    CHECK(store_bytes(&fan) <= 7u << 20);
    begin(MOST, 1);
    for (uint32_t i = 0; i < 2 * POOL_KEPT; i++) {
        pose.position_m[0] += 0.5;
        send();
        CHECK_INT(store->pool.n, i < POOL_KEPT ? i + 1 : POOL_KEPT);
        CHECK_INT(newest(0)->seq, ping.seq);
    }
}

/* Something else stands beside it, nearer: both pings show that, and neither of them the echo. */
TEST(a_ping_that_alone_shows_an_echo_is_kept)
{
    for (int matrix = 0; matrix < 2; matrix++) {
        begin(3, 10);
        ping.el_aperture_rad = (float)geo_rad(10);
        for (int i = 0; i < 3 && matrix; i++) {
            beam[i].az_rad = 0;
            beam[i].el_rad = (float)geo_rad(10 * (i - 1));
        }
        beam[2].n = 1;
        beam[2].free_to_m = 2;
        for (int k = 0; k < 3; k++) {
            beam[1].n = k == 1;
            beam[1].free_to_m = k == 0 ? 10 : k == 1 ? 5 : 0; /* at last it received nothing, once */
            pose.position_m[0] += 0.03;
            pose.path_m += 0.03;
            send();
        }
        CHECK_INT(store->pool.n, 3);
        CHECK_NEAR(free_at(0, 0), 5, 0, 0.2);
    }
}

TEST(the_last_beams_of_a_head_are_a_row_that_is_kept_every_sixth)
{
    begin(1, 2.5);
    for (int i = 0; i < 24; i++)
        send_at(2 * i);
    CHECK_INT(store->pool.n, 4);
    CHECK_INT(newest(0)->seq, 24);
    CHECK_INT(newest(0)->newest_ns - newest(0)->t_ns, 17 * TICK);
    CHECK_INT(newest(3)->seq, 6);
    send_at(48);
    CHECK_INT(store->pool.n, 5);
    send_at(50);
    CHECK_INT(store->pool.n, 5);
    CHECK_NEAR(free_at(25, 0), 10, 0, 0.13);
    CHECK_NEAR(free_at(49, 0), 10, 0, 0.13);
    CHECK(free_at(55, 0) <= START_M);
}

/* What was uncertain when its first beam was sent is so of all of it. */
TEST(a_row_is_as_old_as_its_oldest_beam)
{
    begin(1, 2.5);
    for (int i = 0; i < 6; i++) {
        pose.path_m = 3 + 0.01 * i;
        pose.drift_m[0] = 1 + 0.001 * i;
        pose.drift_m[1] = 2 + 0.001 * i;
        pose.uncertain_m = 0.01 * (i == 2);
        pose.uncertain_rad = 0.02 * (i == 3);
        send_at(2 * i);
    }
    const struct water_record *r = newest(0);
    CHECK_INT(r->newest_ns - r->t_ns, 5 * TICK);
    CHECK_NEAR(r->path_m, 3, 1e-9, 0);
    CHECK_NEAR(r->drift_m[0], 1, 1e-9, 0);
    CHECK_NEAR(r->drift_m[1], 2, 1e-9, 0);
    CHECK_NEAR(r->uncertain_m, 0.01, 1e-9, 0);
    CHECK_NEAR(r->tilt_rad, 0.02, 1e-6, 0);
    CHECK_INT(r->sense, 1);
}

/* The vehicle may have drifted from one beam to the next: nearer than where they overlap by that nothing is free, be it
 * level or in depth, whichever way the head turns; where beams reach high and are tilted against each other they
 * overlap less. */
TEST(drift_between_beams_moves_where_they_overlap)
{
    static const double high_deg[ROW_ROWS] = {12.5, 8.75, 3.125, 8.75, 12.5};
    for (int kind = 0; kind < 8; kind++) {
        const int part = kind % 2, sense = kind & 2 ? -1 : 1;
        const double tilt_rad = kind & 4 ? 0.01 : 0;
        begin(1, 2.5);
        for (int i = 0; i < 9; i++) {
            pose.drift_m[part] = 0.02 * i;
            quat_from_rpy(i % 2 ? tilt_rad : 0, 0, 0, pose.attitude);
            send_at(sense * 2 * (i - 4));
        }
        const struct water_image *image = &newest(0)->image;
        for (int row = 0; row < ROW_ROWS; row++)
            for (int column = 0; column < image->columns; column++) {
                const double high = geo_rad(high_deg[row]), over = geo_rad(0.5) - tilt_rad * tan(high);
                CHECK_NEAR(image->cell[row * image->columns + column].from * WATER_UNIT_M,
                           0.02 / (sin(over) * cos(high)), 0.03, 0);
            }
    }
}

/* However few of them lie within the width of a row. */
TEST(no_beam_of_a_head_of_long_steps_is_left_out)
{
    for (int step_deg = 8; step_deg <= 40; step_deg++) {
        begin(1, step_deg);
        for (int i = 0; i * step_deg < 300; i++)
            send_at(i * step_deg);
        for (int i = 0; i * step_deg < 300; i++)
            CHECK_NEAR(free_at(i * step_deg, 0), 10, 0, 0.13);
    }
}

TEST(a_row_goes_round_north_and_back)
{
    for (int sense = -1; sense <= 1; sense += 2) {
        begin(1, 2.5);
        for (int i = -20; i < 20; i++)
            send_at(180 + sense * 2 * i);
        CHECK_NEAR(free_at(180, 0), 10, 0, 0.13);
        CHECK_NEAR(free_at(179, 0), 10, 0, 0.13);
        send_at(180 + sense * 36); /* turned back */
        CHECK_INT(newest(0)->t_ns, newest(0)->newest_ns);
        CHECK_INT(newest(1)->seq, ping.seq - 1);
    }
}

/* An echo beside the gap ends nothing in it. */
TEST(where_pings_are_lost_a_row_says_nothing)
{
    begin(1, 2.5);
    for (int i = 0; i < 24; i++)
        send_at(2 * i);
    beam[0].free_to_m = 6;
    beam[0].n = 1;
    for (int i = 23; i >= 0; i--) {
        if (i == 10 || i == 11)
            ping.seq++;
        else
            send_at(2 * i);
    }
    CHECK_NEAR(free_at(21, 0), 10, 0, 0.13); /* of the time before */
    CHECK_NEAR(free_at(18, 0), 6, 0, 0.13);
    CHECK_NEAR(free_at(23, 0), 6, 0, 0.13);
    CHECK(store->pool.n <= 9);
    /* many of them: nobody knows what the head did meanwhile */
    ping.seq += 20;
    send_at(-2);
    CHECK_INT(newest(0)->t_ns, newest(0)->newest_ns);
    begin(1, 5); /* beams that overlap all the same */
    for (int i = 0; i < 9; i++)
        send_at(2 * i);
    ping.seq++;
    send_at(20);
    CHECK_NEAR(free_at(18, 0), 10, 0, 0.13);
}

/* Two beams that only touch, sent from two places: between them something may stand where the later one was sent from
 * beyond the edge of the one before. */
TEST(nearer_than_beams_overlap_nothing_is_free)
{
    for (int way = -1; way <= 1; way += 2) {
        begin(1, 2.5);
        for (int i = 0; i < 9; i++) {
            pose.position_m[1] = 0.02 * i * way;
            send_at(2 * i);
        }
        const double slip_m = 0.02 / sin(geo_rad(0.5));
        if (way > 0) {
            CHECK(free_from(slip_m - 0.1, 8, 0) < slip_m);
            CHECK(free_from(slip_m + 0.1, 8, 0) > 9.5);
        } else
            CHECK(free_from(1.2, 8, 0) > 9.5);
    }
}

/* On its way a head looks from where its axes meet: of the steps between its beams next to nothing is uncertain. */
TEST(a_row_loses_little_by_the_way_of_its_beams)
{
    for (int to = 0; to < 4; to++) {
        begin(1, 5);
        for (int i = 0; i < 40; i++) {
            pose.position_m[0] = 0.02 * i * (to == 0 ? 1 : to == 1 ? -1 : 0);
            pose.position_m[1] = 0.02 * i * (to == 2 ? 1 : to == 3 ? -1 : 0);
            send_at(2 * i - 40);
        }
        CHECK(newest(0)->spread_m[0] < 0.05);
        CHECK(newest(0)->spread_m[1] < (to == 3 ? 0.13 : 0.07)); /* the axes meet too far ahead */
        CHECK(newest(0)->spread_m[2] < 0.12);
        CHECK(newest(0)->uncertain_m <= 0);
        CHECK(free_from(2, 22, 0) > 9 && free_from(2, 22, 0) <= 10.2);
    }
}

TEST(what_is_deaf_once_says_nothing_and_twice_ends_the_water)
{
    begin(9, 3);
    send();
    beam[4].free_to_m = 0;
    send();
    CHECK_NEAR(free_at(0, 0), 10, 0, 0.13);
    beam[4].free_to_m = 10;
    beam[5].free_to_m = 0;
    send();
    CHECK_NEAR(free_at(3, 0), 10, 0, 0.13);
    send();
    CHECK(free_at(3, 0) <= START_M);
    CHECK_NEAR(free_at(0, 0), 10, 0, 0.13);
}

/* What echoed may stand where the openings overlap, and the beam that is nearer to that did not look so far. */
TEST(an_echo_ends_what_the_beam_beside_it_does_not_reach)
{
    static const struct {
        double wide_deg, beside_m, free_m;
    } row[] = {{2, 10, 10}, {2, 0, 5}, {2, 3, 5}, {2, 4.9, 5}, {2, 7, 10}, {1, 0, 10}, {1, 3, 10}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        for (int side = -1; side <= 1; side += 2)
            for (int head = 0; head < 2; head++) {
                begin(head ? 1 : MOST, row[i].wide_deg);
                for (int turn = 0; turn < 2; turn++)
                    for (int k = 0; k < MOST; k++) {
                        struct beam_echoes *b = &beam[head ? 0 : k];
                        const bool echo = turn && k == 30, beside = turn && k == 30 + side;
                        b->az_rad = (float)geo_rad(k - (MOST - 1) / 2.0);
                        b->n = echo;
                        b->free_to_m = echo ? 5.0f : beside ? (float)row[i].beside_m : 10.0f;
                        if (head || k + 1 == MOST)
                            send();
                    }
                CHECK_NEAR(free_from(4, -1.5 + side * 0.95, 0), row[i].free_m, 0, 0.13);
            }
}

/* However it turns meanwhile, and whatever it hears next to the sensor later. */
TEST(what_a_fan_is_deaf_to_twice_stays_ended)
{
    for (int side = -1; side <= 1; side += 2) {
        begin(MOST, 1);
        for (int i = 0; i < 16; i++) {
            quat_from_rpy(0, 0, side * geo_rad(0.1) * i, pose.attitude);
            beam[30].free_to_m = i < 10 ? 10.0f : i < 12 ? 0.0f : 3.0f;
            send();
            if (i < 10)
                CHECK(free_from(4, -1.5 + side * 0.1 * i, 0) > 9.8);
        }
        CHECK(free_from(4, -1.5 + side * 1.1, 0) <= 4);
        CHECK(free_from(0.5, -1.5 + side * 1.5, 0) > 2.8);
    }
}

TEST(a_head_that_is_deaf_twice_ends_what_both_beams_looked_at)
{
    begin(1, 2.5);
    for (int i = 0; i < 20; i++)
        send_at(2 * i);
    for (int i = 0; i < 20; i++) {
        beam[0].free_to_m = i == 4 || i == 10 || i == 11 ? 0 : 10;
        send_at(40 - 2 * i);
    }
    CHECK_NEAR(free_at(32, 0), 10, 0, 0.13);
    CHECK(free_at(20, 0) <= START_M);
    CHECK(free_at(18, 0) <= START_M);
    CHECK_NEAR(free_at(24, 0), 10, 0, 0.13);
}

TEST(an_own_echo_ends_what_is_behind_it)
{
    begin(9, 3);
    send();
    beam[4].n = 1;
    beam[4].echo[0] = (struct echo){.range_m = 2, .near_m = 1.9f, .flags = ECHO_OWN};
    beam[4].free_to_m = 0;
    send();
    CHECK(free_at(0, 0) <= START_M);
}

static bool shows_echo(void)
{
    for (uint32_t i = 0; i < store->pool.n; i++)
        if (pool_at(&store->pool, i)->echoes)
            return true;
    return false;
}

TEST(a_fan_is_thinned_and_what_one_ping_alone_shows_is_kept)
{
    begin(MOST, 1);
    for (int i = 0; i < 40; i++)
        send();
    CHECK_INT(store->pool.n, 2);
    beam[30].n = 1;
    beam[30].echo[0] = (struct echo){.range_m = 4, .near_m = 3.9f};
    beam[30].free_to_m = 3.9f;
    send();
    beam[30].n = 0;
    beam[30].free_to_m = 10;
    for (int i = 0; i < 40; i++)
        send();
    CHECK(shows_echo());
    CHECK(store->pool.n <= 5);
    /* what all of them show is no reason to keep them */
    beam[30].n = 1;
    beam[30].free_to_m = 3.9f;
    for (int i = 0; i < 40; i++)
        send();
    CHECK(store->pool.n <= 7);
    CHECK_NEAR(free_at(-1.5, 0), 3.9, 0, 0.13);
}

/* In a third of its pings each beam detects to its full range at its edges, as far as its neighbour does so in another
 * third. */
TEST(what_a_still_fan_frees_in_some_pings_is_free)
{
    begin(MOST, 1);
    for (int k = 0; k < 40; k++) {
        for (int i = 0; i < MOST; i++) {
            beam[i].off_axis = true;
            beam[i].side_to_m = 10;
            beam[i].edge_from_m = 0.1f;
            beam[i].edge_to_m = (i + k) % 3 ? 2 : 10;
        }
        send();
    }
    CHECK(store->pool.n <= 4);
    CHECK_NEAR(free_at(0, 0), 10, 0, 0.13);
    CHECK_NEAR(free_at(0.5, 0), 10, 0, 0.13);
    for (int i = 0; i < MOST; i++) {
        beam[i].n = 1;
        beam[i].free_to_m = beam[i].side_to_m = beam[i].edge_to_m = 6;
    }
    send();
    CHECK_NEAR(free_at(0.5, 0), 6, 0, 0.13);
    ping.t_ns += 28 * SECOND; /* the echo stays, whatever frees the water before it */
    CHECK_NEAR(free_at(0.5, 0), 6, 0, 0.13);
}

/* Pings are joined from a thousandth of a radian, or from a centimetre: what has come farther is spared. */
TEST(a_fan_that_creeps_or_turns_slowly_is_thinned)
{
    for (int kind = 0; kind < 4; kind++) {
        begin(MOST, 1);
        for (int i = 0; i < 300; i++) {
            if (kind < 2)
                quat_from_rpy(0, 0, geo_rad(kind ? 0.05 : 0.02) * i, pose.attitude);
            else {
                pose.position_m[1] += kind == 2 ? 0.006 : 0.002;
                pose.path_m += kind == 2 ? 0.006 : 0.002;
            }
            send();
        }
        CHECK(store->pool.n <= 25);
        if (kind == 1)
            CHECK_NEAR(free_at(-31, 0), 10, 0, 0.13); /* 28 s ago */
    }
}

/* However slowly the vehicle turns meanwhile: a row of next to no width would shrink by all that it pitches. Each ping
 * of one is a record of the same size. */
TEST(a_beam_that_stands_is_free_as_the_vehicle_pitches)
{
    for (int wide = 0; wide < 2; wide++) {
        begin(1, wide ? 12 : 2);
        for (int i = 0; i < 300; i++) {
            const double yaw_deg = 3 * sin(i * 0.02), pitch_deg = 2 * sin(i * 0.2);
            quat_from_rpy(0, geo_rad(pitch_deg), geo_rad(yaw_deg), pose.attitude);
            send();
            if (i > 20 && i % 7 == 0)
                CHECK_NEAR(free_at(yaw_deg, pitch_deg), 10, 0, 0.13);
        }
        CHECK(store->pool.n <= (wide ? 25 : 160));
    }
}

/* No less of what a fan has seen while it turned or pitched is free if it is narrow. */
TEST(a_narrow_fan_leaves_no_gaps_as_it_turns)
{
    for (int pitches = 0; pitches < 2; pitches++) {
        begin(pitches ? 20 : 2, pitches ? 4 : 1);
        ping.el_aperture_rad = (float)geo_rad(pitches ? 2 : 25);
        for (int i = 0; i <= 60; i++) {
            quat_from_rpy(0, pitches ? geo_rad(0.3) * i : 0, pitches ? 0 : geo_rad(0.3) * i, pose.attitude);
            send();
        }
        for (double deg = 0; deg < 18; deg += 0.4)
            CHECK_NEAR(free_at(pitches ? 2 : deg, pitches ? deg : 0), 10, 0, 0.13);
    }
}

/* What is spared is not told by one that is much older: here one beam is deaf in the newest ping alone. */
TEST(of_a_fan_that_turns_to_and_fro_some_are_kept)
{
    begin(MOST, 1);
    for (int i = 0; i < 400; i++) {
        const double yaw_deg = 0.1 * abs(i % 40 - 20);
        quat_from_rpy(0, 0, geo_rad(yaw_deg), pose.attitude);
        beam[30].free_to_m = i == 399 ? 0.0f : 10.0f;
        send();
        if (i == 399)
            CHECK_NEAR(free_at(-1.5 + yaw_deg, 0), 10, 0, 0.13);
    }
}

/* All pings are from the same place, as far as poses tell. What they show is as old as the drift since. */
TEST(pings_of_a_fan_that_drifts_are_joined_for_a_while)
{
    begin(MOST, 1);
    for (int i = 0; i < 100; i++) {
        pose.drift_m[0] += 0.05;
        beam[30].free_to_m = i % 10 ? 10.0f : 0.0f;
        send();
        if (i > 50 && i % 10 == 0)
            CHECK(free_from(4, -1.5, 0) > 9.5);
    }
}

TEST(a_fan_that_moves_is_kept)
{
    begin(MOST, 1);
    for (int i = 0; i < 40; i++) {
        pose.position_m[0] += 0.1;
        send();
    }
    CHECK(store->pool.n >= 20);
}

TEST(old_water_is_free_no_more)
{
    begin(9, 3);
    send();
    ping.t_ns += 29 * SECOND;
    CHECK_NEAR(free_at(0, 0), 10, 0, 0.13);
    ping.t_ns += 2 * SECOND;
    CHECK(free_at(0, 0) <= START_M);
    /* a row is as old as its oldest beam */
    begin(1, 2.5);
    for (int i = 0; i < 6; i++)
        send_at(2 * i);
    ping.t_ns += 30 * SECOND - 6 * TICK;
    CHECK_NEAR(free_at(5, 0), 10, 0, 0.13);
    ping.t_ns += 3 * TICK;
    CHECK(free_at(5, 0) <= START_M);
}

/* An echo that may be nearly anywhere leaves older water as it is; one of the vehicle's own does not. */
TEST(a_ping_whose_pose_is_hardly_known_ends_nothing)
{
    begin(9, 3);
    send();
    pose.uncertain_rad = geo_rad(5);
    beam[4].n = 1;
    beam[4].free_to_m = 4;
    send();
    pose.uncertain_rad = 0;
    CHECK_NEAR(free_at(0, 0), 10, 0, 0.13);
    pose.uncertain_rad = geo_rad(1);
    send();
    pose.uncertain_rad = 0;
    CHECK_NEAR(free_at(0, 0), 4, 0, 0.2);
    begin(9, 3);
    send();
    pose.uncertain_m = 0.2;
    beam[4].n = 1;
    beam[4].echo[0] = (struct echo){.range_m = 2, .near_m = 1.9f, .flags = ECHO_OWN};
    beam[4].free_to_m = 0;
    send();
    CHECK(free_at(0, 0) <= START_M);
}

TEST(poses_that_break_make_all_unknown)
{
    for (int kind = 0; kind < 7; kind++) {
        begin(9, 3);
        send();
        pose.discontinuities += kind == 0;
        pose.withdrawn += kind == 1;
        pose.position_m[0] += kind == 2 ? 1.1 : 0;
        pose.has &= kind == 3 ? ~(unsigned)POSE_ATTITUDE : ~0u;
        pose.position_m[1] += kind == 4 ? 1.1 : 0;
        pose.position_m[2] += kind == 5 ? 1.1 : 0;
        pose.has &= kind == 6 ? ~(unsigned)POSE_DEPTH : ~0u; /* the next ping is from another place */
        CHECK(kind == 6 || free_at(0, 0) <= START_M);
        send();
        CHECK_INT(store->pool.n, 1);
        CHECK_INT(newest(0)->seq, kind == 3 ? 1 : 2);
    }
}

/* What a pose without a ping must be, so that the vehicle is known to have gone there. */
TEST(only_a_pose_that_goes_on_is_followed)
{
    for (int kind = 0; kind < 7; kind++) {
        begin(9, 3);
        if (kind == 6)
            pose.has &= ~(unsigned)POSE_ATTITUDE; /* of the ping: where water lies in the body's axes */
        send();
        struct pose next = pose;
        next.has |= POSE_ATTITUDE;
        next.position_m[0] = kind == 1 ? 1.1 : 0.5;
        next.t_ns = kind == 2 ? ping.t_ns - 1 : ping.t_ns;
        next.discontinuities += kind == 3;
        next.withdrawn += kind == 4;
        next.has &= kind == 5 ? ~(unsigned)POSE_DEPTH : ~0u;
        store_follow(store, &next);
        CHECK_NEAR(store->at_m[0], kind == 0 ? 0.5 : 0, 0, 0);
    }
}

/* Each by itself, and all of them: of the ping, and since. */
TEST(water_is_as_uncertain_as_all_that_moved_it)
{
    static const struct {
        double then_m, any_m, blur_m, now_m, level_m, depth_m, way_m, margin_m;
    } row[] = {
        {.margin_m = 0},
        {.then_m = 0.1, .margin_m = 0.1},
        {.any_m = 0.1, .margin_m = 0.1},
        {.blur_m = 0.1, .margin_m = 0.1},
        {.now_m = 0.1, .margin_m = 0.1},
        {.level_m = 0.3, .margin_m = 0.3},
        {.depth_m = 0.3, .margin_m = 0.3},
        {.level_m = 0.3, .depth_m = 0.4, .margin_m = 0.5},
        {.way_m = 2, .margin_m = 2 * POSE_WAY_ERROR},
        {0.1, 0.02, 0.03, 0.2, 0.3, 0.4, 2, 0.1 + 0.02 + 0.03 + 0.2 + 0.5 + 2 * POSE_WAY_ERROR},
    };
    static struct water_view view[ASK_RECORDS];
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        begin(9, 3);
        pose.uncertain_m = row[i].then_m;
        pose.blur_any_m = row[i].any_m;
        pose.blur_m[1] = row[i].blur_m;
        pose.drift_m[0] = 0.7; /* what was before the ping is no matter */
        pose.drift_m[1] = 0.9;
        pose.path_m = 50;
        send();
        pose.uncertain_m = row[i].now_m;
        pose.drift_m[0] += row[i].level_m;
        pose.drift_m[1] += row[i].depth_m;
        pose.path_m += row[i].way_m;
        CHECK_INT(look(view), 1);
        CHECK_NEAR(view[0].margin_m, row[i].margin_m, 1e-6, 1e-6);
    }
    begin(9, 3); /* the limit of the way counts with all that */
    send();
    pose.path_m = 19.7;
    CHECK(look(view) == 1 && !view[0].lost);
    pose.path_m = 19.9;
    CHECK(look(view) == 1 && view[0].lost);
}

/* A sensor on an arm is moved by what the body turns, and its beams turn by that: of the ping, and since. */
TEST(water_is_as_uncertain_as_all_that_turned_it)
{
    static const struct mount arm = {.attitude = {1, 0, 0, 0}, .position_m = {0, 0.8, 0}};
    static const double row[][4] = {
        {0.01, 0, 0, 0.01}, {0, 0.02, 0, 0.02}, {0, 0, 0.005, 0.01}, {0.01, 0.02, 0.005, 0.04}};
    static struct water_view view[ASK_RECORDS];
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        begin(9, 3);
        pose.uncertain_rad = row[i][0];
        pose.blur_rad = row[i][1];
        ping.pose = pose;
        store_enter(store, &ping, &arm);
        pose.heading_radps = row[i][2];
        ping.t_ns += 2 * SECOND;
        CHECK_INT(look(view), 1);
        CHECK_NEAR(view[0].margin_rad, row[i][3], 1e-6, 0);
        CHECK_NEAR(view[0].margin_m, row[i][3] * 0.8, 1e-6, 0);
    }
}

/* Drift is level, and a heading turns about the vertical: for a sensor that leans that is up and down, too. */
TEST(water_of_a_sensor_that_leans_is_uncertain_up_and_down)
{
    static struct water_view view[ASK_RECORDS];
    for (int leans = 0; leans < 2; leans++) {
        const struct mount mount = {
            .attitude = {leans ? sqrt(0.75) : 1, leans ? 0.5 : 0, 0, 0}}; /* by 60 degrees */
        const double leaning = leans ? sqrt(0.75) : 0;
        begin(9, 3);
        ping.pose = pose;
        store_enter(store, &ping, &mount);
        pose.uncertain_m = 0.1;
        pose.drift_m[0] = 0.3;
        pose.drift_m[1] = 0.4;
        pose.heading_radps = 0.005;
        ping.t_ns += 2 * SECOND;
        CHECK_INT(look(view), 1);
        CHECK_NEAR(view[0].level_m, 0.3, 1e-6, 0);
        CHECK_NEAR(view[0].lift_m, 0.1 + 0.4 + 0.3 * leaning, 1e-6, 0);
        CHECK_NEAR(view[0].margin_rad, 0.01, 1e-6, 0);
        CHECK_NEAR(view[0].lift_rad, 0.01 * leaning, 1e-6, 1e-9);
    }
}

/* Each step of the way since went wrong by what the heading has drifted since the record before it. */
TEST(water_strays_by_the_heading_on_the_way_since)
{
    static struct water_view view[ASK_RECORDS];
    begin(9, 3);
    send();
    ping.t_ns += 2 * SECOND - TICK;
    pose.path_m = 4;
    send();
    ping.t_ns += 3 * SECOND;
    pose.path_m = 10;
    pose.heading_radps = 0.01;
    CHECK_INT(look(view), 2);
    const double newer_m = 0.01 * 3 * (10 - 4), older_m = newer_m + 0.01 * 5 * 4;
    CHECK_NEAR(view[0].margin_m, POSE_WAY_ERROR * 6 + newer_m, 1e-6, 0);
    CHECK_NEAR(view[1].margin_m, POSE_WAY_ERROR * 10 + older_m, 1e-6, 0);
    ping.t_ns += 500 * SECOND; /* no farther than straight back */
    const struct store_now now = {.now_ns = ping.t_ns, .pose = &pose, .clear_for_s = 1000, .move_limit_m = 90};
    CHECK_INT(store_view(store, &now, view), 2);
    CHECK_NEAR(view[0].margin_m, POSE_WAY_ERROR * 6 + 2 * 6, 1e-6, 0);
}

/* What is forgotten counts from the vehicle, and a sensor may look from its side. */
TEST(what_is_kept_counts_from_the_vehicle)
{
    static const struct mount arm = {.attitude = {1, 0, 0, 0}, .position_m = {0, 0.8, 0}};
    static struct water_view view[ASK_RECORDS];
    begin(9, 3);
    ping.pose = pose;
    store_enter(store, &ping, &arm);
    struct store_now now = {
        .now_ns = ping.t_ns, .pose = &pose, .clear_for_s = 30, .move_limit_m = 20, .keeps_m = 6};
    CHECK_INT(store_view(store, &now, view), 1);
    CHECK_NEAR(view[0].keeps_m, 5.2, 1e-6, 0);
    now.keeps_m = 0.5;
    CHECK(store_view(store, &now, view) == 1 && view[0].keeps_m > 0 && view[0].keeps_m < 0.1);
}

/* An echo in a record for which there was no room may have ended it: of its own sonar since its newest beam, of another
 * one since its oldest. */
TEST(water_is_doubted_since_a_record_was_lost)
{
    static struct water_view view[ASK_RECORDS];
    begin(1, 2.5);
    for (int i = 0; i < 6; i++)
        send_at(2 * i);
    const struct store_now now = {.now_ns = ping.t_ns, .pose = &pose, .clear_for_s = 30, .move_limit_m = 20};
    for (int sensor = 0; sensor < 2; sensor++)
        for (int when = 0; when < 3; when++) {
            struct store_list list;
            store_list(store, &list);
            list.gone_ns[sensor] = when == 0   ? newest(0)->t_ns
                                   : when == 1 ? newest(0)->newest_ns
                                               : newest(0)->newest_ns + 1;
            CHECK_INT(store_look(store, &list, &now, view), 1);
            CHECK(view[0].lost == (when == 2 || (when == 1 && sensor == 1)));
        }
}

TEST(what_is_no_ping_of_a_sonar_is_left_alone)
{
    for (int kind = 0; kind < 3; kind++) {
        begin(9, 3);
        ping.sensor = kind == 0 ? STORE_SENSORS : 0;
        ping.n_beams = kind == 1 ? 0 : kind == 2 ? BEAMS_MAX + 1 : 9;
        send();
        CHECK_INT(store->pool.n, 0);
    }
}

TEST(small_steps_between_pings_are_no_jump)
{
    begin(9, 3);
    send();
    for (int i = 0; i < 20; i++) {
        pose.position_m[0] += 0.1;
        pose.t_ns = ping.t_ns + (unsigned)i;
        store_follow(store, &pose);
    }
    CHECK(free_at(0, 0) > 7.5 && free_at(0, 0) < 8.1);
}

TEST(without_an_attitude_water_lies_in_the_bodys_axes)
{
    begin(9, 3);
    pose.has = 0;
    send();
    CHECK_NEAR(free_at(0, 0), 10, 0, 0.13);
    pose.drift_m[0] = 0.5;
    CHECK(free_from(4, 0, 0) > 9 && free_from(4, 0, 0) < 9.6);
    pose.heading_adrift = true;
    send();
    CHECK_INT(store->pool.n, 0);
    pose = pose_identity;
    send();
    pose.has = POSE_ATTITUDE;
    send();
    CHECK_INT(store->pool.n, 1);
}

TEST(way_uncertainty_and_drift_make_water_smaller)
{
    begin(9, 3);
    send();
    pose.path_m = 15;
    CHECK(free_at(0, 0) > 9.5 && free_at(0, 0) <= 9.85);
    pose.path_m = 21;
    CHECK(free_at(0, 0) <= START_M); /* farther than the limit */
    pose.path_m = 0;
    pose.uncertain_m = 0.5;
    CHECK(free_from(4, 0, 0) > 9 && free_from(4, 0, 0) <= 9.5);
    pose.uncertain_m = 0;
    pose.heading_radps = geo_rad(2);
    CHECK_NEAR(free_at(10, 0), 10, 0, 0.13);
    ping.t_ns += 2 * SECOND;
    CHECK(free_at(10, 0) <= START_M);
    CHECK(free_at(7, 0) > 9);
}

TEST(a_lost_sonar_ends_water_and_frees_none)
{
    static struct water_view view[ASK_RECORDS];
    begin(9, 3);
    const struct ask_question q = {.axis = {1, 0, 0}, .half_rad = geo_rad(0.1), .near_m = START_M, .to_m = 9};
    struct store_now now = {.pose = &pose, .clear_for_s = 30, .move_limit_m = 20, .lost = 2};
    send();
    ping.sensor = 1;
    beam[4].n = 1;
    beam[4].free_to_m = 5;
    send();
    now.now_ns = ping.t_ns;
    CHECK_NEAR(ask_free(view, store_view(store, &now, view), &q).free_to_m, 5, 0, 0.13);
    now.lost = 3;
    CHECK(ask_free(view, store_view(store, &now, view), &q).free_to_m <= START_M);
}

/* An older echo that the grid has forgotten may stand where this ping heard none. */
TEST(nothing_is_free_where_nothing_is_kept)
{
    static struct water_view view[ASK_RECORDS];
    begin(9, 3);
    const struct ask_question q = {.axis = {1, 0, 0}, .half_rad = geo_rad(0.1), .near_m = START_M, .to_m = 9};
    struct store_now now = {.pose = &pose, .clear_for_s = 30, .move_limit_m = 20};
    send();
    now.now_ns = ping.t_ns;
    CHECK(ask_free(view, store_view(store, &now, view), &q).free_to_m == 9);
    now.keeps_m = 6;
    CHECK_NEAR(ask_free(view, store_view(store, &now, view), &q).free_to_m, 6, 0, 0.13);
    CHECK(ask_free(view, store_view(store, &now, view), &q).free_to_m <= 6);
}

/* A beam that is free to 10 m on its axis, and to 3 m at its edge. */
TEST(off_its_axis_a_beam_frees_no_more_than_it_detects)
{
    begin(1, 25);
    beam[0].off_axis = true;
    beam[0].side_to_m = 7;
    beam[0].edge_from_m = 0.1f;
    beam[0].edge_to_m = 3;
    send_at(0);
    CHECK_NEAR(free_at(0, 0), 10, 0, 0.13);
    for (int side = -1; side <= 1; side += 2) {
        CHECK_NEAR(free_at(0, side * 9), 3, 0, 0.13);
        CHECK_NEAR(free_at(0, side * 5), 7, 0, 0.13);
        CHECK_NEAR(free_at(side * 9, 0), 3, 0, 0.13);
        CHECK_NEAR(free_at(side * 5, 0), 7, 0, 0.13);
        CHECK(free_at(side * 13.5, 0) <= START_M);
    }
    store_init(store, &conf);
    beam[0].edge_from_m = 1;
    send_at(0);
    CHECK(free_at(9, 0) <= START_M && free_at(0, 9) <= START_M);
    CHECK_NEAR(free_at(0, 0), 10, 0, 0.13);
    CHECK_NEAR(free_at(0, 5), 7, 0, 0.13);
}

/* Tiles over many beams lie in the parts on their axes alone: what the edges above and below lack takes nothing of
 * them. */
TEST(many_beams_are_as_free_as_the_part_of_them_that_is_asked)
{
    begin(40, 1);
    for (int i = 0; i < 40; i++) {
        beam[i].az_rad = (float)geo_rad(0.5 * (i - 19.5));
        beam[i].off_axis = true;
        beam[i].side_to_m = 10;
        beam[i].edge_from_m = 0.1f;
        beam[i].edge_to_m = 3;
    }
    send();
    static struct water_view view[ASK_RECORDS];
    for (int levels = 2; levels <= TILES_LEVELS; levels++) {
        const struct ask_question q = {
            .axis = {1}, .half_rad = geo_rad(2), .near_m = START_M, .to_m = 9, .levels = levels};
        CHECK_NEAR(ask_free(view, look(view), &q).free_to_m, 9, 0, 0.01);
    }
    CHECK_NEAR(free_at(0, 10), 3, 0, 0.13);
}

/* Halfway to a neighbour a beam detects as at its edge, where they do not overlap; with too many beams for columns of
 * their own all of each is free as far as that. */
TEST(between_two_beams_no_more_is_free_than_they_detect_there)
{
    for (int many = 0; many < 2; many++) {
        begin(many ? 100 : 5, many ? 1.5 : 20);
        for (int i = 0; i < ping.n_beams; i++) {
            beam[i].off_axis = true;
            beam[i].side_to_m = 7;
            beam[i].edge_from_m = 1.5f;
            beam[i].edge_to_m = 3;
        }
        send();
        CHECK_NEAR(free_from(1.8, many ? 0 : 10, 0), 3, 0, 0.13);
        CHECK_NEAR(free_from(1.8, many ? 0.75 : 0, 0), many ? 3 : 10, 0, 0.13);
        CHECK(free_from(1, many ? 0 : 10, 0) <= 1);
        if (!many)
            CHECK_NEAR(free_from(1.8, 3.75, 0), 7, 0, 0.13);
    }
}

/* A beam so wide that a tile lies in it is a record of its own while the vehicle turns; and a row is as wide as the
 * opening of its first beam. */
TEST(what_a_beam_alone_frees_no_other_takes_away)
{
    begin(1, 30);
    for (int i = 0; i < 20; i++)
        send_at(2 * i);
    CHECK_INT(newest(0)->t_ns, newest(0)->newest_ns);
    CHECK_NEAR(free_at(25, 0), 10, 0, 0.13);
    begin(1, 8);
    for (int i = 0; i < 40; i++)
        send_at(i);
    static struct water_view view[ASK_RECORDS];
    look(view);
    struct ask_question q = {.half_rad = geo_rad(0.1), .near_m = START_M, .to_m = 12};
    geo_direction(geo_rad(19.5), 0, q.axis);
    CHECK_NEAR(ask_free(view, 1, &q).free_to_m, 10, 0, 0.13);
}

TEST(what_is_wider_than_a_row_is_cut)
{
    begin(1, 178);
    send_at(0);
    CHECK_NEAR(free_at(60, 0), 10, 0, 0.13);
    CHECK(free_at(85, 0) <= START_M);
    begin(MOST, 5.5);
    send();
    CHECK_NEAR(free_at(75, 0), 10, 0, 0.13);
    CHECK(free_at(85, 0) <= START_M);
}

/* Azimuths of pings are within a turn: what is to the left of ahead has nearly a whole one. */
TEST(beams_to_the_left_are_as_good_as_those_to_the_right)
{
    begin(MOST, 1);
    for (int i = 0; i < MOST; i++)
        beam[i].az_rad = (float)geo_wrap((double)beam[i].az_rad);
    send();
    for (int az = -31; az <= 31; az++)
        CHECK_NEAR(free_at(az, 0), 10, 0, 0.13);
    CHECK(free_at(33, 0) <= START_M && free_at(-33, 0) <= START_M);
}

/* A matrix of 8 columns and rows that overlap, free to 10 m. */
static void begin_matrix(void)
{
    begin(MOST, 3);
    ping.az_aperture_rad = (float)geo_rad(4);
    ping.el_aperture_rad = (float)geo_rad(6);
    for (int i = 0; i < MOST; i++) {
        beam[i].az_rad = (float)geo_rad(3 * (i % 8) - 10.5);
        beam[i].el_rad = (float)geo_rad(5 * (double)(i / 8) - 17.5);
    }
}

static double wide_free_at(double az_deg, double el_deg, double half_deg)
{
    static struct water_view view[ASK_RECORDS];
    struct ask_question q = {.half_rad = geo_rad(half_deg), .near_m = START_M, .to_m = 12};
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), q.axis);
    return ask_free(view, look(view), &q).free_to_m;
}

TEST(what_lies_across_the_beams_of_a_matrix_is_free_by_all_of_them)
{
    begin_matrix();
    send();
    CHECK_INT(store->pool.n, 1);
    CHECK_NEAR(wide_free_at(0, 0, 8), 10, 0, 0.26);
    beam[27].n = 1; /* 4th from below and from the left */
    beam[27].free_to_m = 6;
    send();
    CHECK_NEAR(wide_free_at(0, 0, 8), 6, 0, 0.26);
    CHECK_NEAR(free_at(-1.5, -2.5), 6, 0, 0.13);
    CHECK_NEAR(free_at(-1.5, 2.5), 10, 0, 0.13);
}

/* Each beam points a little off the grid. */
TEST(every_beams_echo_ends_older_water_wherever_it_points)
{
    for (int i = 0; i < MOST; i += 7) {
        begin_matrix();
        for (int k = 0; k < MOST; k++) {
            beam[k].az_rad += (float)geo_rad(0.02 * sin(k));
            beam[k].el_rad += (float)geo_rad(0.02 * cos(k));
        }
        send();
        const double az = geo_deg((double)beam[i].az_rad), el = geo_deg((double)beam[i].el_rad);
        CHECK_NEAR(free_at(az, el), 10, 0, 0.13);
        beam[i].n = 1;
        beam[i].free_to_m = 6;
        send();
        CHECK_NEAR(free_at(az, el), 6, 0, 0.13);
    }
}

TEST(a_still_matrix_is_thinned_and_what_any_row_shows_is_kept)
{
    begin_matrix();
    for (int i = 0; i < 20; i++)
        send();
    CHECK_INT(store->pool.n, 2);
    for (int row = 0; row < 8; row++) {
        begin_matrix();
        for (int i = 0; i < 5; i++)
            send();
        beam[8 * row].n = 1;
        beam[8 * row].free_to_m = 6;
        send();
        beam[8 * row].n = 0;
        beam[8 * row].free_to_m = 10;
        for (int i = 0; i < 20; i++) {
            pose.position_m[1] = i % 2 * 0.1; /* not from one place, nor far from it */
            send();
        }
        CHECK(shows_echo());
        CHECK(store->pool.n <= 6);
    }
}

/* Sensor 0 sees water once, ahead; sensor 1 is a fan that moves too fast to be thinned, and sees a thing there at
 * first. */
static void send_beside(uint32_t fans, bool shown)
{
    begin(9, 3);
    send();
    ping.sensor = 1;
    for (uint32_t i = 0; i < fans; i++) {
        beam[4].n = shown && i == 0;
        beam[4].free_to_m = i == 0 ? 5 : 2;
        ping.t_ns -= TICK - TICK / 10;
        pose.position_m[0] = i % 2 * 0.5;
        send();
    }
    pose.position_m[0] = 0;
}

static int records_of(uint32_t sensor)
{
    int n = 0;
    for (uint32_t i = 0; i < store->pool.n; i++)
        n += pool_at(&store->pool, i)->sensor == sensor;
    return n;
}

TEST(a_sonar_pushes_no_record_of_another_out)
{
    send_beside(3 * POOL_KEPT, false);
    CHECK_INT(records_of(0), 1);
    CHECK_INT(records_of(1), POOL_KEPT);
}

/* The one that saw the thing goes when there is no room; what it ended does not become free again. */
TEST(what_goes_for_want_of_room_brings_no_older_water_back)
{
    send_beside(POOL_KEPT - 1, true);
    CHECK_NEAR(free_at(0, 0), 5, 0, 0.13);
    send_beside(POOL_KEPT + 1, true);
    CHECK(free_at(0, 0) <= 2.5);
}

/* A head's row stands at its newest beam: what another sonar has seen since its older ones freed the water counts. */
TEST(what_another_sonar_saw_meanwhile_ends_older_beams_of_a_row)
{
    for (int echo = 0; echo < 2; echo++) {
        begin(1, 2.5);
        for (int i = 0; i < 6; i++)
            send_at(2 * i);
        struct beam_echoes one[9];
        struct echoes fan = ping;
        fan.sensor = 1;
        fan.n_beams = 9;
        fan.beam = one;
        fan.t_ns += TICK / 2;
        for (int i = 0; i < 9; i++)
            one[i] = (struct beam_echoes){.az_rad = (float)geo_rad(2.5 * (i - 2)),
                                          .blind_m = 0.1f,
                                          .free_to_m = echo ? 4 : 9,
                                          .n = (uint8_t)echo};
        store_enter(store, &fan, &mount_identity);
        CHECK_NEAR(free_at(4, 0), echo ? 4 : 10, 0, 0.2);
        for (int i = 6; i < 12; i++)
            send_at(2 * i);
        CHECK_NEAR(free_at(4, 0), echo ? 4 : 10, 0, 0.2);
    }
}

int main(void)
{
    RUN(a_look_is_by_a_beam_that_passes_there);
    RUN(a_part_of_an_image_is_what_its_rows_say);
    RUN(memory_is_bounded);
    RUN(a_ping_that_alone_shows_an_echo_is_kept);
    RUN(the_last_beams_of_a_head_are_a_row_that_is_kept_every_sixth);
    RUN(a_row_is_as_old_as_its_oldest_beam);
    RUN(drift_between_beams_moves_where_they_overlap);
    RUN(no_beam_of_a_head_of_long_steps_is_left_out);
    RUN(a_row_goes_round_north_and_back);
    RUN(where_pings_are_lost_a_row_says_nothing);
    RUN(nearer_than_beams_overlap_nothing_is_free);
    RUN(a_row_loses_little_by_the_way_of_its_beams);
    RUN(what_is_deaf_once_says_nothing_and_twice_ends_the_water);
    RUN(an_echo_ends_what_the_beam_beside_it_does_not_reach);
    RUN(what_a_fan_is_deaf_to_twice_stays_ended);
    RUN(a_head_that_is_deaf_twice_ends_what_both_beams_looked_at);
    RUN(an_own_echo_ends_what_is_behind_it);
    RUN(a_fan_is_thinned_and_what_one_ping_alone_shows_is_kept);
    RUN(what_a_still_fan_frees_in_some_pings_is_free);
    RUN(a_fan_that_creeps_or_turns_slowly_is_thinned);
    RUN(a_beam_that_stands_is_free_as_the_vehicle_pitches);
    RUN(a_narrow_fan_leaves_no_gaps_as_it_turns);
    RUN(of_a_fan_that_turns_to_and_fro_some_are_kept);
    RUN(pings_of_a_fan_that_drifts_are_joined_for_a_while);
    RUN(a_fan_that_moves_is_kept);
    RUN(old_water_is_free_no_more);
    RUN(a_ping_whose_pose_is_hardly_known_ends_nothing);
    RUN(poses_that_break_make_all_unknown);
    RUN(only_a_pose_that_goes_on_is_followed);
    RUN(water_is_as_uncertain_as_all_that_moved_it);
    RUN(water_is_as_uncertain_as_all_that_turned_it);
    RUN(water_of_a_sensor_that_leans_is_uncertain_up_and_down);
    RUN(water_strays_by_the_heading_on_the_way_since);
    RUN(what_is_kept_counts_from_the_vehicle);
    RUN(water_is_doubted_since_a_record_was_lost);
    RUN(what_is_no_ping_of_a_sonar_is_left_alone);
    RUN(small_steps_between_pings_are_no_jump);
    RUN(without_an_attitude_water_lies_in_the_bodys_axes);
    RUN(way_uncertainty_and_drift_make_water_smaller);
    RUN(a_lost_sonar_ends_water_and_frees_none);
    RUN(nothing_is_free_where_nothing_is_kept);
    RUN(off_its_axis_a_beam_frees_no_more_than_it_detects);
    RUN(many_beams_are_as_free_as_the_part_of_them_that_is_asked);
    RUN(between_two_beams_no_more_is_free_than_they_detect_there);
    RUN(what_a_beam_alone_frees_no_other_takes_away);
    RUN(what_is_wider_than_a_row_is_cut);
    RUN(beams_to_the_left_are_as_good_as_those_to_the_right);
    RUN(what_lies_across_the_beams_of_a_matrix_is_free_by_all_of_them);
    RUN(every_beams_echo_ends_older_water_wherever_it_points);
    RUN(a_still_matrix_is_thinned_and_what_any_row_shows_is_kept);
    RUN(a_sonar_pushes_no_record_of_another_out);
    RUN(what_goes_for_want_of_room_brings_no_older_water_back);
    RUN(what_another_sonar_saw_meanwhile_ends_older_beams_of_a_row);
    return test_end();
}
