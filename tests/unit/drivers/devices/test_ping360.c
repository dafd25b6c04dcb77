/* SPDX-License-Identifier: MIT */
/*
 * The Ping360 device against a scripted head on a simulated clock: the head reads what the device sends, byte by
 * byte by its own hand, and answers after the time that line, sound and motor need.
 */
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/ping360.h"
#include "drivers/devices/ping360_scan.h"
#include "tests/lib/test.h"

#define MS  1000000ull
#define SEC 1000000000ull

/* ---- the rig: device, clock, head ---- */

struct answer {
    uint64_t t_ns;
    size_t n;
    uint8_t bytes[PING_FRAME_MAX];
};

struct rig {
    void *state;
    struct device_io io;
    struct device_conf conf;
    uint64_t now_ns;

    /* what the head does */
    bool mute, knows_auto, knows_version, deaf_to_2602, nack_2602, nack_4;
    uint8_t type;
    unsigned lose_replies; /* so many of the next data frames vanish whole */
    unsigned cut_replies;  /* so many lack a byte in the middle */
    unsigned flip_replies; /* so many have a wrong bit */
    unsigned lose_autos;
    uint64_t motor_ns;          /* per gradian */
    unsigned n_samples, period; /* 0: as it was told */
    bool acks_motor_off;
    bool empty; /* sends no samples */
    /* Another program speaks so often to the bridge in between, which answers whoever spoke last; 0: nobody does. */
    uint64_t other_ns;
    uint64_t spoke_ns; /* when the device did */

    /* where the head is */
    unsigned angle;
    bool scanning;
    int direction;
    unsigned start, stop, step;
    struct ping360_settings set;
    uint64_t next_auto_ns;
    struct answer queue[64];
    unsigned queued;

    /* what was seen */
    unsigned wire_baud; /* of a wire that is no line */
    bool in_break;
    uint64_t break_ns; /* since when */
    unsigned breaks, autobauds, ask_info, ask_version, transducers, auto_transmits, motor_offs;
    uint16_t asked[4096];
    unsigned n_asked;
    unsigned pings;
    struct ping last;
    uint64_t ping_ns[8192];
    uint16_t ping_angle[8192];
    uint8_t ping_flags[8192];
    char notes[4096];
    unsigned warnings;
    bool no_room;
    struct ping buffer;
    struct ping_beam beam;
    uint8_t samples[PING_MAX_BINS];
};

static struct rig rig;

static unsigned u16(const uint8_t *b)
{
    return b[0] | (unsigned)b[1] << 8;
}

static uint64_t line(size_t bytes)
{
    const unsigned baud = rig.conf.baud ? rig.conf.baud : rig.wire_baud;
    return baud ? bytes * 10 * SEC / baud : 0;
}

static void answer(uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    if (rig.queued == 64)
        abort();
    struct answer *a = &rig.queue[rig.queued++];
    a->t_ns = t_ns;
    a->n = n;
    memcpy(a->bytes, bytes, n);
}

static void answer_message(uint16_t id, const void *payload, size_t n)
{
    uint8_t b[64];
    answer(rig.now_ns + 2 * MS + line(10 + n), b, ping_frame_build(b, sizeof b, id, 2, payload, n));
}

/* Data of the angle the head stands at, on the line after `wait`. */
static void answer_data(bool automatic, uint64_t wait_ns)
{
    static uint8_t samples[PING360_SAMPLES_MAX];
    uint8_t b[PING_FRAME_MAX];
    struct ping360_data d = {.set = rig.set, .automatic = automatic, .data = samples};
    if (rig.n_samples)
        d.set.n_samples = (uint16_t)rig.n_samples;
    if (rig.period)
        d.set.sample_period = (uint16_t)rig.period;
    d.set.angle = (uint16_t)rig.angle;
    d.sweep = (struct ping360_sweep){(uint16_t)rig.start, (uint16_t)rig.stop, (uint8_t)rig.step, 0};
    d.data_length = d.n_data = rig.empty ? 0 : d.set.n_samples;
    memset(samples, (int)(rig.angle & 0xff), sizeof samples);
    size_t n = ping360_encode_data(b, sizeof b, 2, &d);
    if (rig.lose_replies) {
        rig.lose_replies--;
        return;
    }
    if (rig.flip_replies) {
        rig.flip_replies--;
        b[100] ^= 0x10;
    }
    if (rig.cut_replies) {
        rig.cut_replies--;
        n--;
        memmove(b + 100, b + 101, n - 100);
    }
    answer(rig.now_ns + wait_ns + ping360_listening_ns(&d.set) + line(n), b, n);
}

static void on_transducer(const uint8_t *p)
{
    rig.transducers++;
    rig.asked[rig.n_asked++ % 4096] = (uint16_t)u16(p + 2);
    CHECK(u16(p + 2) < 400);
    CHECK_INT(p[12], 1);
    int turn = ping360_angle_to((uint16_t)rig.angle, (uint16_t)u16(p + 2));
    rig.scanning = false;
    rig.angle = u16(p + 2);
    rig.set = (struct ping360_settings){p[0],
                                        p[1],
                                        (uint16_t)u16(p + 2),
                                        (uint16_t)u16(p + 4),
                                        (uint16_t)u16(p + 6),
                                        (uint16_t)u16(p + 8),
                                        (uint16_t)u16(p + 10)};
    answer_data(false, (unsigned)abs(turn) * rig.motor_ns + 19 * MS + line(24));
}

static void on_auto_transmit(const uint8_t *p)
{
    rig.auto_transmits++;
    if (rig.nack_2602) {
        answer_message(PING_NACK, "\x2a\x0aunknown message", 17);
        return;
    }
    if (rig.deaf_to_2602)
        return;
    rig.set = (struct ping360_settings){
        p[0], p[1], 0, (uint16_t)u16(p + 2), (uint16_t)u16(p + 4), (uint16_t)u16(p + 6), (uint16_t)u16(p + 8)};
    rig.start = u16(p + 10), rig.stop = u16(p + 12), rig.step = p[14];
    CHECK(rig.start <= rig.stop && rig.stop < 400 && rig.step >= 1 && rig.step <= 10);
    rig.angle = rig.start;
    rig.direction = 1;
    rig.scanning = true;
    rig.next_auto_ns = rig.now_ns + SEC;
}

static void on_request(const uint8_t *p)
{
    if (u16(p) == PING_DEVICE_INFORMATION) {
        rig.ask_info++;
        const uint8_t info[6] = {rig.type, 0, 3, 3, 8, 0};
        if (rig.nack_4)
            answer_message(PING_NACK, "\4\0unknown message", 17);
        else
            answer_message(PING_DEVICE_INFORMATION, info, sizeof info);
    } else if (u16(p) == PING_PROTOCOL_VERSION) {
        rig.ask_version++;
        if (rig.knows_version)
            answer_message(PING_PROTOCOL_VERSION, "\1\2\3", 4);
    }
}

static void head_send(void *ctx, const uint8_t *b, size_t n)
{
    (void)ctx;
    rig.spoke_ns = rig.now_ns;
    if (n > 0 && b[0] == 'U') {
        rig.autobauds++;
        return;
    }
    unsigned sum = 0;
    for (size_t i = 0; i + 2 < n; i++)
        sum += b[i];
    CHECK(n >= 10 && b[0] == 'B' && b[1] == 'R' && n == 10 + u16(b + 2) && (sum & 0xffff) == u16(b + n - 2));
    if (rig.mute)
        return;
    switch (u16(b + 4)) {
    case PING_GENERAL_REQUEST:
        on_request(b + 8);
        break;
    case PING360_TRANSDUCER:
        on_transducer(b + 8);
        break;
    case PING360_AUTO_TRANSMIT:
        on_auto_transmit(b + 8);
        break;
    case PING360_MOTOR_OFF:
        rig.motor_offs++;
        rig.scanning = false;
        if (rig.acks_motor_off)
            answer_message(PING_ACK, "\x57\x0b", 2);
        break;
    default:
        CHECK(false);
    }
}

static void head_break(void *ctx, bool on)
{
    (void)ctx;
    CHECK(rig.in_break != on);
    rig.in_break = on;
    if (on) {
        rig.break_ns = rig.now_ns;
        rig.breaks++;
        rig.scanning = false;
    } else {
        CHECK(rig.now_ns - rig.break_ns >= 10 * MS);
    }
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    rig.buffer =
        (struct ping){.beam = &rig.beam, .samples = rig.samples, .max_beams = 1, .max_samples = PING_MAX_BINS};
    return rig.no_room ? NULL : &rig.buffer;
}

static void done_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    rig.ping_ns[rig.pings % 8192] = p->t_in_ns;
    rig.ping_angle[rig.pings % 8192] = (uint16_t)p->head_units;
    rig.ping_flags[rig.pings % 8192] = p->flags;
    rig.last = *p;
    rig.pings++;
}

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx;
    size_t used = strlen(rig.notes);
    va_list args;
    va_start(args, fmt);
    if (used < sizeof rig.notes - 200) {
        vsnprintf(rig.notes + used, 200, fmt, args);
        strcat(rig.notes, "\n");
    }
    va_end(args);
    rig.warnings += level == NOTE_WARNING;
}

static struct device_conf usual_conf(void)
{
    return (struct device_conf){
        .range_m = 20.0, .sound_speed_mps = 1500.0, .gain = -1, .step_rad = geo_rad(0.9), .baud = 115200};
}

/* A new head and a device that knows conf; the port is still closed. */
static void rig_new(const struct device_conf *conf)
{
    struct fault fault = {""};
    free(rig.state);
    memset(&rig, 0, sizeof rig);
    rig.state = calloc(1, device_ping360.state_size);
    rig.io = (struct device_io){.send = head_send,
                                .hold_break = head_break,
                                .ping_begin = begin_ping,
                                .ping_done = done_ping,
                                .note = take_note};
    rig.conf = *conf;
    rig.now_ns = 100 * SEC;
    rig.type = 2;
    rig.knows_auto = rig.knows_version = rig.acks_motor_off = true;
    rig.motor_ns = 6 * MS;
    if (!device_ping360.init(rig.state, conf, &fault)) {
        printf("init: %s\n", fault.text);
        abort();
    }
}

static void rig_open(void)
{
    device_ping360.opened(rig.state, rig.now_ns, &rig.io);
}

static void auto_ping(void)
{
    if (rig.lose_autos)
        rig.lose_autos--, rig.lose_replies++;
    answer_data(true, 0);
    int next = (int)rig.angle + rig.direction * (int)rig.step;
    if (rig.start == 0 && rig.stop == 399) {
        rig.angle = (unsigned)(next + 400) % 400;
    } else {
        if (next > (int)rig.stop || next < (int)rig.start)
            rig.direction = -rig.direction;
        rig.angle = (unsigned)((int)rig.angle + rig.direction * (int)rig.step);
    }
    rig.next_auto_ns =
        rig.now_ns + ping360_listening_ns(&rig.set) + line(1230) + rig.step * rig.motor_ns + 19 * MS;
}

/* Let the time pass up to t_ns: answers arrive, deadlines come, the scanning head pings. */
static void run_until(uint64_t t_ns)
{
    for (;;) {
        uint64_t due_ns = device_ping360.deadline(rig.state), next_ns = t_ns;
        unsigned first = UINT32_MAX;
        for (unsigned i = 0; i < rig.queued; i++) {
            if (rig.queue[i].t_ns < next_ns) {
                next_ns = rig.queue[i].t_ns;
                first = i;
            }
        }
        bool scan = rig.scanning && rig.next_auto_ns < next_ns;
        if (scan)
            next_ns = rig.next_auto_ns;
        bool tick = due_ns < next_ns;
        if (tick)
            next_ns = due_ns;
        rig.now_ns = next_ns > rig.now_ns ? next_ns : rig.now_ns;
        if (tick) {
            device_ping360.tick(rig.state, rig.now_ns, &rig.io);
            CHECK(device_ping360.deadline(rig.state) > rig.now_ns || rig.conf.baud == 0);
        } else if (scan) {
            auto_ping();
        } else if (first != UINT32_MAX) {
            struct answer a = rig.queue[first];
            rig.queue[first] = rig.queue[--rig.queued];
            if (rig.other_ns && rig.now_ns / rig.other_ns != rig.spoke_ns / rig.other_ns)
                continue;
            device_ping360.feed(rig.state, a.bytes, a.n, rig.now_ns, &rig.io);
        } else {
            return;
        }
    }
}

static void run_for(uint64_t ns)
{
    run_until(rig.now_ns + ns);
}

static void run_to_ping(unsigned pings, uint64_t at_most_ns)
{
    for (uint64_t end_ns = rig.now_ns + at_most_ns; rig.pings < pings && rig.now_ns < end_ns;)
        run_for(MS);
}

static struct device_status status(void)
{
    struct device_status s;
    device_ping360.status(rig.state, &s);
    return s;
}

/* ---- arithmetic ---- */

TEST(settings_for_a_range)
{
    enum { MOST = PING360_SAMPLES_MAX, FEW = PING360_SAMPLES_FEW };
    static const struct {
        double range_m;
        unsigned n_most, n, period, transmit_us;
        double back_m;
    } row[] = {
        {1, MOST, 667, 80, 5, 1.0005},        {2, MOST, 1200, 89, 11, 2.0025},
        {10, MOST, 1200, 445, 53, 10.0125},   {20, MOST, 1200, 889, 107, 20.0025},
        {50, MOST, 1200, 2223, 267, 50.0175}, {0.75, MOST, 500, 80, 5, 0.75},
        {60, MOST, 1200, 2667, 320, 60.0075}, {200, MOST, 1200, 8889, 500, 200.0025},
        {1.8, MOST, 1200, 80, 10, 1.8},       {0.75, FEW, 500, 80, 5, 0.75},
        {1, FEW, 640, 84, 6, 1.008},          {10, FEW, 640, 834, 53, 10.008},
        {50, FEW, 640, 4167, 267, 50.004},    {6, FEW, 640, 500, 32, 6},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct ping360_settings set = {0};
        ping360_set_range(&set, row[i].range_m, 1500.0, row[i].n_most);
        CHECK_INT(set.n_samples, row[i].n);
        CHECK_INT(set.sample_period, row[i].period);
        CHECK_INT(set.transmit_us, row[i].transmit_us);
        CHECK_NEAR(set.n_samples * ping360_sample_m(&set, 1500.0), row[i].back_m, 1e-9, 0);
    }
}

TEST(settings_are_legal_everywhere)
{
    uint64_t rng = test_seed();
    for (int i = 0; i < 100000; i++) {
        double range_m = 0.75 + 199.25 * test_uniform(&rng) * test_uniform(&rng);
        double c = 1350.0 + 300.0 * test_uniform(&rng);
        struct ping360_settings s = {0};
        ping360_set_range(&s, range_m, c, i % 2 ? PING360_SAMPLES_FEW : PING360_SAMPLES_MAX);
        double back_m = s.n_samples * ping360_sample_m(&s, c);
        if (s.n_samples < 200 || s.n_samples > 1200 || s.sample_period < 80 || s.sample_period > 40000 ||
            s.transmit_us < 5 || s.transmit_us > 500 ||
            s.transmit_us < fmin(500.0, 2.5 * 0.025 * s.sample_period) ||
            s.transmit_us > 64 * 0.025 * s.sample_period || back_m > range_m + 0.025 || back_m < range_m - 1e-6) {
            printf("range %.17g m, c %.17g: n %u period %u transmit %u back %g\n", range_m, c, s.n_samples,
                   s.sample_period, s.transmit_us, back_m);
            CHECK(false);
            return;
        }
    }
}

TEST(configuration_faults_name_the_key)
{
    static const struct {
        const char *key;
        size_t offset;
        double value;
    } row[] = {
        {"range", offsetof(struct device_conf, range_m), 0.74},
        {"range", offsetof(struct device_conf, range_m), 200.1},
        {"range", offsetof(struct device_conf, range_m), NAN},
        {"sound_speed", offsetof(struct device_conf, sound_speed_mps), 0.0},
        {"frequency", offsetof(struct device_conf, frequency_hz), 499e3},
        {"frequency", offsetof(struct device_conf, frequency_hz), 1001e3},
        {"step", offsetof(struct device_conf, step_rad), -0.1},
        {"step", offsetof(struct device_conf, step_rad), 4.0},
        {"sector", offsetof(struct device_conf, sector_end_rad), INFINITY},
        {"sector", offsetof(struct device_conf, sector_start_rad), NAN},
    };
    void *state = calloc(1, device_ping360.state_size);
    struct fault fault;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual_conf();
        memcpy((char *)&conf + row[i].offset, &row[i].value, sizeof(double));
        fault.text[0] = '\0';
        CHECK(!device_ping360.init(state, &conf, &fault));
        CHECK(strstr(fault.text, row[i].key) == fault.text);
    }
    for (int gain = -3; gain < 5; gain++) {
        struct device_conf conf = usual_conf();
        conf.gain = gain;
        CHECK(device_ping360.init(state, &conf, &fault) == (gain >= -1 && gain <= 2));
    }
    CHECK(strstr(fault.text, "gain = 4") == fault.text);
    free(state);
}

/* ---- the order of angles ---- */

TEST(sector_goes_back_and_forth)
{
    static const struct {
        const char *name;
        double start_deg, end_deg, step_deg;
        int want[12];
    } row[] = {
        {"-2.7..2.7 deg by 1.8", -2.7, 2.7, 1.8, {197, 199, 201, 203, 201, 199, 197, 199, -1}},
        {"step does not divide", 0, 4.5, 1.8, {200, 202, 204, 202, 200, 202, -1}},
        {"one direction", 90, 90.1, 0.9, {300, 300, 300, -1}},
        {"across the head's zero", 178.2, -178.2, 0.9, {398, 399, 0, 1, 2, 1, 0, 399, 398, 399, -1}},
        {"step below a gradian", 0, 1.8, 0.1, {200, 201, 202, 201, -1}},
        {"step of 18 deg", 0, 36, 18, {200, 220, 240, 220, 200, -1}},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct ping360_scan scan;
        ping360_scan_init(&scan, geo_rad(row[i].start_deg), geo_rad(row[i].end_deg), geo_rad(row[i].step_deg));
        for (int k = 0; row[i].want[k] >= 0; k++) {
            if (ping360_scan_angle(&scan) != row[i].want[k]) {
                printf("%s: %d is %u\n", row[i].name, k, ping360_scan_angle(&scan));
                CHECK(false);
            }
            ping360_scan_advance(&scan, 0);
        }
    }
}

TEST(full_circle_has_every_angle)
{
    static const double ends_deg[][2] = {{0, 0}, {0, 360}, {-180, 180}, {10, 370}, {0, 359.9}};
    for (size_t i = 0; i < sizeof ends_deg / sizeof ends_deg[0]; i++) {
        struct ping360_scan scan;
        bool seen[400] = {false};
        ping360_scan_init(&scan, geo_rad(ends_deg[i][0]), geo_rad(ends_deg[i][1]), geo_rad(0.9));
        CHECK_INT(scan.positions, 0);
        CHECK(scan.by_itself && scan.sweep.start == 0 && scan.sweep.stop == 399 && scan.sweep.step == 1);
        for (int k = 0; k < 400; k++) {
            CHECK(!seen[ping360_scan_angle(&scan)]);
            seen[ping360_scan_angle(&scan)] = true;
            ping360_scan_advance(&scan, 0);
        }
    }
}

TEST(scans_the_head_cannot_do_itself)
{
    struct ping360_scan scan;
    ping360_scan_init(&scan, 0, 0, geo_rad(9.0));
    CHECK(scan.by_itself && scan.sweep.step == 10);
    ping360_scan_init(&scan, 0, 0, geo_rad(9.9));
    CHECK(!scan.by_itself);
    ping360_scan_init(&scan, geo_rad(170), geo_rad(-170), geo_rad(0.9));
    CHECK(!scan.by_itself);
    ping360_scan_init(&scan, geo_rad(-45), geo_rad(45), geo_rad(0.9));
    CHECK(scan.by_itself && scan.sweep.start == 150 && scan.sweep.stop == 250);
}

/* Angles seen, and at which of them a new sweep begins. */
TEST(new_sweeps_from_the_angles_seen)
{
    static const struct {
        const char *name;
        int angle[16];
        const char *want; /* one letter per angle: N new, . not */
    } row[] = {
        {"circle by 100", {0, 100, 200, 300, 0, 100, 200, 300, 0, -1}, "....N...N"},
        {"circle started in the middle", {150, 250, 350, 50, 150, 250, -1}, "....N."},
        {"circle by 150", {0, 150, 300, 50, 200, 350, 100, -1}, "...N..N"},
        {"circle backward", {0, 300, 200, 100, 0, 300, -1}, "....N."},
        {"sector", {200, 201, 202, 201, 200, 201, 202, -1}, "...N.N."},
        {"sector, ends repeated", {200, 201, 202, 202, 201, 200, 200, 201, -1}, "....N..N"},
        {"across zero", {398, 399, 0, 1, 0, 399, 398, 399, -1}, "....N..N"},
        {"with holes", {0, 10, 90, 120, 260, 390, 10, -1}, "......N"},
        {"one direction", {7, 7, 7, 7, -1}, "...."},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct ping360_track track;
        char got[17] = "";
        ping360_track_reset(&track);
        for (int k = 0; row[i].angle[k] >= 0; k++) {
            struct ping360_data d = {.set.angle = (uint16_t)row[i].angle[k]};
            unsigned missing;
            got[k] = ping360_track_follow(&track, &d, &missing) ? 'N' : '.';
            CHECK_INT(missing, 0);
        }
        if (strcmp(got, row[i].want) != 0) {
            printf("%s: %s, expected %s\n", row[i].name, got, row[i].want);
            CHECK(false);
        }
    }
}

TEST(missing_angles_of_the_heads_own_scan)
{
    static const struct {
        const char *name;
        struct ping360_sweep sweep;
        int angle[12];
        unsigned want;
    } row[] = {
        {"circle", {0, 399, 1, 0}, {397, 398, 399, 0, 1, -1}, 0},
        {"circle, three lost over zero", {0, 399, 1, 0}, {397, 398, 2, 3, -1}, 3},
        {"circle by 10", {0, 399, 10, 0}, {0, 10, 40, 50, -1}, 2},
        {"circle, one angle twice", {0, 399, 1, 0}, {10, 11, 11, 12, -1}, 0},
        {"sector turns round", {10, 14, 1, 0}, {10, 11, 12, 13, 14, 13, 12, -1}, 0},
        {"one lost on the way", {10, 14, 1, 0}, {10, 11, 13, 14, 13, -1}, 1},
        {"the end lost", {10, 14, 1, 0}, {11, 12, 13, 13, 12, -1}, 1},
        {"three round the end lost", {10, 14, 1, 0}, {11, 12, 12, 11, -1}, 3},
        {"end repeated", {10, 14, 1, 0}, {12, 13, 14, 14, 13, -1}, 0},
        {"step does not divide", {10, 15, 2, 0}, {10, 12, 14, 12, 10, 12, -1}, 0},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct ping360_track track;
        unsigned sum = 0, missing;
        ping360_track_reset(&track);
        for (int k = 0; row[i].angle[k] >= 0; k++) {
            struct ping360_data d = {
                .set.angle = (uint16_t)row[i].angle[k], .automatic = true, .sweep = row[i].sweep};
            ping360_track_follow(&track, &d, &missing);
            sum += missing;
        }
        if (sum != row[i].want) {
            printf("%s: %u, expected %u\n", row[i].name, sum, row[i].want);
            CHECK(false);
        }
    }
}

/* ---- conversations ---- */

TEST(handshake_then_the_heads_own_scan)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    CHECK_INT(status().state, DEVICE_CLOSED);
    rig_open();
    CHECK_INT(rig.breaks, 1);
    CHECK_INT(status().state, DEVICE_IDENTIFY);
    run_for(500 * MS);
    CHECK_INT(rig.autobauds, 1);
    CHECK_INT(rig.ask_info, 1);
    CHECK_INT(rig.ask_version, 1);
    CHECK_STR(status().what, "Ping360 fw 3.3.8 id 2");
    CHECK_INT(status().state, DEVICE_SETUP);
    run_for(10 * SEC);
    CHECK_INT(rig.auto_transmits, 1);
    CHECK_INT(rig.transducers, 0);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK(rig.pings > 40);
    CHECK_INT(status().pings, rig.pings);
    CHECK_INT(status().timeouts, 0);
    CHECK_INT(rig.set.gain, 1);
    CHECK_INT(rig.set.frequency_khz, 750);
    CHECK_NEAR(status().range_m, 20.0025, 1e-9, 0);
}

TEST(request_and_response)
{
    struct device_conf conf = usual_conf();
    conf.request_response = true;
    conf.gain = 2;
    conf.frequency_hz = 800e3;
    conf.sector_start_rad = geo_rad(-9);
    conf.sector_end_rad = geo_rad(9);
    rig_new(&conf);
    rig_open();
    run_to_ping(200, 60 * SEC);
    CHECK_INT(rig.auto_transmits, 0);
    CHECK_INT(rig.pings, 200);
    CHECK_INT(status().timeouts, 0);
    CHECK_INT(rig.set.gain, 2);
    CHECK_INT(rig.set.frequency_khz, 800);
    for (unsigned i = 1; i < 200; i++) {
        CHECK_INT(abs((int)rig.ping_angle[i] - (int)rig.ping_angle[i - 1]), 1);
        CHECK(rig.ping_angle[i] >= 190 && rig.ping_angle[i] <= 210);
        CHECK_INT(rig.ping_flags[i], i > 20 && (i - 1) % 20 == 0 ? PING_NEW_TURN : 0);
    }
    CHECK_INT(rig.n_asked, 201); /* the next is asked for at once */
}

TEST(a_steered_head_sends_fewer_samples)
{
    struct device_conf conf = usual_conf();
    conf.steered = true;
    rig_new(&conf);
    rig_open();
    run_to_ping(5, 60 * SEC);
    CHECK_INT(rig.pings, 5);
    CHECK_INT(rig.set.n_samples, PING360_SAMPLES_FEW);
    CHECK_INT(rig.last.n_bins, PING360_SAMPLES_FEW);
    CHECK_NEAR(status().range_m, 20.0, 0, 0.025);
}

TEST(ping_content)
{
    struct device_conf conf = usual_conf();
    conf.request_response = true;
    conf.sector_start_rad = geo_rad(90);
    conf.sector_end_rad = geo_rad(99);
    rig_new(&conf);
    rig_open();
    run_to_ping(1, 10 * SEC);
    const struct ping *p = &rig.last;
    CHECK_INT(p->kind, PING_PROFILE);
    CHECK_INT(p->n_beams, 1);
    CHECK_INT(p->sample_bytes, 1);
    CHECK_INT(p->n_bins, 1200);
    CHECK_INT(p->head_units, 300);
    CHECK_INT(p->head_turn, 400);
    CHECK_INT(p->flags, 0);
    CHECK_NEAR(p->r0_m, 0, 0, 0);
    CHECK_NEAR(p->dr_m, 889 * 25e-9 * 750.0, 1e-6, 0);
    CHECK_NEAR(p->pulse_m, 107e-6 * 750.0, 1e-6, 0);
    CHECK_NEAR(p->az_aperture_rad, geo_rad(2), 1e-6, 0);
    CHECK_NEAR(p->el_aperture_rad, geo_rad(25), 1e-6, 0);
    CHECK_NEAR(p->beam[0].az_rad, geo_rad(90), 1e-6, 0);
    CHECK_NEAR(p->beam[0].el_rad, 0, 0, 0);
    CHECK_INT(rig.samples[0], 300 & 0xff);
    CHECK_INT(rig.samples[1199], 300 & 0xff);
    /* the whole frame came in one read: its line time and the listening before that are reckoned back */
    CHECK_INT(p->t_ns, p->t_in_ns - line(1224) - 1200 * 889 * 25);
}

/* Another program sets a narrow sector and 2 m: bytes as the head sends them then. */
static void take_over(void)
{
    rig.start = 180, rig.stop = 220, rig.step = 1;
    rig.angle = 180;
    rig.direction = 1;
    rig.set.gain = 0;
    rig.set.transmit_us = 11;
    rig.set.sample_period = 88;
}

TEST(a_head_with_settings_of_others_is_set_up_again)
{
    static const char other[] =
        "gain_setting 0 (sent 1), transmit_duration 11 (sent 107), sample_period 88 (sent 889), "
        "start_angle 180 (sent 0), stop_angle 220 (sent 399)";
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig_open();
    run_to_ping(30, 60 * SEC);
    CHECK_STR(status().other_settings, "");
    CHECK_INT(rig.warnings + (unsigned)status().taken_over, 0);
    take_over();
    unsigned before = rig.pings;
    run_to_ping(before + 7, 60 * SEC);
    CHECK_STR(status().other_settings, "");
    CHECK_INT(rig.auto_transmits, 1);
    run_to_ping(before + 8, 60 * SEC);
    CHECK_STR(status().other_settings, other);
    CHECK_INT(rig.auto_transmits, 2);
    CHECK_INT(rig.warnings, 1);
    CHECK(
        strstr(
            rig.notes,
            "are not the ones that were sent (another program?); sending them again: gain_setting 0 (sent 1), ") !=
        NULL);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK_NEAR(status().range_m, 1.98, 1e-9, 0); /* the ping is what it says, not what was sent */
    CHECK_NEAR(rig.last.dr_m * (float)rig.last.n_bins, 1.98, 1e-6, 0);
    CHECK_NEAR(rig.last.gain_db, -6, 1e-6, 0);
    run_for(10 * SEC);
    CHECK_STR(status().other_settings, "");
    CHECK_INT(status().taken_over, 1);
    CHECK_INT(status().restarts, 1);
    CHECK_INT(rig.auto_transmits, 2);
    CHECK_NEAR(status().range_m, 20.0025, 1e-9, 0);
    CHECK_INT(rig.start, 0);
    CHECK_INT(rig.stop, 399);

    rig.deaf_to_2602 = true; /* a program that is quicker than we: one warning, fewer and fewer tries */
    take_over();
    run_for(120 * SEC);
    CHECK(rig.auto_transmits >= 6 && rig.auto_transmits <= 8);
    CHECK_INT(rig.warnings, 1);
    CHECK_INT(status().taken_over, 2);
    CHECK_STR(status().other_settings, other);
    CHECK_INT(status().state, DEVICE_RUNNING);
    rig.deaf_to_2602 = false;
    run_for(60 * SEC);
    CHECK_STR(status().other_settings, "");
}

TEST(pings_of_the_settings_before_are_no_takeover)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig_open();
    run_to_ping(30, 60 * SEC);
    const struct ping360_settings ours = rig.set;
    rig.set.sample_period = 88;
    run_to_ping(36, 60 * SEC);
    rig.set = ours;
    run_for(60 * SEC);
    CHECK_INT(rig.auto_transmits, 1);
    CHECK_INT(rig.warnings + (unsigned)status().taken_over, 0);
}

static void feed_data(unsigned angle, unsigned n_samples, unsigned period, uint64_t first_ns, uint64_t last_ns)
{
    static const uint8_t samples[PING_PAYLOAD_MAX] = {9, 8, 7};
    uint8_t b[PING_FRAME_MAX];
    struct ping360_data d = {.set = {1, 0, (uint16_t)angle, 11, (uint16_t)period, 750, (uint16_t)n_samples},
                             .data_length = (uint16_t)n_samples,
                             .n_data = (uint16_t)n_samples,
                             .data = samples};
    size_t n = ping360_encode_data(b, sizeof b, 2, &d);
    device_ping360.feed(rig.state, b, 5, first_ns, &rig.io);
    device_ping360.feed(rig.state, b + 5, n - 5, last_ns, &rig.io);
}

/* Each request has all settings, so nothing is set up again; that somebody else asks too is said. */
TEST(a_head_that_others_ask_too_is_told)
{
    struct device_conf conf = usual_conf();
    conf.request_response = true;
    rig_new(&conf);
    rig_open();
    for (unsigned i = 1; i <= 40; i++) {
        run_to_ping(2 * i - 1, 10 * SEC);
        feed_data(100 + i, 1200, 88, rig.now_ns, rig.now_ns);
        CHECK_INT(rig.pings, 2 * i);
    }
    CHECK_INT(status().taken_over, 1);
    CHECK_INT(rig.warnings, 1);
    CHECK(strstr(status().other_settings, "sample_period 88 (sent 889)") != NULL);
    CHECK_INT(status().restarts + rig.auto_transmits, 0);
    run_for(20 * SEC);
    CHECK_STR(status().other_settings, "");
}

static const char lost_again[] =
    "its answers get lost again and again although it answers: another program seems to "
    "speak to it, too (a bridge answers whoever spoke last), or the line is poor\n";

static unsigned times_said(const char *what)
{
    unsigned n = 0;
    for (const char *at = rig.notes; (at = strstr(at, what)); at++)
        n++;
    return n;
}

/* A head on the network that another program speaks to, too: the pings that come are ours, most go to the other. */
static void contested(bool polled, uint64_t other_ns)
{
    struct device_conf conf = usual_conf();
    conf.baud = 0;
    conf.request_response = polled;
    rig_new(&conf);
    rig_open();
    run_to_ping(30, 60 * SEC);
    run_for(60 * SEC);
    CHECK(!status().contested);
    CHECK_INT(rig.warnings + (unsigned)status().timeouts, 0);
    rig.other_ns = other_ns;
    for (unsigned i = 0; i < 300 && !status().contested; i++)
        run_for(SEC);
    CHECK(status().contested);
    CHECK_INT(times_said(lost_again), 1);
    CHECK_STR(status().other_settings, "");
    const unsigned pings = rig.pings, warnings = rig.warnings;
    const size_t notes = strlen(rig.notes);
    const uint64_t restarts = status().restarts;
    run_for(120 * SEC);
    CHECK(status().contested);
    CHECK_INT(rig.warnings, warnings); /* all has been said ... */
    CHECK(!strstr(rig.notes + notes, "asking for every ping") && !strstr(rig.notes + notes, ", range"));
    CHECK(status().restarts <= restarts + 60); /* at a sane pace ... */
    CHECK(rig.pings > pings);                  /* ... and not in vain */
    rig.other_ns = 0;
    run_for(60 * SEC);
    CHECK(!status().contested);
    CHECK_INT(times_said("its answers are no longer lost\n"), 1);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(a_scanning_head_that_answers_others_is_told)
{
    contested(false, 1300 * MS); /* it comes back with our next word */
    contested(false, 70 * MS);   /* hardly a ping comes: it is set up again and again */
}

TEST(an_asked_head_that_answers_others_is_told)
{
    contested(true, 90 * MS);
}

/* One answer in ten is lost. */
TEST(a_poor_line_is_not_taken_for_another_program)
{
    struct device_conf conf = usual_conf();
    conf.baud = 0;
    conf.request_response = true;
    rig_new(&conf);
    rig_open();
    for (unsigned i = 0; i < 100; i++) {
        run_to_ping(rig.pings + 9, 60 * SEC);
        rig.lose_replies = 1;
        CHECK(!status().contested);
    }
    CHECK(status().timeouts >= 99);
    CHECK_INT(rig.warnings, 0);
}

/* Without power for a while, twice. */
TEST(a_head_that_was_dead_is_not_taken_for_another_program)
{
    struct device_conf conf = usual_conf();
    conf.baud = 0;
    rig_new(&conf);
    rig_open();
    for (unsigned i = 0; i < 2; i++) {
        run_to_ping(rig.pings + 9, 60 * SEC);
        rig.mute = true;
        rig.scanning = false;
        run_for(100 * SEC);
        rig.mute = false;
        run_for(60 * SEC);
        CHECK(!status().contested);
    }
    CHECK_INT(times_said(lost_again), 0);
}

/* Every answer comes after it has been asked for again, and then once more. */
TEST(a_slow_head_is_not_taken_for_another_program)
{
    struct device_conf conf = usual_conf();
    conf.baud = 0;
    conf.request_response = true;
    rig_new(&conf);
    rig.motor_ns = 300 * MS;
    rig_open();
    run_for(300 * SEC);
    CHECK(rig.pings > 100);
    CHECK(status().timeouts > 100);
    CHECK(!status().contested);
    CHECK_INT(times_said(lost_again), 0);
}

TEST(time_of_a_ping)
{
    struct device_conf conf = usual_conf();
    conf.listen_only = true;
    rig_new(&conf);
    rig_open();
    /* the line needs 28.3 ms for 326 bytes */
    feed_data(10, 302, 100, 50 * SEC, 50 * SEC + 100 * MS);
    CHECK_INT(rig.last.t_ns, 50 * SEC - 302 * 100 * 25);
    CHECK_INT(rig.last.t_in_ns, 50 * SEC + 100 * MS);
    feed_data(10, 302, 100, 60 * SEC, 60 * SEC + 1 * MS);
    CHECK_INT(rig.last.t_ns, 60 * SEC + 1 * MS - line(326) - 302 * 100 * 25);
    feed_data(10, 302, 100, 1, 2); /* before the clock began */
    CHECK_INT(rig.last.t_ns, 0);
    CHECK_INT(rig.last.t_in_ns, 2);
}

/* Buffers are shared with sonars that send more; what follows the device is sized by what it says it sends at most. */
TEST(no_ping_is_longer_than_the_device_says)
{
    struct device_conf conf = usual_conf();
    conf.listen_only = true;
    rig_new(&conf);
    rig_open();
    feed_data(10, PING_PAYLOAD_MAX - 14, 100, SEC, SEC);
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.last.n_bins, device_ping360.max_bins);
}

TEST(azimuth_of_every_head_angle)
{
    struct device_conf conf = usual_conf();
    conf.listen_only = true;
    rig_new(&conf);
    rig_open();
    for (unsigned a = 0; a < 400; a++) {
        feed_data(a, 3, 88, SEC, SEC);
        double want_deg = a * 0.9 - 180.0;
        CHECK_NEAR(rig.last.beam->az_rad, geo_rad(want_deg < 0 ? want_deg + 360 : want_deg), 1e-6, 1e-9);
    }
    CHECK_INT(rig.pings, 400);
}

TEST(senseless_data_is_counted)
{
    struct device_conf conf = usual_conf();
    conf.listen_only = true;
    rig_new(&conf);
    rig_open();
    feed_data(400, 3, 88, SEC, SEC);
    feed_data(65535, 3, 88, SEC, SEC);
    feed_data(1, 3, 0, SEC, SEC);
    feed_data(1, 3, 40001, SEC, SEC);
    uint8_t b[64];
    size_t n = ping_frame_build(b, sizeof b, 2300, 2, "\1\1\1\0\1\0\1\1\1\1\1\0\1", 13);
    device_ping360.feed(rig.state, b, n, SEC, &rig.io);
    CHECK_INT(rig.pings, 0);
    CHECK_INT(status().bad_frame, 5);
    feed_data(1, 0, 88, SEC, SEC); /* the head only moved */
    CHECK_INT(rig.pings, 0);
    CHECK_INT(status().bad_frame, 5);
    feed_data(399, 2, 88, SEC, SEC); /* a short ping is a ping */
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.last.n_bins, 2);
}

TEST(no_room_for_a_ping_is_survived)
{
    struct device_conf conf = usual_conf();
    conf.request_response = true;
    rig_new(&conf);
    rig_open();
    rig.no_room = true;
    run_for(10 * SEC);
    CHECK_INT(rig.pings, 0);
    CHECK(rig.n_asked > 20);
    CHECK_INT(status().timeouts, 0);
}

TEST(nack_falls_back_to_asking)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.nack_2602 = true;
    rig_open();
    run_for(10 * SEC);
    CHECK_INT(rig.auto_transmits, 1);
    CHECK(rig.pings > 20);
    CHECK_INT(status().nacks, 1);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK(strstr(rig.notes, "unknown message") != NULL);
}

TEST(a_head_that_refuses_its_name_scans_all_the_same)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.nack_4 = true;
    rig_open();
    run_for(10 * SEC);
    CHECK_INT(rig.ask_info, 1);
    CHECK(rig.pings > 20);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK_INT(rig.warnings, 0);
}

/* A head that sends data frames without samples, at once, has not pinged: it is asked at the pace of pings, and set up
 * anew. */
TEST(data_without_samples_are_no_ping)
{
    for (int request = 0; request < 2; request++) {
        struct device_conf conf = usual_conf();
        conf.request_response = request;
        rig_new(&conf);
        rig.empty = true;
        rig.motor_ns = 0;
        rig_open();
        run_for(30 * SEC);
        CHECK_INT(rig.pings, 0);
        CHECK(rig.transducers > 2 && rig.transducers < 30);
        CHECK_INT(status().state, DEVICE_SILENT);
        CHECK(strstr(rig.notes, "the Ping360 answers without samples; retrying") != NULL);
        CHECK_INT(rig.warnings, 1);
        rig.empty = false;
        run_for(30 * SEC);
        CHECK(rig.pings > 20);
        CHECK_INT(status().state, DEVICE_RUNNING);
    }
}

TEST(no_answer_to_auto_falls_back_to_asking)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.deaf_to_2602 = true;
    rig_open();
    run_for(20 * SEC);
    CHECK_INT(rig.auto_transmits, 1);
    CHECK(rig.pings > 20);
    CHECK_INT(status().restarts, 0);
}

TEST(no_version_is_no_obstacle)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.knows_version = false;
    rig_open();
    run_for(10 * SEC);
    CHECK_INT(rig.ask_version, 3);
    CHECK(rig.pings > 10);
}

/* Nacks with text from hell are shown escaped and cut. */
TEST(text_from_the_line_is_escaped)
{
    struct device_conf conf = usual_conf();
    conf.listen_only = true;
    rig_new(&conf);
    rig_open();
    uint8_t payload[300], b[320];
    memset(payload, '%', sizeof payload);
    memcpy(payload, "\x2a\x0a%n%s\x1b[2J\n\\", 12);
    device_ping360.feed(rig.state, b, ping_frame_build(b, sizeof b, PING_NACK, 2, payload, sizeof payload), SEC,
                        &rig.io);
    CHECK(strstr(rig.notes, "refused message 2602: %n%s\\x1b[2J\\x0a\\x5c%%") != NULL);
    CHECK(strlen(rig.notes) < 120);
    device_ping360.feed(rig.state, b, ping_frame_build(b, sizeof b, PING_ASCII_TEXT, 2, "hello", 5), SEC, &rig.io);
    CHECK(strstr(rig.notes, "says: hello\n") != NULL);
}

/* How long the scan stands still for one lost frame, for all kinds of losing it, lines and steps. */
TEST(a_slow_wire_is_waited_for)
{
    for (int mode = 0; mode < 2; mode++) {
        struct device_conf conf = usual_conf();
        conf.baud = 0;
        conf.least_baud = 60000;
        conf.request_response = mode == 0;
        conf.range_m = 2;
        rig_new(&conf);
        rig.wire_baud = 60000;
        rig_open();
        run_to_ping(50, 60 * SEC);
        CHECK_INT(status().timeouts, 0);
        CHECK_INT(status().lost_frames, 0);
        CHECK_INT(status().restarts, 0);
    }
}

TEST(a_lost_frame_costs_at_most_200_ms)
{
    static const struct {
        const char *name;
        unsigned baud;
        double range_m, step_deg;
        uint64_t motor_ns;
    } row[] = {
        {"115200, 20 m", 115200, 20, 0.9, 6 * MS},
        {"115200, 2 m", 115200, 2, 0.9, 10 * MS},
        {"921600, 20 m", 921600, 20, 0.9, 6 * MS},
        {"921600, 20 m, 9 deg", 921600, 20, 9, 6 * MS},
        {"115200, 20 m, 9 deg", 115200, 20, 9, 10 * MS},
        {"115200, 20 m, nimble", 115200, 20, 9, 0},
        {"network, 20 m", 0, 20, 9, 6 * MS},
        {"network, 50 m", 0, 50, 0.9, 6 * MS},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct device_conf conf = usual_conf();
        conf.request_response = true;
        conf.baud = row[i].baud;
        conf.range_m = row[i].range_m;
        conf.step_rad = geo_rad(row[i].step_deg);
        rig_new(&conf);
        rig.motor_ns = row[i].motor_ns;
        rig_open();
        run_to_ping(10, 60 * SEC);
        uint64_t usual_ns = rig.ping_ns[9] - rig.ping_ns[8];
        unsigned *fault[] = {&rig.lose_replies, &rig.cut_replies, &rig.flip_replies};
        for (unsigned k = 0; k < 3; k++) {
            unsigned before = rig.pings;
            *fault[k] = 1;
            run_to_ping(before + 3, 10 * SEC);
            uint64_t took_ns = 0; /* the longest gap */
            for (unsigned p = before; p < rig.pings; p++)
                if (rig.ping_ns[p] - rig.ping_ns[p - 1] > took_ns)
                    took_ns = rig.ping_ns[p] - rig.ping_ns[p - 1];
            /* the lost ping's own time, the wait, and the ping again */
            if (took_ns > 2 * usual_ns + 200 * MS || took_ns <= usual_ns || rig.pings != before + 3) {
                printf("%s, fault %u: %.1f ms instead of %.1f\n", row[i].name, k, (double)took_ns / 1e6,
                       (double)usual_ns / 1e6);
                CHECK(false);
            }
            for (unsigned p = before; p < rig.pings; p++) /* no angle is left out */
                CHECK_INT((rig.ping_angle[p] + 400 - rig.ping_angle[p - 1]) % 400, lround(row[i].step_deg / 0.9));
        }
        CHECK_INT(status().lost_frames, 3);
        CHECK_INT(status().restarts, 0);
    }
}

TEST(lost_frames_of_the_heads_own_scan_are_counted)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig_open();
    run_to_ping(10, 60 * SEC);
    rig.lose_autos = 1;
    run_to_ping(20, 60 * SEC);
    rig.lose_autos = 3;
    run_to_ping(30, 60 * SEC);
    CHECK_INT(status().lost_frames, 4);
    CHECK_INT(status().timeouts, 0);
    CHECK_INT(rig.auto_transmits, 1);
}

TEST(late_answer_is_a_ping_and_confuses_nobody)
{
    struct device_conf conf = usual_conf();
    conf.request_response = true;
    rig_new(&conf);
    rig_open();
    run_to_ping(10, 60 * SEC);
    rig.motor_ns = 150 * MS; /* one slow step: the answer comes after the time-out, and then once more */
    run_to_ping(11, 60 * SEC);
    rig.motor_ns = 6 * MS;
    run_for(10 * SEC);
    unsigned n = rig.pings;
    CHECK(status().timeouts >= 1);
    CHECK_INT(status().restarts, 0);
    CHECK_INT(rig.n_asked, n - status().timeouts + 1 + status().timeouts); /* one request is out, not two */
    for (unsigned p = 1; p < n; p++)
        CHECK((rig.ping_angle[p] + 400 - rig.ping_angle[p - 1]) % 400 <= 1);
}

TEST(answer_behind_a_false_start_is_found)
{
    struct device_conf conf = usual_conf();
    conf.request_response = true;
    conf.range_m = 0.75; /* a short answer: it fits into what the false start waits for */
    rig_new(&conf);
    rig_open();
    run_to_ping(10, 60 * SEC);
    const uint8_t noise[] = {'B', 'R', 0x00, 0x05};
    device_ping360.feed(rig.state, noise, sizeof noise, rig.now_ns, &rig.io);
    uint64_t t_ns = rig.now_ns;
    run_to_ping(11, 60 * SEC);
    CHECK(rig.now_ns - t_ns < 300 * MS);
    CHECK_INT(rig.n_asked, 12); /* it was not asked for again */
    CHECK_INT(status().garbage_bytes, 4);
}

TEST(line_full_of_noise_times_out)
{
    struct device_conf conf = usual_conf();
    conf.request_response = true;
    rig_new(&conf);
    rig_open();
    run_to_ping(5, 60 * SEC);
    rig.mute = true;
    uint64_t end_ns = rig.now_ns + 3 * SEC;
    while (rig.now_ns < end_ns) {
        run_for(5 * MS);
        device_ping360.feed(rig.state, (const uint8_t *)"zzzz", 4, rig.now_ns, &rig.io);
    }
    CHECK(status().timeouts >= 5);
    CHECK(status().restarts >= 1);
}

TEST(silence_and_return)
{
    for (int request = 0; request < 2; request++) {
        struct device_conf conf = usual_conf();
        conf.request_response = request;
        rig_new(&conf);
        rig_open();
        run_to_ping(10, 60 * SEC);
        unsigned breaks = rig.breaks;
        rig.mute = true; /* its power is gone: settings too */
        rig.scanning = false;
        rig.queued = 0;
        run_for(5 * SEC);
        CHECK_INT(status().state, DEVICE_SILENT);
        CHECK_INT(status().restarts, 1);
        CHECK(rig.breaks > breaks);
        CHECK_INT(rig.warnings, 1);
        run_for(600 * SEC);
        CHECK_INT(status().state, DEVICE_SILENT);
        CHECK_INT(rig.warnings, 1); /* said once */
        CHECK(rig.breaks - breaks > 600 / 5 && rig.breaks - breaks < 600 / 3 + 10);
        unsigned before = rig.pings;
        rig.mute = false;
        run_for(5 * SEC + SEC);
        CHECK(rig.pings > before);
        CHECK_INT(status().state, DEVICE_RUNNING);
        rig.mute = true; /* a second silence is news again, and the delays begin anew */
        rig.scanning = false;
        while (rig.warnings < 2 && rig.now_ns < 1000 * SEC)
            run_for(10 * MS);
        CHECK_INT(rig.warnings, 2);
        breaks = rig.breaks;
        run_for(6 * SEC + 500 * MS);
        CHECK_INT(rig.breaks - breaks, 3);
    }
}

TEST(nobody_there_from_the_start)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.mute = true;
    rig_open();
    run_for(10 * SEC);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK_INT(rig.warnings, 1);
    rig.mute = false;
    run_for(8 * SEC);
    CHECK_INT(status().state, DEVICE_RUNNING);
}

TEST(another_device_is_not_commanded)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig.type = 1;
    rig_open();
    run_for(30 * SEC);
    CHECK_INT(rig.auto_transmits + rig.transducers, 0);
    CHECK_INT(status().state, DEVICE_SILENT);
    CHECK(strstr(rig.notes, "type 1") != NULL);
    CHECK_INT(rig.warnings, 1);
}

TEST(geometry_comes_from_the_frame)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig_open();
    run_to_ping(5, 60 * SEC);
    CHECK_NEAR(rig.last.dr_m * (float)rig.last.n_bins, 20.0025, 1e-6, 0);
    rig.n_samples = 666;
    rig.period = 80;
    run_to_ping(8, 60 * SEC);
    CHECK_NEAR(rig.last.dr_m * (float)rig.last.n_bins, 0.999, 1e-6, 0);
    CHECK_INT(rig.last.n_bins, 666);
    CHECK_NEAR(status().range_m, 0.999, 1e-9, 0);
}

TEST(replug)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    for (int k = 0; k < 5; k++) {
        rig_open();
        run_for(10 * SEC);
        CHECK_INT(status().state, DEVICE_RUNNING);
        CHECK(status().pings > 20u * (unsigned)k);
        device_ping360.feed(rig.state, (const uint8_t *)"BR\1", 3, rig.now_ns, &rig.io);
        device_ping360.closed(rig.state, rig.now_ns);
        CHECK_INT(status().state, DEVICE_CLOSED);
        CHECK(device_ping360.deadline(rig.state) == UINT64_MAX);
        rig.scanning = false;
        rig.queued = 0;
        run_for(SEC);
    }
    CHECK_INT(rig.breaks, 5);
    CHECK_INT(status().restarts, 0);
    CHECK(status().cut_bytes >= 15);
    CHECK_INT(status().garbage_bytes, 0);
}

TEST(stop_switches_the_motor_off)
{
    struct device_conf conf = usual_conf();
    rig_new(&conf);
    rig_open();
    run_to_ping(5, 60 * SEC);
    device_ping360.stop(rig.state, rig.now_ns, &rig.io);
    run_for(5 * SEC);
    CHECK_INT(rig.motor_offs, 1);
    CHECK(device_ping360.deadline(rig.state) == UINT64_MAX);

    rig_new(&conf);
    rig.acks_motor_off = false;
    rig_open();
    run_to_ping(5, 60 * SEC);
    device_ping360.stop(rig.state, rig.now_ns, &rig.io);
    CHECK(device_ping360.deadline(rig.state) != UINT64_MAX);
    run_for(5 * SEC);
    CHECK_INT(rig.motor_offs, 3);
    CHECK(device_ping360.deadline(rig.state) == UINT64_MAX);
}

TEST(listening_sends_nothing)
{
    struct device_conf conf = usual_conf();
    conf.listen_only = true;
    rig_new(&conf);
    rig_open();
    feed_data(7, 100, 88, 200 * SEC, 200 * SEC);
    run_for(100 * SEC);
    device_ping360.tick(rig.state, rig.now_ns, &rig.io);
    device_ping360.stop(rig.state, rig.now_ns, &rig.io);
    run_for(100 * SEC);
    CHECK_INT(rig.pings, 1);
    CHECK_INT(rig.breaks + rig.autobauds + rig.ask_info + rig.transducers + rig.auto_transmits + rig.motor_offs,
              0);
    CHECK_INT(status().state, DEVICE_RUNNING);
    CHECK_INT(status().timeouts, 0);
}

TEST(device_is_in_the_table)
{
    CHECK(device_find("ping360") == &device_ping360);
    CHECK(device_find("ping") == NULL);
    CHECK(device_find("") == NULL);
}

int main(void)
{
    RUN(settings_for_a_range);
    RUN(settings_are_legal_everywhere);
    RUN(configuration_faults_name_the_key);
    RUN(sector_goes_back_and_forth);
    RUN(full_circle_has_every_angle);
    RUN(scans_the_head_cannot_do_itself);
    RUN(new_sweeps_from_the_angles_seen);
    RUN(missing_angles_of_the_heads_own_scan);
    RUN(handshake_then_the_heads_own_scan);
    RUN(request_and_response);
    RUN(a_steered_head_sends_fewer_samples);
    RUN(ping_content);
    RUN(a_head_with_settings_of_others_is_set_up_again);
    RUN(pings_of_the_settings_before_are_no_takeover);
    RUN(a_head_that_others_ask_too_is_told);
    RUN(a_scanning_head_that_answers_others_is_told);
    RUN(an_asked_head_that_answers_others_is_told);
    RUN(a_poor_line_is_not_taken_for_another_program);
    RUN(a_head_that_was_dead_is_not_taken_for_another_program);
    RUN(a_slow_head_is_not_taken_for_another_program);
    RUN(time_of_a_ping);
    RUN(no_ping_is_longer_than_the_device_says);
    RUN(azimuth_of_every_head_angle);
    RUN(senseless_data_is_counted);
    RUN(no_room_for_a_ping_is_survived);
    RUN(nack_falls_back_to_asking);
    RUN(a_head_that_refuses_its_name_scans_all_the_same);
    RUN(data_without_samples_are_no_ping);
    RUN(no_answer_to_auto_falls_back_to_asking);
    RUN(no_version_is_no_obstacle);
    RUN(text_from_the_line_is_escaped);
    RUN(a_slow_wire_is_waited_for);
    RUN(a_lost_frame_costs_at_most_200_ms);
    RUN(lost_frames_of_the_heads_own_scan_are_counted);
    RUN(late_answer_is_a_ping_and_confuses_nobody);
    RUN(answer_behind_a_false_start_is_found);
    RUN(line_full_of_noise_times_out);
    RUN(silence_and_return);
    RUN(nobody_there_from_the_start);
    RUN(another_device_is_not_commanded);
    RUN(geometry_comes_from_the_frame);
    RUN(replug);
    RUN(stop_switches_the_motor_off);
    RUN(listening_sends_nothing);
    RUN(device_is_in_the_table);
    free(rig.state);
    return test_end();
}
