/* SPDX-License-Identifier: MIT */
/* Files of Ping Viewer 2, made here as it writes them: their pings as frames, the vehicle's attitude as poses. */
#include "client/ctl/import.h"

#include <math.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/capture/mcap.h"
#include "drivers/devices/ping1d.h"
#include "drivers/devices/ping_frame.h"
#include "tests/lib/test.h"

#define T0 1750000000000000000u /* ns since 1970 */
#define A  "/device_0f8e/"
#define B  "/device_77aa/"

#define PING360                                                                                                   \
    "{\"mode\":1,\"gain_setting\":2,\"angle\":%d,\"transmit_duration\":107,\"sample_period\":889,"                \
    "\"transmit_frequency\":750,\"start_angle\":0,\"stop_angle\":399,\"num_steps\":1,\"delay\":0,"                \
    "\"number_of_samples\":5,\"data_length\":5,\"data\":[9,66,82,%d,255]}"
#define PING1D                                                                                                    \
    "{\"distance\":4500,\"confidence\":98,\"transmit_duration\":100,\"ping_number\":77,\"scan_start\":500,"       \
    "\"scan_length\":9500,\"gain_setting\":3,\"profile_data_length\":3,\"profile_data\":[1,2,255]}"
#define VEHICLE "{\"roll\":0.1,\"pitch\":-0.2,\"yaw\":%s,\"alt\":-3.5,\"lat\":52.5,\"lon\":13.4}"

static struct fault fault;

static struct {
    struct mcap_writer *w;
    int fd, channel[8];
    uint32_t n;
} making;

static void begin(const char *const *topic, const char *encoding)
{
    const struct mcap_options options = {.library = "foxglove-sdk-rust/0.8"};
    making.fd = memfd_create("viewer2", MFD_CLOEXEC);
    making.w = mcap_create(dup(making.fd), &options, &fault);
    making.n = 0;
    for (int i = 0; topic[i]; i++)
        making.channel[i] = mcap_add_channel(making.w, topic[i], encoding, NULL, 0, &fault);
}

/* A tenth of a second after the one before. */
static void add(int channel, const char *json)
{
    const uint64_t t_ns = T0 + 100000000ull * making.n;
    const struct mcap_message m = {.sequence = making.n++,
                                   .log_ns = t_ns,
                                   .publish_ns = t_ns,
                                   .data = (const uint8_t *)json,
                                   .size = strlen(json)};
    CHECK(mcap_write_message(making.w, making.channel[channel], &m, &fault));
}

static uint8_t file[1 << 16];
static size_t size;

static void end(void)
{
    CHECK(mcap_finish(making.w, &fault));
    const ssize_t n = pread(making.fd, file, sizeof file, 0);
    size = n > 0 ? (size_t)n : 0;
    close(making.fd);
}

static struct {
    struct ping_parser parser;
    unsigned pings, problems, poses, readings;
    uint64_t first_ns, last_ns, pose_ns;
    struct ping360_data data;
    uint8_t sample[8];
    struct ping1d_reading reading;
    char pose[200], problem[200];
} heard;

static bool on_bytes(void *ctx, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    struct ping_frame frame;
    (void)ctx;
    while (ping_parser_next(&heard.parser, &bytes, &n, t_ns, &frame)) {
        if (ping1d_decode(&frame, &heard.reading))
            heard.readings++;
        if (!ping360_decode_data(&frame, &heard.data))
            continue;
        heard.first_ns = heard.pings++ == 0 ? t_ns : heard.first_ns;
        memcpy(heard.sample, heard.data.data, heard.data.n_data);
    }
    heard.last_ns = t_ns;
    return true;
}

static bool on_pose(void *ctx, uint64_t t_ns, const char *json)
{
    (void)ctx;
    heard.poses++;
    heard.pose_ns = t_ns;
    snprintf(heard.pose, sizeof heard.pose, "%s", json);
    return true;
}

static void on_problem(void *ctx, const char *sentence)
{
    (void)ctx;
    heard.problems++;
    snprintf(heard.problem, sizeof heard.problem, "%s", sentence);
}

static struct import_result import(void)
{
    static const struct import_sink sink = {NULL, on_bytes, on_problem};
    struct import_result result;
    memset(&heard, 0, sizeof heard);
    ping_parser_init(&heard.parser, PING_PAYLOAD_MAX);
    import_viewer2(file, size, &sink, on_pose, &result);
    return result;
}

static const char *ping360(int angle, int sample)
{
    static char text[512];
    snprintf(text, sizeof text, PING360, angle, sample);
    return text;
}

static const char *vehicle(const char *yaw)
{
    static char text[256];
    snprintf(text, sizeof text, VEHICLE, yaw);
    return text;
}

TEST(pings_of_a_ping360_become_frames_with_their_times)
{
    static const char *const topic[] = {A "Ping1D", A "Ping360", A "VehicleData", NULL};
    begin(topic, "json");
    add(1, ping360(0, 1));
    add(1, ping360(399, 8));
    end();
    CHECK_INT(import_kind(file, size), IMPORT_VIEWER2);
    const struct import_result r = import();
    CHECK_INT(r.records, 2);
    CHECK_INT(heard.pings, 2);
    CHECK_INT(heard.problems, 0);
    CHECK_INT(heard.first_ns, T0);
    CHECK_INT(heard.last_ns, T0 + 100000000);
    CHECK_INT(heard.data.set.angle, 399);
    CHECK_INT(heard.data.set.gain, 2);
    CHECK_INT(heard.data.set.sample_period, 889);
    CHECK_INT(heard.data.set.n_samples, 5);
    CHECK(heard.data.n_data == 5 && memcmp(heard.sample, (uint8_t[]){9, 66, 82, 8, 255}, 5) == 0);
}

/* Names without the leading slash, and with the kind of the device in place of its number, are as good. */
TEST(profiles_of_a_ping1d_become_frames)
{
    static const char *const topic[] = {"device_Ping1D_0/Ping1D", NULL};
    begin(topic, "json");
    add(0, PING1D);
    end();
    CHECK_INT(import_kind(file, size), IMPORT_VIEWER2);
    import();
    CHECK_INT(heard.readings, 1);
    CHECK_INT(heard.reading.distance_mm, 4500);
    CHECK_INT(heard.reading.confidence_percent, 98);
    CHECK_INT(heard.reading.start_mm, 500);
    CHECK_INT(heard.reading.length_mm, 9500);
    CHECK_INT(heard.reading.ping_number, 77);
}

/* The program repeats the last attitude beside every ping: once it has heard no more, the pose must grow old. */
TEST(an_attitude_that_is_repeated_is_one_pose)
{
    static const char *const topic[] = {A "Ping360", A "VehicleData", NULL};
    begin(topic, "json");
    for (int i = 0; i < 4; i++) {
        add(0, ping360(i, 1));
        add(1, vehicle(i == 0 ? "1.5" : "1.5707963"));
    }
    end();
    import();
    CHECK_INT(heard.pings, 4);
    CHECK_INT(heard.poses, 2);
    CHECK_INT(heard.pose_ns, T0 + 300000000);
    CHECK_STR(heard.pose, "{\"attitude_deg\":[5.729578,-11.459156,89.999998],\"t_unix\":1750000000.300000000}");
}

TEST(what_cannot_be_is_left_out_and_counted)
{
    static const char *const topic[] = {A "Ping360", B "Ping360", A "VehicleData", "/note", A "Ping1D", NULL};
    begin(topic, "json");
    add(0, ping360(7, 3));
    add(1, ping360(8, 3));
    add(3, "{}");
    end();
    import();
    CHECK_INT(heard.pings, 1);
    CHECK_INT(heard.data.set.angle, 7);
    CHECK_STR(heard.problem, "2 messages of other devices or kinds are left out");
    begin(topic, "json");
    add(0, ping360(-1, 3));
    add(0, ping360(70000, 3));
    add(0, ping360(7, 256));
    add(0, ping360(7, -1));
    add(0, "{\"mode\":1}");
    add(0, "nonsense");
    add(0, "[]");
    add(2, vehicle("\"north\""));
    add(2, vehicle("1e300"));
    add(2, "");
    add(4, "{\"distance\":1}");
    add(0, ping360(5, 3));
    end();
    const struct import_result r = import();
    CHECK_INT(heard.pings, 1);
    CHECK_INT(heard.poses, 0);
    CHECK_INT(heard.data.set.angle, 5);
    CHECK_STR(heard.problem, "11 messages with a field missing or out of range are left out");
    CHECK(r.left_out_bytes > 0);
}

TEST(other_captures_are_none)
{
    static const char *const topic[] = {"/front/rx", NULL}, *const proto[] = {A "Ping360", NULL};
    begin(topic, "octet-stream");
    add(0, "x");
    end();
    CHECK_INT(import_kind(file, size), IMPORT_UNKNOWN);
    begin(proto, "protobuf");
    add(0, "x");
    end();
    CHECK_INT(import_kind(file, size), IMPORT_UNKNOWN);
}

int main(void)
{
    RUN(pings_of_a_ping360_become_frames_with_their_times);
    RUN(profiles_of_a_ping1d_become_frames);
    RUN(an_attitude_that_is_repeated_is_one_pose);
    RUN(what_cannot_be_is_left_out_and_counted);
    RUN(other_captures_are_none);
    return test_end();
}
