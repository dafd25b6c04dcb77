/* SPDX-License-Identifier: MIT */
/*
 * conf - the configuration: one table of keys (conf_table.c) from which the parser, --check, --print, the default
 * file and the man page's table come. Everything in struct conf is SI and radians; the units stand in the file.
 */
#ifndef SONARD_CONF_H
#define SONARD_CONF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "core/fault.h"

#define CONF_MAX_SONARS   8
#define CONF_MAX_GRIDS    4 /* beside the plain [grid] */
#define CONF_MAX_QUEUE    1022
#define CONF_NAME_MAX     32
#define CONF_MAIN_GRID    "main"
#define CONF_TEXT_MAX     256
#define CONF_MAP_NAME_MAX 65

enum conf_amplitude {
    CONF_AMPLITUDE_AUTO,
    CONF_AMPLITUDE_LINEAR,
    CONF_AMPLITUDE_POWER,
    CONF_AMPLITUDE_SQRT,
    CONF_AMPLITUDE_LOG
};
enum conf_scan_mode { CONF_MODE_AUTO, CONF_MODE_TRANSMIT, CONF_MODE_REQUEST };
enum conf_scan { CONF_SCAN_AUTO, CONF_SCAN_PLAIN, CONF_SCAN_ACTIVE };
enum conf_detector { CONF_CA, CONF_GOCA, CONF_SOCA, CONF_OS };
enum conf_order { CONF_ORDER_SAFE, CONF_ORDER_PAPER };
enum conf_median { CONF_MEDIAN_OFF, CONF_MEDIAN_3, CONF_MEDIAN_5 };
enum conf_no_echo { CONF_NO_ECHO_MINIMUM, CONF_NO_ECHO_HEARD, CONF_NO_ECHO_RANGE };
enum conf_sensor_model { CONF_OPENING, CONF_GAUSS, CONF_MIDPOINT };
enum conf_update { CONF_BAYES, CONF_MAX };
enum conf_elevation { CONF_ELEVATION_FULL, CONF_ELEVATION_LEVEL };
enum conf_axes { CONF_AXES_NED, CONF_AXES_COURSE };
enum conf_function { CONF_HOLDING, CONF_INPUT };
enum conf_type { CONF_INT16, CONF_UINT16, CONF_INT32, CONF_FLOAT32 };
enum conf_word_order { CONF_BIG, CONF_LITTLE };
enum conf_resync { CONF_SILENCE, CONF_ECHO };
enum conf_depth_unit { CONF_UNIT_M, CONF_UNIT_PA, CONF_UNIT_KPA, CONF_UNIT_MBAR, CONF_UNIT_DBAR, CONF_UNIT_BAR };
enum conf_parity { CONF_PARITY_NONE, CONF_PARITY_EVEN, CONF_PARITY_ODD };
enum conf_nmea_use { CONF_NMEA_HEADING, CONF_NMEA_DEPTH, CONF_NMEA_BOTH, CONF_NMEA_ALTITUDE };
enum conf_checksum { CONF_CHECKSUM_REQUIRED, CONF_CHECKSUM_OPTIONAL };
enum conf_active { CONF_ACTIVE_HIGH, CONF_ACTIVE_LOW };
enum conf_bias { CONF_BIAS_AS_IS, CONF_BIAS_PULL_UP, CONF_BIAS_PULL_DOWN };
enum conf_switch { CONF_ON, CONF_OFF };
enum conf_edge { CONF_RISING, CONF_FALLING };
enum conf_unknown { CONF_UNKNOWN_SLOW, CONF_UNKNOWN_STOP, CONF_UNKNOWN_IGNORE };
enum conf_log_level { CONF_LOG_ERR, CONF_LOG_WARNING, CONF_LOG_NOTICE, CONF_LOG_INFO, CONF_LOG_DEBUG };

/* [sonar NAME] */
struct conf_sonar {
    char name[CONF_NAME_MAX];   /* letters, digits, - and _ */
    char device[CONF_NAME_MAX]; /* device = ping360 */
    char port[CONF_TEXT_MAX];   /* port = serial:/dev/ttyUSB0:115200 */
    char tap[CONF_TEXT_MAX];    /* tap = /run/sonard/front.tty: link to a terminal that mirrors it; none: empty */
    double range_m;             /* range = 20 m            [0.75 .. 200] */
    int gain;                   /* gain = 1                [0 .. 10]; auto: -1 */
    double sector_rad[2];       /* sector = 0 360 deg      start end, clockwise; a turn apart: full circle */
    double step_rad;            /* step = 0.9 deg          [0.1 .. 90], less than the sector */
    int mode;                   /* mode = auto | transmit | request (enum conf_scan_mode) */
    int scan;                   /* scan = auto | plain | active (enum conf_scan) */
    double circle_s;            /* circle = 60 s            [1 .. 3600]; auto: 0 */
    double frequency_hz;        /* frequency = 750 kHz     [10 .. 3000]; auto: 0, the device's default */
    int node;                   /* node = 42                [0 .. 253], on a CAN bus; any: -1 */
    int sensor_id;              /* sensor_id = 3            [0 .. 255], of that node; any: -1 */
    double aperture_rad[2];     /* aperture = 6.5 6.5 deg   width height; auto: 0 0, as the device says */
    double mount_m[3];          /* mount = 0.2 0 0.1 m     forward right down */
    double rotation_rad[3];     /* rotation = 0 0 0 deg    roll pitch yaw */
    int mirror;                 /* mirror = no | yes: port and starboard of the sensor swapped */
    int amplitude;              /* amplitude = auto | linear | power | sqrt | log */
    double db_per_count;        /* decibels_per_count = 0.3137 dB; auto: 0; positive when amplitude = log */
    double min_confidence;      /* min_confidence = 0.5: of ranges that the device picks itself [0.01 .. 1] */
    double delay_s[2];          /* delay = 0.4 0.4 s: of its readings, and uncertain by; auto: -1, the device's */
    double ring_down_m; /* ring_down = 0.3 m; auto: -1, found from the device and the beam; less than range */
    char background[CONF_TEXT_MAX]; /* background = /var/lib/sonard/front.bg; none: empty */
    char power[CONF_NAME_MAX];      /* power = LINE: GPIO line that switches it; none: empty */
    int power_active;               /* power_active = high | low */
    double power_cycle_after_s;     /* power_cycle_after = 30 s; never: 0 */
    int power_at_stop;              /* power_at_stop = on | off */
    char trigger[CONF_NAME_MAX];    /* trigger = LINE: GPIO line with an edge at every ping; none: empty */
    int trigger_edge;               /* trigger_edge = rising | falling */
};

struct conf_water {
    double sound_speed_mps; /* sound_speed = 1500 m/s [1350 .. 1650] */
    double density_kgpm3;   /* density = 1025 kg/m3 [900 .. 1100] */
};

struct conf_extract {
    int detector;           /* detector = soca | goca | ca | os */
    int order;              /* order = safe | paper: detect on the raw power or on the cleaned image */
    double false_alarm;     /* false_alarm = 1e-4, per bin  [1e-12 .. 0.1] */
    double window_m;        /* window = 0.4 m: reference cells on each side */
    double guard_m;         /* guard = 0.1 m: beside the cell under test, on each side; less than window */
    double rank;            /* rank = 0.75: order statistic of detector os, as a share of the cells */
    int floor_counts;       /* floor = 8: bins at or below are never an echo  [0 .. 65535] */
    double min_contrast_db; /* min_contrast = 14 dB: over the reference cells [0 .. 100] */
    int learn_ring_down;    /* learn_ring_down = off | on, where ring_down = auto */
    int median;             /* median = off | 3 | 5 (enum conf_median) */
    int otsu;               /* otsu = off | on */
    int clahe;              /* clahe = off | on */
    double clahe_clip;      /* clahe_clip = 2 [1 .. 100] */
    int classes;            /* classes = off | on */
    int marks;              /* marks = on | off: bursts, ghosts, own echoes */
    int no_echo;            /* no_echo = heard | minimum | range */
    double target_db;       /* target = wall: less than a wall returns [0 .. 40] */
    double bottom_db;       /* bottom = 15 dB: likewise, of a bottom [0 .. 40]; -1: off */
    /* minimum_range = 0.75 m: free interval of a beam without an echo; <= every sonar's range */
    double minimum_range_m;
};

/* [background]: what of a template is the vehicle; see grid/range/background_keep.h */
struct conf_background {
    int mask;            /* mask = 64 counts [1 .. 254]: louder cells are blind */
    double neighbour_m;  /* neighbour = 0.15 m [0.01 .. 1] */
    int min_points;      /* min_points = 6 [1 .. 1000] */
    double min_level;    /* min_level = 80 counts [0 .. 255] */
    double extent_m;     /* extent = 1 m */
    double reach_m;      /* reach = 3 m */
    double share;        /* share = 0.25 of all bearings */
    double ring_m;       /* ring = 0.5 m */
    int open_water;      /* open_water = no | yes: promised to hold the vehicle alone */
    double save_every_s; /* save_every = 60 s; never: 0 */
};

/* [grid], which is "main" where a name is wanted, and [grid NAME]: what is not said there is as in [grid] */
struct conf_grid {
    char name[CONF_NAME_MAX]; /* of those with one */
    double range_max_m;       /* range = 20 m           [0.75 .. 200]; auto: 0, longest range of the sonars */
    double angular_step_rad;  /* angular_step = 2 deg   [0.5 .. 15] */
    double layer_m;           /* layer = 0.05 m: thickness of the nearest layers */
    double growth;            /* growth = 1.035: of the layers beyond */
    int elevation;            /* elevation = full | level */
    int axes;                 /* axes = ned | course */
    int sensor_model;   /* sensor_model = opening | gauss | midpoint: how an echo is shared out among cells */
    int update;         /* update = bayes | max */
    double range_error; /* range_error = 0.003: standard deviation of a range as a share of it */
    double mask_reach;  /* mask_reach = 2 [1.2 .. 4]: standard deviations that an echo is spread over */
    double relaxation;  /* relaxation = 0 [0 .. 1]: cells share in their neighbours' evidence; 0: they do not */
    double cluster_relaxation; /* cluster_relaxation = 0 [0 .. 1]: the same for the cells of clusters */
    int max_cells;             /* max_cells = 65536 */
    double blocked_above; /* blocked_above = 0.6: probability from which a cell is an obstacle [0.51 .. 0.99] */
    double clear_for_s;   /* clear_for = 30 s: a direction counts as clear so long after its last ping; auto: 0 */
    double forget_s; /* forget = 160 s: an obstacle without a new echo blocks no longer; >= clear_for; auto: 0 */
    double move_limit_m; /* move_limit = 0.5 m: travel after which a cleared direction is unknown; auto: 0 */
};

/* [grids] */
struct conf_grids {
    double memory_bytes; /* memory = 1024 MiB: of all grids together */
};

/* [map]; see grid/voxel */
struct conf_map {
    double voxel_m;                /* voxel = 0.2 m [0.02 .. 5]; none: 0, there is no map */
    double memory_bytes;           /* memory = 64 MiB */
    double extent_m;               /* extent = 60 m: side of a submap; auto: 0 */
    double height_m;               /* height = 16 m */
    int threshold;                 /* threshold = 1 [0 .. 254] */
    int echoes;                    /* echoes = on | off */
    int echo_weight;               /* echo_weight = 2 [0 .. 255] */
    double tolerance_m;            /* tolerance = 0 m */
    double opening;                /* opening = 0.5 [0.1 .. 1]: share of the height of a beam, beside its edge */
    int weight_levels;             /* weight_levels = 1 [1 .. 8]: looks near the axis count more; 1: alike */
    int beam;                      /* beam = wedge | pyramid */
    double body_m;                 /* body = 0.4 m: radius; none: 0 */
    double submap_distance_m;      /* submap_distance = 10 m */
    double submap_time_s;          /* submap_time = 60 s; never: 0 */
    double forget_s;               /* forget = 600 s; never: 0 */
    char directory[CONF_TEXT_MAX]; /* directory = /var/lib/sonard/maps; none: empty */
    char origin[CONF_NAME_MAX];    /* origin = NAME of what positions count from; none: empty, nobody says */
    double save_every_s;           /* save_every = 60 s; never: 0 */
    char load[CONF_MAP_NAME_MAX];  /* load = NAME of a map, at the start; none: empty */
};

struct conf_pose {
    double max_age_s;           /* max_age = 1 s: older is stale; auto: 0 */
    double heading_drift_radps; /* heading_drift = 0.01 deg/s: of the attitude's heading, at most */
    double delay_s[2];          /* delay = 0.1 0.05 s: a pose is so much older than its time, and uncertain by */
};

#define CONF_KEEP_AUTO (-2.0)

/* [vehicle]: what `limit` and `time_to_collision` need to know; see grid/answer/corridor.h and limit.h */
struct conf_vehicle {
    double radius_m;       /* radius = 0.4 m: of the upright cylinder that holds it */
    double height_m;       /* height = 0.5 m: of the same */
    double margin_m;       /* margin = 0.3 m: of water on every side */
    double near_m;         /* near = 1.5 m: nearer water is not asked for; auto: 0 */
    double max_speed_mps;  /* max_speed = 1.5 m/s; told: 0 */
    double max_turn_radps; /* max_turn = 90 deg/s; told: 0 */
    double keep_mps;       /* station_keeping = 0.05 m/s; no: -1; auto: CONF_KEEP_AUTO */
    double current_mps;    /* current = 0.2 m/s; unknown: -1 */
    double braking_mps2;   /* braking = 0.2 m/s2 */
    double latency_s;      /* latency = 0.5 s */
    int unknown;           /* unknown = slow | stop | ignore */
    double slow_mps;       /* slow = 0.1 m/s */
};

/* [answers] */
struct conf_answers {
    double look_ahead_m; /* look_ahead = 5 m: how far sectors are judged; auto: 0 */
};

/* [depth]: one Modbus slave */
struct conf_depth {
    char source
        [CONF_TEXT_MAX];    /* source = modbus-rtu:/dev/ttyUSB1:9600 | modbus-tcp:192.168.2.5:502; none: empty */
    int parity;             /* parity = none | even | odd */
    int slave;              /* slave = 1 [0 .. 247] */
    int function;           /* function = holding | input */
    int reg;                /* register = 2 */
    int type;               /* type = int16 | uint16 | int32 | float32 */
    int word_order;         /* word_order = big | little */
    double scale, offset;   /* value in `unit` = raw * scale + offset */
    int unit;               /* unit = m | Pa | kPa | mbar | dbar | bar */
    double surface_pa;      /* surface_pressure = 1013.25 mbar: what it reads at the surface */
    double mount_m[3];      /* mount = 0 0 0 m */
    double rate_hz;         /* rate = 5 Hz [0.1 .. 50] */
    double timeout_s;       /* timeout = 300 ms [20 .. 2000] */
    double turnaround_s;    /* turnaround = 1000 ms [20 .. 10000]: its longest answer time; >= timeout */
    int resync;             /* resync = silence | echo: what a late answer is ruled out by */
    double plausible_m[2];  /* plausible = -1 300 m: other depths are refused */
    double speed_limit_mps; /* speed_limit = 3 m/s: faster changes are refused */
};

/* [nmea] */
struct conf_nmea {
    char port[CONF_TEXT_MAX]; /* port = serial:/dev/ttyS1:4800; none: empty */
    int use;                  /* use = heading | depth | both */
    double variation_rad;     /* variation = 2.5 deg, east positive; none: CONF_NO_VARIATION */
    int checksum;             /* checksum = required | optional */
};

#define CONF_NO_VARIATION 10.0

struct conf_gpio {
    char chip[CONF_NAME_MAX]; /* chip = LABEL or name; any: empty */
    char leak[CONF_NAME_MAX]; /* leak = LINE; none: empty */
    int leak_active;          /* leak_active = high | low */
    int leak_bias;            /* leak_bias = as-is | pull-up | pull-down */
};

struct conf_server {
    char socket[108];           /* socket = /run/sonard/sonard.sock */
    int mode;                   /* mode = 0660: permission bits, octal in the file */
    char change[CONF_TEXT_MAX]; /* change = group | all | root, pilot, @sonar, 1000; group: empty */
    char keep[CONF_TEXT_MAX];   /* keep = sonard-mavlink, sonard-web; none: empty */
    int max_clients;            /* max_clients = 64 */
    double client_timeout_s;    /* client_timeout = 10 s  [1 .. 3600] */
};

struct conf_pipeline {
    int threads; /* threads = 0 | 1 | 2 */
    int queue;   /* queue = 16: pings that may wait  [2 .. CONF_MAX_QUEUE] */
};

/* [realtime] */
struct conf_realtime {
    int priority;        /* priority = 40 [2 .. 90]: SCHED_FIFO; none: 0 */
    int processor;       /* processor = 3; any: -1 */
    int processor_count; /* processor_count = 1: that one and those after it */
    int lock_memory;     /* lock_memory = on | off */
};

struct conf_record {
    char directory[CONF_TEXT_MAX]; /* directory = /var/lib/sonard/captures; none: empty, no recording */
    double file_size_bytes;        /* file_size = 256 MiB */
    int files;                     /* files = 8: oldest beyond are removed; all: -1, none is removed */
    int start;                     /* start = at once | on request */
};

struct conf_log {
    int level; /* level = info */
};

struct conf {
    int n_sonars;
    struct conf_sonar sonar[CONF_MAX_SONARS];
    struct conf_water water;
    struct conf_extract extract;
    struct conf_background background;
    struct conf_grid grid, more_grid[CONF_MAX_GRIDS]; /* next to each other: conf_base */
    int n_more_grids;
    struct conf_grids grids;
    struct conf_map map;
    struct conf_pose pose;
    struct conf_vehicle vehicle;
    struct conf_answers answers;
    struct conf_depth depth;
    struct conf_nmea nmea;
    struct conf_gpio gpio;
    struct conf_server server;
    struct conf_pipeline pipeline;
    struct conf_realtime realtime;
    struct conf_record record;
    struct conf_log log;
};

/* Sees every fault of a file: one call per fault, in order of lines. message is a whole line without newline. */
typedef void (*conf_fault_fn)(void *ctx, const char *message);

/* A check that the configuration itself cannot make (does the device exist, is the port's address well formed).
 * Returns false with a sentence in fault. */
struct conf_checks {
    bool (*device)(const char *name, struct fault *fault);
    bool (*port)(const char *address, struct fault *fault);
    bool (*depth)(const char *source, struct fault *fault);
    bool (*line)(const char *name, struct fault *fault); /* of a GPIO chip: can there be any? */
    /* All of a sonar whose keys are good each: can its device do that, over that port? fault begins with the key. */
    bool (*sonar)(const struct conf_sonar *sonar, const struct conf_water *water, struct fault *fault);
    /* All of a configuration without another fault: can it be started? fault begins "[section] key". */
    bool (*whole)(const struct conf *conf, struct fault *fault);
    /* Has a device that exists a use for that key of [sonar NAME], one that not all of them have a use for? */
    bool (*uses)(const char *device, const char *key);
    /* Those that have one, as "a, b". */
    void (*users)(const char *key, char *text, size_t size);
    /* Can a sonar of a good configuration take another value of this key (range, gain or mode) while it runs? */
    bool (*retunes)(const struct conf *conf, int sonar, const char *key);
    /* The devices that can, as "a, b". */
    void (*retuners)(const char *key, char *text, size_t size);
    bool recorded; /* what a recording was made with: a key that its device has no use for is no fault */
    /* A file of the folder that begins with this line is written by a page; NULL: none is. Where left_out is set, a
     * line of it that is wrong by itself is no fault: it has no effect, and left_out is told why. */
    const char *page_file;
    conf_fault_fn left_out;
    void *left_out_ctx;
};

struct conf_source; /* where every value came from, and the text as read (for captures) */

/**
 * conf_load - read `path` into *conf, over the defaults, and then the *.conf files of the folder `path`.d in the order
 * of their names: what a later file says wins, sonars of the same name are the same.
 * Every fault is reported (file:line: [section] key = value: what was found; what is allowed); returns their number,
 * 0 for a good file, -1 when a file cannot be read (reported too). With faults *conf holds what could be
 * understood and must not be put in force. checks may be NULL. *source is always set, for conf_source_free; it is
 * NULL only when memory ran out, which all functions here bear.
 */
int conf_load(struct conf *conf, struct conf_source **source, const char *path, const struct conf_checks *checks,
              conf_fault_fn fault, void *fault_ctx);

/* A file that is in memory already. */
struct conf_text {
    const char *name; /* in messages */
    const char *bytes;
    size_t size;
};

struct conf_where {
    const char *path;
    const struct conf_text *instead; /* of the file of that name in the folder, there or not; NULL: of none */
};

/** conf_load_with - conf_load with another text for one of the folder's files. */
int conf_load_with(struct conf *conf, struct conf_source **source, const struct conf_where *where,
                   const struct conf_checks *checks, conf_fault_fn fault, void *fault_ctx);

/** conf_drop_in - the name of a file within the folder of `path`, if it is read with it; file is absolute and without
 * links. NULL: conf_load does not read it. */
const char *conf_drop_in(const char *path, const char *file);

/** conf_load_text - the same from memory. */
int conf_load_text(struct conf *conf, struct conf_source **source, const struct conf_text *text,
                   const struct conf_checks *checks, conf_fault_fn fault, void *fault_ctx);

/* Sees every key that differs: of a section ("sonar" for all of them), as "[section] key = value", the value wanted. */
typedef void (*conf_change_fn)(void *ctx, const char *section, const char *text, bool live);

/**
 * conf_take_live - put the keys of *wanted that a running daemon can change into *now; the others stay as they are.
 * `change` is called for each that differs. What comes out need not go together: see conf_check_together. checks may be
 * NULL: then no sonar can be retuned.
 */
void conf_take_live(struct conf *now, const struct conf *wanted, const struct conf_checks *checks,
                    conf_change_fn change, void *ctx);

/** conf_check_together - the rules between keys, as conf_load has them; `source` names the lines.
 * Returns the number of faults. */
int conf_check_together(const struct conf *conf, const struct conf_source *source,
                        const struct conf_checks *checks, conf_fault_fn fault, void *fault_ctx);

/** conf_idle - of a checked configuration: `tell` sees a sentence for each key whose value is not its default and has
 * no effect, which begins "[section] key" and says what it needs. checks must have `uses`. */
void conf_idle(const struct conf *conf, const struct conf_checks *checks, conf_fault_fn tell, void *ctx);

/** conf_defaults - what an empty file means: no sonars; every element of sonar[] is at its defaults, too. */
void conf_defaults(struct conf *conf);

#define CONF_TARGET_SIZE 64

/** conf_target_text - the target in words: "wall", "20 dB below a wall". Returns text. */
const char *conf_target_text(const struct conf_extract *extract, char text[CONF_TARGET_SIZE]);

/**
 * conf_print - effective values with units, each with where it came from: `key = value  ; file:line` or `; default`.
 * The output is a configuration itself and loads to the same values, bit for bit; keys without use are not in it.
 */
void conf_print(const struct conf *conf, const struct conf_source *source, FILE *out);

/** conf_sample - the commented default file (config/sonard.conf is its output; a test compares). checks->users names
 * the devices of a key. */
void conf_sample(const struct conf_checks *checks, FILE *out);

/** conf_table_man - the table of keys in man(7) macros, for sonard.conf(5). */
void conf_table_man(const struct conf_checks *checks, FILE *out);

/**
 * conf_source_override - a value does not stand in the file but was given by an option of the command line, which
 * conf_print names then; `option` must stay. Only keys outside of [sonar].
 */
void conf_source_override(struct conf_source *source, const char *section, const char *key, const char *option);

/** conf_source_text - the configuration as one text, and its bytes: as read, or what several files mean; never NULL. */
const char *conf_source_text(const struct conf_source *source, size_t *size);

void conf_source_free(struct conf_source *source);

#endif
