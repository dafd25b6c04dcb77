/* SPDX-License-Identifier: MIT */
/* test_fit - what does not go together is named with the key and what is wanted, and nothing else is. */
#include "tests/lib/test.h"

#include <stdio.h>

#include "config/conf_source.h"
#include "daemon/fit.h"
#include "daemon/settings.h"
#include "drivers/devices/device.h"

#define PORT "port = serial:/dev/x:115200\n"
#define HEAD "[sonar a]\ndevice = ping360\n" PORT

static const struct {
    const char *text, *want; /* a part of the only sentence; NULL: there is none */
} cases[] = {
    {HEAD, NULL},
    /* a head's step against its beam */
    {HEAD "step = 1.8 deg\n", NULL},
    {HEAD "step = 2 deg\n", NULL},
    {HEAD "step = 3.6 deg\n", "[sonar a] step = 3.6 deg is wider than the beam of 2 deg"},
    {HEAD "step = 3.6 deg\naperture = 4 25 deg\n", NULL},
    {HEAD "step = 1.8 deg\naperture = 1 25 deg\n", "set it to at most 1 deg"},
    {"[sonar a]\ndevice = micron\n" PORT "step = 3.6 deg\n", "beam of 3 deg"},
    {"[sonar a]\ndevice = imagenex881a\n" PORT "step = 1.2 deg\naperture = 1 22 deg\n",
     "step = 1.2 deg is wider than the beam of 1 deg"},
    {"[sonar a]\ndevice = imagenex852\n" PORT, NULL}, /* it makes no steps */
    /* a beam that never turns against the directions of the grid */
    {"[sonar a]\ndevice = nmea0183\n" PORT "delay = 1 1 s\n", NULL},
    {"[sonar a]\ndevice = nmea0183\n" PORT "delay = 0 0 s\n[grid]\nangular_step = 4 deg\n",
     "[grid] angular_step = 4 deg is too wide for sonar a"},
    {"[sonar a]\ndevice = ping1d\n" PORT, NULL}, /* it says itself how wide it is */
    {"[sonar a]\ndevice = ping1d\n" PORT "aperture = 5 5 deg\n", "set it to at most 1.7 deg"},
    {HEAD "[grid]\nangular_step = 4 deg\n", NULL},
    /* how late readings come */
    {"[sonar a]\ndevice = nmea0183\n" PORT,
     "[sonar a] delay = auto: how late the readings of nmea0183 come is not published; 1 s, give or take 1 s"},
    {"[sonar a]\ndevice = nmea2000\nport = can:can0\n", "0.5 s, give or take 0.5 s, is assumed"},
    {"[sonar a]\ndevice = dronecan\nport = can:can0\n", "0.4 s, give or take 0.4 s, is assumed"},
    {"[sonar a]\ndevice = dronecan\nport = can:can0\ndelay = 0.1 0 s\n", NULL},
    {"[sonar a]\ndevice = echolist\n" PORT, NULL}, /* its line is sent when its ping is over */
    /* how far off the beams are as high as the vehicle: 0.55 m / sin(9.5 deg) */
    {HEAD "[vehicle]\nnear = 1.5 m\n", "[vehicle] near = 1.5 m ends before 3.3 m"},
    {HEAD "[vehicle]\nnear = 3.4 m\n", NULL},
    {HEAD "mount = 0 0 -0.4 m\n[vehicle]\nheight = 0.8 m\nnear = 3.4 m\n", "set near = 6.7 m"},
    {HEAD "rotation = 180 0 30 deg\n[vehicle]\nnear = 1.5 m\n", "near"}, /* upside down is level, too */
    {HEAD "rotation = 90 0 0 deg\n[vehicle]\nnear = 1.5 m\n", NULL},
    {HEAD "aperture = 2 2 deg\n[vehicle]\nnear = 1.5 m\n", NULL}, /* never */
    /* one that does not turn as wide, too: 0.7 m / sin(9.5 deg) */
    {"[sonar a]\ndevice = ping1d\n" PORT "aperture = 25 25 deg\n[vehicle]\nnear = 3.3 m\n", "set near = 4.3 m"},
    {"[sonar a]\ndevice = ping1d\n" PORT "aperture = 25 25 deg\n[vehicle]\nnear = 4.3 m\n", NULL},
    {"[sonar a]\ndevice = ping1d\n" PORT "aperture = 25 25 deg\nrotation = 0 -90 0 deg\n[vehicle]\nnear = 1.5 m\n",
     NULL},
    {HEAD "[sonar b]\ndevice = micron\nport = serial:/dev/y:115200\n[vehicle]\nnear = 2.3 m\n", NULL},
    /* scans and times */
    {HEAD "scan = active\ncircle = 60 s\n[grid]\nclear_for = 40 s\n",
     "clear_for = 40 s is shorter than circle = 60 s"},
    {HEAD "scan = active\ncircle = 60 s\n", NULL},
    {HEAD "[vehicle]\ncurrent = 0.05 m/s\n", NULL},
    {"[sonar a]\ndevice = imagenex881a\n" PORT "step = 1.2 deg\n[vehicle]\ncurrent = 0.05 m/s\n",
     "[sonar a] imagenex881a cannot be sent to single bearings"},
    {HEAD "[grid]\nforget = 10 s\n",
     "[grid] forget = 10 s makes clear_for = auto 10 s, too, instead of 30 s or more"},
    {HEAD "[grid]\nforget = 30 s\n", NULL},
    {HEAD "[grid]\nforget = 10 s\nclear_for = 10 s\n", NULL},
    {HEAD "[grid]\nforget = 10 s\n[grid far]\nrange = 5 m\n", "[grid] forget = 10 s"}, /* said once */
    {HEAD "[grid far]\nforget = 10 s\n", "[grid far] forget = 10 s makes clear_for = auto 10 s"},
    {HEAD "[pose]\nheading_drift = 0.1 deg/s\n", NULL},
    {HEAD "[pose]\nheading_drift = 0.5 deg/s\n", "in the 30 s of clear_for that is 15 deg"},
    {HEAD "[grid]\nclear_for = 10 s\n[pose]\nheading_drift = 0.5 deg/s\n", NULL},
    /* mounts outside of the vehicle */
    {HEAD "mount = 0.3 0.2 -0.25 m\n", NULL},
    {HEAD "mount = 0 0.45 0 m\n",
     "[sonar a] mount = 0 0.45 0 m: outside of the vehicle, whose radius is 0.4 m; measure it "
     "again, or set [vehicle] radius = 0.45 m at least"},
    {HEAD "mount = 0.3 0.3 0 m\n", "set [vehicle] radius = 0.43 m at least"},
    {HEAD "mount = 0 0 0.4 m\n",
     "whose height is 0.5 m; measure it again, or set [vehicle] height = 0.8 m at least"},
    {HEAD "mount = 20 0 0 m\n[vehicle]\nradius = 20 m\n", NULL},
    {HEAD "[depth]\nsource = modbus-rtu:/dev/z:9600\nmount = 0 0 -0.3 m\n",
     "[depth] mount = 0 0 -0.3 m: outside of the vehicle"},
    /* poses that are stale when they come */
    {HEAD "[pose]\ndelay = 0.9 0.5 s\n", NULL},
    {HEAD "[pose]\ndelay = 1 0 s\n", "[pose] delay = 1 s: every pose is older than max_age = 1 s"},
    {HEAD "[pose]\ndelay = 0.2 0 s\nmax_age = 0.2 s\n", "set max_age = 1.2 s"},
    {HEAD "[pose]\ndelay = 1 0 s\nmax_age = 2 s\n", NULL},
};

static char said[2000];
static int n_said;

static void note(void *ctx, const char *sentence)
{
    (void)ctx;
    snprintf(said, sizeof said, "%s", sentence);
    n_said++;
}

static void fault(void *ctx, const char *message)
{
    (void)ctx;
    printf("%s\n", message);
    test_case_failed = true;
}

TEST(what_does_not_go_together_is_named)
{
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct conf conf;
        struct conf_source *source;
        conf_load_text(&conf, &source, &(struct conf_text){"test", cases[i].text, strlen(cases[i].text)},
                       &settings_checks, fault, NULL);
        conf_source_free(source);
        n_said = 0;
        said[0] = '\0';
        fit_judge(&conf, note, NULL);
        CHECK_INT(n_said, cases[i].want ? 1 : 0);
        CHECK(!cases[i].want || strstr(said, cases[i].want));
        if (test_case_failed) {
            printf("(case %zu: %s)\n", i, said);
            return;
        }
    }
}

/* A Ping1D sends the profile beside its choice. */
TEST(sonars_that_send_ranges_alone_are_named)
{
    static const struct {
        const char *text;
        bool unchecked;
    } row[] = {{HEAD, false},
               {"[sonar a]\ndevice = ping1d\n" PORT "mode = request\n", false},
               {"[sonar a]\ndevice = nmea0183\n" PORT, true},
               {"[sonar a]\ndevice = echolist\n" PORT, true},
               {"[sonar a]\ndevice = surveyor\nport = udp:192.168.2.86:62312\n", true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct conf conf;
        struct conf_source *source;
        conf_load_text(&conf, &source, &(struct conf_text){"test", row[i].text, strlen(row[i].text)},
                       &settings_checks, fault, NULL);
        conf_source_free(source);
        n_said = 0;
        fit_unchecked(&conf, note, NULL);
        CHECK_INT(n_said, row[i].unchecked);
        CHECK(!row[i].unchecked || strstr(said, "[sonar a] "));
        CHECK(!row[i].unchecked || strstr(said, "sends ranges without samples"));
    }
}

/* What is published of a device, or assumed, stands in its key's help as well. Others have no delay. */
TEST(each_device_says_how_late_its_readings_come)
{
    for (const struct device_ops *const *d = device_table; *d; d++) {
        const struct device_key *key = device_key_find(*d, "delay");
        char want[40];
        CHECK(key || ((*d)->delay.s <= 0 && (*d)->delay.uncertain_s <= 0 && !(*d)->delay.assumed));
        snprintf(want, sizeof want, (*d)->delay.s > 0 ? "auto: %g %g s" : "auto: none", (*d)->delay.s,
                 (*d)->delay.uncertain_s);
        CHECK(!key || strncmp(key->help, want, strlen(want)) == 0);
        CHECK(!key || (strstr(key->help, "assumed") != NULL) == (*d)->delay.assumed);
    }
    CHECK_NEAR(device_find("ping1d")->delay.s + device_find("ping1d")->delay.uncertain_s, 0.8, 1e-12, 0);
}

int main(void)
{
    RUN(what_does_not_go_together_is_named);
    RUN(sonars_that_send_ranges_alone_are_named);
    RUN(each_device_says_how_late_its_readings_come);
    return test_end();
}
