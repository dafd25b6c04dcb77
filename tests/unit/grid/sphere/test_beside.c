/* SPDX-License-Identifier: MIT */
/* test_beside - how far from the nearest axis a beam's row has its seams: of fans, and of heads that turn. */
#include "tests/lib/test.h"

#include "grid/sphere/beside.h"

#define SECOND   1000000000ull
#define WIDE_DEG 10.0

#define BEAMS 24

static struct beam_echoes echoes[BEAMS];
static struct echoes ping;
static struct beside_last last;

/* The row of a beam of the ping. */
static struct beam_row row_of(uint16_t index, bool keep)
{
    static const double turn[4] = {1, 0, 0, 0}, origin_m[3] = {0, 0, 0};
    const struct beam_opening opening = beam_opening(geo_rad(WIDE_DEG), geo_rad(20), geo_rad(2), false);
    struct beam b;
    beam_of(&b, &ping, index, &opening, turn, origin_m);
    const struct beam_row row = beside_row(&b, index, &last);
    if (keep)
        beside_keep(&last, &b);
    return row;
}

/* Of one whose beams are at these azimuths, all of them with free water. */
static struct beam_row row_at(const double az_deg[], uint16_t n, uint16_t index, bool keep)
{
    ping.n_beams = n;
    ping.beam = echoes;
    ping.az_aperture_rad = (float)geo_rad(WIDE_DEG);
    ping.el_aperture_rad = (float)geo_rad(20);
    for (uint16_t i = 0; i < n; i++)
        echoes[i] = (struct beam_echoes){
            .az_rad = (float)geo_wrap(geo_rad(az_deg[i])), .blind_m = 0.3f, .free_to_m = 10, .state = BEAM_SILENT};
    return row_of(index, keep);
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

/* In which order the list has its beams: the nearer of two on one side counts, heard or not. */
TEST(the_nearest_beam_on_a_side_is_the_one_beside)
{
    static const double az_deg[] = {0, 8, 3, -4, -1};
    static const uint16_t order[][3] = {{0, 1, 2}, {1, 0, 2}, {2, 0, 1}, {0, 3, 4}, {4, 0, 3}};
    for (size_t k = 0; k < sizeof order / sizeof *order; k++) {
        double listed_deg[3];
        for (int i = 0; i < 3; i++)
            listed_deg[i] = az_deg[order[k][i]];
        const uint16_t middle = listed_deg[0] == 0 ? 0 : 1;
        const bool left = k > 2;
        struct beam_row row = row_at(listed_deg, 3, middle, false);
        CHECK_NEAR(geo_deg((double)(left ? row.left_rad : row.right_rad)), left ? 0.5 : 1.5, 0, 1e-4);
        CHECK((left ? row.right_rad : row.left_rad) == 0);
        for (int i = 0; i < 3; i++)
            if (listed_deg[i] == 3 || listed_deg[i] == -1)
                beam_frees_nothing(&echoes[i]);
        row = row_of(middle, false);
        CHECK(row.left_rad == 0 && row.right_rad == 0);
    }
}

/* A ring of beams has no ends, and no row reaches into another one. */
TEST(rows_go_round_and_keep_their_height)
{
    double az_deg[BEAMS];
    for (int i = 0; i < BEAMS; i++)
        az_deg[i] = i % 12 * 30 - 180;
    row_at(az_deg, BEAMS, 0, false);
    for (int i = 0; i < BEAMS; i++)
        echoes[i].el_rad = i < 12 ? 0 : 0.2f;
    beam_frees_nothing(&echoes[14]);
    for (uint16_t i = 0; i < BEAMS; i++) {
        const struct beam_row row = row_of(i, false);
        CHECK_NEAR(geo_deg((double)row.left_rad), i == 15 ? 0 : 15, 0, 1e-4);
        CHECK_NEAR(geo_deg((double)row.right_rad), i == 13 ? 0 : 15, 0, 1e-4);
    }
    for (int i = 0; i < 12; i++) /* one beam above the other, turned by 1 degree */
        echoes[i] = (struct beam_echoes){.az_rad = (float)geo_rad(i), .el_rad = 0.1f * (float)i, .free_to_m = 10};
    ping.n_beams = 12;
    for (uint16_t i = 0; i < 12; i++)
        CHECK(row_of(i, false).seam_rad == 0);
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
    RUN(the_nearest_beam_on_a_side_is_the_one_beside);
    RUN(rows_go_round_and_keep_their_height);
    RUN(a_heads_seam_is_halfway_to_its_last_beam);
    return test_end();
}
