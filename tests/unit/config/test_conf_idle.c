/* SPDX-License-Identifier: MIT */
/* test_conf_idle - a key that does nothing is named, with what it needs; one that does something, or has its default,
 * is not. */
#include "tests/lib/test.h"

#include <stdio.h>
#include <stdlib.h>

#include "config/conf_source.h"
#include "config/conf_table.h"
#include "config/conf_value.h"
#include "daemon/settings.h"

#define HEAD   "[sonar a]\ndevice = ping360\nport = serial:/dev/x:115200\n"
#define RANGES "[sonar a]\ndevice = nmea0183\nport = serial:/dev/x:4800\n"

static char said[4000];
static int n_said;

static void note(void *ctx, const char *sentence)
{
    const size_t used = strlen(said);
    (void)ctx;
    snprintf(said + used, sizeof said - used, "%s\n", sentence);
    n_said++;
}

static void fault(void *ctx, const char *message)
{
    (void)ctx;
    printf("%s\n", message);
    test_case_failed = true;
}

static void load(const char *text, struct conf *conf)
{
    struct conf_source *source;
    conf_load_text(conf, &source, &(struct conf_text){"test", text, strlen(text)}, &settings_checks, fault, NULL);
    conf_source_free(source);
}

static void judge(const struct conf *conf)
{
    said[0] = '\0';
    n_said = 0;
    conf_idle(conf, &settings_checks, note, NULL);
}

TEST(what_a_key_needs_is_said)
{
    static const struct {
        const char *text, *want; /* the only sentence; NULL: there is none */
    } rows[] = {
        {HEAD, NULL},
        {HEAD "circle = 60 s\n",
         "[sonar a] circle = 60 s has no effect without scan = active or [vehicle] current\n"},
        {HEAD "circle = 60 s\nscan = active\n", NULL},
        {HEAD "power_active = high\n", NULL}, /* the default */
        {HEAD "power_at_stop = on\n[sonar b]\ndevice = micron\nport = serial:/dev/y:115200\npower = GPIO4\n",
         "[sonar a] power_at_stop = on has no effect without power\n"},
        {HEAD "[extract]\nfalse_alarm = 0.001\n", NULL}, /* the default, in other words */
        {HEAD "[extract]\nrank = 0.5\n", "[extract] rank = 0.5 has no effect without detector = os\n"},
        {HEAD "[extract]\nrank = 0.5\ndetector = os\n", NULL},
        {RANGES "[extract]\nrank = 0.5\ndetector = os\n",
         "[extract] detector = os has no effect without a sonar that sends intensities\n"
         "[extract] rank = 0.5 has no effect without a sonar that sends intensities\n"},
        {HEAD "[extract]\nminimum_range = 2 m\n",
         "[extract] minimum_range = 2 m has no effect without no_echo = minimum "
         "or a sonar that reports ready ranges\n"},
        {RANGES "[extract]\nminimum_range = 2 m\n", NULL},
        {HEAD "ring_down = 0.5 m\n[extract]\nlearn_ring_down = on\n",
         "[extract] learn_ring_down = on has no effect without [sonar] ring_down = auto\n"},
        {HEAD "[grid far]\nrange = 5 m\nmask_reach = 3\n",
         "[grid far] mask_reach = 3 has no effect without sensor_model = gauss or midpoint\n"},
        {HEAD "[grid]\nmask_reach = 3\n[grid far]\nrange = 5 m\n",
         "[grid] mask_reach = 3 has no effect without sensor_model = gauss or midpoint\n"},
        {HEAD "[grid]\nmask_reach = 3\n[grid far]\nsensor_model = gauss\n",
         "[grid] mask_reach = 3 has no effect without sensor_model = gauss or midpoint\n"},
        {HEAD "[map]\nheight = 5 m\n", "[map] height = 5 m has no effect without voxel\n"},
        {HEAD "[map]\nvoxel = 0.2 m\nheight = 5 m\n", NULL},
        {HEAD "[depth]\nsource = modbus-tcp:192.168.2.5:502\nparity = even\n",
         "[depth] parity = even has no effect without source = modbus-rtu:*\n"},
        {HEAD "[depth]\nsource = modbus-rtu:/dev/y:9600\nparity = even\n", NULL},
        {HEAD "[gpio]\nchip = x\n",
         "[gpio] chip = x has no effect without leak or [sonar] power or [sonar] trigger\n"},
        {HEAD "trigger = GPIO4\n[gpio]\nchip = x\n", NULL},
        {HEAD "[pipeline]\nqueue = 8\n", "[pipeline] queue = 8 has no effect without threads = 1 or 2\n"},
        {HEAD "[vehicle]\nslow = 0.2 m/s\nunknown = stop\n",
         "[vehicle] slow = 0.2 m/s has no effect without unknown = slow\n"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0] && !test_case_failed; i++) {
        struct conf conf;
        load(rows[i].text, &conf);
        judge(&conf);
        CHECK_STR(said, rows[i].want ? rows[i].want : "");
    }
}

/* Another value than the key has. */
static bool change(const struct conf_key *key, void *base)
{
    char was[CONF_VALUE_MAX], now[CONF_VALUE_MAX], number[CONF_VALUE_MAX];
    struct fault f;
    conf_value_write(key, base, was, sizeof was);
    for (int i = 0; i < 4; i++) {
        const double v = i ? key->hi : key->lo;
        if (key->kind == CONF_QUANTITY) {
            snprintf(number, sizeof number, "%.9g %.9g %.9g", v, v, v);
            char *end = number;
            for (int k = 0; k < key->n; k++)
                end += strcspn(end, " ") + (k + 1 < key->n);
            snprintf(end, 16, " %s", key->unit ? key->unit : "");
        } else if (key->kind == CONF_INTEGER) {
            snprintf(number, sizeof number, "%d", (int)v);
        } else if (key->kind == CONF_OCTAL) {
            snprintf(number, sizeof number, "0777");
        } else if (key->kind == CONF_WORD) {
            snprintf(number, sizeof number, "%s", key->words[i < 2 ? i : 0]);
        } else {
            snprintf(number, sizeof number, "%s", key->kind == CONF_PATH ? "/a" : "a");
        }
        if (conf_value_read(key, number, base, &f)) {
            conf_value_write(key, base, now, sizeof now);
            if (strcmp(was, now) != 0)
                return true;
        }
    }
    return false;
}

/* Every key by itself, beside a head alone: these do nothing there. A new key belongs here or does something. */
TEST(every_key_of_the_table_is_judged)
{
    static const char *const idle =
        " sonar.circle sonar.decibels_per_count sonar.power_active sonar.power_cycle_after sonar.power_at_stop"
        " sonar.trigger_edge water.density extract.rank extract.clahe_clip extract.minimum_range grid.range_error"
        " grid.mask_reach map.memory map.extent map.height map.threshold map.echoes map.echo_weight map.tolerance"
        " map.opening map.weight_levels map.beam map.body map.submap_distance map.submap_time map.forget "
        "map.directory"
        " map.origin map.save_every map.load depth.parity depth.slave depth.function depth.register depth.type"
        " depth.word_order depth.scale depth.offset depth.unit depth.surface_pressure depth.mount depth.rate"
        " depth.timeout depth.turnaround depth.resync depth.plausible depth.speed_limit nmea.use nmea.variation"
        " nmea.checksum gpio.chip gpio.leak_active gpio.leak_bias pipeline.queue realtime.processor_count"
        " record.file_size record.files record.start";
    char name[80], all[4000] = "";
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        struct conf conf;
        load(HEAD, &conf);
        if (!key->standard)
            continue;
        snprintf(name, sizeof name, " %s.%s", key->section, key->name);
        CHECK(change(key, (char *)&conf + conf_base(key, 0)));
        judge(&conf);
        CHECK_INT(n_said > 1, 0);
        if (n_said)
            strncat(all, name, sizeof all - strlen(all) - 1);
        if (test_case_failed) {
            printf("(%s: %s)\n", name, said);
            return;
        }
    }
    CHECK_STR(all, idle);
}

int main(void)
{
    RUN(what_a_key_needs_is_said);
    RUN(every_key_of_the_table_is_judged);
    return test_end();
}
