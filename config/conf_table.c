/* SPDX-License-Identifier: MIT */
/*
 * conf_table - the rows. Defaults are those of a small ROV with one scanning head: safe in a tank and in a harbour.
 * Texts in here are read by pilots: in the sample file and in sonard.conf(5).
 */
#include "conf_table.h"

#include <string.h>

#include "conf.h"

#define SONAR(field) .offset = offsetof(struct conf_sonar, field), .size = sizeof(((struct conf_sonar *)0)->field)
#define CONF(field)  .offset = offsetof(struct conf, field), .size = sizeof(((struct conf *)0)->field)
#define WORDS(...)                                                                                                \
    .kind = CONF_WORD, .words = (const char *const[])                                                             \
    {                                                                                                             \
        __VA_ARGS__, NULL                                                                                         \
    }
#define INTEGER(a, b)            .kind = CONF_INTEGER, .lo = (a), .hi = (b)
#define NUMBER(a, b)             .kind = CONF_QUANTITY, .n = 1, .lo = (a), .hi = (b)
#define QUANTITY(count, u, a, b) .kind = CONF_QUANTITY, .n = (count), .unit = (u), .lo = (a), .hi = (b)

const struct conf_section conf_sections[] = {
    {"sonar", "A sonar on this vehicle. Between one and eight of these sections, each with a name of its own:\n"
              "up to 31 letters, digits, - and _. The name is what answers, logs and captures call it."},
    {"water", "The water the vehicle is in."},
    {"extract", "How the first echo of a beam is told from noise (CFAR: constant false-alarm rate)."},
    {"grid", "The map of free water around the vehicle, and what counts as blocked and as clear."},
    {"pose", "What is known about where the vehicle is and how it lies."},
    {"server", "The socket on which questions are answered."},
    {"pipeline", "How the work is spread over processors. Changes the time an answer takes, never the answer."},
    {"record", "Captures of everything the sonars say, as MCAP files."},
    {"log", "What is written to standard error, or to the journal."},
    {NULL, NULL},
};

const struct conf_key conf_keys[] = {
    {"sonar", "device", .kind = CONF_TEXT, .form = "the name of a device, for instance ping360",
     .example = "ping360", SONAR(device), .help = "What kind of sonar it is."},
    {"sonar", "port", .kind = CONF_TEXT, .form = "KIND:ADDRESS, for instance serial:/dev/ttyUSB0:115200",
     .example = "serial:/dev/ttyUSB0:115200", SONAR(port),
     .help = "Where it is connected. For a serial line the device file and the speed in baud; names below\n"
             "/dev/serial/by-id/ stay the same when plugs are moved. A scanning head at 115200 baud is limited\n"
             "by the line: choose a faster one where the sonar can follow."},
    {"sonar", "range", QUANTITY(1, "m", 0.75, 200), .standard = "20 m", SONAR(range_m),
     .help = "How far to listen. A longer range makes every turn of a scanning head slower and bins coarser;\n"
             "20 m is several times the way in which a small ROV stops."},
    {"sonar", "gain", INTEGER(0, 10), .standard = "auto", .instead = "auto", .instead_value = -1, SONAR(gain),
     .help = "Receiver gain on the device's own scale (ping360: 0, 1 or 2). auto: the device's default."},
    {"sonar", "sector", QUANTITY(2, "deg", -360, 360), .standard = "0 360 deg", SONAR(sector_rad),
     .help = "First and last azimuth of the scan in the sensor's frame, clockwise from first to last; 0 is\n"
             "the head's own forward. 0 360 is the full circle, 300 60 is the third ahead. A smaller sector is\n"
             "seen more often, and everything outside it stays unknown."},
    {"sonar", "step", QUANTITY(1, "deg", 0.1, 90), .standard = "0.9 deg", SONAR(step_rad),
     .help = "Angle from one ping to the next; less than the sector. 0.9 deg is the finest step of a Ping360,\n"
             "1.8 deg scans twice as fast and still overlaps its 2 deg beam."},
    {"sonar", "mode", WORDS("auto", "transmit", "request"), .standard = "auto", SONAR(mode),
     .help = "transmit: the sonar pings by itself, which is faster; request: every ping is asked for, which\n"
             "old firmware needs. auto: transmit, and request when the sonar refuses."},
    {"sonar", "frequency", QUANTITY(1, "kHz", 10, 3000), .standard = "auto", .instead = "auto", .instead_value = 0,
     SONAR(frequency_hz), .help = "Transmit frequency. auto: the device's default (ping360: 750 kHz)."},
    {"sonar", "mount", QUANTITY(3, "m", -50, 50), .standard = "0 0 0 m", SONAR(mount_m),
     .help = "Where the transducer sits in the vehicle: forward, right, down from the vehicle's reference point."},
    {"sonar", "rotation", QUANTITY(3, "deg", -360, 360), .standard = "0 0 0 deg", SONAR(rotation_rad),
     .help = "How it is turned against the vehicle: roll, pitch, yaw. A head that hangs upside down has 180 0 0."},
    {"sonar", "amplitude", WORDS("auto", "linear", "power", "sqrt", "log"), .standard = "auto", SONAR(amplitude),
     .help = "What the intensities stand for: counts proportional to sound pressure (linear), to power, to the\n"
             "square root of pressure (sqrt), or to decibels (log). auto: what is known of the device. A wrong\n"
             "one makes the detector deaf or nervous."},
    {"sonar", "decibels_per_count", QUANTITY(1, "dB", 0.001, 0.47), .standard = "auto", .instead = "auto",
     .instead_value = 0, SONAR(db_per_count),
     .help = "For amplitude = log, which needs it: decibels of one count, for instance 0.3137 dB where 80 dB\n"
             "are spread over 0 to 255."},
    {"sonar", "ring_down", QUANTITY(1, "m", 0.01, 20), .standard = "auto", .instead = "auto", .instead_value = -1,
     SONAR(ring_down_m),
     .help = "Nothing is believed nearer than this, because the transducer still rings; less than range.\n"
             "auto: found from the device and from every beam."},

    {"water", "sound_speed", QUANTITY(1, "m/s", 1350, 1650), .standard = "1500 m/s", CONF(water.sound_speed_mps),
     .help = "Speed of sound. 1500 m/s is that of sea water of 13 C; fresh water of 10 C has 1447 m/s.\n"
             "All ranges scale with it."},

    {"extract", "detector", WORDS("ca", "goca", "soca", "os"), .standard = "soca", CONF(extract.detector),
     .help = "Which reference cells set the threshold: the mean of all (ca), the greater (goca) or the smaller\n"
             "(soca) of the two side means, or an order statistic (os). soca finds a weak wall beside a strong\n"
             "echo, which is what a collision is made of; goca is the quietest."},
    {"extract", "false_alarm", NUMBER(1e-12, 0.1), .standard = "1e-4", CONF(extract.false_alarm),
     .help = "Probability that a bin of pure noise is taken for an echo. 1e-4 is one in ten thousand bins, or\n"
             "about one false echo in eight beams of 1200 bins."},
    {"extract", "window", QUANTITY(1, "m", 0.005, 20), .standard = "0.4 m", CONF(extract.window_m),
     .help = "Length of the reference cells on each side of the cell under test."},
    {"extract", "guard", QUANTITY(1, "m", 0, 10), .standard = "0.1 m", CONF(extract.guard_m),
     .help = "Cells left out beside the cell under test, on each side, so that an echo does not raise its own\n"
             "threshold: at least the length of the pulse; less than window."},
    {"extract", "rank", NUMBER(0.05, 1), .standard = "0.75", CONF(extract.rank),
     .help = "For detector = os: which of the sorted reference cells, as a share of their number. 0.75 bears a\n"
             "quarter of the cells being echoes themselves."},
    {"extract", "floor", INTEGER(0, 65535), .standard = "8", CONF(extract.floor_counts),
     .help = "Bins at or below this many counts are never an echo. Sonars send stretches of zeros, over which\n"
             "any stray count would stand out."},
    {"extract", "min_contrast", QUANTITY(1, "dB", 0, 100), .standard = "14 dB", CONF(extract.min_contrast_db),
     .help = "How far an echo must rise above its surroundings. The false-alarm rule alone takes every ripple of\n"
             "reverberation for an echo; a hull, a wall or a pile stands out by far more than this."},
    {"extract", "no_echo", WORDS("minimum", "heard", "range"), .standard = "minimum", CONF(extract.no_echo),
     .help = "How far the water is taken as free where a beam found nothing. minimum: to minimum_range, the\n"
             "cautious rule; heard: as far as the beam heard its own noise floor; range: to the end of the\n"
             "range, which trusts silence and may call a soft wall free water."},
    {"extract", "minimum_range", QUANTITY(1, "m", 0.1, 200), .standard = "0.75 m", CONF(extract.minimum_range_m),
     .help =
         "For no_echo = minimum: how far the water is free where a beam found nothing. Not beyond the range of\n"
         "any sonar."},

    {"grid", "range", QUANTITY(1, "m", 0.75, 200), .standard = "auto", .instead = "auto", .instead_value = 0,
     CONF(grid.range_max_m), .help = "How far the map reaches. auto: as far as the sonar with the longest range."},
    {"grid", "angular_step", QUANTITY(1, "deg", 0.5, 15), .standard = "2 deg", CONF(grid.angular_step_rad),
     .help = "Width of a direction. About the width of the beam; finer costs memory and finds nothing."},
    {"grid", "layer", QUANTITY(1, "m", 0.01, 5), .standard = "0.05 m", CONF(grid.layer_m),
     .help = "Thickness of the nearest layers of cells."},
    {"grid", "growth", NUMBER(1, 2), .standard = "1.035", CONF(grid.growth),
     .help =
         "Beyond, each layer is thicker than the one before it by this factor; 1 keeps all alike. 1.035 keeps\n"
         "cells about as deep as they are wide."},
    {"grid", "elevation", WORDS("full", "level"), .standard = "full", CONF(grid.elevation),
     .help = "full: directions over the whole sphere; level: one row of directions, for a level sonar on a\n"
             "vehicle that stays level. level is cheaper and knows nothing of above and below."},
    {"grid", "max_cells", INTEGER(1024, 16777216), .standard = "65536", CONF(grid.max_cells),
     .help = "Cells there is room for; all memory is taken at the start."},
    {"grid", "blocked_above", NUMBER(0.51, 0.99), .standard = "0.6", CONF(grid.blocked_above),
     .help = "Probability from which a cell is an obstacle. Lower: earlier warnings, more of them false."},
    {"grid", "clear_for", QUANTITY(1, "s", 0.5, 86400), .standard = "30 s", CONF(grid.clear_for_s),
     .help = "A direction counts as clear for this long after its last ping, then it is unknown. Longer than one\n"
             "turn of the head, which takes 9 to 35 s; not longer than forget."},
    {"grid", "forget", QUANTITY(1, "s", 1, 86400), .standard = "60 s", CONF(grid.forget_s),
     .help =
         "Time constant in which an obstacle that is not seen again fades; not shorter than clear_for, so that\n"
         "a direction is never called clear because its obstacle was forgotten."},
    {"grid", "move_limit", QUANTITY(1, "m", 0.05, 100), .standard = "0.5 m", CONF(grid.move_limit_m),
     .help =
         "A direction that was clear is unknown again after the vehicle has moved this far without seeing it."},

    {"pose", "max_age", QUANTITY(1, "s", 0.01, 3600), .standard = "1 s", CONF(pose.max_age_s),
     .help = "An older pose is stale, and what needs it is unknown."},

    {"server", "socket", .kind = CONF_PATH, .standard = "/run/sonard/sonard.sock", CONF(server.socket),
     .form = "an absolute path of at most 107 bytes", .help = "Path of the UNIX socket."},
    {"server", "mode", .kind = CONF_OCTAL, .lo = 0600, .hi = 0777, .standard = "0660", CONF(server.mode),
     .help = "Permission bits of the socket, in octal: who may ask. 0660 is the user and the group."},
    {"server", "max_clients", INTEGER(1, 1024), .standard = "64", CONF(server.max_clients),
     .help = "Connections at a time; one more is refused."},

    {"pipeline", "threads", INTEGER(0, 2), .standard = "0", CONF(pipeline.threads),
     .help = "Threads beside the event loop. 0: all in the loop, enough for one scanning head; 1: extraction and\n"
             "map together in one; 2: one for each."},
    {"pipeline", "queue", INTEGER(2, 1024), .standard = "16", CONF(pipeline.queue),
     .help = "Pings that may wait. When the queue is full the oldest is dropped and counted."},

    {"record", "directory", .kind = CONF_PATH, .standard = "none", .instead = "none", CONF(record.directory),
     .form = "an absolute path", .help = "Where captures go. none: nothing is recorded."},
    {"record", "file_size", QUANTITY(1, "MiB", 1, 65536), .standard = "256 MiB", CONF(record.file_size_bytes),
     .help = "A new file is begun when one has reached this size."},
    {"record", "files", INTEGER(1, 1000000), .standard = "8", .instead = "all", .instead_value = -1,
     CONF(record.files),
     .help = "How many files are kept; the oldest beyond them is removed. all: none is removed."},

    {"log", "level", WORDS("err", "warning", "notice", "info", "debug"), .standard = "info", CONF(log.level),
     .help = "Least important event that is still written."},
    {.name = NULL},
};

_Static_assert(sizeof conf_keys / sizeof conf_keys[0] <= CONF_KEYS_MAX, "CONF_KEYS_MAX is too small");

const struct conf_key *conf_key_find(const char *section, const char *name)
{
    for (const struct conf_key *key = conf_keys; key->name; key++)
        if (strcmp(key->section, section) == 0 && strcmp(key->name, name) == 0)
            return key;
    return NULL;
}

const struct conf_section *conf_section_find(const char *name)
{
    for (const struct conf_section *section = conf_sections; section->name; section++)
        if (strcmp(section->name, name) == 0)
            return section;
    return NULL;
}

bool conf_key_is_sonar(const struct conf_key *key)
{
    return strcmp(key->section, "sonar") == 0;
}
