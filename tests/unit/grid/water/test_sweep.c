/* SPDX-License-Identifier: MIT */
/* test_sweep - the row that a head's last beams make: rule by rule, each on the fewest beams that show it. */
#include "tests/lib/test.h"

#include "grid/water/sweep.h"

#define HALF_DEG 2.0 /* of a beam's width */
#define HIGH_DEG 10.0
#define UNIT_M   (1.01 * WATER_UNIT_M)

static struct sweep sweep;
static struct row_room room;
static struct water_record record, next_at; /* of the row; of the next beam, whose axes are the vehicle's */
static struct beams_row next;
static double next_deg;

/* The next beam: from the origin, straight ahead, free from 0.3 to 10 m. */
static void begin(void)
{
    sweep = (struct sweep){.n = 0};
    next_at = (struct water_record){.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .seq = 100, .t_ns = 1000};
    next.n = 1;
    next.shape = (struct row_shape){.half_az_rad = geo_rad(HALF_DEG), .half_el_rad = geo_rad(HIGH_DEG)};
    next.beam[0] = (struct row_beam){
        .near_m = 0.3, .edge_near_m = 0.3, .axis_m = 10, .side_m = 10, .edge_m = 10, .ends_m = INFINITY};
    next_deg = 0;
}

/* The vehicle leans: to what is north, east and down of it, from what is ahead, right and down. */
static void lean(const double v[3], double out[3])
{
    double attitude[4];
    quat_from_rpy(0.3, -0.2, 1, attitude);
    quat_rotate(attitude, v, out);
}

/* It is sent, and another one like it follows, turned on by so much. */
static bool send(double turn_deg)
{
    next.beam[0].az_rad = geo_rad(next_deg);
    next_at.newest_ns = next_at.t_ns;
    struct water_record at = next_at;
    lean(next_at.place_m, at.place_m);
    for (int i = 0; i < 3; i++)
        lean(next_at.axis[i], at.axis[i]);
    const bool joined = sweep_add(&sweep, &at, &next);
    next_deg += turn_deg;
    next_at.seq++;
    next_at.t_ns += 10;
    return joined;
}

static void send_all(int n, double turn_deg)
{
    for (int i = 0; i < n; i++)
        send(turn_deg);
}

static void write_row(void)
{
    sweep_write(&sweep, &record, &room);
}

/* What the row says in that direction of its own axes, in that row of the image. */
static struct water_cell said_at(double az_deg, int row)
{
    const struct water_image *image = &record.image;
    const int column = water_image_find(image->tan_az, image->columns, tan(geo_rad(az_deg)));
    return image->cell[row * image->columns + column];
}

#define AXIS 2 /* that row of the image */

static double free_to_m(double az_deg)
{
    return said_at(az_deg, AXIS).least * WATER_UNIT_M;
}

static double free_from_m(double az_deg)
{
    return said_at(az_deg, AXIS).from * WATER_UNIT_M;
}

/* Where an echo ends the water; INFINITY: nowhere. */
static double ends_m(double az_deg)
{
    const struct water_cell cell = said_at(az_deg, AXIS);
    return cell.ends == WATER_NO_END ? INFINITY : cell.ends * WATER_UNIT_M;
}

static double left_deg(void)
{
    return geo_deg(atan(record.image.tan_az[0]));
}

static double right_deg(void)
{
    return geo_deg(atan(record.image.tan_az[record.image.columns]));
}

/* ---- what is in a row ---- */

TEST(a_beam_joins_the_one_before_if_the_head_goes_on)
{
    static const struct {
        double turn_deg, half_deg, half_el_deg, el_deg;
        uint32_t lost;
        int64_t later_ns;
        bool joins;
    } c[] = {
        {3, 2, 10, 0, 0, 10, true},     {3, 2, 10, 0, 4, 10, true},     {3, 2, 10, 0, 5, 10, false},
        {3, 2, 10, 0, 0, 0, true},      {3, 2, 10, 0, 0, -1, false},    {3, 2.1, 10, 0, 0, 10, false},
        {3, 2, 10.1, 0, 0, 10, false},  {3, 2, 10, 0.1, 0, 10, false},  {0, 2, 10, 0, 0, 10, false},
        {0.24, 2, 10, 0, 0, 10, false}, {0.26, 2, 10, 0, 0, 10, true}, /* an eighth */
        {59.9, 2, 10, 0, 0, 10, true},  {60.1, 2, 10, 0, 0, 10, false},
    };
    for (size_t i = 0; i < sizeof c / sizeof *c; i++)
        for (int side = -1; side <= 1; side += 2) {
            begin();
            send(side * c[i].turn_deg);
            next.shape.half_az_rad = geo_rad(c[i].half_deg);
            next.shape.half_el_rad = geo_rad(c[i].half_el_deg);
            next.shape.el_rad = geo_rad(c[i].el_deg);
            next_at.seq += c[i].lost;
            next_at.t_ns = 1000 + (uint64_t)c[i].later_ns;
            CHECK_INT(send(1), c[i].joins);
            CHECK_INT(sweep.n, c[i].joins ? 2 : 1);
            CHECK_INT(sweep.begun, c[i].joins ? 100 : 101 + c[i].lost);
            CHECK_INT(sweep.since, c[i].joins ? 2 : 1);
            CHECK_NEAR(sweep.sense, c[i].joins ? side : 0, 0, 0);
        }
}

TEST(a_head_that_turns_back_begins_a_row)
{
    for (int side = -1; side <= 1; side += 2) {
        begin();
        send_all(2, side * 3);
        CHECK(send(side * -4));
        CHECK(!send(0));
        CHECK_INT(sweep.n, 1);
    }
}

/* Ten degrees and wider, tiles lie in one of them. */
TEST(wide_beams_make_a_row_only_where_the_head_turns_fast)
{
    static const struct {
        double half_deg, turn_deg;
        bool joins;
    } c[] = {{4.99, 0.65, true}, {5.01, 2.4, false}, {5.01, 2.6, true}, {5.01, -2.4, false}, {5.01, -2.6, true}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        begin();
        next.shape.half_az_rad = geo_rad(c[i].half_deg);
        send(c[i].turn_deg);
        CHECK_INT(send(0), c[i].joins);
    }
}

/* By number, and by how wide they are together. The one before the first of those that stay is its neighbour. */
TEST(of_a_row_that_goes_on_the_oldest_beams_are_left_out)
{
    for (int side = -1; side <= 1; side += 2) {
        begin();
        send_all(SWEEP_BEAMS, side * 2);
        CHECK(sweep.n == SWEEP_BEAMS && sweep.first == 0);
        send_all(1, side * 2);
        CHECK(sweep.n == SWEEP_BEAMS + 1 && sweep.first == 1);
        CHECK_INT(sweep.look[0].at.seq, 100);
        send_all(2, side * 2);
        CHECK(sweep.n == SWEEP_BEAMS + 1 && sweep.first == 1);
        CHECK_INT(sweep.look[0].at.seq, 102);
        CHECK_INT(sweep.look[SWEEP_BEAMS].at.seq, 102 + SWEEP_BEAMS);
        write_row();
        CHECK_INT(record.t_ns, 1000 + 10 * 3);
        for (int exact = 0; exact < 2; exact++) {
            begin();
            send_all(10, side * (exact ? 10.001 : 9.999));
            CHECK_INT(sweep.n - sweep.first, exact ? 6 : 7);
            CHECK_INT(sweep.look[sweep.first].at.seq, 110 - (exact ? 6 : 7));
        }
    }
}

/* One of every six; of a row that holds fewer, and has left others behind, no fewer than that has in common. */
TEST(rows_are_kept_so_often_that_two_have_a_beam_in_common)
{
    static const struct {
        double turn_deg;
        int each;
    } c[] = {{3, 6}, {9, 6}, {11, 5}, {14, 4}, {19, 3}, {29, 2}, {40, 1}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        begin();
        send_all(30, c[i].turn_deg);
        int kept[2] = {0, 0}, n = 0; /* a row is kept when the next one counts from 1 again */
        for (int k = 0; k < 20; k++) {
            send(c[i].turn_deg);
            CHECK_INT(sweep.before, next_at.seq - 2);
            if (sweep.since == 1 && n < 2)
                kept[n++] = k;
        }
        CHECK_INT(kept[1] - kept[0], c[i].each);
    }
    begin(); /* before any is left behind */
    for (int i = 0; i < 5; i++) {
        send(13);
        CHECK_INT(sweep.since, i + 1);
    }
}

/* A beam that received nothing usable, after another one: both end what they looked at. */
TEST(two_deaf_beams_end_what_both_looked_at)
{
    for (int kind = 0; kind < 4; kind++) {
        begin();
        next.beam[0].axis_m = kind == 1 ? 10 : 0;
        send(3);
        next.beam[0].axis_m = kind == 2 ? 0.5 : 0;
        next.beam[0].ends_m = kind == 2 ? 0.5 : kind == 3 ? (double)INFINITY : 0;
        CHECK(send(3));
        CHECK(kind == 0 ? sweep.look[0].beam.ends_m == 0 : isinf(sweep.look[0].beam.ends_m));
    }
}

/* ---- two beams ---- */

/* The second beam: they overlap by a degree. */
static const struct sweep_look *second(const double place_m[3], double drift_m, double tilt_rad, int side)
{
    send(side * 3);
    memcpy(next_at.place_m, place_m, sizeof next_at.place_m);
    next_at.drift_m[0] += 0.6 * drift_m;
    next_at.drift_m[1] += 0.8 * drift_m;
    const double az = geo_rad(side * 3), c = cos(tilt_rad),
                 d = sin(tilt_rad); /* it is rolled about its own axis */
    const double right[3] = {-sin(az), cos(az), 0}, down[3] = {0, 0, 1};
    memcpy(next_at.axis[0], (double[3]){cos(az), sin(az), 0}, sizeof next_at.axis[0]);
    for (int k = 0; k < 3; k++) {
        next_at.axis[1][k] = c * right[k] + d * down[k];
        next_at.axis[2][k] = c * down[k] - d * right[k];
    }
    next_deg = 0;
    CHECK(send(0));
    return &sweep.look[1];
}

/* What was sent from beyond the edge of the one before it leaves a gap up to where their edges cross. */
TEST(beams_from_two_places_leave_a_gap_up_to_where_their_edges_cross)
{
    static const struct {
        double ahead_m, aside_m, drift_m, tilt_rad, el_deg;
    } c[] = {{0, 0, 0, 0, 0},       {0, 0.05, 0, 0, 0},     {-0.5, 0.05, 0, 0, 0},   {0.5, 0.05, 0, 0, 0},
             {3, 0.05, 0, 0, 0},    {0, -0.05, 0, 0, 0},    {0, 0, 0.05, 0, 0},      {0, 0.02, 0.03, 0, 0},
             {0, 0.05, 0, 0.01, 0}, {0, 0.05, 0, 0.01, 20}, {0, 0.05, 0, 0.01, -20}, {0, 0, 0, 0.01, 20},
             {0, 0.01, 0, 0.06, 0}, {0, 0, 0, 0.15, 0}};
    static const double share[] = {1, 0.7, 0.25, 0.7, 1}, from[] = {-1, -0.7, -0.25, 0.25, 0.7, 1};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++)
        for (int side = -1; side <= 1; side += 2) {
            begin();
            next.shape.el_rad = geo_rad(c[i].el_deg);
            const double half = geo_rad(HALF_DEG);
            const struct sweep_look *look =
                second((double[3]){c[i].ahead_m, side * c[i].aside_m, 0}, c[i].drift_m, c[i].tilt_rad, side);
            const double slip_m = fmax(c[i].aside_m * cos(half) - c[i].ahead_m * sin(half), 0) + c[i].drift_m;
            CHECK_NEAR(look->tilt_rad, c[i].tilt_rad, 0, 1e-5);
            CHECK_NEAR(look->aside_m,
                       fmax(c[i].aside_m * cos(geo_rad(1.5)) - c[i].ahead_m * sin(geo_rad(1.5)), 0) + c[i].drift_m,
                       0, 1e-9);
            for (int row = 0; row < ROW_ROWS; row++) {
                const double el = c[i].el_deg, low = fabs(el + HIGH_DEG * from[row]),
                             high = fabs(el + HIGH_DEG * from[row + 1]);
                const double steep = el != 0 ? geo_rad(fmax(low, high)) : geo_rad(share[row] * HIGH_DEG);
                const double over = geo_rad(1) - c[i].tilt_rad * tan(steep);
                const double want_m = slip_m <= 0 && over > -ROW_TOUCH_RAD ? 0
                                      : over <= 0                          ? (double)INFINITY
                                                                           : slip_m / (sin(over) * cos(steep));
                CHECK_NEAR(look->join_m[row], want_m, 1e-5, 1e-9);
            }
            CHECK_INT(look->apart, look->join_m[2] > 6);
        }
}

/* They overlap by a degree: a post that is no more than 6 cm thick may stand in the gap up to where it is as narrow. */
TEST(a_row_tells_up_to_where_a_post_may_stand_between_its_beams)
{
    static const struct {
        double ahead_m, aside_m, gap_m;
    } c[] = {{0, 0.06, 0}, {0, -0.2, 0}, {0, 0.1, 2.289}, {1, 0.135, 2.289}, {3, 0, 0}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++)
        for (int side = -1; side <= 1; side += 2) {
            begin();
            second((double[3]){c[i].ahead_m, side * c[i].aside_m, 0}, 0, 0, side);
            write_row();
            CHECK_NEAR(sweep.look[1].gap_m, c[i].gap_m, 0, 5e-3);
            /* the row's place is no farther than 0.3 m from the first beam's */
            CHECK_NEAR(record.gap_m, c[i].gap_m > 0 ? c[i].gap_m + c[i].ahead_m : 0, 0, c[i].gap_m > 0 ? 0.31 : 0);
            CHECK_NEAR(record.ahead_m, c[i].ahead_m, 0, 0.31);
        }
}

/* Two in turn that only touch, and what they are tilted by what their bearings are rounded by. */
TEST(beams_that_all_but_touch_leave_no_gap)
{
    for (int kind = 0; kind < 2; kind++) {
        begin();
        send(2 * HALF_DEG + geo_deg(kind ? 1.01 : 0.99) * ROW_TOUCH_RAD);
        send(0);
        CHECK(kind ? isinf(sweep.look[1].join_m[2]) : sweep.look[1].join_m[2] == 0);
        CHECK_INT(sweep.look[1].apart, kind);
    }
}

TEST(beams_that_leave_a_gap_too_far_are_apart)
{
    for (int kind = 0; kind < 2; kind++)
        for (int side = -1; side <= 1; side += 2) {
            begin();
            const double want_m = kind ? 6.01 : 5.99, aside_m = want_m * sin(geo_rad(1)) * cos(geo_rad(2.5));
            const struct sweep_look *look =
                second((double[3]){0, side * aside_m / cos(geo_rad(HALF_DEG)), 0}, 0, 0, side);
            CHECK_NEAR(look->join_m[2], want_m, 1e-6, 0);
            CHECK_INT(look->apart, kind);
        }
}

/* ---- the row ---- */

TEST(a_row_is_of_the_time_of_all_its_beams)
{
    for (int side = -1; side <= 1; side += 2) {
        begin();
        next_at.sensor = 7;
        for (int i = 0; i < 4; i++) {
            next_at.path_m = 50 + i;
            next_at.drift_m[0] = 0.01 * (1 + i);
            next_at.drift_m[1] = 0.02 * (1 + i);
            next_at.uncertain_m = i == 2 ? 0.3 : 0.1;
            next_at.tilt_rad = i == 2 ? 0.03 : 0.01;
            send(side * 3);
        }
        write_row();
        CHECK(record.sensor == 7 && record.t_ns == 1000 && record.newest_ns == 1030 && record.seq == 103);
        CHECK_INT(record.sweep, 100);
        CHECK_INT(record.sense, side);
        CHECK_NEAR(record.path_m, 50, 0, 0);
        CHECK_NEAR(record.drift_m[0], 0.01, 0, 0);
        CHECK_NEAR(record.drift_m[1], 0.02, 0, 0);
        CHECK_NEAR(record.uncertain_m, 0.3, 0, 0);
        CHECK_NEAR(record.tilt_rad, 0.03, 0, 1e-7);
        CHECK_NEAR(geo_dot(record.axis[0], sweep.look[1].at.axis[0]), 1, 0,
                   1e-12); /* it looks as the middle one */
    }
    begin();
    send(3);
    write_row();
    CHECK_INT(record.sense, 0);
}

/* Its axes are the middle one's: others are turned against them. */
TEST(a_row_is_as_uncertain_as_its_beams_are_tilted)
{
    begin();
    next_at.tilt_rad = 0.01;
    second((double[3]){0}, 0, 0.05, 1);
    write_row();
    CHECK_NEAR(record.tilt_rad, 0.06, 0, 1e-6);
}

/* How far a place so far ahead and aside of the middle beam's is from all axes, and from that one's own place, which
 * counts the more the higher the beams are. */
static double off_axes(const struct sweep_look *middle, const double at_m[2])
{
    const double high = fabs(middle->shape.el_rad) + middle->shape.half_el_rad, lift = 1 - cos(high);
    const double own = 0.002 + lift * lift + 0.05 * sin(high) * sin(high);
    double sum = 0;
    for (int i = sweep.first; i < sweep.n; i++) {
        double to_m[3];
        for (int k = 0; k < 3; k++)
            to_m[k] = middle->at.place_m[k] + at_m[0] * middle->at.axis[0][k] + at_m[1] * middle->at.axis[1][k] -
                      sweep.look[i].at.place_m[k];
        const double off_m = geo_dot(to_m, sweep.look[i].at.axis[1]);
        sum += off_m * off_m + own * (at_m[0] * at_m[0] + at_m[1] * at_m[1]);
    }
    return sum;
}

/* Level, as near to all of them as may be. */
TEST(a_row_stands_where_its_axes_meet)
{
    static const double place_m[][3] = {{0.3, -0.1, 0}, {0.2, 0, 0}, {-0.1, 0.2, 0},   {0.1, 0.3, 0}, {0.4, 0, 0},
                                        {0, -0.3, 0},   {0, 0.1, 0}, {0.2, -0.2, 0.1}, {-0.3, 0, 0}};
    for (int kind = 0; kind < 8; kind++) {
        const int n = kind % 2 ? 9 : 4;
        begin();
        next.shape.el_rad = geo_rad(kind / 2 % 2 ? -25 : 0);
        next.beam[0].near_m = 5;
        for (int i = 0; i < n; i++) {
            memcpy(next_at.place_m, place_m[i], sizeof next_at.place_m);
            send(kind / 4 ? 14 : -7);
        }
        write_row();
        const struct sweep_look *middle = &sweep.look[(sweep.first + sweep.n - 1) / 2];
        double way_m[3], at_m[3];
        for (int k = 0; k < 3; k++)
            way_m[k] = record.place_m[k] - middle->at.place_m[k];
        for (int k = 0; k < 3; k++)
            at_m[k] = geo_dot(way_m, middle->at.axis[k]);
        CHECK(hypot(at_m[0], at_m[1]) > 0.01 && fabs(at_m[2]) < 1e-12);
        for (int k = 0; k < 2; k++) {
            const double step_m[2] = {k ? 0 : 1e-3, k ? 1e-3 : 0};
            const double less = off_axes(middle, (double[2]){at_m[0] - step_m[0], at_m[1] - step_m[1]}),
                         more = off_axes(middle, (double[2]){at_m[0] + step_m[0], at_m[1] + step_m[1]});
            CHECK_NEAR((more - less) / 2e-3, 0, 0, 1e-9);
        }
    }
    begin(); /* no farther ahead than where the middle beam begins to detect */
    for (int i = 0; i < 9; i++) {
        next_at.place_m[0] = -0.5 * cos(geo_rad(next_deg));
        next_at.place_m[1] = -0.5 * sin(geo_rad(next_deg));
        send(7);
    }
    write_row();
    double way_m[3];
    for (int k = 0; k < 3; k++)
        way_m[k] = record.place_m[k] - sweep.look[sweep.first + 3].at.place_m[k];
    CHECK_NEAR(geo_length(way_m), 0.3, 0, 0.01);
}

/* What ranges do not allow for is uncertain: by turns ahead, aside and above of the row's place. */
TEST(a_row_tells_how_far_beside_it_its_beams_were_sent)
{
    static const double off_m[][3] = {{0, 0, 0},    {0.1, 0, 0},      {-0.1, 0, 0},
                                      {0, 0.04, 0}, {0, -0.04, 0},    {0, 0, 0.1},
                                      {0, 0, -0.1}, {0.1, 0.04, 0.1}, {-0.2, -0.04, 0.05}};
    for (size_t i = 0; i < sizeof off_m / sizeof *off_m; i++)
        for (int deaf = 0; deaf < 2; deaf++) {
            begin();
            next.shape.el_rad = geo_rad(-8);
            const double near_m = deaf ? 0 : 0.02;
            next.beam[0] = (struct row_beam){.near_m = near_m, .edge_near_m = near_m, .ends_m = deaf ? 0 : 9};
            if (!deaf)
                next.beam[0].axis_m = next.beam[0].side_m = next.beam[0].edge_m = 9;
            send(3);
            memcpy(next_at.place_m, off_m[i], sizeof next_at.place_m);
            send(0);
            write_row();
            double want_m[3] = {0, 0, 0};
            const double half = geo_rad(HALF_DEG), high = geo_rad(8 + HIGH_DEG);
            for (int k = 0; k < 2; k++) {
                const struct sweep_look *look = &sweep.look[k];
                double off[3] = {0, 0, 0};
                for (int j = 0; j < 3; j++)
                    for (int m = 0; m < 3; m++)
                        off[j] += (look->at.place_m[m] - record.place_m[m]) * look->at.axis[j][m];
                const double ahead_m = fabs(off[0]), side_m = fabs(off[1]), up_m = fabs(off[2]);
                const double bent_m = hypot(side_m + ahead_m * sin(half), up_m + ahead_m * sin(high)),
                             from_m = fmax(near_m, fmin(4 * bent_m, 0.5));
                const double left_m = ahead_m * (1 - cos(high) * cos(half)) + side_m * sin(half) +
                                      up_m * sin(high) + (from_m > 0 ? bent_m * bent_m / from_m : 0);
                want_m[0] = fmax(want_m[0], left_m);
                want_m[1] = fmax(want_m[1], side_m + fmax(off[0], 0) * sin(half));
                want_m[2] = fmax(want_m[2], up_m + ahead_m * sin(high));
                const double az = k ? 3 : 0;
                if (deaf) {
                    CHECK(free_to_m(az) == 0 && ends_m(az) == 0); /* wherever it was */
                    continue;
                }
                CHECK_NEAR(free_to_m(az), 9 + off[0], 0, UNIT_M);
                CHECK_NEAR(ends_m(az), 9 + off[0], 0, UNIT_M);
                CHECK_NEAR(free_from_m(az),
                           fmax(fmax(from_m + off[0],
                                     sweep.look[1].join_m[AXIS] > 0 ? sweep.look[1].join_m[AXIS] + off[0] : 0),
                                0),
                           0, UNIT_M);
            }
            for (int j = 0; j < 3; j++)
                CHECK_NEAR(record.spread_m[j], want_m[j], 1e-9, 1e-12);
        }
}

/* Off its axis, too: of the parts each counts from the row's place. */
TEST(ranges_of_all_parts_of_a_beam_count_from_the_rows_place)
{
    begin();
    next.beam[0].side_m = 8;
    next.beam[0].edge_m = 6;
    next.beam[0].edge_near_m = 1;
    send(3);
    next_at.place_m[0] = -0.4;
    send(0);
    write_row();
    const struct sweep_look *look = &sweep.look[1];
    double along_m = 0;
    for (int m = 0; m < 3; m++)
        along_m += (look->at.place_m[m] - record.place_m[m]) * look->at.axis[0][m];
    CHECK(along_m < -0.2);
    CHECK_NEAR(said_at(3, 2).least * WATER_UNIT_M, 10 + along_m, 0, UNIT_M);
    CHECK_NEAR(said_at(3, 1).least * WATER_UNIT_M, 8 + along_m, 0, UNIT_M);
    CHECK_NEAR(said_at(3, 0).least * WATER_UNIT_M, 6 + along_m, 0, UNIT_M);
    CHECK_NEAR(said_at(3, 0).from * WATER_UNIT_M, 1 + along_m, 0, UNIT_M);
    for (int part = 0; part < 4;
         part++) { /* what frees nothing there does not from elsewhere, and what is near does */
        begin();
        next.beam[0].near_m = next.beam[0].edge_near_m = 0.1;
        next.beam[0].axis_m = part > 2 ? 0 : 0.9;
        next.beam[0].side_m = part > 1 ? 0 : 0.8;
        next.beam[0].edge_m = part > 0 ? 0 : 0.7;
        next.beam[0].ends_m = INFINITY;
        next_at.place_m[0] = -0.1;
        send(3);
        next.beam[0].ends_m = 0.9;
        next_at.place_m[0] = 0.1;
        send(0);
        write_row();
        const double off_m = ends_m(3) - 0.9;
        CHECK(off_m > 0.05);
        CHECK_NEAR(said_at(3, 2).least * WATER_UNIT_M, part > 2 ? 0 : 0.9 + off_m, 0, UNIT_M);
        CHECK_NEAR(said_at(3, 1).least * WATER_UNIT_M, part > 1 ? 0 : 0.8 + off_m, 0, UNIT_M);
        CHECK_NEAR(said_at(3, 0).least * WATER_UNIT_M, part > 0 ? 0 : 0.7 + off_m, 0, UNIT_M);
    }
}

/* Between the edges of the first and the last beam, or halfway to the one before, echoes end what is older. */
TEST(a_row_ends_water_between_the_edges_of_its_beams)
{
    for (int side = -1; side <= 1; side += 2)
        for (int goes_on = 0; goes_on < 2; goes_on++) {
            begin();
            next.beam[0].ends_m = 10;
            send_all(goes_on ? SWEEP_BEAMS + 1 : SWEEP_BEAMS, side * 3);
            write_row();
            const double first_deg = -3.0 * 8 - HALF_DEG, own_deg = goes_on ? -3 * 8 - 1.5 : first_deg,
                         last_deg = 3.0 * 9 + HALF_DEG;
            CHECK_NEAR(left_deg(), side > 0 ? first_deg : -last_deg, 0, 1e-6);
            CHECK_NEAR(right_deg(), side > 0 ? last_deg : -first_deg, 0, 1e-6);
            CHECK(isfinite(ends_m(side * (own_deg + 0.1))) && isfinite(ends_m(side * (last_deg - 0.1))));
            CHECK_INT(isfinite(ends_m(side * (first_deg + 0.1))), !goes_on);
        }
    for (int side = -1; side <= 1; side += 2) { /* two; and one that is apart of the one before the row */
        begin();
        next.beam[0].ends_m = 10;
        send(side * 3);
        send(0);
        write_row();
        CHECK(isfinite(ends_m(side * (3 + HALF_DEG - 0.1))) && isfinite(ends_m(side * (0.1 - HALF_DEG))));
        begin();
        next.beam[0].ends_m = 10;
        send(side * 3);
        next_at.place_m[1] = side * 0.3;
        send_all(SWEEP_BEAMS, side * 3);
        write_row();
        CHECK(sweep.first == 1 && sweep.look[1].apart);
        CHECK(isfinite(ends_m(side * (-24 - HALF_DEG + 0.1))));
    }
    begin(); /* one alone */
    next.beam[0].ends_m = 10;
    send(3);
    write_row();
    CHECK_NEAR(left_deg(), -HALF_DEG, 0, 1e-6);
    CHECK_NEAR(right_deg(), HALF_DEG, 0, 1e-6);
    CHECK(isfinite(ends_m(-1.9)) && isfinite(ends_m(1.9)));
}

TEST(no_row_is_wider_than_80_degrees_to_a_side)
{
    begin();
    next.shape.half_az_rad = geo_rad(85);
    send(50);
    write_row();
    CHECK_NEAR(left_deg(), -80, 0, 1e-6);
    CHECK_NEAR(right_deg(), 80, 0, 1e-6);
    send(0);
    write_row();
    CHECK_INT(sweep.n, 2);
    CHECK_NEAR(left_deg(), -80, 0, 1e-6);
    CHECK_NEAR(right_deg(), 80, 0, 1e-6);
}

/* Seen from its middle beam nothing of the last one is left out: an echo there ends older water. */
TEST(no_beam_of_a_row_is_cut)
{
    static const struct {
        double half_deg, turn_deg;
        int beams;
    } row[] = {{19, 59, 2}, {25, 50, 2}, {31, 50, 1}, {35, 50, 1},
               {35, 40, 2}, {45, 29, 3}, {45, 36, 1}, {60, 40, 1}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        for (int side = -1; side <= 1; side += 2) {
            begin();
            next.shape.half_az_rad = geo_rad(row[i].half_deg);
            next.beam[0].ends_m = 5;
            for (int k = 0; k < 6; k++) {
                send(side * row[i].turn_deg);
                write_row();
                const double off_deg = geo_deg(atan2(geo_dot(sweep.look[sweep.n - 1].at.axis[0], record.axis[1]),
                                                     geo_dot(sweep.look[sweep.n - 1].at.axis[0], record.axis[0])));
                CHECK(left_deg() <= off_deg - row[i].half_deg + 1e-6 || side > 0);
                CHECK(right_deg() >= off_deg + row[i].half_deg - 1e-6 || side < 0);
                CHECK_NEAR(ends_m(off_deg + side * (row[i].half_deg - 0.1)), 5, 0, UNIT_M);
            }
            CHECK_INT(sweep.n - sweep.first, row[i].beams);
        }
}

/* Two are farther apart than their edges cross: nothing is said where they meet, and only there. */
TEST(nothing_is_said_between_beams_that_are_apart)
{
    for (int side = -1; side <= 1; side += 2)
        for (int gap = 1; gap < 4; gap++) {
            begin();
            for (int i = 0; i < 4; i++) {
                next_at.place_m[1] = i < gap ? 0 : side * 0.3;
                send(side * 3);
            }
            write_row();
            for (int i = 1; i < 4; i++) {
                CHECK_INT(sweep.look[i].apart, i == gap);
                CHECK((free_to_m(side * (3.0 * (i - 1) - 1.5)) <= 0) == (i == gap));
            }
        }
}

/* Both of them begin there, and no others. */
TEST(beams_begin_where_they_leave_no_gap_to_either_neighbour)
{
    for (int side = -1; side <= 1; side += 2)
        for (int gap = 1; gap < 4; gap++) {
            begin();
            for (int i = 0; i < 4; i++) {
                next_at.place_m[1] = i < gap ? 0 : side * 0.05;
                send(side * 3);
            }
            write_row();
            for (int i = 0; i < 4; i++) {
                const bool late = i == gap || i == gap - 1;
                const double from_m = free_from_m(side * 3.0 * (i - 1));
                CHECK_INT(sweep.look[i].apart, false);
                CHECK(late ? from_m > 2.5 && from_m < 3.1 : from_m < 0.6);
            }
        }
    for (int i = 0; i < SWEEP_BEAMS + 1; i++) { /* the one before the row is a neighbour, too */
        if (i == 0)
            begin();
        next_at.place_m[1] = i < 1 ? 0 : 0.05;
        send(3);
    }
    write_row();
    CHECK(free_from_m(-24) > 2.5 && free_from_m(-21) < 0.6);
}

/* Parts of beams that detect less off their axes are wider by that. */
TEST(a_row_tells_how_its_axes_diverge)
{
    double high[3];
    for (int kind = 0; kind < 3; kind++) {
        begin();
        next.beam[0].side_m = 8;
        next.beam[0].edge_m = 6;
        next.shape.half_az_rad = geo_rad(4);
        second((double[3]){0}, kind == 1 ? 0.005 : 0, kind == 2 ? 0.02 : 0, 1);
        write_row();
        high[kind] = record.image.tan_el[4];
    }
    CHECK(high[1] < high[0] - 1e-4 && high[2] < high[0] - 1e-4);
}

int main(void)
{
    RUN(a_beam_joins_the_one_before_if_the_head_goes_on);
    RUN(a_head_that_turns_back_begins_a_row);
    RUN(wide_beams_make_a_row_only_where_the_head_turns_fast);
    RUN(of_a_row_that_goes_on_the_oldest_beams_are_left_out);
    RUN(rows_are_kept_so_often_that_two_have_a_beam_in_common);
    RUN(two_deaf_beams_end_what_both_looked_at);
    RUN(beams_from_two_places_leave_a_gap_up_to_where_their_edges_cross);
    RUN(a_row_tells_up_to_where_a_post_may_stand_between_its_beams);
    RUN(beams_that_all_but_touch_leave_no_gap);
    RUN(beams_that_leave_a_gap_too_far_are_apart);
    RUN(a_row_is_of_the_time_of_all_its_beams);
    RUN(a_row_is_as_uncertain_as_its_beams_are_tilted);
    RUN(a_row_stands_where_its_axes_meet);
    RUN(a_row_tells_how_far_beside_it_its_beams_were_sent);
    RUN(ranges_of_all_parts_of_a_beam_count_from_the_rows_place);
    RUN(a_row_ends_water_between_the_edges_of_its_beams);
    RUN(no_row_is_wider_than_80_degrees_to_a_side);
    RUN(no_beam_of_a_row_is_cut);
    RUN(nothing_is_said_between_beams_that_are_apart);
    RUN(beams_begin_where_they_leave_no_gap_to_either_neighbour);
    RUN(a_row_tells_how_its_axes_diverge);
    return test_end();
}
