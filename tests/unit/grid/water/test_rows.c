/* SPDX-License-Identifier: MIT */
/*
 * test_rows - rows of a head, fans and matrices: what they have free some beam passed, wherever that was sent from, and
 * on the axis of a beam the water is as it says.
 */
#include "tests/lib/random.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/store.h"

#define PINGS 40
#define BEAMS 100 /* of one ping, at most */

static uint64_t seed;
static struct store *store;
static struct pose pose;
static struct beam_echoes beam, beams[BEAMS];
static struct echoes ping;

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

/* As it was sent: the sensor and its axes, turned to the beam. */
static struct sent {
    double at_m[3], axis[3][3];
    struct beam_echoes beam;
    uint64_t t_ns;
} sent[BEAMS];
static int n_sent;

static void begin(uint16_t n)
{
    static const struct store_conf conf = {.beams = {BEAMS}, .spare = 1};
    static void *memory;
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping = (struct echoes){
        .n_beams = n, .t_ns = UINT64_C(1000000000), .range_max_m = 20, .beam = n == 1 ? &beam : beams};
}

/* What a beam detects off its axis may be less. */
static struct beam_echoes draw_beam(double az_rad, double el_rad, bool nested, double echoes)
{
    const double free_m = between(0, 1) < 0.1 ? 0 : between(3, 9);
    struct beam_echoes b = {.az_rad = (float)geo_wrap(az_rad),
                            .el_rad = (float)el_rad,
                            .n = between(0, 1) < echoes,
                            .blind_m = (float)between(0.1, 0.6),
                            .free_to_m = (float)free_m};
    if (nested) {
        b.off_axis = true;
        b.side_to_m = (float)(free_m * between(0.6, 1));
        b.edge_from_m = (float)between(0.1, 1);
        b.edge_to_m = (float)((double)b.side_to_m * between(0.5, 1));
    }
    return b;
}

static void note(struct sent *s, const struct beam_echoes *b, const struct water_record *at)
{
    s->beam = *b;
    s->t_ns = at->t_ns;
    memcpy(s->at_m, at->place_m, sizeof s->at_m);
    const double c = cos((double)b->az_rad), d = sin((double)b->az_rad);
    for (int k = 0; k < 3; k++) {
        s->axis[0][k] = c * at->axis[0][k] + d * at->axis[1][k];
        s->axis[1][k] = c * at->axis[1][k] - d * at->axis[0][k];
        s->axis[2][k] = at->axis[2][k];
    }
}

/* A fan or a matrix, with beams that overlap, that touch or that leave gaps. */
static void draw_ping(bool matrix, bool nested)
{
    const bool many = !matrix && between(0, 1) < 0.2; /* for columns of their own */
    const int columns = matrix ? 5
                        : many ? 88 + (int)between(0, 10)
                               : 3 + (int)between(0, 20),
              rows = matrix ? 4 : 1;
    const double wide_deg = many ? between(1, 2) : between(1, 5), high_deg = between(4, 14),
                 step_deg = fmin(wide_deg * between(0.4, 1.3), many ? 1.6 : 7),
                 row_deg = high_deg * between(0.4, 1.3), look_el = matrix ? 0 : geo_rad(between(-20, 20));
    const double echoes = floor(between(0, 3)) / 2; /* in none of them, some or all */
    begin((uint16_t)(columns * rows));
    ping.az_aperture_rad = (float)geo_rad(wide_deg);
    ping.el_aperture_rad = (float)geo_rad(high_deg);
    quat_from_rpy(between(-0.3, 0.3), between(-0.3, 0.3), between(0, 6), pose.attitude);
    ping.pose = pose;
    ping.seq = 1;
    struct water_record at;
    beams_begin(&at, &ping, &mount_identity);
    for (n_sent = 0; n_sent < columns * rows; n_sent++) {
        const double az_deg = (n_sent % columns - columns / 2.0) * step_deg,
                     el_deg = (n_sent / columns - rows / 2.0) * row_deg;
        beams[n_sent] = draw_beam(geo_rad(az_deg), matrix ? geo_rad(el_deg) : look_el, nested, echoes);
        note(&sent[n_sent], &beams[n_sent], &at);
    }
    store_enter(store, &ping, &mount_identity);
}

/* A head on a vehicle that goes and rolls. */
static void sail(bool nested)
{
    const double step_deg = between(0.8, 4), kind = between(0, 3),
                 wide_deg = fmin(step_deg * (kind < 1   ? between(1, 1.2)
                                             : kind < 2 ? between(0.9, 3)
                                                        : between(4, 9)),
                                 9.9),
                 sense = between(0, 1) < 0.5 ? -1 : 1;
    const double first_deg = between(0, 360), look_el = between(0, 1) < 0.7 ? 0 : between(-0.4, 0.4);
    const bool goes = between(0, 1) < 0.8, rolls = between(0, 1) < 0.5;
    double rpy[3] = {0, 0, between(0, GEO_TURN)};
    const double way_m[3] = {between(-0.03, 0.03), between(-0.03, 0.03), between(-0.01, 0.01)};
    const struct mount mount = {.attitude = {1, 0, 0, 0},
                                .position_m = {between(-0.3, 0.3), between(-0.3, 0.3), between(-0.2, 0.2)}};
    int steps = 0;
    begin(1);
    ping.az_aperture_rad = (float)geo_rad(wide_deg);
    ping.el_aperture_rad = (float)geo_rad(between(10, 40));
    for (n_sent = 0; n_sent < PINGS; n_sent++) {
        const int turns = between(0, 1) < 0.05 ? 1 + (int)between(1, 4) : 1; /* some pings are lost */
        steps += turns;
        beam = draw_beam(geo_rad(first_deg + sense * step_deg * steps), look_el, nested, 0.5);
        for (int k = 0; k < 3; k++) {
            pose.position_m[k] += goes ? way_m[k] : 0;
            rpy[k] += rolls ? between(-1, 1) * geo_rad(0.3) : 0;
        }
        quat_from_rpy(rpy[0], rpy[1], rpy[2], pose.attitude);
        ping.pose = pose;
        ping.seq += (uint32_t)turns;
        ping.t_ns += UINT64_C(100000000);
        store_enter(store, &ping, &mount);
        struct water_record at;
        beams_begin(&at, &ping, &mount);
        note(&sent[n_sent], &beam, &at);
    }
}

/* Where a beam has a point: shares of its half opening, aside and up, and the range. */
struct seen {
    double aside, up, range_m;
};

static struct seen seen_by(const struct sent *s, const double p[3])
{
    double to[3];
    for (int k = 0; k < 3; k++)
        to[k] = p[k] - s->at_m[k];
    const double ahead = geo_dot(to, s->axis[0]), right = geo_dot(to, s->axis[1]), down = geo_dot(to, s->axis[2]);
    return (struct seen){atan2(right, ahead) / ((double)ping.az_aperture_rad / 2),
                         (atan2(-down, hypot(ahead, right)) - (double)s->beam.el_rad) /
                             ((double)ping.el_aperture_rad / 2),
                         geo_length(to)};
}

/* Did that beam pass the place without an echo, as it detects there? Beams that all but touch do. */
static bool passed(const struct sent *s, const double p[3], double seam)
{
    const struct seen at = seen_by(s, p);
    const double slack = 1 + ROW_TOUCH_RAD / (double)ping.az_aperture_rad, share = hypot(at.aside, at.up) / seam;
    const struct beam_echoes *b = &s->beam;
    double from_m = (double)b->blind_m, to_m = (double)b->free_to_m;
    if (fabs(at.aside) > slack || fabs(at.up) > slack)
        return false;
    if (b->off_axis && share > BEAM_AXIS_SHARE)
        to_m = (double)b->side_to_m;
    if (b->off_axis && share > BEAM_SIDE_SHARE) {
        to_m = (double)b->edge_to_m;
        from_m = fmax(from_m, (double)b->edge_from_m);
    }
    return at.range_m >= from_m - 1e-3 && at.range_m <= to_m + 1e-3;
}

static bool somebody_passed(const double p[3], double seam)
{
    for (int i = 0; i < n_sent; i++)
        if (passed(&sent[i], p, seam))
            return true;
    return false;
}

static int look(struct water_view view[ASK_RECORDS])
{
    const struct store_now now = {.now_ns = ping.t_ns, .pose = &pose, .clear_for_s = 100, .move_limit_m = 100};
    return store_view(store, &now, view);
}

/* Along a line near the axis of some beam, by one record. */
static void decide(const struct water_view *view, struct water_tile *tile, struct water_pieces *out)
{
    const struct sent *s = &sent[(int)between(0, n_sent - 0.01)];
    const double az = between(-1, 1) * geo_rad(3),
                 el = (double)s->beam.el_rad + between(-0.6, 0.6) * (double)ping.el_aperture_rad;
    *tile = (struct water_tile){.half_rad = 0};
    for (int j = 0; j < 3; j++)
        tile->v[j] = cos(el) * (cos(az) * s->axis[0][j] + sin(az) * s->axis[1][j]) - sin(el) * s->axis[2][j];
    water_decide(view, tile, 0.2, 9, out);
}

/* Points of what is free that no beam passed. */
static int wrong_points(const struct water_view *view, double seam, int *points)
{
    struct water_tile tile;
    struct water_pieces out;
    int wrong = 0;
    decide(view, &tile, &out);
    for (int m = 0; m < out.n; m++)
        for (int r = 0; r < 4 && out.piece[m].says == WATER_FREE; r++) {
            const double share = r < 2 ? between(0, 0.05) : between(0, 1);
            const double t_m = out.piece[m].from_m + share * (out.piece[m].to_m - out.piece[m].from_m);
            double p[3];
            for (int j = 0; j < 3; j++)
                p[j] = pose.position_m[j] + t_m * tile.v[j];
            ++*points;
            wrong += !somebody_passed(p, seam);
        }
    return wrong;
}

TEST(what_a_row_has_free_some_beam_passed)
{
    static struct water_view view[ASK_RECORDS];
    int points = 0, wrong = 0;
    seed = test_seed();
    for (int world = 0; world < 150; world++) {
        sail(world % 3 == 0);
        const int n = look(view);
        for (int i = 0; i < n; i++)
            for (int k = 0; k < 12; k++)
                wrong += wrong_points(&view[i], 1 + 1e-3, &points);
    }
    CHECK_INT(wrong, 0);
    CHECK(points > 5000);
}

/* As the vehicle sees the place now, in each row that has the beam. */
TEST(behind_the_echo_of_a_beam_its_row_ends)
{
    static struct water_view view[ASK_RECORDS];
    int echoes = 0, late = 0;
    seed = test_seed();
    for (int world = 0; world < 60; world++) {
        sail(world % 3 == 0);
        const int n = look(view);
        for (int i = 0; i < n; i++)
            for (int k = 0; k < n_sent; k++) {
                const struct sent *s = &sent[k];
                const double el = (double)s->beam.el_rad, to_m = (double)s->beam.free_to_m;
                if (!s->beam.n || to_m <= 0 || s->t_ns < view[i].record->t_ns ||
                    s->t_ns > view[i].record->newest_ns)
                    continue;
                struct water_tile tile = {.half_rad = 0};
                struct water_pieces out;
                for (int j = 0; j < 3; j++)
                    tile.v[j] = s->at_m[j] - pose.position_m[j] +
                                (to_m + 0.02) * (cos(el) * s->axis[0][j] - sin(el) * s->axis[2][j]);
                const double there_m = geo_length(tile.v);
                for (int j = 0; j < 3; j++)
                    tile.v[j] /= there_m;
                water_decide(&view[i], &tile, 0.2, there_m + 0.5, &out);
                const struct water_piece *last = &out.piece[out.n - 1];
                echoes++;
                late += last->says != WATER_ENDED || last->from_m > there_m;
            }
    }
    CHECK_INT(late, 0);
    CHECK(echoes > 1000);
}

TEST(what_one_ping_has_free_its_beams_detect)
{
    static struct water_view view[ASK_RECORDS];
    int points = 0, wrong = 0;
    seed = test_seed();
    for (int world = 0; world < 400; world++) {
        draw_ping(world % 2, world % 4 < 2);
        bool echoes = false;
        for (int i = 0; i < n_sent; i++)
            echoes = echoes || beams[i].n > 0;
        CHECK_INT(look(view), 1);
        CHECK(view[0].record->echoes == echoes);
        for (int k = 0; k < 40; k++)
            wrong += wrong_points(&view[0], 1 + 1e-3, &points);
    }
    CHECK_INT(wrong, 0);
    CHECK(points > 5000);
}

/* The nearest echo of its ping, if it does not reach that far, in whose beam's opening some of its own part may be:
 * that of a beam less than two openings away. */
static double nearest_echo_m(int which)
{
    const struct beam_echoes *own = &sent[which].beam;
    double least_m = own->n ? (double)own->free_to_m : INFINITY;
    for (int i = 0; i < n_sent; i++) {
        const struct beam_echoes *b = &sent[i].beam;
        const double az = fabs(geo_wrap_pi((double)b->az_rad - (double)own->az_rad)),
                     el = fabs((double)b->el_rad - (double)own->el_rad);
        if (b->n && b->free_to_m >= own->free_to_m && az < 2 * (double)ping.az_aperture_rad &&
            el < 2 * (double)ping.el_aperture_rad)
            least_m = fmin(least_m, (double)b->free_to_m);
    }
    return least_m;
}

/* On its axis, whatever it detects off it and its neighbours do. */
TEST(on_a_beams_axis_water_is_as_the_beam_says)
{
    static struct water_view view[ASK_RECORDS];
    seed = test_seed();
    for (int world = 0; world < 100; world++) {
        draw_ping(world % 2, world % 4 == 0); /* parts of many beams are as small as there is room for */
        look(view);
        for (int i = 0; i < n_sent && n_sent < 80; i++) {
            const struct beam_echoes *b = &sent[i].beam;
            const double el = (double)b->el_rad, start_m = 0.09;
            struct water_tile tile = {.half_rad = 0};
            struct water_pieces out;
            double free_m = 0, free_from_m = INFINITY, ends_m = INFINITY;
            for (int j = 0; j < 3; j++)
                tile.v[j] = cos(el) * sent[i].axis[0][j] - sin(el) * sent[i].axis[2][j];
            water_decide(&view[0], &tile, start_m, 9.5, &out);
            for (int m = 0; m < out.n; m++) {
                free_m += out.piece[m].says == WATER_FREE ? out.piece[m].to_m - out.piece[m].from_m : 0;
                free_from_m = fmin(free_from_m, out.piece[m].says == WATER_FREE ? out.piece[m].from_m : INFINITY);
                ends_m = out.piece[m].says == WATER_ENDED ? out.piece[m].from_m : ends_m;
            }
            const double to_m = (double)b->free_to_m, want_m = to_m > 0 ? to_m - (double)b->blind_m : 0;
            CHECK(free_m <= want_m + 1e-6 && free_m > want_m - 0.1);
            CHECK(to_m <= 0 ||
                  (free_from_m >= (double)b->blind_m - 1e-6 && free_from_m < (double)b->blind_m + 0.03));
            CHECK(!b->n || ends_m <= fmax(to_m, start_m) + 1e-6);
            CHECK(ends_m >= nearest_echo_m(i) - 0.03);
        }
    }
}

/* Beams anyhow apart, sent from places so far aside of each other's. */
static size_t draw_row(struct row_shape *shape, struct row_beam *row, double aside_m[], double tilt_rad[])
{
    const size_t n = 2 + (size_t)between(0, 6);
    *shape = (struct row_shape){
        .half_az_rad = geo_rad(between(0.5, 6)), .el_rad = between(-1, 1), .half_el_rad = geo_rad(between(3, 20))};
    for (size_t i = 0; i < n; i++) {
        const double step = between(0, 1) < 0.2 ? 2.5 : between(0.2, 2);
        row[i] = (struct row_beam){.az_rad = i ? row[i - 1].az_rad + step * shape->half_az_rad : -0.2,
                                   .axis_m = 9,
                                   .side_m = between(0.5, 9),
                                   .near_m = between(0.1, 0.5),
                                   .ends_m = INFINITY};
        row[i].edge_m = row[i].side_m * between(0, 1);
        row[i].edge_near_m = row[i].near_m + between(0, 1);
        aside_m[i] = i ? between(0, 0.1) : 0; /* it and the one before */
        tilt_rad[i] = i ? between(0, 0.01) : 0;
    }
    for (size_t i = 0; i < n; i++) {
        row[i].aside_m = fmax(aside_m[i], i + 1 < n ? aside_m[i + 1] : 0);
        row[i].tilt_rad = fmax(tilt_rad[i], i + 1 < n ? tilt_rad[i + 1] : 0);
    }
    shape->from_rad = shape->outer_rad[0] = row[0].az_rad - shape->half_az_rad;
    shape->to_rad = shape->outer_rad[1] = row[n - 1].az_rad + shape->half_az_rad;
    return n;
}

static bool detects(const struct row_beam *b, double share, double range_m)
{
    const double to_m = share <= BEAM_AXIS_SHARE ? b->axis_m : share <= BEAM_SIDE_SHARE ? b->side_m : b->edge_m;
    return range_m <= to_m && range_m >= (share <= BEAM_SIDE_SHARE ? b->near_m : b->edge_near_m);
}

/* The seam of two is what their own axes make it, whatever the others of the row do. */
TEST(at_a_seam_a_row_frees_what_its_beams_detect_there)
{
    static struct row_room room;
    struct water_record record;
    int points = 0, wrong = 0;
    seed = test_seed();
    for (int world = 0; world < 2000; world++) {
        struct row_shape shape;
        struct row_beam row[8];
        double aside_m[8], tilt_rad[8];
        const size_t n = draw_row(&shape, row, aside_m, tilt_rad);
        row_write(&record, &room, &shape, row, n);
        for (int k = 0; k < 100; k++) {
            const size_t i = 1 + (size_t)between(0, (double)n - 1.01);
            const double step_rad = row[i].az_rad - row[i - 1].az_rad, seam_rad = row[i].az_rad - step_rad / 2;
            const double up = between(-0.8, 0.8), el_rad = shape.el_rad + up * shape.half_el_rad,
                         range_m = between(0.1, 9);
            const double off_rad = step_rad / 2 + aside_m[i] / 2 / (range_m * cos(el_rad)) +
                                   tilt_rad[i] / 2 * tan(fabs(el_rad)),
                         share = hypot(off_rad / shape.half_az_rad, up) - 1e-3;
            const struct water_image *image = &record.image;
            const int y = water_image_find(image->tan_el, image->rows, tan(el_rad));
            for (int side = 0; side < 2 && step_rad <= 2 * shape.half_az_rad; side++) {
                const double az_rad = seam_rad + (side ? 1e-9 : -1e-9);
                const int x = water_image_find(image->tan_az, image->columns, tan(az_rad));
                const struct water_cell *cell = &image->cell[y * image->columns + x];
                if (range_m < cell->from * WATER_UNIT_M || range_m > cell->least * WATER_UNIT_M)
                    continue;
                points++;
                wrong += !detects(&row[i - 1 + (size_t)side], share, range_m);
            }
        }
    }
    CHECK_INT(wrong, 0);
    CHECK(points > 20000);
}

int main(void)
{
    RUN(what_a_row_has_free_some_beam_passed);
    RUN(at_a_seam_a_row_frees_what_its_beams_detect_there);
    RUN(behind_the_echo_of_a_beam_its_row_ends);
    RUN(what_one_ping_has_free_its_beams_detect);
    RUN(on_a_beams_axis_water_is_as_the_beam_says);
    return test_end();
}
