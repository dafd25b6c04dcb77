/* SPDX-License-Identifier: MIT */
/* test_rows - rows of a head's beams, sent from different places and attitudes: what is free some beam passed. */
#include "tests/lib/random.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/store.h"

#define PINGS 40

static uint64_t seed;
static struct store *store;
static struct pose pose;
static struct beam_echoes beam;
static struct echoes ping;

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

/* As it was sent: the sensor and its axes, turned to the beam. */
static struct sent {
    double at_m[3], axis[3][3];
    struct beam_echoes beam;
} sent[PINGS];
static int n_sent;

/* A head on a vehicle that goes and rolls; what its beams detect off their axes may be less. */
static void sail(bool nested)
{
    static const struct store_conf conf = {.beams = {1}, .spare = 1};
    static void *memory;
    const double step_deg = between(0.8, 4), wide_deg = step_deg * between(0.9, 3),
                 sense = between(0, 1) < 0.5 ? -1 : 1;
    const double first_deg = between(0, 360), look_el = between(0, 1) < 0.7 ? 0 : between(-0.4, 0.4);
    const bool goes = between(0, 1) < 0.8, rolls = between(0, 1) < 0.5;
    double rpy[3] = {0, 0, between(0, GEO_TURN)};
    const double way_m[3] = {between(-0.03, 0.03), between(-0.03, 0.03), between(-0.01, 0.01)};
    const struct mount mount = {.attitude = {1, 0, 0, 0},
                                .position_m = {between(-0.3, 0.3), between(-0.3, 0.3), between(-0.2, 0.2)}};
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping = (struct echoes){.n_beams = 1,
                           .t_ns = UINT64_C(1000000000),
                           .range_max_m = 20,
                           .az_aperture_rad = (float)geo_rad(wide_deg),
                           .el_aperture_rad = (float)geo_rad(between(10, 40)),
                           .beam = &beam};
    for (n_sent = 0; n_sent < PINGS; n_sent++) {
        const double free_m = between(0, 1) < 0.1 ? 0 : between(3, 9);
        beam = (struct beam_echoes){.az_rad = (float)geo_wrap(geo_rad(first_deg + sense * step_deg * n_sent)),
                                    .el_rad = (float)look_el,
                                    .n = between(0, 1) < 0.5,
                                    .blind_m = (float)between(0.1, 0.6),
                                    .free_to_m = (float)free_m};
        if (nested) {
            beam.off_axis = true;
            beam.side_to_m = (float)(free_m * between(0.6, 1));
            beam.edge_from_m = (float)between(0.1, 1);
            beam.edge_to_m = (float)((double)beam.side_to_m * between(0.5, 1));
        }
        for (int k = 0; k < 3; k++) {
            pose.position_m[k] += goes ? way_m[k] : 0;
            rpy[k] += rolls ? between(-1, 1) * geo_rad(0.3) : 0;
        }
        quat_from_rpy(rpy[0], rpy[1], rpy[2], pose.attitude);
        ping.pose = pose;
        ping.seq += between(0, 1) < 0.05 ? 2 : 1;
        ping.t_ns += UINT64_C(100000000);
        store_enter(store, &ping, &mount);
        struct water_record at;
        beams_begin(&at, &ping, &mount);
        struct sent *s = &sent[n_sent];
        s->beam = beam;
        memcpy(s->at_m, at.place_m, sizeof s->at_m);
        const double c = cos((double)beam.az_rad), d = sin((double)beam.az_rad);
        for (int k = 0; k < 3; k++) {
            s->axis[0][k] = c * at.axis[0][k] + d * at.axis[1][k];
            s->axis[1][k] = c * at.axis[1][k] - d * at.axis[0][k];
            s->axis[2][k] = at.axis[2][k];
        }
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

#define SEAM                                                                                                      \
    1.15 /* parts off the axis meet as they are seen from the row's place: nearer, they are that much wider */

/* Did that beam pass the place without an echo, as it detects there? Beams that all but touch do. */
static bool passed(const struct sent *s, const double p[3])
{
    const struct seen at = seen_by(s, p);
    const double slack = 1 + ROW_TOUCH_RAD / (double)ping.az_aperture_rad, share = hypot(at.aside, at.up) / SEAM;
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

static bool somebody_passed(const double p[3])
{
    for (int i = 0; i < n_sent; i++)
        if (passed(&sent[i], p))
            return true;
    return false;
}

static int look(struct water_view view[ASK_RECORDS])
{
    const struct store_now now = {.now_ns = ping.t_ns, .pose = &pose, .clear_for_s = 100, .move_limit_m = 100};
    return store_view(store, &now, view);
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
            for (int k = 0; k < 12; k++) {
                const struct sent *s = &sent[(int)between(0, n_sent - 0.01)];
                const double az = between(-1, 1) * geo_rad(3),
                             el = (double)s->beam.el_rad + between(-0.5, 0.5) * (double)ping.el_aperture_rad;
                struct water_tile tile = {.half_rad = 0};
                struct water_pieces out;
                for (int j = 0; j < 3; j++)
                    tile.v[j] =
                        cos(el) * (cos(az) * s->axis[0][j] + sin(az) * s->axis[1][j]) - sin(el) * s->axis[2][j];
                water_decide(&view[i], &tile, 0.2, 9, &out);
                for (int m = 0; m < out.n; m++)
                    for (int r = 0; r < 4 && out.piece[m].says == WATER_FREE; r++) {
                        const double t_m = between(out.piece[m].from_m, out.piece[m].to_m);
                        double p[3];
                        for (int j = 0; j < 3; j++)
                            p[j] = pose.position_m[j] + t_m * tile.v[j];
                        points++;
                        wrong += !somebody_passed(p);
                    }
            }
    }
    printf("# %d points\n", points);
    CHECK_INT(wrong, 0);
    CHECK(points > 5000);
}

int main(void)
{
    RUN(what_a_row_has_free_some_beam_passed);
    return test_end();
}
