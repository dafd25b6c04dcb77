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
#define LIVE                     .live = true
#define LINE_FORM                "name of a GPIO line, for instance GPIO17"
#define INTEGER(a, b)            .kind = CONF_INTEGER, .lo = (a), .hi = (b)
#define NUMBER(a, b)             .kind = CONF_QUANTITY, .n = 1, .lo = (a), .hi = (b)
#define QUANTITY(count, u, a, b) .kind = CONF_QUANTITY, .n = (count), .unit = (u), .lo = (a), .hi = (b)

const struct conf_section conf_sections[] = {
    {"sonar", "A sonar on this vehicle. Between one and eight of these sections, each with a name of its own:\n"
              "up to 31 letters, digits, - and _. The name is what answers, logs and captures call it."},
    {"water", "The water the vehicle is in."},
    {"extract", "How the first echo of a beam is told from noise (CFAR: constant false-alarm rate)."},
    {"background",
     "What a sonar hears of its own vehicle: frame, tether, electronics. Such places are blind: neither\n"
     "blocked nor clear. Of what was loud while a template was learnt, only what these keys describe is\n"
     "taken for the vehicle; the rest, walls above all, stays an obstacle."},
    {"grid",
     "The grid of directions around the vehicle, and what counts as blocked and as clear. Up to four more grids "
     "may\n"
     "stand beside it, as [grid NAME], for another range, resolution or sensor model: every ping goes into all\n"
     "of them, and questions name the one they mean. What is not said there is as in [grid]."},
    {"grids", "All grids together."},
    {"map",
     "The map of places: which water has been found free, kept in voxels as the vehicle moves. Needs poses with\n"
     "position, depth and attitude. Without `voxel` there is none, and it takes neither memory nor time."},
    {"pose", "What is known about where the vehicle is and how it lies."},
    {"vehicle", "The vehicle's body and how it brakes: what the answers `limit` and `time_to_collision` go by."},
    {"depth", "A depth or pressure transmitter that is read over Modbus. The defaults are those of a Keller 33X."},
    {"nmea", "An instrument that sends NMEA 0183: a compass, or a depth cell."},
    {"gpio", "Pins of this computer. The lines that belong to a sonar stand in its own section."},
    {"server", "The socket on which questions are answered."},
    {"pipeline", "How the work is spread over processors. Changes the time an answer takes, never the answer."},
    {"realtime",
     "How sonard holds its place beside other programs of this computer, see docs/raspberry-pi.md. What is\n"
     "asked for here and cannot be had is a reason not to start."},
    {"record", "Captures of everything the sonars say, as MCAP files."},
    {"log", "What is written to standard error, or to the journal."},
    {NULL, NULL},
};

const struct conf_key conf_keys[] = {
    {"sonar", "device", .kind = CONF_TEXT, .form = "the name of a device, for instance ping360",
     .example = "ping360", SONAR(device), .help = "What kind of sonar it is."},
    {"sonar", "port", .kind = CONF_TEXT, .form = "KIND:ADDRESS, for instance serial:/dev/ttyUSB0:115200",
     .example = "serial:/dev/ttyUSB0:115200", SONAR(port),
     .help = "Where it is connected. For a serial line the device file and the speed in baud (115200 where none is\n"
             "given), then :rs485 for a two-wire line whose direction the port has to switch; names below\n"
             "/dev/serial/by-id/ stay the same when plugs are moved. A scanning head at 115200 baud is limited\n"
             "by the line: choose a faster one where the sonar can follow. udp:HOST:PORT is a sonar or a bridge\n"
             "on the network: a numeric address, as udp:192.168.2.2:9092 or udp:[fe80::1%eth0]:9092; :LOCALPORT\n"
             "may follow where it answers to a fixed port only."},
    {"sonar", "tap", .kind = CONF_PATH, .standard = "none", .instead = "none", SONAR(tap),
     .form = "an absolute path",
     .help = "A pseudo-terminal, found by this symbolic link, that says what the sonar says, for a viewer or a "
             "logger\n"
             "to listen to. What is written to it is thrown away: sonard alone talks to the sonar."},
    {"sonar", "range", QUANTITY(1, "m", 0.75, 200), .standard = "20 m", SONAR(range_m),
     .help = "How far to listen. A longer range makes every turn of a scanning head slower and bins coarser;\n"
             "20 m is several times the way in which a small ROV stops."},
    {"sonar", "gain", INTEGER(0, 40), .standard = "auto", .instead = "auto", .instead_value = -1, SONAR(gain),
     .help = "Receiver gain on the device's own scale (ping360: 0, 1 or 2; imagenex: dB; micron: 0 to 10,\n"
             "tenths of the full gain). auto: the default."},
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
    {"sonar", "scan", WORDS("plain", "active"), .standard = "plain", SONAR(scan),
     .help =
         "active: half of the pings go where they tell most, mostly ahead of the way, and the full circle takes\n"
         "a little over twice as long. Wants a velocity and an attitude (sonard-protocol(7), pose); without it\n"
         "is as plain with mode = request. For device = ping360 and micron."},
    {"sonar", "circle", QUANTITY(1, "s", 1, 3600), .standard = "auto", .instead = "auto", .instead_value = 0,
     SONAR(circle_s),
     .help =
         "scan = active: all of the circle is seen again within this time; what is left of it goes where looks\n"
         "tell most. Shorter than a plain turn takes: nothing is left. auto: half of the pings, however long a\n"
         "turn takes."},
    {"sonar", "frequency", QUANTITY(1, "kHz", 10, 3000), .standard = "auto", .instead = "auto", .instead_value = 0,
     SONAR(frequency_hz),
     .help = "Transmit frequency. auto: the device's default (ping360: 750 kHz, micron: 675 kHz)."},
    {"sonar", "node", INTEGER(0, 253), .standard = "any", .instead = "any", .instead_value = -1, SONAR(node),
     .help =
         "On a CAN bus: whose messages to take, a DroneCAN node id or an NMEA 2000 address. any: everybody's,\n"
         "which is right while one sonar of the kind is on the bus."},
    {"sonar", "sensor_id", INTEGER(0, 255), .standard = "any", .instead = "any", .instead_value = -1,
     SONAR(sensor_id), .help = "DroneCAN: which of that node's range sensors. any: all of them."},
    {"sonar", "aperture", QUANTITY(2, "deg", 0.1, 180), .standard = "auto", .instead = "auto", .instead_value = 0,
     SONAR(aperture_rad),
     .help = "Width and height of one beam at half power, where the transducer is another than is usual with the\n"
             "device. An obstacle is taken to fill the whole beam. auto: what is known of the device."},
    {"sonar", "mount", QUANTITY(3, "m", -50, 50), .standard = "0 0 0 m", SONAR(mount_m),
     .help = "Where the transducer sits in the vehicle: forward, right, down from the vehicle's reference point."},
    {"sonar", "rotation", QUANTITY(3, "deg", -360, 360), .standard = "0 0 0 deg", SONAR(rotation_rad),
     .help = "How it is turned against the vehicle: roll, pitch, yaw. A head that hangs upside down has 180 0 0."},
    {"sonar", "amplitude", LIVE, WORDS("auto", "linear", "power", "sqrt", "log"), .standard = "auto", SONAR(amplitude),
     .help = "What the intensities stand for: counts proportional to sound pressure (linear), to power, to the\n"
             "square root of pressure (sqrt), or to decibels (log). auto: what is known of the device. A wrong\n"
             "one makes the detector deaf or nervous."},
    {"sonar", "decibels_per_count", LIVE, QUANTITY(1, "dB", 0.001, 0.47), .standard = "auto", .instead = "auto",
     .instead_value = 0, SONAR(db_per_count),
     .help = "For amplitude = log, which needs it: decibels of one count, for instance 0.3137 dB where 80 dB\n"
             "are spread over 0 to 255."},
    {"sonar", "min_confidence", NUMBER(0.01, 1), .standard = "0.5", SONAR(min_confidence),
     .help = "For sonars that pick the range themselves and say how sure they are (ping1d): a less sure one\n"
             "counts as nothing heard."},
    {"sonar", "ring_down", LIVE, QUANTITY(1, "m", 0.01, 20), .standard = "auto", .instead = "auto", .instead_value = -1,
     SONAR(ring_down_m),
     .help = "Nothing is believed nearer than this, because the transducer still rings; less than range.\n"
             "auto: found from the device and from every beam."},
    {"sonar", "background", .kind = CONF_PATH, .standard = "none", .instead = "none", SONAR(background),
     .form = "an absolute path",
     .help = "File with the template of what this sonar hears of the vehicle itself; `sonarctl background learn`\n"
             "makes one, `save` writes it here. Loaded at the start where it is there. See [background]."},
    {"sonar", "power", .kind = CONF_TEXT, .form = LINE_FORM, .standard = "none", .instead = "none", SONAR(power),
     .help = "GPIO line that switches the sonar's power. It is switched on at the start."},
    {"sonar", "power_active", WORDS("high", "low"), .standard = "high", SONAR(power_active),
     .help = "Level of that line that means on."},
    {"sonar", "power_cycle_after", QUANTITY(1, "s", 5, 3600), .standard = "never", .instead = "never",
     .instead_value = 0, SONAR(power_cycle_after_s),
     .help = "A sonar that has sent no ping for so long is switched off for three seconds and on again. Longer\n"
             "than it takes to boot: a Micron takes up to 30 s."},
    {"sonar", "power_at_stop", WORDS("on", "off"), .standard = "off", SONAR(power_at_stop),
     .help = "What the line is set to when sonard ends. What it does once sonard has let go of it is up to the\n"
             "chip's driver; most keep the level."},
    {"sonar", "trigger", .kind = CONF_TEXT, .form = LINE_FORM, .standard = "none", .instead = "none",
     SONAR(trigger),
     .help = "GPIO line on which an edge marks every transmission; the kernel's time of the edge becomes the\n"
             "time of the ping."},
    {"sonar", "trigger_edge", WORDS("rising", "falling"), .standard = "rising", SONAR(trigger_edge),
     .help = "Which edge of that line."},

    {"water", "sound_speed", QUANTITY(1, "m/s", 1350, 1650), .standard = "1500 m/s", CONF(water.sound_speed_mps),
     .help = "Speed of sound. 1500 m/s is that of sea water of 13 C; fresh water of 10 C has 1447 m/s.\n"
             "All ranges scale with it."},
    {"water", "density", QUANTITY(1, "kg/m3", 900, 1100), .standard = "1025 kg/m3", CONF(water.density_kgpm3),
     .help = "Turns pressure into depth: 1025 kg/m3 is coastal sea, 997 kg/m3 fresh water, 3 % apart."},

    {"extract", "detector", LIVE, WORDS("ca", "goca", "soca", "os"), .standard = "soca", CONF(extract.detector),
     .help = "Which reference cells set the threshold: the mean of all (ca), the greater (goca) or the smaller\n"
             "(soca) of the two side means, or an order statistic (os). soca finds a weak wall beside a strong\n"
             "echo, which is what a collision is made of; goca is the quietest."},
    {"extract", "order", WORDS("safe", "paper"), .standard = "safe", CONF(extract.order),
     .help = "Where the image is cleaned: safe detects on what the sonar sent and takes from the cleaned image\n"
             "only what it rules out; paper detects on the cleaned image, with no defined rate of false alarms."},
    {"extract", "false_alarm", LIVE, NUMBER(1e-12, 0.1), .standard = "1e-3", CONF(extract.false_alarm),
     .help = "Probability that a bin of pure noise is taken for a part of an echo. An echo's peak has to have\n"
             "min_contrast as well, so this mostly decides where the faint edge of an echo begins: a larger\n"
             "one ends the free water sooner, a smaller one claims more and misses more."},
    {"extract", "window", LIVE, QUANTITY(1, "m", 0.005, 20), .standard = "0.4 m", CONF(extract.window_m),
     .help = "Length of the reference cells on each side of the cell under test."},
    {"extract", "guard", LIVE, QUANTITY(1, "m", 0, 10), .standard = "0.1 m", CONF(extract.guard_m),
     .help = "Cells left out beside the cell under test, on each side, so that an echo does not raise its own\n"
             "threshold: at least the length of the pulse; less than window."},
    {"extract", "rank", LIVE, NUMBER(0.05, 1), .standard = "0.75", CONF(extract.rank),
     .help = "For detector = os: which of the sorted reference cells, as a share of their number. 0.75 bears a\n"
             "quarter of the cells being echoes themselves."},
    {"extract", "floor", LIVE, INTEGER(0, 65535), .standard = "8", CONF(extract.floor_counts),
     .help = "Counts that the surroundings of an echo are taken to have at least: over these, too, it rises by\n"
             "min_contrast. Sonars send stretches of zeros, over which any stray count would stand out. With a\n"
             "linear receiver of 8 bits, 8 and 14 dB make 40 counts: less is right where it is quiet."},
    {"extract", "min_contrast", LIVE, QUANTITY(1, "dB", 0, 100), .standard = "14 dB", CONF(extract.min_contrast_db),
     .help = "How far an echo must rise above its surroundings. The false-alarm rule alone takes every ripple of\n"
             "reverberation for an echo; a hull, a wall or a pile stands out by far more than this."},
    {"extract", "learn_ring_down", LIVE, WORDS("on", "off"), .standard = "off", CONF(extract.learn_ring_down),
     .help =
         "For ring_down = auto: a beam that seems to ring longer than the sonar usually does is believed from\n"
         "where it usually ends, so that a wall close to the head is found there. Parts of the vehicle are too."},
    {"extract", "median", WORDS("off", "3", "5"), .standard = "off", CONF(extract.median),
     .help =
         "Smooth the image of a scanning head: the median of 3 x 3 or 5 x 5 bins, against single specks.\n"
         "Holds every ping back until one (3) or two (5) more have come; the last wait while a sonar is silent."},
    {"extract", "otsu", WORDS("on", "off"), .standard = "off", CONF(extract.otsu),
     .help = "Take away what is no louder than the threshold that parts the last turn best in two (Otsu)."},
    {"extract", "clahe", WORDS("on", "off"), .standard = "off", CONF(extract.clahe),
     .help = "Even out the contrast of the image (CLAHE), each part of it by its own last pass."},
    {"extract", "clahe_clip", NUMBER(1, 100), .standard = "2", CONF(extract.clahe_clip),
     .help = "How far clahe may stretch: no count counts for more than this many times the mean one."},
    {"extract", "classes", WORDS("on", "off"), .standard = "off", CONF(extract.classes),
     .help =
         "Part the last turn of the image in three classes; what lies in the lowest is no echo. Weak obstacles\n"
         "in a scene with strong ones may be lost by it."},
    {"extract", "marks", WORDS("on", "off"), .standard = "on", CONF(extract.marks),
     .help =
         "Mark echoes that other looks at nearly the same bearing should show and do not (bursts of other\n"
         "sound), and ghosts of nearer echoes. A marked echo blocks, but gives way to the first look that hears\n"
         "nothing there. Bursts are told only where attitude and position or velocity are known."},
    {"extract", "no_echo", LIVE, WORDS("minimum", "heard", "range"), .standard = "minimum", CONF(extract.no_echo),
     .help = "How far the water is taken as free where a beam found nothing. minimum: to minimum_range, the\n"
             "cautious rule; heard: as far as the beam heard its own noise floor; range: to the end of the\n"
             "range, which trusts silence and may call a soft wall free water."},
    {"extract", "minimum_range", LIVE, QUANTITY(1, "m", 0.1, 200), .standard = "0.75 m", CONF(extract.minimum_range_m),
     .help =
         "For no_echo = minimum: how far the water is free where a beam found nothing. Not beyond the range of\n"
         "any sonar."},

    {"background", "mask", INTEGER(1, 254), .standard = "64", CONF(background.mask),
     .help = "Counts of the template above which a cell is blind. Well above the noise, below the weakest echo\n"
             "of the frame that was ever taken for an obstacle."},
    {"background", "neighbour", QUANTITY(1, "m", 0.01, 1), .standard = "0.15 m", CONF(background.neighbour_m),
     .help = "Loud cells nearer to each other than this belong together."},
    {"background", "min_points", INTEGER(1, 1000), .standard = "6", CONF(background.min_points),
     .help = "Loud cells that must lie so near to one, itself counted, for it to be more than a speckle."},
    {"background", "min_level", NUMBER(0, 255), .standard = "80", CONF(background.min_level),
     .help = "Mean counts of a part of the vehicle, at least: metal close by is loud."},
    {"background", "extent", QUANTITY(1, "m", 0.01, 50), .standard = "1 m", CONF(background.extent_m),
     .help = "A part of the vehicle is not longer than this in range."},
    {"background", "reach", QUANTITY(1, "m", 0.05, 50), .standard = "3 m", CONF(background.reach_m),
     .help = "No part of the vehicle is farther from the sonar than this: the length of the vehicle."},
    {"background", "share", NUMBER(0.001, 1), .standard = "0.25", CONF(background.share),
     .help = "No part of the vehicle takes more of all bearings than this."},
    {"background", "ring", QUANTITY(1, "m", 0, 20), .standard = "0.5 m", CONF(background.ring_m),
     .help = "Nearer than this everything that stays is the transducer's own ring, at all bearings."},
    {"background", "save_every", QUANTITY(1, "s", 1, 86400), .standard = "never", .instead = "never", .instead_value = 0,
     CONF(background.save_every_s),
     .help = "A template that was learnt goes to the file of its sonar so often, where it has changed, and when\n"
             "sonard stops. never: only `sonarctl background save` writes it."},

    {"grid", "range", QUANTITY(1, "m", 0.75, 200), .standard = "auto", .instead = "auto", .instead_value = 0,
     CONF(grid.range_max_m),
     .help = "How far the grid reaches. auto: as far as the sonar with the longest range."},
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
    {"grid", "axes", WORDS("ned", "course"), .standard = "ned", CONF(grid.axes),
     .help =
         "Where the division into directions begins once a pose tells an attitude. ned: at north, which costs\n"
         "nothing. course: where the vehicle goes, so that a corridor ahead stays in the same cells; each turn of\n"
         "more than 10 degrees and two steps costs time, and water beside what is not known becomes unknown."},
    {"grid", "sensor_model", WORDS("opening", "gauss", "midpoint"), .standard = "opening", CONF(grid.sensor_model),
     .help =
         "Where in a beam an echo counts. opening: everywhere alike, for nobody knows where the reflector is;\n"
         "gauss: less off the axis and off the range (normal distributions, half at half power), integrated\n"
         "over cells; midpoint: the same, taken at their middle: cheaper, coarse in wide cells."},
    {"grid", "update", WORDS("bayes", "max"), .standard = "bayes", CONF(grid.update),
     .help = "bayes: echoes of one place add up; max: the strongest counts."},
    {"grid", "range_error", NUMBER(0, 0.1), .standard = "0.003", CONF(grid.range_error),
     .help = "Standard deviation of a range as a share of it, for sensor_model gauss and midpoint."},
    {"grid", "relaxation", NUMBER(0, 1), .standard = "0", CONF(grid.relaxation),
     .help =
         "How far directions are raised towards what stands around them: fills gaps in a wall that is heard only\n"
         "now and then, and makes obstacles wider. 0: not at all; 0.5 suits a sonar that often hears nothing."},
    {"grid", "max_cells", INTEGER(1024, 16777216), .standard = "65536", CONF(grid.max_cells),
     .help = "Cells there is room for; all memory is taken at the start."},
    {"grid", "blocked_above", NUMBER(0.51, 0.99), .standard = "0.6", CONF(grid.blocked_above),
     .help = "Probability from which a cell is an obstacle. Lower: earlier warnings, more of them false."},
    {"grid", "clear_for", LIVE, QUANTITY(1, "s", 0.5, 86400), .standard = "30 s", CONF(grid.clear_for_s),
     .help = "A direction counts as clear for this long after its last ping, then it is unknown. Longer than one\n"
             "turn of the head, which takes 9 to 35 s; not longer than forget."},
    {"grid", "forget", QUANTITY(1, "s", 1, 86400), .standard = "160 s", CONF(grid.forget_s),
     .help =
         "An obstacle that is not heard again blocks no longer than this: so long when it was heard often, half\n"
         "as long after one echo. What is there is unknown then. Not shorter than clear_for."},
    {"grid", "move_limit", LIVE, QUANTITY(1, "m", 0.05, 100), .standard = "0.5 m", CONF(grid.move_limit_m),
     .help =
         "A direction that was clear is unknown again after the vehicle has moved this far without seeing it: so far and\n"
         "at most 0.2 m farther, for less than 0.1 m to and fro, the noise of a position, is no way."},

    {"grids", "memory", QUANTITY(1, "MiB", 1, 65536), .standard = "1024 MiB", CONF(grids.memory_bytes),
     .help = "All that grids may take, those that are made later among them, and their clusters, which are\n"
             "made when somebody asks for them: five times as much as the cells."},

    {"map", "voxel", QUANTITY(1, "m", 0.02, 5), .standard = "none", .instead = "none", .instead_value = 0,
     CONF(map.voxel_m),
     .help =
         "Edge of a voxel; none: no map. 0.2 m suits tanks, harbours and dams. Half of it takes eight times the\n"
         "memory for the same water."},
    {"map", "memory", QUANTITY(1, "MiB", 1, 65536), .standard = "64 MiB", CONF(map.memory_bytes),
     .help = "All that the map may take; it is taken at the start. When it runs low the oldest submaps go to "
             "files in\n"
             "directory, or without one are forgotten: their water is unknown."},
    {"map", "extent", QUANTITY(1, "m", 1, 2000), .standard = "auto", .instead = "auto", .instead_value = 0,
     CONF(map.extent_m),
     .help =
         "Side of a submap in plan. What a beam covers beyond it is not entered. auto: what the longest range of\n"
         "the sonars and submap_distance need."},
    {"map", "height", QUANTITY(1, "m", 0.1, 2000), .standard = "16 m", CONF(map.height_m),
     .help = "Height of a submap, half of it above and half below where it was begun."},
    {"map", "threshold", INTEGER(0, 254), .standard = "1", CONF(map.threshold),
     .help = "A voxel is free when more looks than this have found it free. 1 bears a single wrong one."},
    {"map", "echoes", WORDS("on", "off"), .standard = "on", CONF(map.echoes),
     .help =
         "Remember where something was heard, in a second plane of bytes, so that a thin thing is not lost at\n"
         "the next sweep and answers tell occupied from unknown."},
    {"map", "echo_weight", INTEGER(0, 255), .standard = "2", CONF(map.echo_weight),
     .help = "How many looks that found a voxel free one echo in it outweighs."},
    {"map", "tolerance", QUANTITY(1, "m", 0, 1), .standard = "0 m", CONF(map.tolerance_m),
     .help =
         "Moves the side faces of every beam outwards; never the end of it. Closes gaps between beams, and calls\n"
         "water free that no beam has been in: 0 is safe."},
    {"map", "opening", NUMBER(0.1, 1), .standard = "0.5", CONF(map.opening),
     .help =
         "Share of a beam's height (of a round beam: of its width) in which water is taken as free; what is\n"
         "heard fills the whole beam. A floor that only the beam's edge grazes answers too weakly to be heard:\n"
         "with 1 up to a twentieth of what is free is solid ground, with 0.5 up to a four-hundredth, and a look\n"
         "frees half as much. See docs/map.md."},
    {"map", "body", QUANTITY(1, "m", 0.01, 20), .standard = "none", .instead = "none", .instead_value = 0,
     CONF(map.body_m),
     .help =
         "Radius around the vehicle's reference point of which it is sure that only the vehicle itself is there:\n"
         "along its way that water is free. none: only beams free water."},
    {"map", "submap_distance", QUANTITY(1, "m", 0.5, 1000), .standard = "10 m", CONF(map.submap_distance_m),
     .help = "A new submap is begun when the vehicle is so far from where it began the last one."},
    {"map", "submap_time", QUANTITY(1, "s", 1, 86400), .standard = "never", .instead = "never", .instead_value = 0,
     CONF(map.submap_time_s), .help = "And so long after it."},
    {"map", "forget", QUANTITY(1, "s", 1, 604800), .standard = "never", .instead = "never", .instead_value = 0,
     CONF(map.forget_s),
     .help =
         "All counts are halved so often, so that what is not seen again is forgotten: free water and echoes."},
    {"map", "directory", .kind = CONF_PATH, .standard = "none", .instead = "none", CONF(map.directory),
     .form = "an absolute path",
     .help = "Where maps are saved, exported and loaded from, and where submaps go that memory has no room for.\n"
             "none: nothing of this."},
    {"map", "origin", .kind = CONF_TEXT, .form = "a name, for instance basin-east or geo:41.1784,-8.6071",
     .standard = "none", .instead = "none", CONF(map.origin),
     .help = "What positions count from: any name, the same whenever they count from the same place. A saved map\n"
             "holds it, and one of another origin is not loaded. none: maps that do not tell are loaded, with a\n"
             "warning when another run made them."},
    {"map", "save_every", QUANTITY(1, "s", 1, 86400), .standard = "never", .instead = "never", .instead_value = 0,
     CONF(map.save_every_s),
     .help = "The map is saved as last.map in directory so often, if it has changed, and when sonard stops. What\n"
             "that name had before is before.map then, where it was not loaded."},
    {"map", "load", .kind = CONF_NAME, .form = "last, the name of another map", .standard = "none",
     .instead = "none", CONF(map.load),
     .help = "At the start this map in directory is loaded; last is the one that save_every has kept. Only for\n"
             "vehicles whose positions count from the same place as when it was saved: sonard cannot know but by\n"
             "origin. A map that cannot be loaded is told, and sonard begins with an empty one."},

    {"pose", "max_age", LIVE, QUANTITY(1, "s", 0.01, 3600), .standard = "1 s", CONF(pose.max_age_s),
     .help = "An older pose is stale, and what needs it is unknown."},

    {"vehicle", "radius", LIVE, QUANTITY(1, "m", 0.05, 50), .standard = "0.4 m", CONF(vehicle.radius_m),
     .help = "Radius of the upright cylinder around the reference point that holds the whole vehicle."},
    {"vehicle", "height", LIVE, QUANTITY(1, "m", 0.05, 50), .standard = "0.5 m", CONF(vehicle.height_m),
     .help = "Height of that cylinder, half of it above and half below the reference point."},
    {"vehicle", "margin", LIVE, QUANTITY(1, "m", 0, 20), .standard = "0.3 m", CONF(vehicle.margin_m),
     .help = "Water to be kept on every side of it."},
    {"vehicle", "near", LIVE, QUANTITY(1, "m", 0.05, 50), .standard = "auto", .instead = "auto", .instead_value = 0,
     CONF(vehicle.near_m),
     .help = "Water nearer than this to the reference point counts as known, because the vehicle is in it or has seen it\n"
             "on its way; what was heard there still blocks, or is unknown where it is too faint to block.\n"
             "auto: the ball that holds the cylinder with its margin. A level scanning head never sees what is\n"
             "close above and below: with auto all is unknown ahead of it;\n"
             "(height / 2 + margin) / sin(half the height of its fan) is where its fan has opened far enough, and a\n"
             "grid's directions are known only when they lie in it whole: take 1.5 angular_step off that half. It\n"
             "counts for corridors that `blocked` is asked for, too, and for what sonard-mavlink sends as free."},
    {"vehicle", "max_speed", LIVE, QUANTITY(1, "m/s", 0.01, 50), .standard = "told", .instead = "told", .instead_value = 0,
     CONF(vehicle.max_speed_mps),
     .help = "It never goes faster. For so long as nobody has told where it is, answers take it to be anywhere that it can\n"
             "have gone to meanwhile, all obstacles nearer and all free water shorter by that. told: as fast as its pose\n"
             "last said, so that a vehicle that has just set out is taken to stand still until its next pose: half\n"
             "its acceleration times the square of that time is missing. Set it when poses come less than 5 times a\n"
             "second. Over ground: poses that go 5 m farther than so hold the map ([map], docs/map.md)."},
    {"vehicle", "max_turn", LIVE, QUANTITY(1, "deg", 0.1, 1000), .standard = "told", .instead = "told", .instead_value = 0,
     CONF(vehicle.max_turn_radps),
     .help = "It never turns by more in a second; as max_speed, for directions that are asked for in the body's frame.\n"
             "Poses that turn 5 degrees farther have jumped: what was found clear before is unknown until it is looked\n"
             "at again. told: a turn a second, so that with few poses a jump goes unseen. Poses that turn 20 degrees\n"
             "farther hold the map."},
    {"vehicle", "braking", LIVE, QUANTITY(1, "m/s2", 0.01, 20), .standard = "0.2 m/s2", CONF(vehicle.braking_mps2),
     .help = "How hard it can brake in still water, at the least and in every direction. Measure it."},
    {"vehicle", "latency", LIVE, QUANTITY(1, "s", 0, 10), .standard = "0.5 s", CONF(vehicle.latency_s),
     .help = "From sonard's answer to the moment when braking takes effect."},
    {"vehicle", "unknown", LIVE, WORDS("slow", "stop", "ignore"), .standard = "slow", CONF(vehicle.unknown),
     .help = "What `limit` allows where the water ahead is unknown. slow: the speed below; stop: nothing; ignore: as if\n"
             "it were free, and then only what was heard limits."},
    {"vehicle", "slow", LIVE, QUANTITY(1, "m/s", 0, 5), .standard = "0.1 m/s", CONF(vehicle.slow_mps),
     .help = "Into unknown water at most, with unknown = slow: so slow that touching something does no harm."},

    {"depth", "source", .kind = CONF_TEXT, .form = "modbus-rtu:DEVICE:BAUD, or modbus-tcp:ADDRESS:PORT",
     .standard = "none", .instead = "none", CONF(depth.source),
     .help = "Where the slave is: modbus-rtu:/dev/ttyUSB1:9600 on a line, modbus-tcp:192.168.2.5:502 on a\n"
             "network. none: there is none."},
    {"depth", "parity", WORDS("none", "even", "odd"), .standard = "none", CONF(depth.parity),
     .help = "Of a serial line; with none there is one stop bit as well."},
    {"depth", "slave", INTEGER(0, 247), .standard = "1", CONF(depth.slave), .help = "Its Modbus address."},
    {"depth", "function", WORDS("holding", "input"), .standard = "holding", CONF(depth.function),
     .help = "Which registers are read: holding registers with function 3, input registers with function 4."},
    {"depth", "register", INTEGER(0, 65535), .standard = "2", CONF(depth.reg),
     .help = "First register of the value, counted from 0. 2 is pressure P1 of a Keller."},
    {"depth", "type", WORDS("int16", "uint16", "int32", "float32"), .standard = "float32", CONF(depth.type),
     .help = "What the registers hold; int32 and float32 take two."},
    {"depth", "word_order", WORDS("big", "little"), .standard = "big", CONF(depth.word_order),
     .help = "Which of two registers comes first: the one with the high bits (big) or the low bits (little)."},
    {"depth", "scale", NUMBER(-1e9, 1e9), .standard = "1", CONF(depth.scale),
     .help = "The number read is multiplied with this."},
    {"depth", "offset", NUMBER(-1e9, 1e9), .standard = "0", CONF(depth.offset),
     .help = "Then this is added, and what comes out is in `unit`."},
    {"depth", "unit", WORDS("m", "Pa", "kPa", "mbar", "dbar", "bar"), .standard = "bar", CONF(depth.unit),
     .help = "m: it is a depth. Otherwise it is a pressure, and depth follows from surface_pressure and the\n"
             "density in [water]."},
    {"depth", "surface_pressure", QUANTITY(1, "mbar", -2000, 2000), .standard = "1013.25 mbar",
     CONF(depth.surface_pa),
     .help = "What it reads at the surface: the air pressure of the day for an absolute sensor, 0 for a vented\n"
             "one. Weather is worth 0.3 m."},
    {"depth", "mount", QUANTITY(3, "m", -50, 50), .standard = "0 0 0 m", CONF(depth.mount_m),
     .help = "Where it sits in the vehicle: forward, right, down from the vehicle's reference point."},
    {"depth", "rate", QUANTITY(1, "Hz", 0.1, 50), .standard = "5 Hz", CONF(depth.rate_hz),
     .help = "How often it is asked. At 9600 baud about 20 Hz is the limit."},
    {"depth", "timeout", QUANTITY(1, "ms", 20, 2000), .standard = "300 ms", CONF(depth.timeout_s),
     .help = "How long an answer is waited for."},
    {"depth", "turnaround", QUANTITY(1, "ms", 20, 10000), .standard = "1000 ms", CONF(depth.turnaround_s),
     .help =
         "Longest time after which it may still answer. After a time-out the line must have been quiet for so\n"
         "long before it is asked again: a late answer carries nothing that tells which question it is to.\n"
         "Not shorter than timeout."},
    {"depth", "resync", WORDS("silence", "echo"), .standard = "silence", CONF(depth.resync),
     .help =
         "How a slave on a line is believed again after a fault. silence: after two quiet times of turnaround\n"
         "and an answer that is thrown away. echo: it must know function 8 (a Keller does), and send a number\n"
         "back; then no answer is taken for another's, however late it comes."},
    {"depth", "plausible", QUANTITY(2, "m", -100, 12000), .standard = "-1 300 m", CONF(depth.plausible_m),
     .help = "Smallest and largest depth that is believed."},
    {"depth", "speed_limit", QUANTITY(1, "m/s", 0.1, 100), .standard = "3 m/s", CONF(depth.speed_limit_mps),
     .help = "A depth that would mean a faster dive or rise than this is not believed."},

    {"nmea", "port", .kind = CONF_TEXT, .form = "KIND:ADDRESS, for instance serial:/dev/ttyS1:4800",
     .standard = "none", .instead = "none", CONF(nmea.port),
     .help = "Where it is connected. none: there is none."},
    {"nmea", "use", WORDS("heading", "depth", "both"), .standard = "heading", CONF(nmea.use),
     .help =
         "heading: HDT, HDG and HDM give the heading while nobody gives a whole attitude; the vehicle is taken\n"
         "to lie level then. depth: DPT and DBT are the vehicle's own depth, as a depth cell sends them. Leave\n"
         "depth out for an echosounder: it sends the same sentences and means the water below."},
    {"nmea", "variation", QUANTITY(1, "deg", -180, 180), .standard = "none", .instead = "none",
     .instead_value = CONF_NO_VARIATION, CONF(nmea.variation_rad),
     .help = "Magnetic variation, east positive, for headings that come without one. none: these are not used."},
    {"nmea", "checksum", WORDS("required", "optional"), .standard = "required", CONF(nmea.checksum),
     .help = "optional: sentences without a checksum are believed. A wrong one never is."},

    {"gpio", "chip", .kind = CONF_TEXT, .form = "label or name of a chip, for instance pinctrl-bcm2711",
     .standard = "any", .instead = "any", CONF(gpio.chip),
     .help = "Chip that has the lines; any: the first that has a line of that name. Labels and line names stay\n"
             "the same from boot to boot, numbers do not; gpioinfo lists them."},
    {"gpio", "leak", .kind = CONF_TEXT, .form = LINE_FORM, .standard = "none", .instead = "none", CONF(gpio.leak),
     .help = "Line of a leak probe. A leak is logged, stands in status, and clients that watch status are told\n"
             "at once."},
    {"gpio", "leak_active", WORDS("high", "low"), .standard = "high", CONF(gpio.leak_active),
     .help = "Level of that line that means water."},
    {"gpio", "leak_bias", WORDS("as-is", "pull-up", "pull-down"), .standard = "as-is", CONF(gpio.leak_bias),
     .help = "Resistor of the pin."},

    {"server", "socket", .kind = CONF_PATH, .standard = "/run/sonard/sonard.sock", CONF(server.socket),
     .form = "an absolute path of at most 107 bytes", .help = "Path of the UNIX socket."},
    {"server", "mode", .kind = CONF_OCTAL, .lo = 0600, .hi = 0777, .standard = "0660", CONF(server.mode),
     .help = "Permission bits of the socket, in octal: who may ask. 0660 is the user and the group."},
    {"server", "change", LIVE, .kind = CONF_NAMES, .standard = "group", .instead = "group", CONF(server.change),
     .form = "all, or users, @groups and their numbers, for instance pilot, @sonar, 1000",
     .help = "Who may also change something: give poses, make and lock grids, teach backgrounds, save and clear\n"
             "the map, reload. group: the group of the socket file; all: everybody who may ask. root and sonard's own\n"
             "user always may."},
    {"server", "max_clients", INTEGER(1, 1024), .standard = "64", CONF(server.max_clients),
     .help = "Connections at a time; one more is refused."},

    {"pipeline", "threads", INTEGER(0, 2), .standard = "0", CONF(pipeline.threads),
     .help = "Threads beside the event loop. 0: all in the loop, enough for one scanning head; of a multibeam\n"
             "answers wait for whole pings then. 1: extraction and grid together in one; 2: one for each."},
    {"pipeline", "queue", INTEGER(2, 1024), .standard = "16", CONF(pipeline.queue),
     .help = "Pings that may wait. When the queue is full the oldest is dropped and counted."},

    {"realtime", "priority", INTEGER(2, 90), .standard = "none", .instead = "none", .instead_value = 0,
     CONF(realtime.priority),
     .help =
         "SCHED_FIFO priority of the loop; the pipeline's threads have one less, writers of captures and maps\n"
         "none. A Linux with PREEMPT_RT handles interrupts at 50: stay below. none: an ordinary process."},
    {"realtime", "processor", INTEGER(0, 511), .standard = "any", .instead = "any", .instead_value = -1,
     CONF(realtime.processor),
     .help =
         "Processor that sonard keeps to, counted from 0: one that the kernel leaves alone (isolcpus=). any: the\n"
         "kernel chooses."},
    {"realtime", "processor_count", INTEGER(1, 512), .standard = "1", CONF(realtime.processor_count),
     .help = "How many from that one on."},
    {"realtime", "lock_memory", WORDS("on", "off"), .standard = "off", CONF(realtime.lock_memory),
     .help = "on: all memory is there from the start and stays, however much other programs take."},

    {"record", "directory", .kind = CONF_PATH, .standard = "none", .instead = "none", CONF(record.directory),
     .form = "an absolute path", .help = "Where captures go. none: nothing is recorded."},
    {"record", "file_size", QUANTITY(1, "MiB", 1, 65536), .standard = "256 MiB", CONF(record.file_size_bytes),
     .help = "A new file is begun when one has reached this size."},
    {"record", "files", INTEGER(1, 1000000), .standard = "8", .instead = "all", .instead_value = -1,
     CONF(record.files),
     .help = "How many files are kept; the oldest beyond them is removed. all: none is removed."},

    {"log", "level", LIVE, WORDS("err", "warning", "notice", "info", "debug"), .standard = "info", CONF(log.level),
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

_Static_assert(offsetof(struct conf, more_grid) == offsetof(struct conf, grid) + sizeof(struct conf_grid),
               "the grids lie next to each other");

size_t conf_base(const struct conf_key *key, int which)
{
    if (conf_key_is_sonar(key))
        return offsetof(struct conf, sonar) + (size_t)which * sizeof(struct conf_sonar);
    return strcmp(key->section, "grid") == 0 ? (size_t)which * sizeof(struct conf_grid) : 0;
}

bool conf_key_is_sonar(const struct conf_key *key)
{
    return strcmp(key->section, "sonar") == 0;
}
