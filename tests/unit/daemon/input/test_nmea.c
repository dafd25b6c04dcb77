/* SPDX-License-Identifier: MIT */
/*
 * test_nmea - what of an instrument's sentences becomes a pose: heading, depth or both, as the configuration wants it,
 * a magnetic heading by the variation, and none beside a client's whole attitude. The instrument is a pseudo-terminal.
 */
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#include <fcntl.h>
#include <math.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "daemon/input/nmea.h"

#define SECOND 1000000000ull

static int instrument;
static struct loop *loop;
static struct pose_log poses;
static struct pose_input input;
static struct nmea *nmea;

static void nobody(void *ctx, const struct pose *pose)
{
    (void)ctx;
    (void)pose;
}

/* variation_deg: NAN, none. */
static void begin(int use, double variation_deg)
{
    struct conf conf;
    struct fault fault = {""};
    conf_defaults(&conf);
    instrument = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (instrument < 0 || grantpt(instrument) != 0 || unlockpt(instrument) != 0) {
        perror("pseudo-terminal");
        exit(1);
    }
    snprintf(conf.nmea.port, sizeof conf.nmea.port, "serial:%s:4800", ptsname(instrument));
    conf.nmea.use = use;
    conf.nmea.checksum = CONF_CHECKSUM_OPTIONAL;
    conf.nmea.variation_rad = isnan(variation_deg) ? CONF_NO_VARIATION : geo_rad(variation_deg);
    loop = loop_new(false);
    pose_log_init(&poses, 3600 * SECOND);
    input = (struct pose_input){.loop = loop, .poses = &poses, .taken = nobody};
    nmea = nmea_new(&conf.nmea, &input, NULL, &fault);
    if (!nmea) {
        printf("FAIL %s\n", fault.text);
        exit(1);
    }
    nmea_start(nmea);
}

static void end(void)
{
    nmea_free(nmea);
    loop_free(loop);
    close(instrument);
}

static struct nmea_status status(void)
{
    struct nmea_status s;
    nmea_status(nmea, &s);
    return s;
}

/* One sentence, and what the pose then has. */
static struct pose hear(const char *sentence)
{
    const uint64_t before = status().counts.sentences;
    struct pose pose = pose_identity;
    CHECK(write(instrument, sentence, strlen(sentence)) == (ssize_t)strlen(sentence));
    CHECK(write(instrument, "\r\n", 2) == 2);
    TURN_UNTIL(loop, status().counts.sentences > before);
    CHECK_INT(status().counts.sentences, before + 1);
    pose_log_at(&poses, loop_now(loop), &pose);
    return pose;
}

static double heading_deg(const struct pose *pose)
{
    const double *q = pose->attitude;
    return geo_deg(geo_wrap(atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]))));
}

TEST(headings_are_true_ones)
{
    static const struct {
        const char *sentence;
        double variation_deg, want_deg; /* NAN: none */
    } row[] = {
        {"$HEHDT,358.0,T", 4, 358},
        {"$HCHDM,90.0,M", 2, 92},
        {"$HCHDM,90.0,M", -2, 88},
        {"$HCHDM,359.0,M", 2, 1},
        {"$HCHDM,90.0,M", NAN, NAN},
        {"$HCHDG,90.0,,,5.0,W", NAN, 85}, /* its own variation, whatever is configured */
        {"$HCHDG,90.0,,,5.0,W", 2, 85},
        {"$HCHDG,90.0,3.0,E,,", 2, 95},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(CONF_NMEA_HEADING, row[i].variation_deg);
        const struct pose pose = hear(row[i].sentence);
        const bool wanted = !isnan(row[i].want_deg);
        if (((pose.has & POSE_ATTITUDE) != 0) != wanted ||
            (wanted && !(fabs(heading_deg(&pose) - row[i].want_deg) < 1e-9))) {
            printf("%s by %g degrees: %g\n", row[i].sentence, row[i].variation_deg, heading_deg(&pose));
            test_case_failed = true;
        }
        CHECK_INT(status().no_variation, !wanted);
        CHECK((status().t_value_ns > 0) == wanted);
        end();
    }
}

TEST(only_what_is_wanted_is_used)
{
    static const struct {
        int use;
        unsigned has;
    } row[] = {{CONF_NMEA_HEADING, POSE_ATTITUDE},
               {CONF_NMEA_DEPTH, POSE_DEPTH},
               {CONF_NMEA_BOTH, POSE_ATTITUDE | POSE_DEPTH}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(row[i].use, NAN);
        hear("$HEHDT,90.0,T");
        const struct pose pose = hear("$SDDPT,5.5,0.5");
        CHECK_INT(pose.has, row[i].has);
        CHECK(!(pose.has & POSE_DEPTH) || pose.position_m[2] == 6);
        end();
    }
}

/* As it was measured, without any offset; 0 is no bottom. */
TEST(an_echosounder_may_tell_the_altitude)
{
    struct pose pose;
    begin(CONF_NMEA_ALTITUDE, NAN);
    hear("$HEHDT,90.0,T");
    CHECK_INT(hear("$SDDPT,5.5,0.5").has, 0); /* alone it is no pose */
    hear("$SDDPT,0.0,0.5");
    CHECK(pose_log_newest(&poses, &pose));
    CHECK_INT(pose.has, POSE_ALTITUDE);
    CHECK_NEAR(pose.altitude_m, 5.5, 0, 1e-12);
    end();
}

TEST(a_clients_attitude_is_worth_more_than_a_heading)
{
    begin(CONF_NMEA_BOTH, NAN);
    input.t_attitude_ns = loop_now(loop);
    const struct pose pose = hear("$HEHDT,90.0,T");
    CHECK(!(pose.has & POSE_ATTITUDE));
    CHECK_INT(input.heading_not_used, 1);
    CHECK_INT(status().t_value_ns, 0);
    end();
}

/* More than a terminal gives at one read. */
TEST(nothing_that_waited_is_used_however_much_it_is)
{
    static const char sentence[] = "$GPHDT,90.0,T\r\n";
    uint64_t n = 0;
    struct pose pose;
    begin(CONF_NMEA_BOTH, NAN);
    hear("$GPHDT,10.0,T");
    loop_turn(loop, 0);
    loop_turn(loop, 0);
    const uint64_t before = status().bytes_in;
    for (; n < 600 * (sizeof sentence - 1); n += sizeof sentence - 1)
        CHECK(write(instrument, sentence, sizeof sentence - 1) == sizeof sentence - 1);
    nanosleep(&(struct timespec){.tv_nsec = 2 * (long)LOOP_TIMELY_NS}, NULL); /* held up for long enough */
    TURN_UNTIL(loop, status().bytes_in >= before + n);
    CHECK_INT(status().late_bytes, n);
    CHECK_INT(status().counts.values, 1);
    pose = hear("$GPHDT,20.0,T");
    CHECK_NEAR(pose.attitude[3], sin(geo_rad(10)), 0, 1e-6);
    CHECK_INT(status().counts.values, 2);
    end();
}

int main(void)
{
    RUN(headings_are_true_ones);
    RUN(only_what_is_wanted_is_used);
    RUN(an_echosounder_may_tell_the_altitude);
    RUN(a_clients_attitude_is_worth_more_than_a_heading);
    RUN(nothing_that_waited_is_used_however_much_it_is);
    return test_end();
}
