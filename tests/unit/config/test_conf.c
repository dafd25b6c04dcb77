/* SPDX-License-Identifier: MIT */
/*
 * test_conf - good files give their values in SI, broken ones all their faults in the order of lines, and what is
 * printed loads again to the same bits.
 */
#include "config/conf.h"

#include <glob.h>
#include <locale.h>
#include <unistd.h>

#include "config/conf_source.h"
#include "config/conf_value.h"
#include "core/fault.h"
#include "daemon/settings.h"
#include "drivers/devices/device.h"
#include "tests/lib/test.h"

/* The least that loads; lines of a case behind it count from 4. */
#define BASE "[sonar a]\ndevice = ping360\nport = serial:/dev/x:115200\n"

static char faults_seen[1 << 16];

static void note_fault(void *ctx, const char *message)
{
    (void)ctx;
    size_t used = strlen(faults_seen);
    snprintf(faults_seen + used, sizeof faults_seen - used, "%s%s", used > 0 ? "\n" : "", message);
}

static bool known_device(const char *name, struct fault *fault)
{
    fault_set(fault, "no such device; expected ping360");
    return strcmp(name, "ping360") == 0;
}

static bool known_port(const char *address, struct fault *fault)
{
    fault_set(fault, "no such kind of port; expected serial:DEVICE:BAUD");
    return strncmp(address, "serial:", 7) == 0;
}

static bool known_depth(const char *source, struct fault *fault)
{
    fault_set(fault, "no such source; expected modbus-rtu:DEVICE:BAUD");
    return strncmp(source, "modbus-", 7) == 0;
}

static bool known_line(const char *name, struct fault *fault)
{
    fault_set(fault, "there are no lines there");
    return strcmp(name, "nowhere") != 0;
}

/* A device that has gain 0 to 6, and does not like water faster than 1600 m/s nor a range of 66 m. */
static bool able_sonar(const struct conf_sonar *sonar, const struct conf_water *water, struct fault *fault)
{
    if (sonar->gain > 6)
        fault_set(fault, "gain = %d: expected 0 .. 6", sonar->gain);
    else if (water->sound_speed_mps > 1600)
        fault_set(fault, "sound_speed = %g m/s: too fast", water->sound_speed_mps);
    else if (sonar->range_m == 66)
        fault_set(fault, "mode = auto: not at 66 m");
    else
        return true;
    return false;
}

static const struct conf_checks checks = {
    .device = known_device, .port = known_port, .depth = known_depth, .line = known_line, .sonar = able_sonar};

static int load_bytes(struct conf *conf, const char *text, size_t size)
{
    struct conf_source *source;
    faults_seen[0] = '\0';
    int n = conf_load_text(conf, &source, &(struct conf_text){"t.conf", text, size}, &checks, note_fault, NULL);
    conf_source_free(source);
    return n;
}

static int load(struct conf *conf, const char *text)
{
    return load_bytes(conf, text, strlen(text));
}

struct broken {
    const char *name, *text, *want;
};

static int count_lines(const char *text)
{
    int n = 1;
    for (; *text; text++)
        n += *text == '\n';
    return n;
}

static void check_broken(const struct broken *cases, size_t n)
{
    struct conf conf;
    for (size_t i = 0; i < n; i++) {
        int faults = load(&conf, cases[i].text);
        if (strcmp(faults_seen, cases[i].want) != 0 || faults != count_lines(cases[i].want)) {
            printf("%s: %d faults\n  got  %s\n  expected %s\n", cases[i].name, faults, faults_seen, cases[i].want);
            test_case_failed = true;
        }
    }
}

#define CHECK_BROKEN(cases) check_broken(cases, sizeof cases / sizeof(cases)[0])

#define SECTIONS                                                                                                  \
    "expected one of [sonar NAME], [water], [extract], [background], [grid], [grids], [map], [pose], "            \
    "[vehicle], [answers], [depth], [nmea], [gpio], "                                                             \
    "[server], "                                                                                                  \
    "[pipeline], [realtime], [record], "                                                                          \
    "[log]"
#define LENGTHS "(m, cm, mm, km)"
#define ANGLES  "(rad, deg, grad)"

TEST(broken_sections)
{
    static const struct broken cases[] = {
        {"empty file", "",
         "t.conf: no sonar; expected 1 to 8 sections [sonar NAME], or [depth] or [nmea] to try that alone"},
        {"only a comment", "# nothing\n",
         "t.conf: no sonar; expected 1 to 8 sections [sonar NAME], or [depth] or [nmea] to try that alone"},
        {"unknown section", BASE "[engine]\npower = 3\n", "t.conf:4: [engine]: unknown section; " SECTIONS},
        {"misspelt section", BASE "[extrat]\n", "t.conf:4: [extrat]: unknown section; did you mean [extract]?"},
        {"misspelt sonar", BASE "[sonra b]\n", "t.conf:4: [sonra b]: unknown section; did you mean [sonar NAME]?"},
        {"name where none belongs", BASE "[water cold]\n",
         "t.conf:4: [water cold]: unknown section; did you mean [water]?"},
        {"section without a name", BASE "[]\n", "t.conf:4: []: unknown section; " SECTIONS},
        {"second section", BASE "[water]\n[grid]\n[water]\n",
         "t.conf:6: [water]: duplicate section (first defined on line 4)"},
        {"faults in a second section", BASE "[water]\n[water]\nsound_speed = 9 m/s\n",
         "t.conf:5: [water]: duplicate section (first defined on line 4)\n"
         "t.conf:6: [water] sound_speed = 9 m/s: out of range; expected 1350 to 1650 m/s"},
        {"second sonar of a name", BASE "[ sonar  a ]\nrange = 5 m\n",
         "t.conf:4: [sonar a]: duplicate section (first defined on line 1)"},
        {"sonar without a name", BASE "[sonar]\n",
         "t.conf:4: [sonar]: a sonar without a name; expected [sonar NAME], NAME of 1 to 31 letters, digits, - "
         "and _"},
        {"sonar with a blank in its name", "[sonar a b]\n",
         "t.conf:1: [sonar a b]: bad name of a sonar; expected [sonar NAME], NAME of 1 to 31 letters, digits, - "
         "and "
         "_"},
        {"sonar name too long", BASE "[sonar x2345678901234567890123456789012]\n",
         "t.conf:4: [sonar x2345678901234567890123456789012]: bad name of a sonar; expected [sonar NAME], NAME of "
         "1 "
         "to "
         "31 letters, digits, - and _"},
        {"no bracket at the end", BASE "[water\nsound_speed = 1 m\n",
         "t.conf:4: [water: no ] at the end of the section; expected [section] alone on its line"},
        {"more behind the bracket", BASE "[water] sound_speed = 1500 m/s\n",
         "t.conf:4: [water] sound_speed = 1500 m/s: more than a section; expected [section] alone on its line"},
        {"key before any section", "range = 20 m\n" BASE,
         "t.conf:1: range = 20 m: no section before it; put a [section] line above it"},
    };
    CHECK_BROKEN(cases);
}

TEST(broken_lines)
{
    static const struct broken cases[] = {
        {"no equals sign", BASE "range 20 m\n",
         "t.conf:4: range 20 m: not a key and its value; expected key = value"},
        {"a colon is none", BASE "range: 20 m\n",
         "t.conf:4: range: 20 m: not a key and its value; expected key = value"},
        {"equals sign in a comment", BASE "range ; = 20 m\n",
         "t.conf:4: range ; = 20 m: not a key and its value; expected key = value"},
        {"no key", BASE "= 20 m\n", "t.conf:4: = 20 m: not a key and its value; expected key = value"},
        {"last line without newline", BASE "range",
         "t.conf:4: range: not a key and its value; expected key = value"},
        {"unknown key", BASE "[water]\ncolour = blue\n",
         "t.conf:5: [water] colour = blue: unknown key; expected one of sound_speed, density"},
        {"misspelt key", BASE "[extract]\ndetectr = soca\n",
         "t.conf:5: [extract] detectr = soca: unknown key; did you mean detector?"},
        {"key of another section", BASE "[extract]\nclear_for = 3 s\n",
         "t.conf:5: [extract] clear_for = 3 s: unknown key; it belongs in [grid]"},
        {"key of two other sections", BASE "[pose]\nforget = 10 s\n",
         "t.conf:5: [pose] forget = 10 s: unknown key; it belongs in [grid] or [map]"},
        {"upper case", BASE "Range = 20 m\n",
         "t.conf:4: [sonar a] Range = 20 m: unknown key; did you mean range?"},
        {"duplicate key", BASE "range = 20 m\n\nrange = 20 m\n",
         "t.conf:6: [sonar a] range = 20 m: duplicate key (first set on line 4)"},
        {"an indented line is no continuation", BASE "range = 20 m\n  30 m\n",
         "t.conf:5: 30 m: not a key and its value; expected key = value"},
        {"hash comment behind a value", BASE "range = 20 m # far\n",
         "t.conf:4: [sonar a] range = 20 m # far: a # after a value; start a comment with ;"},
        {"Latin-1",
         BASE "# Gr\xfc\xdf"
              "e\n",
         "t.conf:4: byte 0xfc in column 5; expected text in UTF-8; the rest was not checked"},
        {"overlong UTF-8", BASE "# \xc0\xaf\n",
         "t.conf:4: byte 0xc0 in column 3; expected text in UTF-8; the rest was not checked"},
        {"surrogate in UTF-8", BASE "# \xed\xa0\x80\n",
         "t.conf:4: byte 0xed in column 3; expected text in UTF-8; the rest was not checked"},
        {"escape sequence", BASE "[log]\nlevel = \x1b[31minfo\n",
         "t.conf:5: byte 0x1b in column 9; expected text in UTF-8; the rest was not checked"},
        {"missing device and port", "\n[sonar a]\nrange = 20 m\n",
         "t.conf:2: [sonar a] device: missing; expected the name of a device, for instance ping360\n"
         "t.conf:2: [sonar a] port: missing; expected KIND:ADDRESS, for instance serial:/dev/ttyUSB0:115200"},
    };
    CHECK_BROKEN(cases);
}

/* What is written is short where any unit of the key makes it so. */
TEST(a_value_is_written_as_it_was_given)
{
    static const struct {
        const char *section, *key, *value, *want;
    } rows[] = {{"pose", "heading_drift", "36 deg/h", "36 deg/h"},
                {"pose", "heading_drift", "0.05 deg/s", "0.05 deg/s"},
                {"vehicle", "max_turn", "90 deg", "90 deg/s"},
                {"vehicle", "max_turn", "7 deg/s", "7 deg/s"},
                {"grid", "clear_for", "1 min", "60 s"},
                {"pose", "heading_drift", "0.0123456789 deg/s", "0.0123456789 deg/s"}};
    struct conf conf;
    char text[256], written[CONF_VALUE_MAX];
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        snprintf(text, sizeof text, BASE "[%s]\n%s = %s\n", rows[i].section, rows[i].key, rows[i].value);
        CHECK_INT(load(&conf, text), 0);
        conf_value_write(conf_key_find(rows[i].section, rows[i].key), &conf, written, sizeof written);
        CHECK_STR(written, rows[i].want);
    }
}

TEST(broken_numbers_with_units)
{
    static const struct broken cases[] = {
        {"nothing", BASE "range =\n",
         "t.conf:4: [sonar a] range = : no value after =; expected 0.75 to 200 m " LENGTHS},
        {"turn in another unit", BASE "[vehicle]\nmax_turn = 90 grad\n",
         "t.conf:5: [vehicle] max_turn = 90 grad: unknown unit 'grad'; expected 0.1 to 1000 deg/s (rad/s, "
         "deg/s, "
         "deg/h), or as many deg, or told"},
        {"no number", BASE "range = far\n",
         "t.conf:4: [sonar a] range = far: 'far' is not a number; expected 0.75 to 200 m " LENGTHS},
        {"nan", BASE "range = nan m\n",
         "t.conf:4: [sonar a] range = nan m: 'nan m' is not a number; expected 0.75 to 200 m " LENGTHS},
        {"infinity", BASE "range = inf m\n",
         "t.conf:4: [sonar a] range = inf m: 'inf m' is not a number; expected 0.75 to 200 m " LENGTHS},
        {"hexadecimal", BASE "range = 0x10 m\n",
         "t.conf:4: [sonar a] range = 0x10 m: '0x10 m' is not a number; expected 0.75 to 200 m " LENGTHS},
        {"decimal comma", BASE "range = 2,5 m\n",
         "t.conf:4: [sonar a] range = 2,5 m: unknown unit ',5 m'; expected 0.75 to 200 m " LENGTHS},
        {"too large for a double", BASE "range = 1e999 m\n",
         "t.conf:4: [sonar a] range = 1e999 m: out of range; expected 0.75 to 200 m " LENGTHS},
        {"out of range", BASE "range = 0.5 km\n",
         "t.conf:4: [sonar a] range = 0.5 km: out of range; expected 0.75 to 200 m " LENGTHS},
        {"below the range", BASE "range = 74.9 cm\n",
         "t.conf:4: [sonar a] range = 74.9 cm: out of range; expected 0.75 to 200 m " LENGTHS},
        {"missing unit", BASE "range = 20\n",
         "t.conf:4: [sonar a] range = 20: the unit is missing; expected 0.75 to 200 m " LENGTHS},
        {"a zero has a unit, too", BASE "[grid]\nmove_limit = 0\n",
         "t.conf:5: [grid] move_limit = 0: the unit is missing; expected 0.05 to 100 m " LENGTHS ", or auto"},
        {"wrong unit", BASE "range = 20 s\n",
         "t.conf:4: [sonar a] range = 20 s: unknown unit 's'; expected 0.75 to 200 m " LENGTHS},
        {"unknown unit", BASE "range = 20 feet\n",
         "t.conf:4: [sonar a] range = 20 feet: unknown unit 'feet'; expected 0.75 to 200 m " LENGTHS},
        {"unit where none belongs", BASE "[extract]\nrank = 0.75 m\n",
         "t.conf:5: [extract] rank = 0.75 m: 'm' after a number without a unit; expected 0.05 to 1"},
        {"too few numbers", BASE "mount = 0.2 0 m\n",
         "t.conf:4: [sonar a] mount = 0.2 0 m: 2 of 3 numbers before 'm'; expected 3 numbers and one unit, each "
         "-50 "
         "to 50 "
         "m " LENGTHS},
        {"too many numbers", BASE "mount = 0.2 0 0 1 m\n",
         "t.conf:4: [sonar a] mount = 0.2 0 0 1 m: more than 3 numbers; expected 3 numbers and one unit, each -50 "
         "to "
         "50 m " LENGTHS},
        {"a unit for each", BASE "mount = 0.2 m 0 m 0 m\n",
         "t.conf:4: [sonar a] mount = 0.2 m 0 m 0 m: 1 of 3 numbers before 'm 0 m 0 m'; expected 3 numbers and "
         "one "
         "unit, each -50 to 50 m " LENGTHS},
        {"commas between numbers", BASE "mount = 0.2, 0, 0.1 m\n",
         "t.conf:4: [sonar a] mount = 0.2, 0, 0.1 m: 1 of 3 numbers before ', 0, 0.1 m'; expected 3 numbers and "
         "one "
         "unit, each -50 to 50 m " LENGTHS},
        {"too few numbers and no unit", BASE "mount = 0.2 0\n",
         "t.conf:4: [sonar a] mount = 0.2 0: 2 of 3 numbers; expected 3 numbers and one unit, each -50 to 50 "
         "m " LENGTHS},
    };
    CHECK_BROKEN(cases);
}

TEST(broken_whole_numbers_and_words)
{
    static const struct broken cases[] = {
        {"no whole number", BASE "gain = 1.5\n",
         "t.conf:4: [sonar a] gain = 1.5: '1.5' is not a whole number; expected 0 to 40, or auto"},
        {"whole number out of range", BASE "[pipeline]\nthreads = 3\n",
         "t.conf:5: [pipeline] threads = 3: out of range; expected 0 to 2"},
        {"whole number beyond int", BASE "[pipeline]\nqueue = 99999999999999999999\n",
         "t.conf:5: [pipeline] queue = 99999999999999999999: out of range; expected 2 to 1022"},
        {"a queue longer than the rings of the pipeline", BASE "[pipeline]\nqueue = 1023\n",
         "t.conf:5: [pipeline] queue = 1023: out of range; expected 2 to 1022"},
        {"zero is not off", BASE "[record]\nfiles = 0\n",
         "t.conf:5: [record] files = 0: out of range; expected 1 to 1000000, or all"},
        {"unknown word", BASE "[extract]\ndetector = best\n",
         "t.conf:5: [extract] detector = best: 'best' is not one of the words; expected ca, goca, soca or os"},
        {"not octal", BASE "[server]\nmode = 0680\n",
         "t.conf:5: [server] mode = 0680: '0680' is not an octal number; expected 0600 to 0777"},
        {"mode without the owner", BASE "[server]\nmode = 0066\n",
         "t.conf:5: [server] mode = 0066: out of range; expected 0600 to 0777"},
        {"relative path", BASE "[server]\nsocket = sonard.sock\n",
         "t.conf:5: [server] socket = sonard.sock: does not begin with a slash; expected an absolute path of at "
         "most "
         "107 bytes"},
        {"path too long",
         BASE "[server]\nsocket = /2345678901234567890123456789012345678901234567890123456789012345678901234567890"
              "1234567890123456789012345678\n",
         "t.conf:5: [server] socket = /234567890123456789012345678901234567890123456789012345678901234567890123456"
         "78901234567890123456789012345678: 108 bytes, more than the 107 there is room for; expected an absolute "
         "path "
         "of at most 107 bytes"},
        {"unknown device", "[sonar a]\ndevice = ping361\nport = serial:/dev/x:115200\n",
         "t.conf:2: [sonar a] device = ping361: no such device; expected ping360"},
        {"bad port", "[sonar a]\ndevice = ping360\nport = usb:1\n",
         "t.conf:3: [sonar a] port = usb:1: no such kind of port; expected serial:DEVICE:BAUD"},
        {"port of another section", BASE "[nmea]\nport = usb:1\n",
         "t.conf:5: [nmea] port = usb:1: no such kind of port; expected serial:DEVICE:BAUD"},
        {"bad source of depth", BASE "[depth]\nsource = usb:1\n",
         "t.conf:5: [depth] source = usb:1: no such source; expected modbus-rtu:DEVICE:BAUD"},
        {"no such line", BASE "power = nowhere\ntrigger = none\n[gpio]\nleak = nowhere\n",
         "t.conf:4: [sonar a] power = nowhere: there are no lines there\n"
         "t.conf:7: [gpio] leak = nowhere: there are no lines there"},
        {"port that is no address", "[sonar a]\ndevice = ping360\nport = /dev/ttyUSB0\n",
         "t.conf:3: [sonar a] port = /dev/ttyUSB0: no kind of port before the file; expected KIND:ADDRESS, for "
         "instance "
         "serial:/dev/ttyUSB0:115200"},
    };
    CHECK_BROKEN(cases);
}

TEST(broken_together)
{
#define SECTOR "; expected start and end at most one turn apart, clockwise, 0 360 deg for the full circle"
    static const struct broken cases[] = {
        {"step as large as the sector", BASE "sector = 350 10 deg\nstep = 20 deg\n",
         "t.conf:5: [sonar a] step = 20 deg: does not go with [sonar a] sector = 350 10 deg; expected a step "
         "smaller "
         "than the sector"},
        {"sector without width", BASE "sector = 90 90 deg\n",
         "t.conf:4: [sonar a] sector = 90 90 deg: starts where it ends" SECTOR},
        {"the full circle backwards", BASE "sector = 360 0 deg\n",
         "t.conf:4: [sonar a] sector = 360 0 deg: starts where it ends" SECTOR},
        {"more than a turn", BASE "sector = -90 300 deg\n",
         "t.conf:4: [sonar a] sector = -90 300 deg: more than one turn" SECTOR},
        {"more than a turn backwards", BASE "sector = 300 -90 deg\n",
         "t.conf:4: [sonar a] sector = 300 -90 deg: more than one turn" SECTOR},
        {"deaf sonar", BASE "ring_down = 2 m\nrange = 2 m\n",
         "t.conf:5: [sonar a] range = 2 m: does not go with [sonar a] ring_down = 2 m; expected ring_down smaller "
         "than "
         "range"},
        {"decibels of nothing", BASE "amplitude = log\n",
         "t.conf:4: [sonar a] amplitude = log: does not go with [sonar a] decibels_per_count = auto; expected "
         "decibels_per_count for amplitude = log"},
        {"free beyond the range", BASE "range = 2 m\n[extract]\nminimum_range = 3 m\n",
         "t.conf:6: [extract] minimum_range = 3 m: does not go with [sonar a] range = 2 m; expected minimum_range "
         "not "
         "beyond range"},
        {"near beyond the range", BASE "range = 5 m\n[vehicle]\nnear = 46 m\n",
         "t.conf:6: [vehicle] near = 46 m: does not go with [sonar a] range = 5 m; expected near not beyond the "
         "range "
         "of every sonar"},
        {"guard as long as the window", BASE "[extract]\nguard = 0.4 m\n",
         "t.conf:5: [extract] guard = 0.4 m: does not go with [extract] window = 0.4 m; expected guard smaller "
         "than "
         "window"},
        {"forgotten before it is unknown", BASE "[grid]\nclear_for = 2 min\nforget = 90 s\n",
         "t.conf:6: [grid] forget = 90 s: does not go with [grid] clear_for = 120 s; expected forget not shorter "
         "than "
         "clear_for"},
        {"given up before it can answer", BASE "[depth]\ntimeout = 2000 ms\n",
         "t.conf:5: [depth] timeout = 2000 ms: does not go with [depth] turnaround = 1000 ms; expected turnaround "
         "not "
         "shorter than timeout"},
        {"two depths",
         BASE "[depth]\nsource = modbus-rtu:/dev/x:9600\n[nmea]\nport = serial:/dev/y:4800\nuse = both\n",
         "t.conf:8: [nmea] use = both: does not go with [depth] source = modbus-rtu:/dev/x:9600; expected depth "
         "from "
         "one "
         "of them"},
        {"fewer processors than threads",
         BASE "[pipeline]\nthreads = 1\n[realtime]\npriority = 40\nprocessor = 3\n",
         "t.conf:5: [pipeline] threads = 1: does not go with [realtime] processor_count = 1; expected "
         "processor_count "
         "= 2: one for the loop and one for each thread"},
        {"a map kept nowhere", BASE "[map]\nsave_every = 60 s\n",
         "t.conf:5: [map] save_every = 60 s: does not go with [map] directory = none; expected a directory to "
         "save "
         "the "
         "map in"},
        {"backgrounds kept nowhere", BASE "[background]\nsave_every = 60 s\n",
         "t.conf:5: [background] save_every = 60 s: does not go with [sonar a] background = none; expected a file "
         "to "
         "save "
         "a sonar's template in"},
        {"a map that is a path", BASE "[map]\nload = ../a\n",
         "t.conf:5: [map] load = ../a: '../a' is not allowed in a name; expected last, the name of another map, "
         "or "
         "none"},
        {"a map from nowhere", BASE "[map]\nload = last\n",
         "t.conf:5: [map] load = last: does not go with [map] directory = none; expected a directory to load the "
         "map "
         "from"},
        {"one line for two sonars", BASE "[sonar b]\ndevice = ping360\nport = serial:/dev/x:9600\n",
         "t.conf:6: [sonar b] port = serial:/dev/x:9600: does not go with [sonar a] port = "
         "serial:/dev/x:115200; expected another serial port: each device needs its own"},
        {"told once where a value was refused", BASE "[grid]\nclear_for = 2 min\nforget = 90\n",
         "t.conf:6: [grid] forget = 90: the unit is missing; expected 1 to 86400 s (s, ms, min, h), or auto"},
        {"all at once, in the order of lines",
         "[sonar a]\ndevice = ping360\nrange = 900 m\n[sonar b]\nport = serial:/dev/y:115200\n[extract]\n"
         "window = 5 cm\nrnak = 1\n[extract]\n[log\n",
         "t.conf:1: [sonar a] port: missing; expected KIND:ADDRESS, for instance serial:/dev/ttyUSB0:115200\n"
         "t.conf:3: [sonar a] range = 900 m: out of range; expected 0.75 to 200 m " LENGTHS "\n"
         "t.conf:4: [sonar b] device: missing; expected the name of a device, for instance ping360\n"
         "t.conf:7: [extract] window = 0.05 m: does not go with [extract] guard = 0.1 m; expected guard smaller "
         "than "
         "window\n"
         "t.conf:8: [extract] rnak = 1: unknown key; did you mean rank?\n"
         "t.conf:9: [extract]: duplicate section (first defined on line 6)\n"
         "t.conf:10: [log: no ] at the end of the section; expected [section] alone on its line"},
    };
    CHECK_BROKEN(cases);
}

TEST(what_the_device_cannot)
{
    static const struct broken cases[] = {
        {"its key", BASE "range = 5 m\ngain = 7\n", "t.conf:5: [sonar a] gain = 7: expected 0 .. 6"},
        {"the second sonar's", BASE "[sonar b]\ndevice = ping360\nport = serial:/dev/y\ngain = 9\n",
         "t.conf:7: [sonar b] gain = 9: expected 0 .. 6"},
        {"a key of another section", BASE "[water]\nsound_speed = 1610 m/s\n",
         "t.conf:5: [sonar a] sound_speed = 1610 m/s: too fast"},
        {"a default", BASE "range = 66 m\n", "t.conf:2: [sonar a] mode = auto: not at 66 m"},
        {"not asked where a key is bad", BASE "gain = 7\nrange = 5\n",
         "t.conf:5: [sonar a] range = 5: the unit is missing; expected 0.75 to 200 m (m, cm, mm, km)"},
        {"not asked where a key is missing", "[sonar a]\ndevice = ping360\ngain = 7\n",
         "t.conf:1: [sonar a] port: missing; expected KIND:ADDRESS, for instance serial:/dev/ttyUSB0:115200"},
    };
    CHECK_BROKEN(cases);
}

TEST(a_nul_byte_is_refused)
{
    static const char text[] = BASE "range = 20\0 m\n";
    struct conf conf;
    CHECK_INT(load_bytes(&conf, text, sizeof text - 1), 1);
    CHECK_STR(faults_seen, "t.conf:4: byte 0x00 in column 11; expected text in UTF-8; the rest was not checked");
}

TEST(an_overlong_line_is_not_cut)
{
    char text[600], value[301];
    struct conf conf;
    memset(value, 'x', 300);
    value[300] = '\0';
    snprintf(text, sizeof text, BASE "[record]\ndirectory = /%s\n", value);
    CHECK_INT(load(&conf, text), 1);
    CHECK_STR(faults_seen, "t.conf:5: 313 bytes in this line; expected at most 197");
    snprintf(text, sizeof text, BASE "[record]\ndirectory = /%.184s\n", value);
    CHECK_INT(load(&conf, text), 0);
    CHECK_INT(strlen(conf.record.directory), 185);
    snprintf(text, sizeof text, BASE "[record]\ndirectory = /%.185s\n", value);
    CHECK_INT(load(&conf, text), 1);
    snprintf(text, sizeof text, BASE "# %s\n", value);
    CHECK_INT(load(&conf, text), 0);
}

TEST(the_ninth_sonar_is_refused)
{
    char text[2048] = "";
    struct conf conf;
    for (int i = 0; i < CONF_MAX_SONARS + 1; i++) {
        size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "[sonar s%d]\ndevice = ping360\nport = serial:x%d:1\n", i, i);
    }
    CHECK_INT(load(&conf, text), 1);
    CHECK_STR(faults_seen, "t.conf:25: [sonar s8]: too many sonars; expected at most 8");
    CHECK_INT(conf.n_sonars, CONF_MAX_SONARS);
}

TEST(more_grids_are_as_the_plain_one_but_for_what_they_say)
{
    struct conf conf;
    CHECK_INT(load(&conf, BASE "[grid near]\nrange = 5 m\n[grid]\nlayer = 0.2 m\nrange = 50 m\n"
                               "[grid far]\nangular_step = 5 deg\n"),
              0);
    CHECK_INT(conf.n_more_grids, 2);
    CHECK_STR(conf.more_grid[0].name, "near");
    CHECK_NEAR(conf.more_grid[0].range_max_m, 5, 0, 0);
    CHECK_NEAR(conf.more_grid[0].layer_m, 0.2, 0, 0);
    CHECK_STR(conf.more_grid[1].name, "far");
    CHECK_NEAR(conf.more_grid[1].range_max_m, 50, 0, 0);
    CHECK_NEAR(conf.more_grid[1].angular_step_rad, 5 * M_PI / 180, 1e-12, 0);
    CHECK_NEAR(conf.grid.angular_step_rad, 2 * M_PI / 180, 1e-12, 0);
    CHECK_INT(
        load(&conf, BASE
             "[grid main]\n[grid a]\n[grid a]\n[grid b]\nclear_for = 30 s\nforget = 10 s\n[grid c]\n[grid d]\n"
             "[grid e]\nforget = x\n"),
        5);
    CHECK_INT(conf.n_more_grids, CONF_MAX_GRIDS);
    CHECK(strstr(faults_seen, "[grid b] forget = 10 s: does not go with [grid b] clear_for = 30 s"));
    CHECK(strstr(faults_seen, "[grid e]: too many grids; expected at most 4 besides [grid]"));
}

TEST(faults_without_end_are_counted)
{
    static char text[6 * 2000 + 1];
    struct conf conf;
    for (size_t i = 0; i < 2000; i++)
        memcpy(text + 6 * i, "a = 1\n", 6);
    CHECK_INT(load(&conf, text), 2001);
    CHECK_INT(count_lines(faults_seen), CONF_FAULTS_MAX + 1);
    CHECK(strstr(faults_seen, "and 1501 more faults") != NULL);
}

TEST(a_file_that_cannot_be_read)
{
    struct conf conf;
    struct conf_source *source;
    size_t size;
    faults_seen[0] = '\0';
    CHECK_INT(conf_load(&conf, &source, "tests/no-such.conf", NULL, note_fault, NULL), -1);
    CHECK_STR(faults_seen,
              "tests/no-such.conf: cannot be read: No such file or directory; expected a readable file of at "
              "most 1048576 bytes");
    CHECK_STR(conf_source_text(source, &size), "");
    CHECK_INT(size, 0);
    conf_source_free(source);

    faults_seen[0] = '\0';
    CHECK_INT(conf_load(&conf, &source, "tests", NULL, note_fault, NULL), -1);
    CHECK_STR(faults_seen,
              "tests: cannot be read: Is a directory; expected a readable file of at most 1048576 bytes");
    conf_source_free(source);

    faults_seen[0] = '\0';
    CHECK_INT(conf_load(&conf, &source, "/dev/zero", NULL, note_fault, NULL), -1);
    CHECK_STR(faults_seen,
              "/dev/zero: cannot be read: File too large; expected a readable file of at most 1048576 bytes");
    conf_source_free(source);
}

TEST(defaults_are_valid_and_as_agreed)
{
    struct conf conf;
    conf_defaults(&conf);
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        struct fault fault;
        char text[CONF_VALUE_MAX];
        struct conf scratch;
        memset(&scratch, 0, sizeof scratch);
        const char *value = key->standard ? key->standard : key->example;
        if (!conf_value_read(key, value, &scratch, &fault)) {
            printf("[%s] %s = %s: %s\n", key->section, key->name, value, fault.text);
            test_case_failed = true;
            continue;
        }
        conf_value_write(key, &scratch, text, sizeof text);
        if (strcmp(key->name, "false_alarm") != 0) /* 1e-3 is 0.001 */
            CHECK_STR(text, value);
    }
    CHECK_INT(conf.n_sonars, 0);
    CHECK(conf.sonar[7].range_m == 20.0);
    CHECK(conf.sonar[0].gain == -1);
    CHECK(conf.sonar[0].ring_down_m == -1.0);
    CHECK(conf.sonar[0].sector_rad[1] == 2 * M_PI);
    CHECK(conf.extract.detector == CONF_SOCA && conf.extract.no_echo == CONF_NO_ECHO_HEARD);
    CHECK(conf.extract.false_alarm == 1e-3);
    CHECK(conf.grid.range_max_m == 0.0);
    CHECK(conf.grid.elevation == CONF_ELEVATION_FULL);
    CHECK_INT(conf.server.mode, 0660);
    CHECK_STR(conf.server.socket, "/run/sonard/sonard.sock");
    CHECK_STR(conf.record.directory, "");
    CHECK(conf.record.file_size_bytes == 256.0 * 1048576.0);
    CHECK_INT(conf.log.level, CONF_LOG_INFO);
}

TEST(words_are_in_the_order_of_their_enums)
{
    struct conf conf;
    CHECK_INT(load(&conf, BASE "amplitude = sqrt\nmode = request\n[extract]\ndetector = os\nno_echo = range\n"
                               "[grid]\nelevation = level\n[log]\nlevel = notice\n"),
              0);
    CHECK_INT(conf.sonar[0].amplitude, CONF_AMPLITUDE_SQRT);
    CHECK_INT(conf.sonar[0].mode, CONF_MODE_REQUEST);
    CHECK_INT(conf.extract.detector, CONF_OS);
    CHECK_INT(conf.extract.no_echo, CONF_NO_ECHO_RANGE);
    CHECK_INT(conf.grid.elevation, CONF_ELEVATION_LEVEL);
    CHECK_INT(conf.log.level, CONF_LOG_NOTICE);
    CHECK_INT(load(&conf, BASE "amplitude = log\ndecibels_per_count = 0.3137 dB\nmode = transmit\n[extract]\n"
                               "detector = goca\nno_echo = heard\n[log]\nlevel = debug\n"),
              0);
    CHECK_INT(conf.sonar[0].amplitude, CONF_AMPLITUDE_LOG);
    CHECK_INT(conf.sonar[0].mode, CONF_MODE_TRANSMIT);
    CHECK_INT(conf.extract.detector, CONF_GOCA);
    CHECK_INT(conf.extract.no_echo, CONF_NO_ECHO_HEARD);
    CHECK_INT(conf.log.level, CONF_LOG_DEBUG);
}

TEST(good_syntax)
{
    struct conf conf;
    CHECK_INT(load(&conf, "\xef\xbb\xbf# byte order mark, then all that is allowed: Gr\xc3\xbc\xc3\x9f"
                          "e\r\n"
                          "; another comment\r\n\r\n"
                          "[sonar front-2_B] ; the bow\r\n"
                          "  device=ping360\r\n"
                          "\tport =\tserial:/dev/x:115200 ; comment = here\r\n"
                          "mount = 0.2 -0 .1m   ; forward right down\r\n"
                          "rotation = 1e1\t+20 -30. deg\r\n"
                          "sector = -180 180 deg\r\n"
                          "[ sonar\tb ]\n"
                          "port = serial:y:1\ndevice = ping360\n"
                          "[server]\nmode = 600\n"
                          "[record]\ndirectory = /data/my captures; all"),
              0);
    CHECK_STR(faults_seen, "");
    CHECK_INT(conf.n_sonars, 2);
    CHECK_STR(conf.sonar[0].name, "front-2_B");
    CHECK_STR(conf.sonar[1].name, "b");
    CHECK_STR(conf.sonar[0].port, "serial:/dev/x:115200");
    CHECK(conf.sonar[0].mount_m[0] == 0.2 && conf.sonar[0].mount_m[2] == 0.1);
    CHECK(conf.sonar[0].mount_m[1] == 0.0 && !signbit(conf.sonar[0].mount_m[1]));
    CHECK(conf.sonar[0].rotation_rad[2] == -30 * (M_PI / 180));
    CHECK_INT(conf.server.mode, 0600);
    CHECK_STR(conf.record.directory, "/data/my captures; all");
}

TEST(units)
{
    static const struct {
        const char *text;
        double want;
    } lengths[] = {{"75 cm", 0.75},  {"1234.5mm", 1.2345}, {"0.1 km", 100.0}, {"115 cm", 1.15},
                   {"200 m", 200.0}, {"3.5e1 m", 35},      {"0.2 km", 200.0}},
      angles[] = {{"1 grad", 2 * M_PI / 400}, {"0.9 deg", 0.9 * (M_PI / 180)}, {"0.5 rad", 0.5}},
      times[] = {{"1500 ms", 1.5}, {"0.5 min", 30}, {"0.005 h", 18}, {"2 s", 2}},
      turns[] = {{"90 deg/s", 90 * (M_PI / 180)}, {"90 deg", 90 * (M_PI / 180)}, {"1.5 rad/s", 1.5}},
      drifts[] = {{"36 deg/h", 36 * (M_PI / 180) / 3600}, {"0.1 deg/s", 0.1 * (M_PI / 180)}},
      frequencies[] = {{"750 kHz", 750e3}, {"0.75 MHz", 750e3}, {"750000 Hz", 750e3}},
      sizes[] = {{"1048576 B", 1048576}, {"2048 KiB", 2097152}, {"1.5 MiB", 1572864}, {"2 GiB", 2147483648.0}};
    struct conf conf;
    char text[256];
#define CHECK_UNITS(table, lines, field)                                                                          \
    for (size_t i = 0; i < sizeof table / sizeof(table)[0]; i++) {                                                \
        snprintf(text, sizeof text, BASE lines " = %s\n", (table)[i].text);                                       \
        CHECK_INT(load(&conf, text), 0);                                                                          \
        CHECK_STR(faults_seen, "");                                                                               \
        CHECK(conf.field == (table)[i].want);                                                                     \
    }
    CHECK_UNITS(lengths, "range", sonar[0].range_m);
    CHECK_UNITS(angles, "step", sonar[0].step_rad);
    CHECK_UNITS(times, "[grid]\nclear_for", grid.clear_for_s);
    CHECK_UNITS(turns, "[vehicle]\nmax_turn", vehicle.max_turn_radps);
    CHECK_UNITS(drifts, "[pose]\nheading_drift", pose.heading_drift_radps);
    CHECK_UNITS(frequencies, "frequency", sonar[0].frequency_hz);
    CHECK_UNITS(sizes, "[record]\nfile_size", record.file_size_bytes);
}

TEST(words_stand_for_what_is_absent)
{
    struct conf conf;
    CHECK_INT(load(&conf, BASE "gain = auto\nfrequency = auto\nring_down = auto\ndecibels_per_count = auto\n"
                               "[grid]\nrange = auto\n[record]\ndirectory = none\nfiles = all\n"),
              0);
    CHECK_INT(conf.sonar[0].gain, -1);
    CHECK(conf.sonar[0].frequency_hz == 0 && conf.sonar[0].db_per_count == 0 && conf.sonar[0].ring_down_m < 0);
    CHECK(conf.grid.range_max_m == 0);
    CHECK_STR(conf.record.directory, "");
    CHECK_INT(conf.record.files, -1);
}

static char *to_text(void (*print)(const struct conf_checks *, FILE *out), const struct conf *conf,
                     const struct conf_source *source)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (print)
        print(&settings_checks, out);
    else
        conf_print(conf, source, out);
    fclose(out);
    return text;
}

/* Puts the process into a locale with a decimal comma; false when none is installed. */
static bool enter_comma_locale(void)
{
    static const char *const names[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "nb_NO.UTF-8", "es_ES.UTF-8", "de_DE"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (setlocale(LC_ALL, names[i]) && *localeconv()->decimal_point == ',')
            return true;
    setlocale(LC_ALL, "C");
    return false;
}

TEST(a_decimal_comma_outside_changes_nothing)
{
    struct conf conf;
    CHECK_INT(load(&conf, BASE "range = 2.5 m\n"), 0);
    CHECK(conf.sonar[0].range_m == 2.5);
    char *printed = to_text(NULL, &conf, NULL), *sample = to_text(conf_sample, NULL, NULL);
    CHECK(strstr(printed, "range = 2.5 m ") != NULL);
    CHECK(strstr(sample, "0.75 to 200 m") != NULL);
    free(printed);
    free(sample);
    CHECK_STR(localeconv()->decimal_point, ",");
    setlocale(LC_ALL, "C");
}

/* ---- keys of devices ---- */

#define SOUNDER "[sonar a]\ndevice = ping1d\nport = serial:/dev/x:115200\n"

/* Loads with the devices there are; `recorded` as from a recording. The source is for conf_source_free. */
static int load_for_devices(struct conf *conf, const char *text, bool recorded, struct conf_source **source)
{
    struct conf_checks real = settings_checks;
    real.recorded = recorded;
    faults_seen[0] = '\0';
    return conf_load_text(conf, source, &(struct conf_text){"t.conf", text, strlen(text)}, &real, note_fault,
                          NULL);
}

TEST(how_late_readings_and_poses_come)
{
    struct conf conf;
    CHECK_INT(load(&conf, BASE), 0);
    CHECK_NEAR(conf.sonar[0].delay_s[0], -1, 0, 0);
    CHECK_NEAR(conf.pose.delay_s[0], 0, 0, 0);
    CHECK_NEAR(conf.pose.delay_s[1], 0, 0, 0);
    CHECK_INT(load(&conf, BASE "delay = 500 300 ms\n[pose]\ndelay = 0.1 0.05 s\n"), 0);
    CHECK_NEAR(conf.sonar[0].delay_s[0], 0.5, 0, 0);
    CHECK_NEAR(conf.sonar[0].delay_s[1], 0.3, 0, 0);
    CHECK_NEAR(conf.pose.delay_s[0], 0.1, 0, 0);
    CHECK_NEAR(conf.pose.delay_s[1], 0.05, 0, 0);
    static const struct broken cases[] = {
        {"no uncertainty", BASE "delay = 0.5 s\n",
         "t.conf:4: [sonar a] delay = 0.5 s: 1 of 2 numbers before 's'; expected 2 numbers and one unit, each 0 "
         "to 2 "
         "s "
         "(s, ms, min, h), or auto"},
        {"too late", BASE "[pose]\ndelay = 3 0 s\n",
         "t.conf:5: [pose] delay = 3 0 s: out of range; expected 2 numbers and one unit, each 0 to 2 s (s, ms, "
         "min, "
         "h)"},
    };
    CHECK_BROKEN(cases);
}

TEST(a_key_without_use_for_the_device_is_refused)
{
    static const struct broken cases[] = {
        {"a step", SOUNDER "step = 3.6 deg\n",
         "t.conf:4: [sonar a] step = 3.6 deg: ping1d does not use this key; remove it"},
        {"its default", SOUNDER "node = any\n",
         "t.conf:4: [sonar a] node = any: ping1d does not use this key; remove it"},
        {"before the device is named", "[sonar a]\nscan = active\ndevice = ping1d\nport = serial:/dev/x:115200\n",
         "t.conf:2: [sonar a] scan = active: ping1d does not use this key; remove it"},
        {"a bad value too, but once", SOUNDER "step = 3.6\n",
         "t.conf:4: [sonar a] step = 3.6: the unit is missing; expected 0.1 to 90 deg (rad, deg, grad)"},
        {"none where the device is unknown",
         "[sonar a]\ndevice = ping9\nport = serial:/dev/x:115200\nnode = any\n", NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct conf conf;
        struct conf_source *source;
        CHECK_INT(load_for_devices(&conf, cases[i].text, false, &source), 1);
        if (cases[i].want)
            CHECK_STR(faults_seen, cases[i].want);
        else
            CHECK(strstr(faults_seen, "node") == NULL);
        conf_source_free(source);
    }
}

TEST(a_recording_may_have_keys_without_use)
{
    struct conf conf, plain;
    struct conf_source *source, *none;
    CHECK_INT(load_for_devices(&plain, SOUNDER, false, &none), 0);
    CHECK_INT(load_for_devices(&conf, SOUNDER "step = 3.6 deg\ngain = 2\n", true, &source), 0);
    CHECK_INT(conf.sonar[0].gain, 2);
    CHECK(conf.sonar[0].step_rad == plain.sonar[0].step_rad);
    conf_source_free(source);
    conf_source_free(none);
}

TEST(print_leaves_keys_without_use_out)
{
    struct conf conf, again;
    struct conf_source *source, *second;
    CHECK_INT(load_for_devices(&conf,
                               SOUNDER "mode = request\n[sonar b]\ndevice = ping360\nport = udp:127.0.0.1:9\n",
                               false, &source),
              0);
    char *printed = to_text(NULL, &conf, source), *of_b = strstr(printed, "[sonar b]");
    CHECK(of_b != NULL && strstr(of_b, "\nstep = 0.9 deg ") != NULL && strstr(of_b, "\nnode = ") == NULL);
    *of_b = '\0';
    CHECK(strstr(printed, "\nstep = ") == NULL && strstr(printed, "\nmin_confidence = 0.5 ") != NULL);
    *of_b = '[';
    CHECK_INT(load_for_devices(&again, printed, false, &second), 0);
    CHECK(memcmp(&conf, &again, sizeof conf) == 0);
    free(printed);
    conf_source_free(source);
    conf_source_free(second);
}

/* What drivers declare are rows of the table, and every such row has a driver. */
TEST(devices_declare_keys_of_the_table)
{
    for (const struct device_ops *const *ops = device_table; *ops; ops++) {
        CHECK((device_key_find(*ops, "scan") != NULL) == ((*ops)->steer != NULL));
        CHECK((device_key_find(*ops, "amplitude") != NULL) ==
              ((*ops)->max_bins > 1 && !(*ops)->chooses)); /* it has intensities */
        for (const struct device_key *key = (*ops)->keys; key && key->name; key++) {
            const struct conf_key *row = conf_key_find("sonar", key->name);
            CHECK(row != NULL && row->standard != NULL && key->lo <= key->hi);
        }
    }
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        char text[CONF_VALUE_MAX] = "";
        settings_checks.users(key->name, text, sizeof text);
        CHECK(!key->of_device || (conf_key_is_sonar(key) && key->standard && *text));
    }
}

TEST(print_says_where_from)
{
    struct conf conf;
    struct conf_source *source;
    const char *text = BASE "range = 5 m\n[grid]\nmove_limit = 40 cm\n";
    CHECK_INT(conf_load_text(&conf, &source, &(struct conf_text){"a\nb.conf", text, strlen(text)}, NULL,
                             note_fault, NULL),
              0);
    char *printed = to_text(NULL, &conf, source);
    CHECK(strstr(printed, "range = 5 m                              ; a?b.conf:4\n") != NULL);
    CHECK(strstr(printed, "move_limit = 0.4 m                       ; a?b.conf:6\n") != NULL);
    CHECK(strstr(printed, "layer = 0.05 m                           ; default\n") != NULL);
    free(printed);
    conf_source_override(source, "grid", "move_limit", "--limit");
    printed = to_text(NULL, &conf, source);
    CHECK(strstr(printed, "move_limit = 0.4 m                       ; --limit\n") != NULL);
    size_t size;
    CHECK_STR(conf_source_text(source, &size), text);
    CHECK_INT(size, strlen(text));
    free(printed);
    conf_source_free(source);
}

/* A text of one key with a random good value. */
static void random_value(const struct conf_key *key, uint64_t *seed, void *base)
{
    void *field = (char *)base + key->offset;
    if (key->instead && test_random(seed) % 4 == 0) {
        struct fault fault;
        conf_value_read(key, key->instead, base, &fault);
        return;
    }
    struct fault fault;
    char text[CONF_VALUE_MAX], path[CONF_TEXT_MAX];
    size_t used = 0, length = 1 + test_random(seed) % (key->size < 170 ? key->size - 1 : 170);
    switch (key->kind) {
    case CONF_QUANTITY:
        if (key->named && test_random(seed) % 2) {
            CHECK(conf_value_read(key, key->named->word, base, &fault));
            return;
        }
        for (int i = 0; i < key->n; i++)
            used += (size_t)snprintf(text + used, sizeof text - used, "%.17g ",
                                     key->lo + (key->hi - key->lo) * test_uniform(seed));
        snprintf(text + used, sizeof text - used, "%s", key->unit ? key->unit : "");
        if (!key->unit)
            text[used - 1] = '\0';
        CHECK(conf_value_read(key, text, base, &fault));
        /* A value that came in another unit need not have a short form in the key's own. */
        if (test_random(seed) % 2)
            ((double *)field)[0] = nextafter(((double *)field)[0], 0);
        return;
    case CONF_INTEGER:
    case CONF_OCTAL:
        *(int *)field = (int)(key->lo + floor((key->hi - key->lo + 1) * test_uniform(seed)));
        return;
    case CONF_WORD:
        for (length = 0; key->words[length]; length++)
            ;
        *(int *)field = (int)(test_random(seed) % length);
        return;
    case CONF_TEXT:
    case CONF_PATH:
    case CONF_NAME:
    case CONF_NAMES:
        for (size_t i = 0; i < length; i++)
            path[i] = key->kind == CONF_NAME    ? "abcXYZ019-_"[test_random(seed) % 11]
                      : key->kind == CONF_NAMES ? "abcXYZ019@-_.$"[test_random(seed) % 14]
                                                : "abcdefghijklmnopqrstuvwxyz/:;#=[].-_"[test_random(seed) % 36];
        path[0] = key->kind == CONF_PATH ? '/' : 'p';
        path[length] = '\0';
        memset(field, 0, key->size);
        memcpy(field, path, length);
        return;
    }
}

/* How many sections have the key. */
static int copies(const struct conf *conf, const struct conf_key *key)
{
    return conf_key_is_sonar(key) ? conf->n_sonars : strcmp(key->section, "grid") ? 1 : 1 + conf->n_more_grids;
}

static void random_conf(struct conf *conf, uint64_t *seed)
{
    conf_defaults(conf);
    conf->n_more_grids = (int)(test_random(seed) % (CONF_MAX_GRIDS + 1));
    for (int i = 0; i < conf->n_more_grids; i++)
        snprintf(conf->more_grid[i].name, sizeof conf->more_grid[i].name, "g%d", i);
    conf->n_sonars = 1 + (int)(test_random(seed) % CONF_MAX_SONARS);
    for (const struct conf_key *key = conf_keys; key->name; key++)
        for (int i = 0; i < copies(conf, key); i++)
            random_value(key, seed, (char *)conf + conf_base(key, i));
    /* what the rules ask for */
    conf->extract.guard_m = fmin(conf->extract.window_m, 10) * test_uniform(seed);
    conf->extract.minimum_range_m = 0.1 + 0.6 * test_uniform(seed);
    conf->grid.forget_s = fmax(conf->grid.forget_s, conf->grid.clear_for_s);
    for (int i = 0; i < conf->n_more_grids; i++)
        conf->more_grid[i].forget_s = fmax(conf->more_grid[i].forget_s, conf->more_grid[i].clear_for_s);
    conf->extract.classes = CONF_ON; /* somebody looks at the median and at CLAHE */
    conf->nmea.use = CONF_NMEA_HEADING;
    if (!conf->map.directory[0]) {
        conf->map.save_every_s = 0;
        memset(conf->map.load, 0, sizeof conf->map.load);
    }
    conf->background.save_every_s = 0;
    if (conf->realtime.processor_count < 1 + conf->pipeline.threads)
        conf->realtime.processor_count = 1 + conf->pipeline.threads;
    conf->depth.turnaround_s = fmax(conf->depth.turnaround_s, conf->depth.timeout_s);
    for (int i = 0; i < conf->n_sonars; i++) {
        struct conf_sonar *s = &conf->sonar[i];
        snprintf(s->name, sizeof s->name, "s%d", i);
        s->sector_rad[0] = 2 * M_PI * test_uniform(seed);
        s->sector_rad[1] = s->sector_rad[0] - 1 - 2 * test_uniform(seed);
        s->range_m = fmax(s->range_m, 0.75);
        s->ring_down_m = fmin(s->ring_down_m, s->range_m / 2);
        if (s->amplitude == CONF_AMPLITUDE_LOG && s->db_per_count == 0)
            s->db_per_count = 0.3137;
    }
    conf->vehicle.near_m = fmin(conf->vehicle.near_m, conf->sonar[0].range_m);
}

TEST(print_loads_to_the_same_bits)
{
    uint64_t seed = test_seed();
    for (int round = 0; round < 500; round++) {
        struct conf conf, again;
        random_conf(&conf, &seed);
        char *printed = to_text(NULL, &conf, NULL);
        struct conf_source *source;
        faults_seen[0] = '\0';
        int n = conf_load_text(&again, &source, &(struct conf_text){"printed", printed, strlen(printed)}, NULL,
                               note_fault, NULL);
        char *second = to_text(NULL, &again, NULL);
        bool same = true;
        for (const struct conf_key *key = conf_keys; key->name; key++)
            for (int i = 0; i < copies(&conf, key); i++) {
                const size_t at = conf_base(key, i) + key->offset;
                same = same && memcmp((char *)&conf + at, (char *)&again + at, key->size) == 0;
            }
        CHECK_STR(faults_seen, "");
        CHECK_INT(n, 0);
        CHECK_INT(again.n_sonars, conf.n_sonars);
        CHECK(same);
        CHECK(strcmp(printed, second) == 0);
        free(printed);
        free(second);
        /* with the origins of a long file name in it, it still loads */
        char name[200];
        memset(name, 'n', sizeof name - 1);
        name[sizeof name - 1] = '\0';
        conf_source_free(source);
        char *plain = to_text(NULL, &conf, NULL);
        conf_load_text(&again, &source, &(struct conf_text){name, plain, strlen(plain)}, NULL, note_fault, NULL);
        printed = to_text(NULL, &again, source);
        CHECK_INT(load(&conf, printed) < 0, 0);
        CHECK(strstr(faults_seen, "bytes in this line") == NULL);
        conf_source_free(source);
        free(plain);
        free(printed);
        if (test_case_failed)
            return;
    }
}

static char *read_all(const char *path)
{
    FILE *file = fopen(path, "r");
    if (!file)
        return strdup("");
    char *text = calloc(1, 1 << 20);
    size_t n = fread(text, 1, (1 << 20) - 1, file);
    text[n] = '\0';
    fclose(file);
    return text;
}

TEST(the_default_file_is_the_sample)
{
    char *file = read_all("config/sonard.conf"), *sample = to_text(conf_sample, NULL, NULL);
    CHECK(strcmp(file, sample) == 0);
    free(file);
    free(sample);
}

/* The sample shows defaults behind a '#': with the '#' away it must load to the same. */
TEST(the_sample_uncommented_is_the_default)
{
    char *sample = to_text(conf_sample, NULL, NULL);
    struct conf conf, plain;
    CHECK_INT(load(&plain, sample), 0);
    for (char *line = sample; line; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : NULL)
        if (line[0] == '#' && line[1] >= 'a' && line[1] <= 'z')
            line[0] = ' ';
    CHECK_INT(load(&conf, sample), 0);
    CHECK_STR(faults_seen, "");
    CHECK(memcmp(&conf, &plain, sizeof conf) == 0);
    free(sample);
}

TEST(shipped_files_load)
{
    glob_t found;
    CHECK_INT(glob("config/scenes/*.conf", 0, NULL, &found), 0);
    CHECK(found.gl_pathc >= 3);
    for (size_t i = 0; i < found.gl_pathc; i++) {
        struct conf conf;
        struct conf_source *source;
        faults_seen[0] = '\0';
        CHECK_INT(conf_load(&conf, &source, found.gl_pathv[i], &checks, note_fault, NULL), 0);
        CHECK_STR(faults_seen, "");
        conf_source_free(source);
    }
    globfree(&found);
}

TEST(the_man_table_has_every_key)
{
    char *man = to_text(conf_table_man, NULL, NULL), row[64];
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        snprintf(row, sizeof row, ".TP\n.B %s\n", key->name);
        CHECK(strstr(man, row) != NULL);
    }
    CHECK(strstr(man, "Default: 0.9 deg.\n") != NULL);
    CHECK(strstr(man, "\nOnly for ping1d.\n") != NULL);
    CHECK(strstr(man, "\n'") == NULL);
    free(man);
}

int main(void)
{
    RUN(broken_sections);
    RUN(broken_lines);
    RUN(broken_numbers_with_units);
    RUN(broken_whole_numbers_and_words);
    RUN(broken_together);
    RUN(what_the_device_cannot);
    RUN(a_nul_byte_is_refused);
    RUN(an_overlong_line_is_not_cut);
    RUN(the_ninth_sonar_is_refused);
    RUN(more_grids_are_as_the_plain_one_but_for_what_they_say);
    RUN(faults_without_end_are_counted);
    RUN(a_file_that_cannot_be_read);
    RUN(defaults_are_valid_and_as_agreed);
    RUN(words_are_in_the_order_of_their_enums);
    RUN(good_syntax);
    RUN(units);
    RUN(a_value_is_written_as_it_was_given);
    RUN(words_stand_for_what_is_absent);
    if (enter_comma_locale())
        RUN(a_decimal_comma_outside_changes_nothing);
    else
        printf("skip a_decimal_comma_outside_changes_nothing: no locale with a decimal comma is installed\n");
    RUN(how_late_readings_and_poses_come);
    RUN(a_key_without_use_for_the_device_is_refused);
    RUN(a_recording_may_have_keys_without_use);
    RUN(print_leaves_keys_without_use_out);
    RUN(devices_declare_keys_of_the_table);
    RUN(print_says_where_from);
    RUN(print_loads_to_the_same_bits);
    RUN(the_default_file_is_the_sample);
    RUN(the_sample_uncommented_is_the_default);
    RUN(shipped_files_load);
    RUN(the_man_table_has_every_key);
    return test_end();
}
