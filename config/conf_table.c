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
#define NAMED(...)                                                                                                \
    .named = (const struct conf_named[])                                                                          \
    {                                                                                                             \
        __VA_ARGS__,                                                                                              \
        {                                                                                                         \
            NULL, 0                                                                                               \
        }                                                                                                         \
    }
#define LIVE                     .live = true
#define LIVE_HEAD                .live = true, .of_head = true
#define OF_DEVICE                .of_device = true
#define LINE_FORM                "name of a GPIO line, for instance GPIO17"
#define INTEGER(a, b)            .kind = CONF_INTEGER, .lo = (a), .hi = (b)
#define NUMBER(a, b)             .kind = CONF_QUANTITY, .n = 1, .lo = (a), .hi = (b)
#define QUANTITY(count, u, a, b) .kind = CONF_QUANTITY, .n = (count), .unit = (u), .lo = (a), .hi = (b)

const struct conf_section conf_sections[] = {
    {"sonar", "A sonar on this vehicle. One to eight of these sections, each with its own name of up to 31\n"
              "letters, digits, - and _. Answers, logs and captures use the name."},
    {"water", "The water the vehicle is in."},
    {"extract", "How the first echo of a beam is separated from noise (CFAR: constant false-alarm rate)."},
    {"background",
     "Echoes of the vehicle itself: frame, tether, electronics. Their cells are blind: neither blocked\n"
     "nor clear. While a template is learnt, only loud cells that fit these keys count as the vehicle.\n"
     "All others, walls above all, stay obstacles."},
    {"grid", "The spherical grid around the vehicle, and what counts as blocked and as clear. Up to four more\n"
             "grids, [grid NAME], can have another range, resolution or sensor model. Every ping goes into all\n"
             "of them, and a question names the grid it means. Keys not set in [grid NAME] are taken from\n"
             "[grid]."},
    {"grids", "All grids together."},
    {"map", "The voxel map: where the water was observed free as the vehicle moved. Needs poses with position,\n"
            "depth and attitude. Without `voxel` no map is kept, and it takes neither memory nor time."},
    {"pose", "How long a pose of the vehicle is valid."},
    {"vehicle", "The vehicle's body and its braking, for the answers `limit` and `time_to_collision`."},
    {"answers", "How far answers look."},
    {"depth", "A depth or pressure transmitter read over Modbus. The defaults fit a Keller 33X."},
    {"nmea", "A sensor that sends NMEA 0183: a compass or a depth sensor."},
    {"gpio", "Pins of this computer. The lines of a sonar are set in its own section."},
    {"server", "The socket that answers questions."},
    {"pipeline", "How the work is spread over processors. Changes how long an answer takes, never the answer."},
    {"realtime",
     "Priority, processor and memory of sonard beside other programs, see docs/raspberry-pi.md. sonard\n"
     "does not start when a setting cannot be granted."},
    {"record", "Captures of all traffic with the sonars, as MCAP files."},
    {"log", "What is written to standard error, or to the journal."},
    {NULL, NULL},
};

const struct conf_key conf_keys[] = {
    {"sonar", "device", .kind = CONF_TEXT, .form = "the name of a device, for instance ping360",
     .example = "ping360", SONAR(device), .help = "Type of the sonar."},
    {"sonar", "port", .kind = CONF_TEXT, .form = "KIND:ADDRESS, for instance serial:/dev/ttyUSB0:115200",
     .example = "serial:/dev/ttyUSB0:115200", SONAR(port),
     .help = "Where the sonar is connected. Serial: the device file and the baud rate (115200 if left out), then\n"
             ":rs485 for a two-wire line whose direction the port must switch. Names below /dev/serial/by-id/\n"
             "stay the same when plugs are moved. At 115200 baud the line limits a scanning head: choose a\n"
             "faster rate if the sonar supports it. udp:HOST:PORT is a sonar or a bridge on the network, with a\n"
             "numeric address, such as udp:192.168.2.2:9092 or udp:[fe80::1%eth0]:9092. Append :LOCALPORT if the\n"
             "sonar answers to a fixed port only. udp:HOST:PORT:listen only listens, on the local port PORT, to\n"
             "HOST with any port of its own; 0.0.0.0 and [::] are any host. A device that sends nothing\n"
             "listens like that in every form. tcp:HOST:PORT is a serial line behind a device server, such as\n"
             "tcp:192.168.2.5:4001; HOST may be a name, and the server has the baud rate."},
    {"sonar", "tap", .kind = CONF_PATH, .standard = "none", .instead = "none", SONAR(tap),
     .form = "an absolute path",
     .help = "Symbolic link to a pseudo-terminal that mirrors what the sonar sends, for a viewer or a logger.\n"
             "Bytes written to it are discarded: only sonard sends to the sonar."},
    {"sonar", "range", LIVE_HEAD, QUANTITY(1, "m", 0.75, 200), .standard = "20 m", SONAR(range_m),
     .help = "Range to scan. A longer range makes each revolution of a scanning head slower and the bins\n"
             "coarser. 20 m is several times the stopping distance of a small ROV. A range that is reloaded does\n"
             "not make the grid or the map larger: until the next start they reach as far as before."},
    {"sonar", "gain", OF_DEVICE, LIVE_HEAD, INTEGER(0, 40), .standard = "auto", .instead = "auto",
     .instead_value = -1, SONAR(gain),
     .help = "Receiver gain on the device's own scale. auto: the device's default."},
    {"sonar", "sector", OF_DEVICE, QUANTITY(2, "deg", -360, 360), .standard = "0 360 deg", SONAR(sector_rad),
     .help = "First and last azimuth of the scan in the sensor's frame, clockwise; 0 is forward of the head. 0\n"
             "360 is the full circle, 300 60 the third ahead. A smaller sector is scanned more often; everything\n"
             "outside it stays unknown."},
    {"sonar", "step", OF_DEVICE, QUANTITY(1, "deg", 0.1, 90), .standard = "0.9 deg", SONAR(step_rad),
     .help = "Angle between pings; less than the sector. Twice the step scans twice as fast; beams should still\n"
             "overlap."},
    {"sonar", "mode", OF_DEVICE, LIVE_HEAD, WORDS("auto", "transmit", "request"), .standard = "auto", SONAR(mode),
     .help = "transmit: the sonar pings by itself (auto-transmit), which is faster. request: sonard asks for\n"
             "every ping (polled), which old firmware needs. auto: transmit, or request if the sonar refuses."},
    {"sonar", "scan", OF_DEVICE, WORDS("auto", "plain", "active"), .standard = "auto", SONAR(scan),
     .help = "active: half of the pings go to the directions worth most, mostly ahead; a full circle takes a\n"
             "little over twice as long. That needs velocity and attitude (sonard-protocol(7), pose). Without\n"
             "position and velocity, water is known for seconds only. Then all pings go to the third of the\n"
             "circle towards which the thrusters push, while a client tells that (push_n), and else it scans as\n"
             "plain with mode = request. auto: active where `current` in [vehicle] is set, if the sonar can be\n"
             "steered and scans the full circle; else plain."},
    {"sonar", "circle", OF_DEVICE, QUANTITY(1, "s", 1, 3600), .standard = "auto", .instead = "auto",
     .instead_value = 0, SONAR(circle_s),
     .help = "For active scanning: the whole circle is scanned within this time; the remaining pings go to the\n"
             "directions worth most. If a plain revolution takes longer, none remain. auto: half of the pings,\n"
             "however long a revolution takes."},
    {"sonar", "frequency", OF_DEVICE, QUANTITY(1, "kHz", 10, 3000), .standard = "auto", .instead = "auto",
     .instead_value = 0, SONAR(frequency_hz), .help = "Transmit frequency. auto: the device's default."},
    {"sonar", "node", OF_DEVICE, INTEGER(0, 253), .standard = "any", .instead = "any", .instead_value = -1,
     SONAR(node),
     .help =
         "On a CAN bus: accept messages of this node id or source address only. any: accept all, right with a\n"
         "single sonar of its type on the bus."},
    {"sonar", "sensor_id", OF_DEVICE, INTEGER(0, 255), .standard = "any", .instead = "any", .instead_value = -1,
     SONAR(sensor_id), .help = "Which range sensor of that node. any: all of them."},
    {"sonar", "aperture", QUANTITY(2, "deg", 0.1, 180), .standard = "auto", .instead = "auto", .instead_value = 0,
     SONAR(aperture_rad),
     .help = "Width and height of one beam at half power. Set it for a transducer that is not the device's usual\n"
             "one. An obstacle is assumed to fill the whole beam. auto: the device's known beam."},
    {"sonar", "mount", QUANTITY(3, "m", -50, 50), .standard = "0 0 0 m", SONAR(mount_m),
     .help = "Position of the transducer: forward, right, down from the vehicle's reference point."},
    {"sonar", "rotation", QUANTITY(3, "deg", -360, 360), .standard = "0 0 0 deg", SONAR(rotation_rad),
     .help = "Orientation of the sonar on the vehicle: roll, pitch, yaw. A head mounted upside down has 180 0 0."},
    {"sonar", "mirror", WORDS("no", "yes"), .standard = "no", SONAR(mirror),
     .help =
         "yes: the sonar counts its angles the other way round than sonard takes them, so port and starboard\n"
         "of the sensor are swapped. docs/devices/signs.md says where each device's sense comes from. Try with\n"
         "a target on one side. Not for a head mounted upside down: that is rotation. Learn a background\n"
         "template again after a change."},
    {"sonar", "amplitude", OF_DEVICE, LIVE, WORDS("auto", "linear", "power", "sqrt", "log"), .standard = "auto",
     SONAR(amplitude),
     .help = "Meaning of the intensities: counts proportional to sound pressure (linear), to power, to the\n"
             "square root of pressure (sqrt), or to decibels (log). auto: as known for the device. A wrong\n"
             "setting makes the detector miss echoes or raise false ones."},
    {"sonar", "decibels_per_count", OF_DEVICE, LIVE, QUANTITY(1, "dB", 0.001, 0.47), .standard = "auto",
     .instead = "auto", .instead_value = 0, SONAR(db_per_count),
     .help = "Required by amplitude = log: decibels per count, for instance 0.3137 dB where 80 dB span 0 to 255."},
    {"sonar", "min_confidence", OF_DEVICE, NUMBER(0.01, 1), .standard = "0.5", SONAR(min_confidence),
     .help = "Of ranges that the sonar reports with a confidence: a lower one counts as no echo."},
    {"sonar", "delay", OF_DEVICE, QUANTITY(2, "s", 0, 2), .standard = "auto", .instead = "auto",
     .instead_value = -1, SONAR(delay_s),
     .help =
         "Of ready ranges: how long after its echo a reading comes, beside the time that sound takes, and by how\n"
         "much that is uncertain. 0.5 0.3 s is 0.2 to 0.8 s. Pings are dated back by the delay. Free space is\n"
         "shorter, and obstacles are nearer, by what the vehicle may have moved in the uncertain time. auto:\n"
         "what is published of the device, or an assumption, which --check names (docs/devices)."},
    {"sonar", "ring_down", LIVE, QUANTITY(1, "m", 0.01, 20), .standard = "auto", .instead = "auto",
     .instead_value = -1, SONAR(ring_down_m),
     .help = "Ignore returns closer than this (transducer ring-down); less than range. auto: measured from the\n"
             "device and every beam."},
    {"sonar", "background", OF_DEVICE, .kind = CONF_PATH, .standard = "none", .instead = "none", SONAR(background),
     .form = "an absolute path",
     .help = "File for the template of the vehicle's own echoes: `sonarctl background learn` makes one, `save`\n"
             "writes it here. Loaded at start-up if it exists. See [background]."},
    {"sonar", "power", .kind = CONF_TEXT, .form = LINE_FORM, .standard = "none", .instead = "none", SONAR(power),
     .help = "GPIO line that switches the sonar's power. sonard switches it on at start-up."},
    {"sonar", "power_active", WORDS("high", "low"), .standard = "high", SONAR(power_active),
     .help = "Level of that line that means on."},
    {"sonar", "power_cycle_after", QUANTITY(1, "s", 5, 3600), .standard = "never", .instead = "never",
     .instead_value = 0, SONAR(power_cycle_after_s),
     .help = "Power-cycle the sonar after this long without a ping: off for three seconds, then on. Set it\n"
             "longer than the sonar takes to boot, which can be 30 s."},
    {"sonar", "power_at_stop", WORDS("on", "off"), .standard = "off", SONAR(power_at_stop),
     .help = "State of the line when sonard stops. After that the chip's driver decides; most keep the level."},
    {"sonar", "trigger", .kind = CONF_TEXT, .form = LINE_FORM, .standard = "none", .instead = "none",
     SONAR(trigger),
     .help = "GPIO line with an edge at every transmission. The kernel's time of the edge becomes the time of\n"
             "the ping."},
    {"sonar", "trigger_edge", WORDS("rising", "falling"), .standard = "rising", SONAR(trigger_edge),
     .help = "Which edge of that line."},

    {"water", "sound_speed", QUANTITY(1, "m/s", 1350, 1650), .standard = "1500 m/s", CONF(water.sound_speed_mps),
     .help = "Speed of sound. Sea water at 13 C has 1500 m/s, fresh water at 10 C 1447 m/s. All ranges scale\n"
             "with it."},
    {"water", "density", QUANTITY(1, "kg/m3", 900, 1100), .standard = "1025 kg/m3", CONF(water.density_kgpm3),
     .help = "Converts pressure to depth: 1025 kg/m3 for coastal sea water, 997 kg/m3 for fresh water, 3 %\n"
             "apart."},

    {"extract", "detector", LIVE, WORDS("ca", "goca", "soca", "os"), .standard = "soca", CONF(extract.detector),
     .help = "Which reference cells set the threshold: the mean of all (ca), the greater (goca) or the smaller\n"
             "(soca) of the two side means, or an order statistic (os). Use soca to find a weak wall beside a\n"
             "strong echo, goca for the fewest false echoes."},
    {"extract", "order", WORDS("safe", "paper"), .standard = "safe", CONF(extract.order),
     .help = "Where the clean-up acts. safe: detect on the sonar's own data, then drop echoes that the cleaned\n"
             "image rules out. paper: detect on the cleaned image, with no defined false-alarm rate."},
    {"extract", "false_alarm", LIVE, NUMBER(1e-12, 0.1), .standard = "1e-3", CONF(extract.false_alarm),
     .help = "Probability that a bin of pure noise counts as part of an echo. The peak of an echo must also have\n"
             "min_contrast, so this mostly decides where the faint edge of an echo starts. A larger value ends\n"
             "free space sooner; a smaller one frees more and misses more."},
    {"extract", "window", LIVE, QUANTITY(1, "m", 0.005, 20), .standard = "0.4 m", CONF(extract.window_m),
     .help = "Length of the reference cells on each side of the cell under test."},
    {"extract", "guard", LIVE, QUANTITY(1, "m", 0, 10), .standard = "0.1 m", CONF(extract.guard_m),
     .help = "Cells left out on each side of the cell under test, so that an echo does not raise its own\n"
             "threshold. At least the pulse length; less than window."},
    {"extract", "rank", LIVE, NUMBER(0.05, 1), .standard = "0.75", CONF(extract.rank),
     .help = "For detector = os: which of the sorted reference cells, as a fraction of their number. 0.75\n"
             "tolerates echoes in a quarter of the cells."},
    {"extract", "floor", LIVE, INTEGER(0, 65535), .standard = "8", CONF(extract.floor_counts),
     .help = "Lowest level assumed for the surroundings of an echo, in counts; an echo must rise min_contrast\n"
             "above it. Sonars send runs of zeros, over which any stray count would stand out. With a linear\n"
             "8-bit receiver, 8 and 14 dB make 40 counts. Lower it in quiet water."},
    {"extract", "min_contrast", LIVE, QUANTITY(1, "dB", 0, 100), .standard = "14 dB",
     CONF(extract.min_contrast_db),
     .help = "How far an echo must rise above its surroundings. The false-alarm rule alone takes every ripple of\n"
             "reverberation for an echo; a hull, a wall or a pile stands out by far more than this."},
    {"extract", "learn_ring_down", LIVE, WORDS("on", "off"), .standard = "off", CONF(extract.learn_ring_down),
     .help = "For ring_down = auto: if a beam seems to ring longer than usual, start at the usual end of the\n"
             "ring-down. This finds a wall close to the head, and also parts of the vehicle."},
    {"extract", "median", WORDS("off", "3", "5"), .standard = "off", CONF(extract.median),
     .help = "Smooth the image of a scanning head with a median of 3 x 3 or 5 x 5 bins, against single specks.\n"
             "Delays each ping until one (3) or two (5) more have come; the last ones wait while a sonar is\n"
             "silent."},
    {"extract", "otsu", WORDS("on", "off"), .standard = "off", CONF(extract.otsu),
     .help = "Remove everything below the threshold that best splits the last revolution in two (Otsu)."},
    {"extract", "clahe", WORDS("on", "off"), .standard = "off", CONF(extract.clahe),
     .help = "Equalise the contrast of the image (CLAHE), each part from its own last pass."},
    {"extract", "clahe_clip", NUMBER(1, 100), .standard = "2", CONF(extract.clahe_clip),
     .help = "Limit of clahe: no level counts for more than this many times the mean level."},
    {"extract", "classes", WORDS("on", "off"), .standard = "off", CONF(extract.classes),
     .help = "Split the last revolution into three classes; the lowest contains no echo. May lose weak obstacles\n"
             "in a scene with strong ones."},
    {"extract", "marks", WORDS("on", "off"), .standard = "on", CONF(extract.marks),
     .help =
         "Mark echoes that other beams at nearly the same bearing contradict (interference), that arrive\n"
         "when a pulse of another sonar is due, or that are ghosts of nearer echoes. An echo with one of\n"
         "the first two marks ends free space at once and blocks when a second beam shows it.\n"
         "Without position or velocity only beams of the last 10 s count. With poses the vehicle's own echoes\n"
         "are marked, too: they end free space and never block."},
    {"extract", "no_echo", LIVE, WORDS("minimum", "heard", "range"), .standard = "heard", CONF(extract.no_echo),
     .help = "How far water is free where a beam received no echo. minimum (conservative): at most to\n"
             "minimum_range, as in the paper. heard (noise-limited): as far as the target would have been\n"
             "detected. range (full range): to the end of the beam, off its axis as with heard; may call water\n"
             "free that reverberation masks. Of sonars that report ready ranges always minimum."},
    {"extract", "target", LIVE, QUANTITY(1, "dB", 0, 40), .standard = "wall", CONF(extract.target_db),
     NAMED({"wall", 0}, {"pile", 6}, {"net", 12}, {"line", 18}),
     .help = "Weakest obstacle that free space must not contain: how much less than a wall it returns. A pile\n"
             "returns 6 dB less, a net 12 dB, a line 18 dB. The weaker the target, the shorter the free space;\n"
             "docs/extract.md has the curve. Every answer names the target."},
    {"extract", "bottom", LIVE, QUANTITY(1, "dB", 0, 40), .standard = "15 dB", .instead = "off",
     .instead_value = -1, CONF(extract.bottom_db),
     .help =
         "Weakest bottom that free space must not contain: how much less than a wall it returns where it\n"
         "begins. The echo of a soft bottom has no edge; it is found because it lasts for longer than window.\n"
         "A bottom that the beam grazes, or that is softer, is not found. off: bottoms are judged like any\n"
         "other target, and mud may be called free."},
    {"extract", "minimum_range", LIVE, QUANTITY(1, "m", 0.1, 200), .standard = "0.75 m",
     CONF(extract.minimum_range_m),
     .help = "For no_echo = minimum: how far water is free where a beam received no echo. Not beyond the range\n"
             "of any sonar."},

    {"background", "mask", INTEGER(1, 254), .standard = "64", CONF(background.mask),
     .help = "Template level above which a cell is blind. Set it well above the noise and below the weakest echo\n"
             "of the frame that was taken for an obstacle."},
    {"background", "neighbour", QUANTITY(1, "m", 0.01, 1), .standard = "0.15 m", CONF(background.neighbour_m),
     .help = "Loud cells closer together than this belong to one part."},
    {"background", "min_points", INTEGER(1, 1000), .standard = "6", CONF(background.min_points),
     .help = "Fewest loud cells within `neighbour` of a cell, itself included; fewer are a speckle."},
    {"background", "min_level", NUMBER(0, 255), .standard = "80", CONF(background.min_level),
     .help = "Lowest mean level of a part of the vehicle: metal close by is loud."},
    {"background", "extent", QUANTITY(1, "m", 0.01, 50), .standard = "1 m", CONF(background.extent_m),
     .help = "Greatest length of a part of the vehicle in range."},
    {"background", "reach", QUANTITY(1, "m", 0.05, 50), .standard = "3 m", CONF(background.reach_m),
     .help = "Greatest distance of a part of the vehicle from the sonar: the length of the vehicle."},
    {"background", "share", NUMBER(0.001, 1), .standard = "0.25", CONF(background.share),
     .help = "Greatest fraction of all bearings that a part of the vehicle covers."},
    {"background", "ring", QUANTITY(1, "m", 0, 20), .standard = "0.5 m", CONF(background.ring_m),
     .help = "Within this range any lasting echo is the transducer's ring-down, at all bearings."},
    {"background", "open_water", WORDS("no", "yes"), .standard = "no", CONF(background.open_water),
     .help = "yes: you promise that every template was learnt in open water, with nothing but the vehicle within\n"
             "reach. A part of the vehicle that rings with the head then no longer hides the water behind it,\n"
             "where an echo from behind shows that sound passes."},
    {"background", "save_every", QUANTITY(1, "s", 1, 86400), .standard = "never", .instead = "never",
     .instead_value = 0, CONF(background.save_every_s),
     .help = "Save a learnt template to the file of its sonar this often, if it changed, and when sonard stops.\n"
             "never: only `sonarctl background save` writes it."},

    {"grid", "range", QUANTITY(1, "m", 0.75, 200), .standard = "auto", .instead = "auto", .instead_value = 0,
     CONF(grid.range_max_m), .help = "Range of the grid. auto: that of the sonar with the longest range."},
    {"grid", "angular_step", QUANTITY(1, "deg", 0.5, 15), .standard = "2 deg", CONF(grid.angular_step_rad),
     .help = "Width of a direction. Use about the beam width: finer takes memory and finds nothing more.\n"
             "For a narrow sonar that does not turn use a third of it: a direction is clear only if it\n"
             "lies wholly in the beam."},
    {"grid", "layer", QUANTITY(1, "m", 0.01, 5), .standard = "0.05 m", CONF(grid.layer_m),
     .help = "Thickness of the nearest cells."},
    {"grid", "growth", NUMBER(1, 2), .standard = "1.035", CONF(grid.growth),
     .help = "Each layer is thicker than the one before by this factor; 1 keeps all alike. 1.035 keeps cells\n"
             "about as deep as they are wide."},
    {"grid", "elevation", WORDS("full", "level"), .standard = "full", CONF(grid.elevation),
     .help = "full: directions over the whole sphere. level: one row of directions, for a level sonar on a\n"
             "vehicle that stays level. level is cheaper and knows nothing above and below."},
    {"grid", "axes", WORDS("ned", "course"), .standard = "ned", CONF(grid.axes),
     .help = "Where the grid's directions start once poses have an attitude. ned: at north, at no cost. course:\n"
             "along the course, so that a corridor ahead stays in the same cells. Each change of course by more\n"
             "than 10 degrees and two steps takes time, and water beside unknown water becomes unknown."},
    {"grid", "sensor_model", WORDS("opening", "gauss", "midpoint"), .standard = "opening", CONF(grid.sensor_model),
     .help = "Where in a beam an echo counts. opening (uniform beam model): the same in the whole beam. gauss:\n"
             "less off the axis and off the range (normal distributions, half at half power), integrated over\n"
             "cells. midpoint: as gauss, evaluated at the middle of the cell: cheaper, coarse in wide cells."},
    {"grid", "update", WORDS("bayes", "max"), .standard = "bayes", CONF(grid.update),
     .help = "bayes: echoes in a cell add up. max: the strongest counts."},
    {"grid", "range_error", NUMBER(0, 0.1), .standard = "0.003", CONF(grid.range_error),
     .help = "Standard deviation of a range as a fraction of it, for sensor_model gauss and midpoint."},
    {"grid", "mask_reach", NUMBER(1.2, 4), .standard = "2", CONF(grid.mask_reach),
     .help = "How far the evidence of an echo reaches, in standard deviations of range and angle, for\n"
             "sensor_model gauss and midpoint. Less if that would be more than 343 cells."},
    {"grid", "relaxation", NUMBER(0, 1), .standard = "0", CONF(grid.relaxation),
     .help = "How much a direction is raised towards the obstacles around it. Fills gaps in a wall that returns\n"
             "echoes only now and then, and widens obstacles. 0: off; 0.5 suits a sonar that often misses\n"
             "echoes."},
    {"grid", "cluster_relaxation", NUMBER(0, 1), .standard = "0", CONF(grid.cluster_relaxation),
     .help = "The same for the cells of clusters: parts of a wall with a one-cell gap become one cluster. Does\n"
             "not change answers about free space."},
    {"grid", "max_cells", INTEGER(1024, 16777216), .standard = "65536", CONF(grid.max_cells),
     .help = "Most cells in use; the memory is allocated at start-up."},
    {"grid", "blocked_above", NUMBER(0.51, 0.99), .standard = "0.6", CONF(grid.blocked_above),
     .help = "Probability above which a cell is an obstacle. A lower value warns earlier, and falsely more\n"
             "often."},
    {"grid", "clear_for", LIVE, QUANTITY(1, "s", 0.5, 86400), .standard = "auto", .instead = "auto",
     .instead_value = 0, CONF(grid.clear_for_s),
     .help = "A direction counts as clear for this long after its last ping, then it is unknown. Not longer than\n"
             "forget. If it is shorter than a revolution of the head, most of the circle stays unknown. A\n"
             "revolution takes 9 to 35 s, and 63 s for a Ping360 at 115200 baud and 20 m. auto: 1.5 times the\n"
             "longest measured revolution, at least 30 s; forget, if that is less."},
    {"grid", "forget", QUANTITY(1, "s", 1, 86400), .standard = "auto", .instead = "auto", .instead_value = 0,
     CONF(grid.forget_s),
     .help = "Longest time an obstacle blocks after its last echo. An echo that nothing confirms blocks half as\n"
             "long, at most 1.5 revolutions of the head (5 s at least). Then the place is unknown. Not shorter\n"
             "than clear_for. auto: 2.5 times the longest measured revolution, at least 160 s, and clear_for."},
    {"grid", "move_limit", LIVE, QUANTITY(1, "m", 0.05, 100), .standard = "auto", .instead = "auto",
     .instead_value = 0, CONF(grid.move_limit_m),
     .help = "A clear direction becomes unknown after the vehicle has travelled this far without scanning it\n"
             "again, or up to 0.2 m farther: position noise below 0.1 m is not travel. auto: no fixed limit.\n"
             "Free space shrinks by 1 % of the distance travelled, by the pose uncertainty and, without a\n"
             "position, by the drift, until clear_for ends it. Set it if positions drift by more."},

    {"grids", "memory", QUANTITY(1, "MiB", 1, 65536), .standard = "1024 MiB", CONF(grids.memory_bytes),
     .help = "Most memory for all grids, including those made later, and their clusters. Clusters are made on\n"
             "request and take five times as much as the cells."},

    {"map", "voxel", QUANTITY(1, "m", 0.02, 5), .standard = "none", .instead = "none", .instead_value = 0,
     CONF(map.voxel_m),
     .help = "Edge of a voxel; none: no map. 0.2 m suits tanks, harbours and dams. Half the edge takes eight\n"
             "times the memory for the same water."},
    {"map", "memory", QUANTITY(1, "MiB", 1, 65536), .standard = "64 MiB", CONF(map.memory_bytes),
     .help = "Memory of the map, allocated at start-up. When it runs low the oldest submap is saved to\n"
             "directory, if one is set, and dropped. Its free space becomes unknown; its echoes stay."},
    {"map", "extent", QUANTITY(1, "m", 1, 2000), .standard = "auto", .instead = "auto", .instead_value = 0,
     CONF(map.extent_m),
     .help = "Side of a submap in plan. Parts of a beam outside it are not entered. auto: from the longest sonar\n"
             "range and submap_distance."},
    {"map", "height", QUANTITY(1, "m", 0.1, 2000), .standard = "16 m", CONF(map.height_m),
     .help = "Height of a submap, half above and half below its starting point."},
    {"map", "threshold", INTEGER(0, 254), .standard = "1", CONF(map.threshold),
     .help = "A voxel is free when more observations than this found it free. 1 tolerates a single wrong one."},
    {"map", "echoes", WORDS("on", "off"), .standard = "on", CONF(map.echoes),
     .help = "Keep echoes in a second byte per voxel. A thin obstacle then survives the next sweep, and answers\n"
             "distinguish occupied from unknown."},
    {"map", "echo_weight", INTEGER(0, 255), .standard = "2", CONF(map.echo_weight),
     .help = "How many free observations of a voxel one echo in it outweighs."},
    {"map", "tolerance", QUANTITY(1, "m", 0, 1), .standard = "0 m", CONF(map.tolerance_m),
     .help = "Moves the side faces of every beam outwards, never its end. Closes gaps between beams, but frees\n"
             "water that no beam passed through; 0 is safe."},
    {"map", "opening", NUMBER(0.1, 1), .standard = "0.5", CONF(map.opening),
     .help =
         "Fraction of the beam's height (of a round beam: its width) in which water counts as free up to where\n"
         "the sonar would still detect the target there; half of it up to where the beam's axis is free. Of a\n"
         "sonar with intensities the whole beam is free where even its edge would detect a surface. An echo\n"
         "fills the whole beam. Sonars that report ranges only: all of the fraction up to the range; a floor\n"
         "that only the edge of the beam touches returns too weak an echo. More frees more water, and more of\n"
         "it is solid ground. See docs/map.md."},
    {"map", "weight_levels", INTEGER(1, 8), .standard = "1", CONF(map.weight_levels),
     .help = "An observation counts more near the beam axis than at the edge, in this many steps of the two-way\n"
             "beam pattern; threshold and echo_weight scale with it. 1: the whole beam alike."},
    {"map", "beam", WORDS("wedge", "pyramid"), .standard = "wedge", CONF(map.beam),
     .help = "Shape of a beam whose width and height differ. wedge: edges of equal elevation, as a fan has.\n"
             "pyramid: flat faces, a little less water; for beams below 180 degrees both ways."},
    {"map", "body", QUANTITY(1, "m", 0.01, 20), .standard = "none", .instead = "none", .instead_value = 0,
     CONF(map.body_m),
     .help = "Radius around the vehicle's reference point that surely contains nothing but the vehicle. Water on\n"
             "its path is then free, and near it the whole height of a beam counts, because no surface can be\n"
             "grazed there. none: only beams make water free."},
    {"map", "submap_distance", QUANTITY(1, "m", 0.5, 1000), .standard = "10 m", CONF(map.submap_distance_m),
     .help = "Start a new submap this far from the start of the last one."},
    {"map", "submap_time", QUANTITY(1, "s", 1, 86400), .standard = "never", .instead = "never", .instead_value = 0,
     CONF(map.submap_time_s), .help = "Start a new submap this long after the last one."},
    {"map", "forget", QUANTITY(1, "s", 1, 604800), .standard = "never", .instead = "never", .instead_value = 0,
     CONF(map.forget_s),
     .help = "Half-life: all counts, of free space and of echoes, are halved this often, so that water not\n"
             "scanned again becomes unknown."},
    {"map", "directory", .kind = CONF_PATH, .standard = "none", .instead = "none", CONF(map.directory),
     .form = "an absolute path",
     .help = "Where maps are saved, exported and loaded, and where submaps go when memory is low. none: no\n"
             "files."},
    {"map", "origin", .kind = CONF_TEXT, .form = "a name, for instance basin-east or geo:41.1784,-8.6071",
     .standard = "none", .instead = "none", CONF(map.origin),
     .help = "Name of the origin of positions: any name, the same whenever positions have the same origin. A\n"
             "saved map stores it; a map with another origin is not loaded. none: maps without an origin are\n"
             "loaded, with a warning if another run made them."},
    {"map", "save_every", QUANTITY(1, "s", 1, 86400), .standard = "never", .instead = "never", .instead_value = 0,
     CONF(map.save_every_s),
     .help = "Save the map as last.map in directory this often, if it changed, and when sonard stops. An earlier\n"
             "last.map that was not loaded becomes before.map."},
    {"map", "load", .kind = CONF_NAME, .form = "last, the name of another map", .standard = "none",
     .instead = "none", CONF(map.load),
     .help = "Load this map from directory at start-up; last is the one from save_every. Only for vehicles whose\n"
             "positions have the same origin as the saved map: sonard can check only `origin`. If the map cannot\n"
             "be loaded, sonard logs it and starts with an empty one."},

    {"pose", "max_age", LIVE, QUANTITY(1, "s", 0.01, 3600), .standard = "auto", .instead = "auto",
     .instead_value = 0, CONF(pose.max_age_s),
     .help =
         "An older pose is stale, and answers that need it are unknown. auto: 1 s. If poses, or some part of\n"
         "them, come more rarely and max_speed and max_turn are set, 3 times the usual interval, at most 10 s:\n"
         "the two bound what the vehicle can have done meanwhile. The usual interval is the middle one of the\n"
         "last seven, so this begins with the eighth pose. `sonarctl status` shows what is in force. Raise it\n"
         "yourself only if poses come more rarely still."},
    {"pose", "heading_drift", LIVE, QUANTITY(1, "deg/s", 0, 10), .standard = "0.01 deg/s",
     CONF(pose.heading_drift_radps),
     .help =
         "How fast the heading of the attitudes may drift. What was observed may then lie beside where it now\n"
         "seems to be: answers count everything within heading_drift times clear_for to both sides, and free\n"
         "space shrinks by the drift since each ping, times the distance travelled since. 0.01 deg/s suits an\n"
         "IMU with a compass. Without a compass it is the bias of the gyro, 0.1 deg/s and more for a cheap\n"
         "one: set what you measured, and a short clear_for."},
    {"pose", "delay", LIVE, QUANTITY(2, "s", 0, 2), .standard = "0 0 s", CONF(pose.delay_s),
     .help =
         "How much older every pose is than the time it comes with (t_unix, or else its arrival), and by\n"
         "how much that is uncertain. Headings and depths count as poses. 0.1 0.05 s is 0.05 to 0.15 s. Poses\n"
         "are dated back by the delay. What the vehicle moves and turns in the uncertain time is pose\n"
         "uncertainty: free space is shorter and obstacles are nearer by it."},

    {"vehicle", "radius", LIVE, QUANTITY(1, "m", 0.05, 50), .standard = "0.4 m", CONF(vehicle.radius_m),
     .help = "Radius of the upright cylinder around the reference point that contains the whole vehicle."},
    {"vehicle", "height", LIVE, QUANTITY(1, "m", 0.05, 50), .standard = "0.5 m", CONF(vehicle.height_m),
     .help = "Height of that cylinder, half above and half below the reference point."},
    {"vehicle", "margin", LIVE, QUANTITY(1, "m", 0, 20), .standard = "0.3 m", CONF(vehicle.margin_m),
     .help = "Clearance to keep on every side of it."},
    {"vehicle", "near", LIVE, QUANTITY(1, "m", 0.05, 50), .standard = "auto", .instead = "auto",
     .instead_value = 0, CONF(vehicle.near_m),
     .help =
         "Water within this distance of the reference point counts as known: a promise that nothing stands there\n"
         "out of the sonars' sight. An echo there still blocks, or makes the answer unknown if it is too faint "
         "to\n"
         "block. `limit` and `time_to_collision` do not take the promise for a level bearing at which a\n"
         "head looks, while all that do have not looked yet, are offline or receive nothing usable. In a beam\n"
         "that does not turn, only what it has shown is known. auto: no promise; known is the vehicle's own\n"
         "place with its margin, and what was observed. A level head does not observe water close above and\n"
         "below, so `limit` allows only `slow` until beams have passed there.\n"
         "They are as high as the vehicle from (height / 2 + margin + height of mount) / sin(half the height of\n"
         "the fan) on, with 1.5 angular_step subtracted from that half (docs/grid.md); --check works it out, and\n"
         "says if `near` is less. At most the longest range of a sonar. `blocked`, `sectors` and\n"
         "sonard-mavlink count on it only in directions in which water was observed from somewhere within it on."},
    {"vehicle", "max_speed", LIVE, QUANTITY(1, "m/s", 0.01, 50), .standard = "told", .instead = "told",
     .instead_value = 0, CONF(vehicle.max_speed_mps),
     .help = "Maximum speed over ground. Without a fresh pose the vehicle may be anywhere reachable at this\n"
             "speed, or at the bound that `current` lets count where that is less; obstacles are nearer and free\n"
             "space shorter by that. told: the last reported speed. A vehicle that has just started then counts\n"
             "as at rest until the next pose: half its acceleration times the square of that time is missing.\n"
             "Set a value if poses come less than 5 times a second. Poses that move 5 m farther than this allows\n"
             "hold the map ([map], docs/map.md)."},
    {"vehicle", "max_turn", LIVE, QUANTITY(1, "deg/s", 0.1, 1000), .also = "deg", .standard = "told",
     .instead = "told", .instead_value = 0, CONF(vehicle.max_turn_radps),
     .help = "Maximum turn rate; like max_speed, for directions in the body's frame. An attitude more\n"
             "than 5 degrees beyond it is a jump: what was clear is unknown until it is scanned again. told: the\n"
             "last reported turn rate, but a jump is found only beyond a full turn a second. An attitude more\n"
             "than 20 degrees beyond it holds the map."},
    {"vehicle", "current", LIVE, QUANTITY(1, "m/s", 0, 5), .standard = "unknown", .instead = "unknown",
     .instead_value = -1, CONF(vehicle.current_mps),
     .help =
         "A promise that the water goes no faster than this, where the vehicle is and along its tether; and that\n"
         "nobody hauls the tether in, or tows its boat, faster. A pool has 0.05 m/s by the vehicle's own wash, a\n"
         "sheltered harbour 0.1 to 0.3, a tidal stream 0.5 to 1.5. With it sonard believes the bound of the\n"
         "vehicle's speed through the water that clients send: sonard-mavlink works one out from what the\n"
         "thrusters of a BlueROV2 do. Both together bound how far a vehicle drifts that has neither position nor\n"
         "velocity, and how far any vehicle went since its last position, depth or altitude if these come\n"
         "rarely. unknown: no bound is believed, and max_speed counts. See docs/without-a-dvl.md."},
    {"vehicle", "station_keeping", LIVE, QUANTITY(1, "m/s", 0, 5), .standard = "auto", .instead = "no",
     .instead_value = -1, CONF(vehicle.keep_mps), NAMED({"auto", CONF_KEEP_AUTO}),
     .help =
         "For a vehicle without position and velocity: a promise that it keeps its place and drifts no\n"
         "faster than this. Without attitude, also that it keeps its heading. 0 m/s: it is fixed to a pole\n"
         "or a tank wall. no: it may move at max_speed (3 m/s if not set), and free space shrinks by that\n"
         "every second (docs/design.md, Sensors of the vehicle). auto: it moves no faster than the newest bound\n"
         "that a client sends with its poses (speed_bound_mps) and `current` together; at max_speed while none\n"
         "comes, and while `current` is unknown. A sonar that never received any pose, with no max_speed\n"
         "and no sonard-mavlink, counts as fixed."},
    {"vehicle", "braking", LIVE, QUANTITY(1, "m/s2", 0.01, 20), .standard = "0.2 m/s2", CONF(vehicle.braking_mps2),
     .help = "Lowest braking deceleration in still water, in any direction. Measure it."},
    {"vehicle", "latency", LIVE, QUANTITY(1, "s", 0, 10), .standard = "0.5 s", CONF(vehicle.latency_s),
     .help = "Time from sonard's answer until braking takes effect."},
    {"vehicle", "unknown", LIVE, WORDS("slow", "stop", "ignore"), .standard = "slow", CONF(vehicle.unknown),
     .help = "What `limit` allows where the water ahead is unknown. slow: the speed below. stop: nothing.\n"
             "ignore: as if it were free; only detected obstacles limit."},
    {"vehicle", "slow", LIVE, QUANTITY(1, "m/s", 0, 5), .standard = "0.1 m/s", CONF(vehicle.slow_mps),
     .help = "Maximum speed into unknown water with unknown = slow: so low that touching something does no harm."},

    {"answers", "look_ahead", LIVE, QUANTITY(1, "m", 0.1, 200), .standard = "auto", .instead = "auto",
     .instead_value = 0, CONF(answers.look_ahead_m),
     .help = "How far the sectors of a ring are judged if the question gives no distance. clear: free up to\n"
             "here. blocked: an obstacle is nearer. auto: radius and margin of [vehicle] plus the stopping\n"
             "distance from max_speed (1 m/s if not set); at least 3 m, at most the range of the sonars.\n"
             "free_to_m may be larger."},

    {"depth", "source", .kind = CONF_TEXT, .form = "modbus-rtu:DEVICE:BAUD, or modbus-tcp:ADDRESS:PORT",
     .standard = "none", .instead = "none", CONF(depth.source),
     .help = "Address of the sensor: modbus-rtu:/dev/ttyUSB1:9600 on a serial line, modbus-tcp:192.168.2.5:502\n"
             "on a network. none: no sensor."},
    {"depth", "parity", WORDS("none", "even", "odd"), .standard = "none", CONF(depth.parity),
     .help = "Parity of the serial line; with none there is still one stop bit."},
    {"depth", "slave", INTEGER(0, 247), .standard = "1", CONF(depth.slave),
     .help = "Modbus address of the sensor."},
    {"depth", "function", WORDS("holding", "input"), .standard = "holding", CONF(depth.function),
     .help = "Which registers to read: holding registers with function 3, input registers with function 4."},
    {"depth", "register", INTEGER(0, 65535), .standard = "2", CONF(depth.reg),
     .help = "First register of the value, counted from 0. 2 is pressure P1 of a Keller."},
    {"depth", "type", WORDS("int16", "uint16", "int32", "float32"), .standard = "float32", CONF(depth.type),
     .help = "Type of the value; int32 and float32 take two registers."},
    {"depth", "word_order", WORDS("big", "little"), .standard = "big", CONF(depth.word_order),
     .help = "Which of two registers comes first: the one with the high bits (big) or the low bits (little)."},
    {"depth", "scale", NUMBER(-1e9, 1e9), .standard = "1", CONF(depth.scale),
     .help = "Factor for the value read."},
    {"depth", "offset", NUMBER(-1e9, 1e9), .standard = "0", CONF(depth.offset),
     .help = "Added after scale; the result is in `unit`."},
    {"depth", "unit", WORDS("m", "Pa", "kPa", "mbar", "dbar", "bar"), .standard = "bar", CONF(depth.unit),
     .help = "m: the result is a depth. Otherwise it is a pressure, and depth follows from surface_pressure and\n"
             "density in [water]."},
    {"depth", "surface_pressure", QUANTITY(1, "mbar", -2000, 2000), .standard = "1013.25 mbar",
     CONF(depth.surface_pa),
     .help = "Pressure reading at the surface: today's air pressure for an absolute sensor, 0 for a vented one.\n"
             "Weather changes depth by 0.3 m."},
    {"depth", "mount", QUANTITY(3, "m", -50, 50), .standard = "0 0 0 m", CONF(depth.mount_m),
     .help = "Position of the sensor: forward, right, down from the vehicle's reference point."},
    {"depth", "rate", QUANTITY(1, "Hz", 0.1, 50), .standard = "5 Hz", CONF(depth.rate_hz),
     .help = "How often to read the sensor. At 9600 baud the limit is about 20 Hz."},
    {"depth", "timeout", QUANTITY(1, "ms", 20, 2000), .standard = "300 ms", CONF(depth.timeout_s),
     .help = "How long to wait for an answer."},
    {"depth", "turnaround", QUANTITY(1, "ms", 20, 10000), .standard = "1000 ms", CONF(depth.turnaround_s),
     .help = "Longest time after which the sensor may still answer. After a time-out the line must be quiet for\n"
             "this long before the next request, because a late answer does not say which request it belongs to.\n"
             "Not shorter than timeout."},
    {"depth", "resync", WORDS("silence", "echo"), .standard = "silence", CONF(depth.resync),
     .help = "How to resynchronise with the sensor on a serial line after a fault. silence: wait two quiet times\n"
             "of turnaround and discard one answer. echo: request an echo of a number, which needs function 8 (a\n"
             "Keller has it); a late answer is then never taken for another."},
    {"depth", "plausible", QUANTITY(2, "m", -100, 12000), .standard = "-1 300 m", CONF(depth.plausible_m),
     .help = "Smallest and largest depth to accept."},
    {"depth", "speed_limit", QUANTITY(1, "m/s", 0.1, 100), .standard = "3 m/s", CONF(depth.speed_limit_mps),
     .help = "Reject a depth that would mean a faster dive or rise than this."},

    {"nmea", "port", .kind = CONF_TEXT, .form = "KIND:ADDRESS, for instance serial:/dev/ttyS1:4800",
     .standard = "none", .instead = "none", CONF(nmea.port),
     .help = "Where the sensor is connected; see port of [sonar]. udp:192.168.2.9:10110:listen takes what\n"
             "192.168.2.9 sends to port 10110; tcp:192.168.2.9:10110 connects there. none: no sensor."},
    {"nmea", "use", WORDS("heading", "depth", "both", "altitude"), .standard = "heading", CONF(nmea.use),
     .help =
         "heading: use HDT, THS, HDG and HDM as the heading while no client sends an attitude; the vehicle\n"
         "counts as level. depth: use DPT and DBT as the vehicle's own depth, as depth sensors send it.\n"
         "altitude: use them as the height above the bottom, as an echosounder sends it that looks down; nothing\n"
         "below is free then. An echosounder may as well be a sonar (device = nmea0183)."},
    {"nmea", "variation", QUANTITY(1, "deg", -180, 180), .standard = "none", .instead = "none",
     .instead_value = CONF_NO_VARIATION, CONF(nmea.variation_rad),
     .help = "Magnetic variation, east positive, for headings sent without one. none: such headings are not\n"
             "used."},
    {"nmea", "checksum", WORDS("required", "optional"), .standard = "required", CONF(nmea.checksum),
     .help = "optional: accept sentences without a checksum. A wrong checksum is never accepted."},

    {"gpio", "chip", .kind = CONF_TEXT, .form = "label or name of a chip, for instance pinctrl-bcm2711",
     .standard = "any", .instead = "any", CONF(gpio.chip),
     .help = "Chip that has the lines; any: the first with a line of that name. Labels and line names stay the\n"
             "same from boot to boot, numbers do not; gpioinfo lists them."},
    {"gpio", "leak", .kind = CONF_TEXT, .form = LINE_FORM, .standard = "none", .instead = "none", CONF(gpio.leak),
     .help = "Line of a leak probe. sonard logs a leak, shows it in status and notifies clients that watch\n"
             "status at once."},
    {"gpio", "leak_active", WORDS("high", "low"), .standard = "high", CONF(gpio.leak_active),
     .help = "Level of that line that means water."},
    {"gpio", "leak_bias", WORDS("as-is", "pull-up", "pull-down"), .standard = "as-is", CONF(gpio.leak_bias),
     .help = "Pull resistor of the pin."},

    {"server", "socket", .kind = CONF_PATH, .standard = "/run/sonard/sonard.sock", CONF(server.socket),
     .form = "an absolute path of at most 107 bytes", .help = "Path of the UNIX socket."},
    {"server", "mode", .kind = CONF_OCTAL, .lo = 0600, .hi = 0777, .standard = "0660", CONF(server.mode),
     .help = "Permission bits of the socket, in octal: who may query sonard. 0660 is the user and the group."},
    {"server", "change", LIVE, .kind = CONF_NAMES, .standard = "group", .instead = "group", CONF(server.change),
     .form = "all, or users, @groups and their numbers, for instance pilot, @sonar, 1000",
     .help = "Users who may also make changes: send poses, make and lock grids, learn backgrounds, save and\n"
             "clear the map, reload. group: the group of the socket file. all: everybody who may query. root and\n"
             "sonard's own user always may."},
    {"server", "keep", LIVE, .kind = CONF_NAMES, .standard = "sonard-mavlink, sonard-web", .instead = "none",
     CONF(server.keep), .form = "none, or names of programs or users, for instance sonard-mavlink, pilot",
     .help = "Programs, and users, whose place and watches are kept: two connections of each never make room for\n"
             "others, and get room when there is none. A program is known by its name in ps(1), which it can\n"
             "choose: that guards against greed, not against malice."},
    {"server", "max_clients", INTEGER(1, 1024), .standard = "64", CONF(server.max_clients),
     .help = "Most connections at a time. A further one replaces a client idle for client_timeout; or one of\n"
             "the user, or of the user's programs, that has most connections, if its own has fewer; or is\n"
             "refused. One extra place is reserved for clients that may make changes."},
    {"server", "client_timeout", QUANTITY(1, "s", 1, 3600), .standard = "10 s", CONF(server.client_timeout_s),
     .help = "Disconnect a client that has not read pending replies for this long. A client without requests and\n"
             "watches for this long makes room for others when max_clients are connected."},

    {"pipeline", "threads", INTEGER(0, 2), .standard = "0", CONF(pipeline.threads),
     .help = "Threads beside the event loop. 0: none, enough for one scanning head; with a multibeam, answers\n"
             "then wait for whole pings. 1: one for extraction and grid. 2: one for each."},
    {"pipeline", "queue", INTEGER(2, CONF_MAX_QUEUE), .standard = "16", CONF(pipeline.queue),
     .help = "Pings that may wait. If the queue is full, the oldest is dropped and counted."},

    {"realtime", "priority", INTEGER(2, 90), .standard = "none", .instead = "none", .instead_value = 0,
     CONF(realtime.priority),
     .help = "SCHED_FIFO priority of the loop. The pipeline's threads get one less; writers of captures and maps\n"
             "none. Linux with PREEMPT_RT handles interrupts at 50: stay below. none: an ordinary process."},
    {"realtime", "processor", INTEGER(0, 511), .standard = "any", .instead = "any", .instead_value = -1,
     CONF(realtime.processor),
     .help = "First processor for sonard, counted from 0: one that the kernel leaves alone (isolcpus=). any: the\n"
             "kernel chooses."},
    {"realtime", "processor_count", INTEGER(1, 512), .standard = "1", CONF(realtime.processor_count),
     .help = "Number of processors from that one up. With a priority: one for the loop, and one for each of\n"
             "[pipeline] threads."},
    {"realtime", "lock_memory", WORDS("on", "off"), .standard = "off", CONF(realtime.lock_memory),
     .help = "on: allocate all memory at start-up and keep it, however much other programs use."},

    {"record", "directory", .kind = CONF_PATH, .standard = "none", .instead = "none", CONF(record.directory),
     .form = "an absolute path",
     .help =
         "Where captures go. none: do not record. When the disk fails, is full, or the folder has gone, "
         "recording\n"
         "is tried again after 1 s, then ever later up to every 30 s, in a new file; the folder is made again.\n"
         "A recording on a disk of its own waits for that one to be mounted again."},
    {"record", "file_size", QUANTITY(1, "MiB", 1, 65536), .standard = "256 MiB", CONF(record.file_size_bytes),
     .help = "Start a new file at this size."},
    {"record", "files", INTEGER(1, 1000000), .standard = "8", .instead = "all", .instead_value = -1,
     CONF(record.files), .help = "How many files to keep; the oldest are removed. all: keep every file."},
    {"record", "start", WORDS("at_once", "on_request"), .standard = "at_once", CONF(record.start),
     .help = "When recording begins. on_request: with sonarctl record start, the method record_start, or the "
             "button of\n"
             "the page. It ends with sonarctl record stop, and can begin again, in a new file. Then no recording "
             "removes "
             "another's\n"
             "files: files limits each by itself."},

    {"log", "level", LIVE, WORDS("err", "warning", "notice", "info", "debug"), .standard = "info", CONF(log.level),
     .help = "Least severe event to write."},
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
