/* SPDX-License-Identifier: MIT */
/*
 * test_extract_real - the extractor with its default configuration on recordings of real sonars. The box ships with
 * the tests; the other recordings may not be redistributed and are looked for in ../shared/data.
 * docs/extract.md quotes the lines that this program prints with a leading #.
 */
#include "tests/lib/shots.h"

#include "grid/range/marks.h"

static double first_m(const struct shot *shot)
{
    return shot->found.state == BEAM_ECHO ? (double)shot->found.echo[0].range_m : INFINITY;
}

/* ---- the box: three walls known to a centimetre ---- */

static const struct wall box[] = {{"side A", 0.261, 94.8}, {"side B", 0.294, 273.9}, {"end", 1.460, 184.7}};

/* Index of the nearest wall along a bearing. */
static int box_wall(double bearing_deg, double *range_m)
{
    int nearest = 0;
    *range_m = INFINITY;
    for (int w = 0; w < 3; w++) {
        const double c = cos(geo_rad(bearing_deg - box[w].normal_deg));
        if (c > 0.0 && box[w].distance_m / c < *range_m) {
            *range_m = box[w].distance_m / c;
            nearest = w;
        }
    }
    return nearest;
}

struct box_score {
    int beams[3], found[3]; /* per wall; found: within 3 cm (end) or 5 cm (sides) */
    int open_water;         /* first echoes that lie wholly short of every wall, by more than 20 cm */
    int beyond;             /* beams that call water behind a wall free, by more than 2 cm */
    int end_176_194, end_176_194_found;
    double end_square_sum;
    double blind_min_m;
    int blind_far; /* beams that are blind beyond 0.31 m: what is as loud as their echo drowns there */
};

static struct box_score box_run(const struct head *head)
{
    struct box_score score = {.blind_min_m = INFINITY};
    struct shot shot;
    FILE *file = fopen("tests/replay/box.csv", "r");
    if (!file) {
        printf("tests/replay/box.csv: missing\n");
        exit(1);
    }
    while (shot_read(file, &shot)) {
        run_shot(&shot, head);
        double range_m;
        const int w = box_wall(shot.bearing_deg, &range_m);
        const double error = first_m(&shot) - range_m;
        const bool found = fabs(error) <= (w == 2 ? 0.03 : 0.05);
        score.beams[w]++;
        score.found[w] += found;
        if (w == 2 && shot.bearing_deg >= 176.0 && shot.bearing_deg <= 194.0) {
            score.end_176_194++;
            score.end_176_194_found += found;
            score.end_square_sum += found ? error * error : 0.0;
        }
        score.blind_min_m = fmin(score.blind_min_m, (double)shot.found.blind_m);
        score.blind_far += (double)shot.found.blind_m > 0.31;
        score.open_water += error < -0.2;
        score.beyond += (double)shot.found.free_to_m > range_m + 0.02;
        if (getenv("SONARD_VERBOSE"))
            printf("# %.1f wall %s %.3f: blind %.3f found %.3f near %.3f sd %.3f strength %.1f\n",
                   shot.bearing_deg, box[w].name, range_m, (double)shot.found.blind_m, first_m(&shot),
                   (double)shot.found.echo[0].near_m, (double)shot.found.echo[0].sd_m,
                   (double)shot.found.echo[0].strength);
    }
    fclose(file);
    return score;
}

static double side_share(const struct box_score *s)
{
    return (double)(s->found[0] + s->found[1]) / (s->beams[0] + s->beams[1]);
}

static void box_print(const char *what, const struct box_score *s)
{
    printf("# box, %-24s end %d/%d  side A %d/%d  side B %d/%d (%.0f %%)  open water %d  free behind a wall %d\n",
           what, s->end_176_194_found, s->end_176_194, s->found[0], s->beams[0], s->found[1], s->beams[1],
           100.0 * side_share(s), s->open_water, s->beyond);
}

TEST(box_with_defaults)
{
    struct extract_conf conf;
    extract_defaults(&conf);
    set_up(&conf);
    const struct box_score s = box_run(&ping360);
    box_print("defaults", &s);
    CHECK_INT(s.end_176_194, 20);
    CHECK_INT(s.end_176_194_found, 20);
    CHECK(side_share(&s) >= 0.8);
    CHECK_INT(s.open_water, 0);
    CHECK_INT(s.beyond, 0);
    CHECK(sqrt(s.end_square_sum / 20) < 0.015);
    conf.bottom_db = -1; /* what follows the ring-down is as loud as a soft bottom */
    set_up(&conf);
    const struct box_score ring = box_run(&ping360);
    printf("# box: rings to %.3f m at least, beyond 0.31 m in %d beams (blind in %d); rms error at the end wall "
           "%.4f m\n",
           ring.blind_min_m, ring.blind_far, s.blind_far, sqrt(s.end_square_sum / 20));
    CHECK(ring.blind_min_m > 0.15 && ring.blind_far <= 1);
}

/* The defaults do not sit on an edge: each number may be moved and the box still stands. */
TEST(box_with_neighbouring_settings)
{
    static const struct {
        const char *name;
        double window_m, guard_m, false_alarm, min_contrast_db, ring_down_m;
        uint32_t floor_counts;
    } row[] = {
        {"window 0.3 m", 0.3, 0.1, 1e-3, 14, -1, 8},
        {"window 0.5 m", 0.5, 0.1, 1e-3, 14, -1, 8},
        {"guard 0.08 m", 0.4, 0.08, 1e-3, 14, -1, 8},
        {"guard 0.12 m", 0.4, 0.12, 1e-3, 14, -1, 8},
        {"false_alarm 1e-2", 0.4, 0.1, 1e-2, 14, -1, 8},
        {"false_alarm 1e-4", 0.4, 0.1, 1e-4, 14, -1, 8},
        {"min_contrast 13.5 dB", 0.4, 0.1, 1e-3, 13.5, -1, 8},
        {"min_contrast 15 dB", 0.4, 0.1, 1e-3, 15, -1, 8},
        {"ring_down 0.25 m", 0.4, 0.1, 1e-3, 14, 0.25, 8},
        {"ring_down 0.31 m", 0.4, 0.1, 1e-3, 14, 0.31, 8},
        {"floor 1", 0.4, 0.1, 1e-3, 14, -1, 1},
        {"floor 12", 0.4, 0.1, 1e-3, 14, -1, 12},
    };

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct extract_conf conf;
        extract_defaults(&conf);
        conf.window_m = row[i].window_m;
        conf.guard_m = row[i].guard_m;
        conf.false_alarm = row[i].false_alarm;
        conf.min_contrast_db = row[i].min_contrast_db;
        conf.ring_down_m = row[i].ring_down_m;
        conf.floor_counts = row[i].floor_counts;
        set_up(&conf);
        const struct box_score s = box_run(&ping360);
        box_print(row[i].name, &s);
        CHECK_INT(s.end_176_194_found, 20);
        CHECK(side_share(&s) >= 0.8);
        CHECK_INT(s.open_water, 0);
    }
}

/* Why the defaults are what they are: each of these is worse, and how much is printed. */
TEST(box_without_the_right_law_or_contrast)
{
    struct extract_conf conf;
    extract_defaults(&conf);
    conf.min_contrast_db = 0.0;
    set_up(&conf);
    const struct box_score linear = box_run(&(struct head){AMPLITUDE_LINEAR, 0, 0.012});
    box_print("counts as pressure", &linear);
    CHECK(side_share(&linear) < 0.9);
    const struct box_score any = box_run(&ping360);
    box_print("no min_contrast", &any);
    CHECK(any.open_water > 10);
    conf.false_alarm = 1e-8;
    set_up(&conf);
    const struct box_score rare = box_run(&ping360);
    box_print("no min_contrast, 1e-8", &rare);
}

/* Free water between ring-down and end wall: how its counts scatter decides which law they follow. */
TEST(box_noise_fits_the_square_root_law)
{
    enum { BEGIN = 500, END = 780, BINS = END - BEGIN, LAGS = 40 };
    FILE *file = fopen("tests/replay/box.csv", "r");
    struct shot shot;
    double sum[5] = {0}, square[5] = {0}, correlation[LAGS] = {0};
    long cells = 0;
    int beams = 0;

    while (file && shot_read(file, &shot)) {
        if (shot.bearing_deg < 178.0 || shot.bearing_deg > 192.0)
            continue;
        double power[BINS], mean = 0.0, variance = 0.0;
        for (int i = 0; i < BINS; i++) {
            for (int exponent = 1; exponent <= 4; exponent++) {
                const double x = pow(shot.sample[BEGIN + i], exponent);
                sum[exponent] += x;
                square[exponent] += x * x;
            }
            power[i] = pow(shot.sample[BEGIN + i], 4);
            mean += power[i] / BINS;
        }
        for (int i = 0; i < BINS; i++)
            variance += (power[i] - mean) * (power[i] - mean);
        for (int lag = 1; lag < LAGS; lag++)
            for (int i = 0; i + lag < BINS; i++)
                correlation[lag] += (power[i] - mean) * (power[i + lag] - mean) / variance;
        cells += BINS;
        beams++;
    }
    if (file)
        fclose(file);
    double cv[5] = {0}, length = 1.0;
    for (int exponent = 1; exponent <= 4; exponent++) {
        const double mean = sum[exponent] / (double)cells;
        cv[exponent] = sqrt(square[exponent] / (double)cells - mean * mean) / mean;
    }
    for (int lag = 1; lag < LAGS && correlation[lag] > 0.05 * beams; lag++)
        length += 2.0 * correlation[lag] / beams;
    printf("# box noise: sd / mean of counts %.2f, squared %.2f, to the fourth %.2f; correlated over %.1f bins\n",
           cv[1], cv[2], cv[4], length);
    CHECK(fabs(cv[1] - 0.28) < fabs(cv[1] - 0.52)); /* root of a Rayleigh amplitude, and the amplitude itself */
    CHECK_NEAR(length, ping360.pulse_m / 0.0016875, 0.3, 0);
}

/* From which contrast on there is no false wall, and up to which no true one is lost. */
TEST(box_contrast_has_room_on_both_sides)
{
    static const double contrast_db[] = {0, 10, 12, 13, 14, 15, 16, 17, 18};
    for (int k = 0; k < 9; k++) {
        struct extract_conf conf;
        char name[32];
        extract_defaults(&conf);
        conf.min_contrast_db = contrast_db[k];
        set_up(&conf);
        const struct box_score s = box_run(&ping360);
        snprintf(name, sizeof name, "min_contrast %g dB", contrast_db[k]);
        box_print(name, &s);
        if (contrast_db[k] >= 13 && contrast_db[k] <= 15) {
            CHECK_INT(s.open_water, 0);
            CHECK(side_share(&s) >= 0.85);
        }
    }
}

TEST(box_with_every_detector)
{
    static const char *const name[] = {"ca", "goca", "soca", "os"};
    for (int d = CFAR_CA; d <= CFAR_OS; d++) {
        struct extract_conf conf;
        extract_defaults(&conf);
        conf.detector = (enum cfar_detector)d;
        set_up(&conf);
        const struct box_score s = box_run(&ping360);
        box_print(name[d], &s);
        CHECK_INT(s.open_water, 0);
    }
}

/* ---- recordings that cannot ship ---- */

#define NEAR_FIELD DATA "ping360-nearfield-textdump/test_ping_log.csv"
#define OPEN_WATER DATA "ping360-openwater-pingviewer/20240814-102337673.60m-pings1000-1500.csv"
#define SEABED     DATA "tritech-seanet-rov-seabed/sonar.part1.csv"

/* Beams that have an echo so near the wall; *behind: that call water more than 20 cm behind it free. */
static int echoes_within(const struct look *look, const struct wall *wall, double limit_m, int *behind)
{
    int n = 0;
    *behind = 0;
    for (int i = 0; i < look->n; i++) {
        const struct beam_echoes *b = &look->found[i];
        const double at_m = wall->distance_m / cos(geo_rad(look->bearing_deg[i] - wall->normal_deg));
        bool near = false;
        for (int k = 0; k < b->n; k++)
            near |= fabs((double)b->echo[k].range_m - at_m) < limit_m;
        n += near;
        *behind += b->free_to_m > b->blind_m && (double)b->free_to_m > at_m + 0.2;
    }
    return n;
}

enum { LOOKS = 3, PAUSE = 50 }; /* pings between two looks, at least */

/* The looks of the recording at a wall; returns how many. */
static int read_looks(const struct wall *wall, double half_width_deg, struct look look[LOOKS])
{
    FILE *file = recording(TANK);
    struct extract_conf conf;
    struct shot shot;
    int n = 0, last = -PAUSE - 1;
    extract_defaults(&conf);
    set_up(&conf);
    for (int ping = 0; shot_read(file, &shot); ping++) {
        run_shot(&shot, &micron);
        const double off_deg = turned(shot.bearing_deg, wall->normal_deg);
        if (fabs(off_deg) > half_width_deg)
            continue;
        n += ping - last > PAUSE && n < LOOKS;
        last = ping;
        struct look *l = &look[n - 1];
        if (l->n == LOOK_BEAMS)
            continue;
        l->bearing_deg[l->n] = shot.bearing_deg;
        l->loudest_m[l->n] = loudest_near(&shot, wall->distance_m / cos(geo_rad(off_deg)));
        l->found[l->n++] = shot.found;
    }
    fclose(file);
    return n;
}

/*
 * Micron, 80 dB over 255 counts, in a tank. Ghosts and side lobes are echoes too: the question is whether the wall is
 * among the echoes, and whether water behind it is called free.
 * In the first look at wall S its echo jumps by 12 cm and back.
 */
TEST(micron_tank_walls)
{
    static const struct wall wall[] = {{"W", 2.21, 264}, {"S", 3.98, 175}};
    static const double half_width_deg[] = {36, 19.8};
    static const int least[] = {112, 42}, least_beams[] = {112, 44}, looks[] = {3, 2};
    for (int w = 0; w < 2; w++) {
        static struct look look[LOOKS];
        int beams = 0, within = 0;
        memset(look, 0, sizeof look);
        const int n = read_looks(&wall[w], half_width_deg[w], look);
        CHECK_INT(n, looks[w]);
        for (int k = 0; k < n; k++) {
            const struct wall fit = fitted(&look[k], &wall[w]);
            double error_m;
            int behind;
            const int loudest = loudest_within(&look[k], &fit, 0.15, &error_m);
            const int found = echoes_within(&look[k], &fit, 0.15, &behind);
            printf(
                "# micron tank, wall %s, look %d, fitted %.3f m at %.2f deg, %d beams: within 15 cm the loudest "
                "bin in %d, an echo in %d, free behind it in %d\n",
                fit.name, k + 1, fit.distance_m, fit.normal_deg, look[k].n, loudest, found, behind);
            beams += look[k].n;
            within += found;
            CHECK_INT(behind, 0);
        }
        CHECK(within >= least[w] && beams >= least_beams[w]);
    }
}

/*
 * Wall N stands within the ring-down, 0.18 to 0.20 m away. What lies behind it is multipath: none of it is free water.
 * Where it is seen askew the head rings hardly louder for it.
 */
TEST(micron_tank_wall_beside_the_head)
{
    FILE *file = recording(TANK);
    struct extract_conf conf;
    struct shot shot;
    int beams = 0, claims = 0, others = 0, other_claims = 0;
    extract_defaults(&conf);
    set_up(&conf);
    while (shot_read(file, &shot)) {
        run_shot(&shot, &micron);
        const bool beside =
            fabs(turned(shot.bearing_deg, 354))<45, claim = shot.found.free_to_m> shot.found.blind_m;
        beams += beside;
        claims += beside && claim;
        others += !beside;
        other_claims += !beside && claim;
    }
    fclose(file);
    printf("# micron tank, wall N: %d of %d beams call water behind it free; elsewhere %d of %d call water free\n",
           claims, beams, other_claims, others);
    CHECK(claims * 50 <= beams);
    CHECK(other_claims * 100 >= others * 60);
}

/* Interference lifts the floor of pings 4, 18, 58 and 88 over the whole range: no walls come of it. */
TEST(near_field_raised_floor)
{
    FILE *file = recording(NEAR_FIELD);
    const struct head head = {AMPLITUDE_SQRT, 0, 0.00825};
    struct extract_conf conf;
    struct shot shot;
    int ping = 0, reflector = 0, blind = 0;
    extract_defaults(&conf);
    set_up(&conf);
    for (; shot_read(file, &shot); ping++) {
        run_shot(&shot, &head);
        if (ping == 4 || ping == 18 || ping == 58 || ping == 88)
            CHECK_INT(shot.found.state, BEAM_SILENT);
        blind += shot.found.state == BEAM_BLIND;
        for (int k = 0; k < shot.found.n; k++)
            if (fabs((double)shot.found.echo[k].range_m - 0.85) < 0.05) {
                reflector++;
                break;
            }
    }
    fclose(file);
    printf("# near field: reflector at 0.85 m in %d of %d pings, blind %d\n", reflector, ping, blind);
    CHECK_INT(blind, 1); /* the ping with two samples */
    /* faint, and at the same range in most pings: once the baseline has it, it is weaker than any target */
    CHECK(reflector >= 35);
}

/* 60 m, gain 2: the far half sends zeros with stray counts, and holds nothing. */
TEST(open_water_far_half)
{
    FILE *file = recording(OPEN_WATER);
    const struct head head = {AMPLITUDE_SQRT, 0, 0.24};
    struct extract_conf conf;
    struct shot shot;
    int pings = 0, first_far = 0, any_far = 0, stray = 0;
    extract_defaults(&conf);
    set_up(&conf);
    for (; shot_read(file, &shot); pings++) {
        run_shot(&shot, &head);
        first_far += shot.found.n > 0 && (double)shot.found.echo[0].range_m > shot.range_m / 2;
        /* The near half taken away: the detector alone with the far half. */
        memset(shot.sample, 0, shot.n / 2);
        shot.sample[0] = 255;
        for (uint32_t i = shot.n / 2; i < shot.n; i++)
            stray += shot.sample[i] > 0;
        run_shot(&shot, &head);
        any_far += shot.found.n > 0;
    }
    fclose(file);
    printf("# open water: %d pings, %d stray counts in the far half, first echo there %d, any echo there %d\n",
           pings, stray, first_far, any_far);
    CHECK_INT(first_far, 0);
    CHECK(any_far * 200 <= pings);
}

/* Is an echo there again when the head next looks along its bearing? -1: it does not look again. */
static int is_there_again(const struct shot *shots, int n, int at)
{
    const double range_m = first_m(&shots[at]);
    for (int i = at + 1; i < n; i++) {
        if (i - at < 20 || fabs(turned(shots[i].bearing_deg, shots[at].bearing_deg)) > 0.95)
            continue;
        for (int k = 0; k < shots[i].found.n; k++)
            if (fabs((double)shots[i].found.echo[k].range_m - range_m) < 0.1 + 0.03 * range_m)
                return 1;
        return 0;
    }
    return -1;
}

/* A head at rest on the sea bed, hit by other sound: what is real is there again in the next sweep. */
TEST(seabed_interference)
{
    enum { PINGS = 400 };
    static struct shot shots[PINGS];
    static struct marks marks;
    FILE *file = recording(SEABED);
    const struct head head = {AMPLITUDE_LOG, 80.0 / 255.0, 0.15};
    struct extract_conf conf;
    int n = 0, first = 0, far = 0, far_again = 0, looked[2] = {0}, again[2] = {0}, histogram[11] = {0};

    extract_defaults(&conf);
    set_up(&conf);
    marks_init(&marks, 1500.0);
    struct pose standing = pose_identity;
    standing.has = POSE_ATTITUDE | POSE_POSITION;
    for (; n < PINGS && shot_read(file, &shots[n]); n++) {
        struct shot *shot = &shots[n];
        run_shot(shot, &head);
        shot->found.az_rad = (float)geo_rad(shot->bearing_deg);
        struct echoes echoes = {.t_ns = 1 + (uint64_t)n * 78000000,
                                .n_beams = 1,
                                .max_beams = 1,
                                .range_max_m = (float)shot->range_m,
                                .az_aperture_rad = (float)geo_rad(3.0),
                                .pose = standing,
                                .beam = &shot->found};
        marks_run(&marks, &echoes);
    }
    fclose(file);
    for (int i = 0; i < n; i++) {
        const int there = is_there_again(shots, n, i);
        const bool marked = shots[i].found.echo[0].flags & ECHO_BURST;
        first += shots[i].found.n > 0;
        histogram[shots[i].found.n ? (int)fmin(first_m(&shots[i]) / 5, 10) : 10]++;
        if (!shots[i].found.n || there < 0)
            continue;
        looked[marked]++;
        again[marked] += there;
        far += first_m(&shots[i]) > 41;
        far_again += first_m(&shots[i]) > 41 && there;
    }
    printf("# sea bed: %d pings, first echo in %d; per 5 m:", n, first);
    for (int i = 0; i < 11; i++)
        printf(" %d", histogram[i]);
    printf("\n# sea bed: of those looked at again: beyond 41 m %d, there again %d; marked as a burst %d, there "
           "again %d; "
           "others %d, there again %d\n",
           far, far_again, looked[1], again[1], looked[0], again[0]);
    CHECK(far * 20 <= n);
    CHECK(far - far_again <= 1); /* the others stand there */
    CHECK(again[1] * 4 <= looked[1]);
    CHECK(again[0] * 2 >= looked[0]);
}

int main(void)
{
    RUN(box_with_defaults);
    RUN(box_with_neighbouring_settings);
    RUN(box_without_the_right_law_or_contrast);
    RUN(box_noise_fits_the_square_root_law);
    RUN(box_contrast_has_room_on_both_sides);
    RUN(box_with_every_detector);
    RUN_WITH(TANK, micron_tank_walls);
    RUN_WITH(TANK, micron_tank_wall_beside_the_head);
    RUN_WITH(NEAR_FIELD, near_field_raised_floor);
    RUN_WITH(OPEN_WATER, open_water_far_half);
    RUN_WITH(SEABED, seabed_interference);
    return test_end();
}
