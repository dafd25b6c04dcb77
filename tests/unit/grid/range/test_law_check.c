/* SPDX-License-Identifier: MIT */
/*
 * test_law_check - every amplitude law against every other, on made-up speckle of many levels and on
 * recordings; docs/extract.md quotes the lines with a #.
 */
#include "tests/lib/test.h"

#include "core/fault.h"
#include "grid/range/extract.h"
#include "tests/sound/sound.h"

#define BINS 800

static _Alignas(16) unsigned char memory[1 << 19];
static const char *const law_name[] = {"linear", "power", "sqrt", "log"};
static const char *const doubt_name[] = {"nothing", "compressed", "linear"};

static struct extract *taken_as(int law)
{
    struct extract_conf conf;
    struct fault fault = {""};
    struct extract *extract;
    extract_defaults(&conf);
    conf.law = law;
    conf.db_per_count = 80.0 / 255.0;
    if (extract_size(2000) > sizeof memory || !(extract = extract_init(memory, &conf, 2000, &fault))) {
        printf("extract_init: %s\n", fault.text);
        exit(1);
    }
    return extract;
}

static void feed(struct extract *extract, const uint8_t *counts, uint32_t n, double dr_m, double pulse_m)
{
    struct ping_beam axis = {.az_rad = 0.0f};
    struct beam_echoes found;
    const struct ping ping = {.kind = PING_PROFILE,
                              .sample_bytes = 1,
                              .n_beams = 1,
                              .n_bins = n,
                              .dr_m = (float)dr_m,
                              .pulse_m = (float)pulse_m,
                              .deaf_m = 0.15f, /* of a ring-down nothing is asked */
                              .beam = &axis,
                              .samples = (void *)counts};
    struct echoes out = {.max_beams = 1, .beam = &found};
    extract_run(extract, &ping, NULL, &out);
}

/* Power of speckle that the receiver has smoothed over four looks, mean 1. */
static double speckle(uint64_t *seed)
{
    double power = 0.0;
    for (int look = 0; look < 4; look++)
        power -= log(1.0 - test_uniform(seed)) / 4.0;
    return power;
}

/* Speckle whose mean count is, all along a beam, one of those that rise from beam to beam; log: 80 dB over 255. */
static void render(int law, double mean, uint64_t *seed, uint8_t *counts)
{
    for (int i = 0; i < BINS; i++) {
        const double count = sound_count((enum amplitude_law)law, speckle(seed), mean, SOUND_MICRON_DB);
        counts[i] = sound_byte(count + 0.5);
    }
}

/* C11. What can be told apart: decibels from what is proportional to pressure or (made up) to its root. */
TEST(each_law_against_each)
{
    for (int law = AMPLITUDE_LINEAR; law <= AMPLITUDE_LOG; law++)
        for (int taken = AMPLITUDE_LINEAR; taken <= AMPLITUDE_LOG; taken++) {
            struct extract *extract = taken_as(taken);
            uint64_t seed = 1;
            for (int k = 0; k < 400; k++) {
                uint8_t counts[BINS];
                render(law, 10.0 + 90.0 * k / 400, &seed, counts);
                feed(extract, counts, BINS, 0.0125, 0.0125);
            }
            const enum law_doubt doubt = extract_law_doubt(extract);
            const bool proportional = taken == AMPLITUDE_LINEAR || taken == AMPLITUDE_POWER;
            const enum law_doubt want = law == AMPLITUDE_LOG && proportional             ? LAW_LOOKS_COMPRESSED
                                        : law != AMPLITUDE_LOG && taken == AMPLITUDE_LOG ? LAW_LOOKS_LINEAR
                                                                                         : LAW_FITS;
            printf("# law: made-up %s taken as %s: %s\n", law_name[law], law_name[taken], doubt_name[doubt]);
            CHECK_INT(doubt, want);
        }
}

#define DATA "../shared/data/"

static const struct recording {
    const char *path;
    int law;
    double pulse_m;
} recordings[] = {
    {"tests/replay/box.csv", AMPLITUDE_SQRT, 0.012},
    {DATA "micron-tank-rosbag/static_sonar.csv", AMPLITUDE_LOG, 0.05},
    {DATA "micron-quay-rosbag/2014-07-18-20-59-31.csv", AMPLITUDE_LOG, 0.05},
    {DATA "micron-quay-rosbag/2014-07-18-21-11-13.csv", AMPLITUDE_LOG, 0.05},
    {DATA "tritech-seanet-rov-seabed/sonar.part1.csv", AMPLITUDE_LOG, 0.15},
    {DATA "tritech-v4log-target/target-first-234.csv", AMPLITUDE_LOG, 0.05},
    {DATA "ping360-nearfield-textdump/test_ping_log.csv", AMPLITUDE_SQRT, 0.00825},
    {DATA "ping360-openwater-pingviewer/20240814-102337673.60m-pings1000-1500.csv", AMPLITUDE_SQRT, 0.24},
    {DATA "imagenex852-echosounder/hydroball.csv", AMPLITUDE_LINEAR, 0.1},
    {DATA "imagenex852-echosounder/sonar.first400.csv", AMPLITUDE_LINEAR, 0.1},
};

/* False at the end of the file. */
static bool feed_line(struct extract *extract, FILE *file, double pulse_m)
{
    static char line[1 << 16];
    static uint8_t counts[2000];
    char *at = line;
    do {
        if (!fgets(line, sizeof line, file))
            return false;
    } while (line[0] == '#' || line[0] == 't');
    strtod(at, &at);
    strtod(at + 1, &at);
    const double range_m = strtod(at + 1, &at);
    const unsigned long n = strtoul(at + 1, &at, 10);
    for (unsigned long i = 0; i < n && i < sizeof counts; i++)
        counts[i] = (uint8_t)strtoul(at + 1, &at, 10);
    if (n > 0 && n <= sizeof counts)
        feed(extract, counts, (uint32_t)n, range_m / (double)n, pulse_m);
    return true;
}

static enum law_doubt doubt_of(const struct recording *r, int law)
{
    struct extract *extract = taken_as(law);
    FILE *file = fopen(r->path, "r");
    enum law_doubt doubt = LAW_FITS;
    while (file && feed_line(extract, file, r->pulse_m))
        if (extract_law_doubt(extract) != LAW_FITS) /* even for a while */
            doubt = extract_law_doubt(extract);
    if (file)
        fclose(file);
    return doubt;
}

TEST(no_recording_is_doubted_under_its_own_law)
{
    for (size_t k = 0; k < sizeof recordings / sizeof recordings[0]; k++) {
        const struct recording *r = &recordings[k];
        FILE *file = fopen(r->path, "r");
        if (!file) {
            printf("# law: %s is not here\n", strrchr(r->path, '/') + 1);
            continue;
        }
        fclose(file);
        CHECK_INT(doubt_of(r, r->law), LAW_FITS);
        printf("# law: %s (%s):", strrchr(r->path, '/') + 1, law_name[r->law]);
        for (int taken = AMPLITUDE_LINEAR; taken <= AMPLITUDE_LOG; taken++)
            if (taken != r->law)
                printf(" as %s %s", law_name[taken], doubt_name[doubt_of(r, taken)]);
        printf("\n");
    }
}

int main(void)
{
    RUN(each_law_against_each);
    RUN(no_recording_is_doubted_under_its_own_law);
    return test_end();
}
