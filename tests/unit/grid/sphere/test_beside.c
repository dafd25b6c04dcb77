/* SPDX-License-Identifier: MIT */
/* test_beside - how far from the nearest axis a beam's row has its seams: of fans, and of heads that turn. */
#include "tests/lib/test.h"

#include "grid/sphere/beside.h"

#define SECOND   1000000000ull
#define WIDE_DEG 10.0

static struct beam_echoes echoes[3];
static struct echoes ping;
static struct beside_last last;

/* The row of a beam of a ping whose beams are at these azimuths, all of them with free water. */
static struct beam_row row_at(const double az_deg[], uint16_t n, uint16_t index, bool keep)
{
    static const double turn[4] = {1, 0, 0, 0}, origin_m[3] = {0, 0, 0};
    const struct beam_opening opening = beam_opening(geo_rad(WIDE_DEG), geo_rad(20), geo_rad(2), false);
    struct beam b;
    ping.n_beams = n;
    ping.beam = echoes;
    ping.az_aperture_rad = (float)geo_rad(WIDE_DEG);
    ping.el_aperture_rad = (float)geo_rad(20);
    for (uint16_t i = 0; i < n; i++)
        echoes[i] = (struct beam_echoes){
            .az_rad = (float)geo_wrap(geo_rad(az_deg[i])), .blind_m = 0.3f, .free_to_m = 10, .state = BEAM_SILENT};
    beam_of(&b, &ping, index, &opening, turn, origin_m);
    const struct beam_row row = beside_row(&b, index, &last);
    if (keep)
        beside_keep(&last, &b);
    return row;
}

static double seam_deg(const struct beam_row *row)
{
    return geo_deg((double)row->seam_rad);
}

TEST(a_fans_seam_is_halfway_to_the_farther_of_the_beams_beside)
{
    static const double az_deg[] = {-3, 0, 8}, north_deg[] = {357, 2, 5};
    static const double want_deg[] = {1.5, 4, 4};
    last = (struct beside_last){0};
    for (uint16_t i = 0; i < 3; i++) {
        const struct beam_row row = row_at(az_deg, 3, i, false);
        CHECK_NEAR(seam_deg(&row), want_deg[i], 0, 1e-4);
        CHECK_NEAR(geo_deg((double)row.half_az_rad), WIDE_DEG / 2, 0, 1e-4);
        CHECK_NEAR(geo_deg((double)row.half_el_rad), 10, 0, 1e-4);
        CHECK(!row.several);
    }
    const struct beam_row row = row_at(north_deg, 3, 1, false);
    CHECK_NEAR(seam_deg(&row), 2.5, 0, 1e-4);
}

/* One step after the other; the first one, and one that comes late or from before, has nobody beside it. */
TEST(a_heads_seam_is_halfway_to_its_last_beam)
{
    static const struct {
        double az_deg, after_s, seam_deg;
    } row[] = {
        {10, 0, 0},        {14, 0.1, 2},     {17, 0.1, 1.5},
        {17, 0.1, 1.5},                      /* it does not turn: as its last step was */
        {17.09, 0.1, 1.5}, {11, 1.9, 3.045}, /* the other way */
        {14, 2.1, 0},      {18, 0.1, 2},     {20, -0.05, 0},
    };
    last = (struct beside_last){0};
    ping.t_ns = 100 * SECOND;
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        ping.t_ns += (uint64_t)(int64_t)(row[i].after_s * 1e9);
        const struct beam_row r = row_at(&row[i].az_deg, 1, 0, true);
        if (!(fabs(seam_deg(&r) - row[i].seam_deg) < 1e-3))
            printf("beam %zu: %g deg, want %g deg\n", i, seam_deg(&r), row[i].seam_deg);
        CHECK_NEAR(seam_deg(&r), row[i].seam_deg, 0, 1e-3);
    }
}

int main(void)
{
    RUN(a_fans_seam_is_halfway_to_the_farther_of_the_beams_beside);
    RUN(a_heads_seam_is_halfway_to_its_last_beam);
    return test_end();
}
