/* SPDX-License-Identifier: MIT */
/* test_sim - the virtual Ping360: rays against closed forms, echoes against rays, the head's protocol and timing on
 * simulated time. */
#include "tests/lib/test.h"

#include "core/fault.h"
#include "grid/geometry.h"
#include "tests/sim/lib/sim.h"

#define COUNT(a) (sizeof a / sizeof(a)[0])
#define MS       UINT64_C(1000000)

/* ---- scene ---- */

static struct place scene_of(const char *text)
{
    struct place scene;
    struct fault fault = {""};
    if (!scene_parse(&scene, "test", text, &fault))
        printf("scene: %s\n", fault.text);
    return scene;
}

TEST(ray_meets_shapes_where_geometry_says)
{
    static const struct {
        const char *name, *scene;
        double origin[3], az_deg, el_deg, t_s, range_m, cos_incidence, ghost_m;
    } row[] = {
        {"room, ahead", "box -6 9 -5 4 -2 3", {0, 0, 0}, 0, 0, 0, 9, 1, 24},
        {"room, right", "box -6 9 -5 4 -2 3", {0, 0, 0}, 90, 0, 0, 4, 1, 13},
        {"room, aft from another place", "box -6 9 -5 4 -2 3", {1, 0, 0}, 180, 0, 0, 7, 1, 22},
        {"room, oblique",
         "box -6 9 -50 50 -20 30",
         {0, 0, 0},
         30,
         0,
         0,
         10.392304845413264,
         0.8660254037844387,
         25.392304845413264},
        {"room, ceiling", "box -60 90 -50 40 -2 3", {0, 0, 0}, 0, 30, 0, 4, 0.5, 9},
        {"block from outside", "box 5 6 -1 1 -1 1", {0, 0, 0}, 0, 0, 0, 5, 1, 10},
        {"block beside the ray", "box 5 6 -1 1 -1 1", {0, 0, 0}, 20, 0, 0, INFINITY, 0, 0},
        {"block behind", "box 5 6 -1 1 -1 1", {0, 0, 0}, 180, 0, 0, INFINITY, 0, 0},
        {"pile, centre", "cylinder 6 0 0.5", {0, 0, 0}, 0, 0, 0, 5.5, 1, 11},
        {"pile, off centre", "cylinder 5 0.3 0.5", {0, 0, 0}, 0, 0, 0, 4.6, 0.8, 9.2},
        {"pile, missed", "cylinder 5 0.6 0.5", {0, 0, 0}, 0, 0, 0, INFINITY, 0, 0},
        {"pile, upwards", "cylinder 6 0 0.5", {0, 0, 0}, 0, 60, 0, 11, 0.5, 22},
        {"tank around the sonar", "cylinder 1 0 3", {0, 0, 0}, 0, 0, 0, 4, 1, 8},
        {"slope, facing", "slope 6 0 -60", {0, 0, 0}, 0, -60, 0, 6, 1, 12},
        {"slope, level", "slope 6 0 -60", {0, 0, 0}, 0, 0, 0, 12, 0.5, 24},
        {"slope, away", "slope 6 0 -60", {0, 0, 0}, 180, 0, 0, INFINITY, 0, 0},
        {"moving pile at start", "pile 8 0 0.5 -0.5 0", {0, 0, 0}, 0, 0, 0, 7.5, 1, 15},
        {"moving pile after 4 s", "pile 8 0 0.5 -0.5 0", {0, 0, 0}, 0, 0, 4, 5.5, 1, 11},
        {"nearest of two", "cylinder 9 0 1\ncylinder 4 0 1 # first", {0, 0, 0}, 0, 0, 0, 3, 1, 6},
    };

    for (size_t i = 0; i < COUNT(row); i++) {
        const struct place scene = scene_of(row[i].scene);
        struct place_hit hit = {.range_m = INFINITY};
        double direction[3];
        geo_direction(geo_rad(row[i].az_deg), geo_rad(row[i].el_deg), direction);
        bool found = place_cast(&scene, row[i].origin, direction, row[i].t_s, &hit);
        if (found != isfinite(row[i].range_m))
            printf("%s:\n", row[i].name);
        CHECK(found == isfinite(row[i].range_m));
        CHECK_NEAR(hit.range_m, row[i].range_m, 1e-12, 0);
        CHECK_NEAR(hit.cos_incidence, row[i].cos_incidence, 0, 1e-12);
        CHECK_NEAR(hit.ghost_m, row[i].ghost_m, 1e-12, 0);
    }
}

TEST(broken_scenes_are_refused_with_their_line)
{
    static const struct {
        const char *text, *want;
    } row[] = {
        {"cone 1 2 3", "test:1: 'cone' is no shape; there are box, cylinder, slope, pile"},
        {"\ncylinder 1 2", "test:2: cylinder needs X Y RADIUS, RADIUS > 0"},
        {"cylinder 1 2 3 4", "test:1: cylinder needs X Y RADIUS, RADIUS > 0"},
        {"cylinder 1 2 0", "test:1: cylinder needs X Y RADIUS, RADIUS > 0"},
        {"cylinder 1 2 nan", "test:1: cylinder needs X Y RADIUS, RADIUS > 0"},
        {"cylinder 1 2 3m", "test:1: cylinder needs X Y RADIUS, RADIUS > 0"},
        {"# ok\nbox 1 0 0 1 0 1", "test:2: box needs XMIN XMAX YMIN YMAX ZMIN ZMAX, each MIN below its MAX"},
    };

    for (size_t i = 0; i < COUNT(row); i++) {
        struct place scene;
        struct fault fault = {""};
        CHECK(!scene_parse(&scene, "test", row[i].text, &fault));
        CHECK_STR(fault.text, row[i].want);
    }
}

/* ---- water ---- */

static const struct water quiet = {.sound_speed_mps = 1500, .noise_counts = 0, .ghost = 0.5, .seed = 1};
static const struct water noisy = {.sound_speed_mps = 1500, .noise_counts = 8, .ghost = 0.5, .seed = 1};

/* 20 m, as a driver would set it. */
static struct water_shot shot_ahead(uint64_t number)
{
    return (struct water_shot){
        .sample_s = 888 * PING360_TICK_S,
        .transmit_s = 107e-6,
        .frequency_hz = 750e3,
        .gain = 1,
        .n_samples = 1200,
        .number = number,
    };
}

static double sample_m(const struct water_shot *shot)
{
    return shot->sample_s * 1500 / 2;
}

/* Near edge of the first sample behind the ring-down (1 m) that is above `counts`; infinite: none. */
static double first_above(const struct water_shot *shot, const uint8_t *samples, int counts)
{
    for (uint32_t i = (uint32_t)(1.0 / sample_m(shot)); i < shot->n_samples; i++) {
        if (samples[i] > counts)
            return i * sample_m(shot);
    }
    return INFINITY;
}

TEST(echo_begins_within_one_pulse_of_the_true_range)
{
    static const char *const scenes[] = {"box -6 9 -5 4 -20 20", "cylinder 6 0 0.4", "slope 6 0 0",
                                         "cylinder 2 0 0.1", "box -20 17 -20 20 -20 20"};
    const double pulse_m = 107e-6 * 1500 / 2;
    for (size_t i = 0; i < COUNT(scenes); i++) {
        const struct place scene = scene_of(scenes[i]);
        for (uint64_t number = 1; number <= 20; number++) {
            const struct water_shot shot = shot_ahead(number);
            struct water_truth truth;
            uint8_t samples[WATER_MAX_SAMPLES];
            water_listen(&quiet, &scene, &shot, samples);
            water_look(&scene, &shot, &truth);
            double first_m = first_above(&shot, samples, 40);
            if (!(first_m >= truth.nearest_m - sample_m(&shot) && first_m <= truth.nearest_m + pulse_m)) {
                printf("%s, ping %d: echo at %.3f m, truth %.3f m\n", scenes[i], (int)number, first_m,
                       truth.nearest_m);
                CHECK(false);
            }
        }
    }
}

TEST(nothing_is_heard_in_open_water_without_noise)
{
    const struct place scene = scene_of("");
    const struct water_shot shot = shot_ahead(1);
    uint8_t samples[WATER_MAX_SAMPLES];
    water_listen(&quiet, &scene, &shot, samples);
    CHECK_INT(samples[0], 255); /* ring-down */
    CHECK(isinf(first_above(&shot, samples, 0)));
}

TEST(noise_floor_has_the_mean_that_was_asked_for)
{
    const struct place scene = scene_of("");
    double sum = 0;
    int n = 0;
    for (uint64_t number = 1; number <= 20; number++) {
        const struct water_shot shot = shot_ahead(number);
        uint8_t samples[WATER_MAX_SAMPLES];
        water_listen(&noisy, &scene, &shot, samples);
        for (uint32_t i = 1080; i < 1200; i++, n++) /* 18 to 20 m: the time-varied gain lifts it by 19^(1/4) */
            sum += samples[i] + 0.5;
    }
    CHECK_NEAR(sum / n / pow(19, 0.25), 8, 0.1, 0);
}

TEST(room_has_a_ghost_one_room_behind_the_wall)
{
    const struct place scene = scene_of("box -3 5 -50 50 -50 50");
    const struct water_shot shot = shot_ahead(1);
    uint8_t samples[WATER_MAX_SAMPLES];
    struct water silent = quiet;
    water_listen(&quiet, &scene, &shot, samples);
    const uint32_t at = (uint32_t)((5 + 8 + 0.05) / sample_m(&shot));
    CHECK(samples[at] > 30);
    silent.ghost = 0;
    water_listen(&silent, &scene, &shot, samples);
    CHECK_INT(samples[at], 0);
}

TEST(same_seed_gives_the_same_samples_and_another_does_not)
{
    const struct place scene = scene_of("box -6 9 -5 4 -20 20");
    struct water_shot shot = shot_ahead(7);
    struct water other = noisy;
    uint8_t a[WATER_MAX_SAMPLES], b[WATER_MAX_SAMPLES];
    water_listen(&noisy, &scene, &shot, a);
    water_listen(&noisy, &scene, &shot, b);
    CHECK(memcmp(a, b, sizeof a) == 0);
    other.seed = 2;
    water_listen(&other, &scene, &shot, b);
    CHECK(memcmp(a, b, sizeof a) != 0);
    shot.number = 8;
    water_listen(&noisy, &scene, &shot, b);
    CHECK(memcmp(a, b, sizeof a) != 0);
}

/* ---- head, on simulated time ---- */

struct bench {
    struct head head;
    struct ping_parser parser; /* of the host */
    uint64_t now_ns;
    uint64_t line_ns; /* that a frame takes to leave */
    int n;            /* frames heard since bench_say */
    uint16_t id[64];
    struct ping360_data data[64];
    uint64_t t_ns[64];
};

static uint64_t bench_send(void *ctx, const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    struct bench *b = ctx;
    struct ping_frame frame;
    while (ping_parser_next(&b->parser, &bytes, &n, now_ns, &frame)) {
        if (b->n == (int)COUNT(b->id))
            continue;
        b->id[b->n] = frame.id;
        b->t_ns[b->n] = now_ns;
        memset(&b->data[b->n], 0, sizeof b->data[0]);
        ping360_decode_data(&frame, &b->data[b->n]);
        b->n++;
    }
    return now_ns + b->line_ns;
}

static void bench_listen(void *ctx, const struct head_shot *shot, uint8_t *samples)
{
    (void)ctx;
    memset(samples, 9, shot->settings.n_samples);
}

static const struct head_conf modern = {
    .id = 2, .lag = 2, .ms_per_gradian = 6, .processing_ms = 10, .sound_speed_mps = 1500};

static void bench_init(struct bench *b, const struct head_conf *conf)
{
    memset(b, 0, sizeof *b);
    b->line_ns = 13 * MS;
    ping_parser_init(&b->parser, PING_PAYLOAD_MAX);
    head_init(&b->head, conf, &(struct head_io){.ctx = b, .send = bench_send, .listen = bench_listen});
}

/* Let the head run for so long. */
static void bench_run(struct bench *b, uint64_t ns)
{
    const uint64_t end_ns = b->now_ns + ns;
    while (head_deadline(&b->head) <= end_ns) {
        b->now_ns = head_deadline(&b->head) > b->now_ns ? head_deadline(&b->head) : b->now_ns;
        head_tick(&b->head, b->now_ns);
    }
    b->now_ns = end_ns;
}

static void bench_say(struct bench *b, const uint8_t *bytes, size_t n)
{
    b->n = 0;
    head_feed(&b->head, bytes, n, b->now_ns);
}

static const struct ping360_settings settings_20m = {.mode = 1,
                                                     .gain = 1,
                                                     .angle = 200,
                                                     .transmit_us = 107,
                                                     .sample_period = 888,
                                                     .frequency_khz = 750,
                                                     .n_samples = 1200};

static void bench_transducer(struct bench *b, const struct ping360_settings *set, bool transmit)
{
    uint8_t frame[PING_FRAME_MAX];
    bench_say(b, frame, ping360_encode_transducer(frame, sizeof frame, set, transmit));
}

static void bench_auto(struct bench *b, const struct ping360_settings *set, struct ping360_sweep sweep)
{
    uint8_t frame[PING_FRAME_MAX];
    bench_say(b, frame, ping360_encode_auto_transmit(frame, sizeof frame, set, &sweep));
}

static void bench_request(struct bench *b, uint16_t id)
{
    uint8_t frame[PING_FRAME_MAX];
    bench_say(b, frame, ping_encode_request(frame, sizeof frame, id));
}

TEST(head_says_who_it_is)
{
    struct bench b;
    bench_init(&b, &modern);
    bench_request(&b, PING_DEVICE_INFORMATION);
    CHECK_INT(b.n, 1);
    CHECK_INT(b.id[0], PING_DEVICE_INFORMATION);
    bench_request(&b, PING_PROTOCOL_VERSION);
    CHECK_INT(b.id[0], PING_PROTOCOL_VERSION);
    bench_request(&b, PING360_DEVICE_DATA);
    CHECK_INT(b.id[0], PING360_DEVICE_DATA);
    CHECK_INT(b.data[0].n_data, 0);
    bench_request(&b, 1211);
    CHECK_INT(b.id[0], PING_NACK);
}

TEST(single_ping_takes_the_way_the_listening_and_the_processing)
{
    struct bench b;
    bench_init(&b, &modern);
    bench_transducer(&b, &settings_20m, true);
    bench_run(&b, 5000 * MS);
    CHECK_INT(b.n, 1);
    CHECK_INT(b.id[0], PING360_DEVICE_DATA);
    CHECK_INT(b.data[0].set.angle, 200);
    CHECK_INT(b.data[0].n_data, 1200);
    CHECK_NEAR((double)b.t_ns[0], 200 * 6e6 + 1200 * 888 * 25.0 + 10e6, 1e-9, 2);

    uint64_t start_ns = b.now_ns;
    struct ping360_settings back = settings_20m;
    back.angle = 390; /* 190 gradians forward, and so the way */
    bench_transducer(&b, &back, false);
    bench_run(&b, 5000 * MS);
    CHECK_INT(b.data[0].n_data, 0);
    CHECK_INT(b.data[0].set.angle, 390);
    CHECK_NEAR((double)(b.t_ns[0] - start_ns), 190 * 6e6, 1e-9, 2);

    start_ns = b.now_ns;
    back.angle = 10; /* through zero */
    bench_transducer(&b, &back, false);
    bench_run(&b, 5000 * MS);
    CHECK_NEAR((double)(b.t_ns[0] - start_ns), 20 * 6e6, 1e-9, 2);
}

TEST(bad_values_are_refused)
{
    static const struct {
        const char *name;
        struct ping360_settings set;
        int id;
    } row[] = {
        {"good", {1, 2, 399, 1000, 40000, 1000, 1200}, PING360_DEVICE_DATA},
        {"mode", {0, 1, 0, 100, 888, 750, 1200}, PING_NACK},
        {"gain", {1, 3, 0, 100, 888, 750, 1200}, PING_NACK},
        {"angle", {1, 1, 400, 100, 888, 750, 1200}, PING_NACK},
        {"transmit 0", {1, 1, 0, 0, 888, 750, 1200}, PING_NACK},
        {"transmit 1001", {1, 1, 0, 1001, 888, 750, 1200}, PING_NACK},
        {"period 79", {1, 1, 0, 100, 79, 750, 1200}, PING_NACK},
        {"period 40001", {1, 1, 0, 100, 40001, 750, 1200}, PING_NACK},
        {"frequency", {1, 1, 0, 100, 888, 1001, 1200}, PING_NACK},
        {"samples 199", {1, 1, 0, 100, 888, 750, 199}, PING_NACK},
        {"samples 1201", {1, 1, 0, 100, 888, 750, 1201}, PING_NACK},
    };

    for (size_t i = 0; i < COUNT(row); i++) {
        struct bench b;
        bench_init(&b, &modern);
        bench_transducer(&b, &row[i].set, true);
        bench_run(&b, 10000 * MS);
        if (b.id[0] != row[i].id)
            printf("%s:\n", row[i].name);
        CHECK_INT(b.n, 1);
        CHECK_INT(b.id[0], row[i].id);
    }
}

TEST(auto_transmit_sweeps_as_the_device_does)
{
    static const struct {
        const char *name;
        struct ping360_sweep sweep;
        int angle[8];
    } row[] = {
        {"back and forth", {190, 194, 2, 0}, {190, 192, 194, 192, 190, 192, 194, 192}},
        {"step that does not divide", {10, 15, 4, 0}, {10, 14, 10, 14, 10, 14, 10, 14}},
        {"through zero", {399, 1, 1, 0}, {399, 0, 1, 0, 399, 0, 1, 0}},
        {"one direction", {77, 77, 1, 0}, {77, 77, 77, 77, 77, 77, 77, 77}},
    };

    for (size_t i = 0; i < COUNT(row); i++) {
        struct bench b;
        bench_init(&b, &modern);
        bench_auto(&b, &settings_20m, row[i].sweep);
        bench_run(&b, 4000 * MS);
        CHECK(b.n >= 8);
        for (int k = 0; k < 8; k++) {
            if (b.data[k].set.angle != row[i].angle[k])
                printf("%s, ping %d:\n", row[i].name, k);
            CHECK_INT(b.data[k].set.angle, row[i].angle[k]);
            CHECK(b.data[k].automatic);
        }
    }
}

TEST(full_circle_goes_on_through_zero)
{
    struct bench b;
    bench_init(&b, &modern);
    bench_auto(&b, &settings_20m, (struct ping360_sweep){0, 399, 10, 0});
    bench_run(&b, 10000 * MS);
    for (int k = 0; k < 60; k++)
        CHECK_INT(b.data[k].set.angle, k * 10 % 400);
}

TEST(auto_transmit_waits_for_the_line_and_the_delay)
{
    struct bench b;
    bench_init(&b, &modern);
    bench_auto(&b, &settings_20m, (struct ping360_sweep){0, 399, 1, 50});
    bench_run(&b, 4000 * MS);
    CHECK_NEAR((double)(b.t_ns[5] - b.t_ns[4]), 13e6 + 50e6 + 6e6 + 1200 * 888 * 25.0 + 10e6, 1e-9, 2);
}

TEST(motor_off_ends_auto_transmit)
{
    struct bench b;
    uint8_t frame[PING_FRAME_MAX];
    bench_init(&b, &modern);
    bench_auto(&b, &settings_20m, (struct ping360_sweep){0, 399, 1, 0});
    bench_run(&b, 500 * MS);
    bench_say(&b, frame, ping360_encode_motor_off(frame, sizeof frame));
    bench_run(&b, 5000 * MS);
    CHECK_INT(b.n, 1);
    CHECK_INT(b.id[0], PING_ACK);
}

TEST(old_firmware_refuses_auto_transmit)
{
    struct bench b;
    struct head_conf old = modern;
    old.old_firmware = true;
    bench_init(&b, &old);
    bench_auto(&b, &settings_20m, (struct ping360_sweep){0, 399, 1, 0});
    bench_run(&b, 5000 * MS);
    CHECK_INT(b.n, 1);
    CHECK_INT(b.id[0], PING_NACK);
}

TEST(changed_settings_come_late_and_a_changed_sector_after_the_sweep)
{
    struct bench b;
    struct ping360_settings near = settings_20m;
    near.sample_period = 88;
    near.transmit_us = 11;
    bench_init(&b, &modern);
    bench_auto(&b, &settings_20m, (struct ping360_sweep){100, 105, 1, 0});
    while (b.n < 2)
        bench_run(&b, MS); /* two pings are out */
    bench_auto(&b, &near, (struct ping360_sweep){300, 305, 1, 0});
    bench_run(&b, 5000 * MS);
    /* the lag counts the pings that begin after the change */
    CHECK_INT(b.data[0].set.sample_period, 888);
    CHECK_INT(b.data[1].set.sample_period, 888);
    CHECK_INT(b.data[2].set.sample_period, 88);
    CHECK_INT(b.data[3].set.angle, 105);
    CHECK_INT(b.data[4].set.angle, 300);
}

TEST(strict_head_is_deaf_until_it_has_heard_a_u)
{
    struct bench b;
    struct head_conf strict = modern;
    strict.strict_autobaud = true;
    bench_init(&b, &strict);
    bench_request(&b, PING_DEVICE_INFORMATION);
    CHECK_INT(b.n, 0);
    bench_say(&b, (const uint8_t *)"\0UU", 3);
    bench_request(&b, PING_DEVICE_INFORMATION);
    CHECK_INT(b.n, 1);
}

TEST(forced_range_shows_in_the_frames)
{
    struct bench b;
    bench_init(&b, &modern);
    b.head.forced_range_m = 5;
    bench_transducer(&b, &settings_20m, true);
    bench_run(&b, 5000 * MS);
    CHECK_NEAR(b.data[0].set.n_samples * ping360_sample_m(&b.data[0].set, 1500), 5, 0.01, 0);
}

TEST(any_bytes_leave_the_head_alive)
{
    uint64_t random = test_seed();
    struct bench b;
    bench_init(&b, &modern);
    for (int i = 0; i < 2000; i++) {
        uint8_t bytes[64];
        size_t n = test_random(&random) % sizeof bytes;
        for (size_t k = 0; k < n; k++)
            bytes[k] = (uint8_t)test_random(&random);
        if (n > 2)
            memcpy(bytes, "BR", 2);
        bench_say(&b, bytes, n);
    }
    bench_say(&b, (const uint8_t *)"", 1);
    for (int i = 0; i < PING_FRAME_MAX / 12 + 1; i++) /* fill whatever frame the noise has promised */
        bench_request(&b, PING_DEVICE_INFORMATION);
    CHECK_INT(b.id[0], PING_DEVICE_INFORMATION);
}

int main(void)
{
    RUN(ray_meets_shapes_where_geometry_says);
    RUN(broken_scenes_are_refused_with_their_line);
    RUN(echo_begins_within_one_pulse_of_the_true_range);
    RUN(nothing_is_heard_in_open_water_without_noise);
    RUN(noise_floor_has_the_mean_that_was_asked_for);
    RUN(room_has_a_ghost_one_room_behind_the_wall);
    RUN(same_seed_gives_the_same_samples_and_another_does_not);
    RUN(head_says_who_it_is);
    RUN(single_ping_takes_the_way_the_listening_and_the_processing);
    RUN(bad_values_are_refused);
    RUN(auto_transmit_sweeps_as_the_device_does);
    RUN(full_circle_goes_on_through_zero);
    RUN(auto_transmit_waits_for_the_line_and_the_delay);
    RUN(motor_off_ends_auto_transmit);
    RUN(old_firmware_refuses_auto_transmit);
    RUN(changed_settings_come_late_and_a_changed_sector_after_the_sweep);
    RUN(strict_head_is_deaf_until_it_has_heard_a_u);
    RUN(forced_range_shows_in_the_frames);
    RUN(any_bytes_leave_the_head_alive);
    return test_end();
}
