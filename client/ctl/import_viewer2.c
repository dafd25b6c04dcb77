/* SPDX-License-Identifier: MIT */
/*
 * import_viewer2 - the MCAP files of Ping Viewer 2: one device in each, whose messages it has taken apart and
 * written as JSON, on the topics device_ID/Ping360 (fields of auto_device_data), device_ID/Ping1D (of profile) and
 * device_ID/VehicleData (roll, pitch, yaw in radians, alt, lat, lon), with Unix times. The frames are made anew of
 * them. Beside every ping stands the last attitude that it has heard, however old: what says the same again is no
 * pose. Source: github.com/bluerobotics/ping-viewer-next, and the messages' public definition.
 */
#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "drivers/capture/mcap.h"
#include "drivers/devices/ping1d.h"
#include "drivers/devices/ping_frame.h"
#include "import.h"

#define LOOKED_AT 1000 /* messages, for one of the topics, where the file has no summary */
#define SOURCE_ID 2

enum part { PART_NONE, PART_PING360, PART_PING1D, PART_VEHICLE };

/* What the channel is, and how long the name of its device. */
static enum part part_of(const struct mcap_channel *c, size_t *device_n)
{
    static const char *const name[] = {
        [PART_PING360] = "Ping360", [PART_PING1D] = "Ping1D", [PART_VEHICLE] = "VehicleData"};
    const char *slash = strrchr(c->topic, '/');
    if (!slash || !strstr(c->topic, "device_") || strcmp(c->encoding, "json") != 0)
        return PART_NONE;
    *device_n = (size_t)(slash - c->topic);
    for (unsigned i = PART_PING360; i < sizeof name / sizeof name[0]; i++)
        if (strcmp(slash + 1, name[i]) == 0)
            return (enum part)i;
    return PART_NONE;
}

bool import_is_viewer2(const uint8_t *data, size_t size)
{
    struct fault fault;
    struct mcap_message m;
    size_t n;
    bool found = false;
    struct mcap_reader *r = mcap_open_memory(data, size, NULL, NULL, &fault);
    for (unsigned i = 0; r && !found && i < LOOKED_AT && mcap_next(r, &m); i++)
        found = part_of(m.channel, &n) != PART_NONE;
    mcap_close(r);
    return found;
}

/* A whole number 0 .. most of the object; false: it is none. */
static bool whole(const json_t *object, const char *key, uint32_t most, uint32_t *out)
{
    const json_t *v = json_object_get(object, key);
    const json_int_t n = json_integer_value(v);
    *out = (uint32_t)n;
    return json_is_integer(v) && n >= 0 && n <= most;
}

/* Up to `room` samples; their number, or -1 when they are none. */
static int samples(const json_t *object, const char *key, uint8_t *out, size_t room)
{
    const json_t *array = json_object_get(object, key);
    const size_t n = json_array_size(array);
    if (!json_is_array(array) || n > room)
        return -1;
    for (size_t i = 0; i < n; i++) {
        const json_t *v = json_array_get(array, i);
        const json_int_t sample = json_integer_value(v);
        if (!json_is_integer(v) || sample < 0 || sample > UINT8_MAX)
            return -1;
        out[i] = (uint8_t)sample;
    }
    return (int)n;
}

/* The frame of a ping; its length, or 0 when a field is missing or cannot be. */
static size_t frame_of_ping360(const json_t *o, uint8_t *out, size_t size)
{
    static const struct {
        const char *key;
        uint32_t most;
    } field[] = {{"mode", UINT8_MAX},
                 {"gain_setting", UINT8_MAX},
                 {"angle", UINT16_MAX},
                 {"transmit_duration", UINT16_MAX},
                 {"sample_period", UINT16_MAX},
                 {"transmit_frequency", UINT16_MAX},
                 {"number_of_samples", UINT16_MAX}};
    uint32_t v[sizeof field / sizeof field[0]];
    uint8_t data[PING_PAYLOAD_MAX];
    const int n = samples(o, "data", data, sizeof data);
    for (size_t i = 0; i < sizeof field / sizeof field[0]; i++)
        if (!whole(o, field[i].key, field[i].most, &v[i]))
            return 0;
    if (n < 0)
        return 0;
    const struct ping360_data d = {.set = {.mode = (uint8_t)v[0],
                                           .gain = (uint8_t)v[1],
                                           .angle = (uint16_t)v[2],
                                           .transmit_us = (uint16_t)v[3],
                                           .sample_period = (uint16_t)v[4],
                                           .frequency_khz = (uint16_t)v[5],
                                           .n_samples = (uint16_t)v[6]},
                                   .data_length = (uint16_t)n,
                                   .n_data = (uint16_t)n,
                                   .data = data};
    return ping360_encode_data(out, size, SOURCE_ID, &d);
}

static size_t frame_of_ping1d(const json_t *o, uint8_t *out, size_t size)
{
    static const struct {
        const char *key;
        uint32_t most;
    } field[] = {{"distance", UINT32_MAX},    {"confidence", UINT16_MAX}, {"transmit_duration", UINT16_MAX},
                 {"ping_number", UINT32_MAX}, {"scan_start", UINT32_MAX}, {"scan_length", UINT32_MAX},
                 {"gain_setting", UINT32_MAX}};
    uint32_t v[sizeof field / sizeof field[0]];
    uint8_t data[PING1D_SAMPLES_MAX];
    const int n = samples(o, "profile_data", data, sizeof data);
    for (size_t i = 0; i < sizeof field / sizeof field[0]; i++)
        if (!whole(o, field[i].key, field[i].most, &v[i]))
            return 0;
    if (n < 0)
        return 0;
    const struct ping1d_reading r = {.distance_mm = v[0],
                                     .confidence_percent = (uint16_t)v[1],
                                     .transmit_us = (uint16_t)v[2],
                                     .ping_number = v[3],
                                     .start_mm = v[4],
                                     .length_mm = v[5],
                                     .gain = v[6],
                                     .n_samples = (uint16_t)n,
                                     .samples = data};
    return ping1d_encode_reading(out, size, SOURCE_ID, &r);
}

struct viewer2 {
    const struct import_sink *sink;
    bool (*pose)(void *ctx, uint64_t t_ns, const char *json);
    struct import_result *out;
    char device[MCAP_STRING_MAX + 1]; /* the first one; empty: none yet */
    uint64_t last_ns;
    double attitude_deg[3]; /* the last one, valid with `posed` */
    bool posed;
    uint64_t others, malformed;
};

/* False: it is malformed. */
static bool take_vehicle(struct viewer2 *v, const json_t *o)
{
    static const char *const key[] = {"roll", "pitch", "yaw"};
    double deg[3];
    char text[160];
    for (int i = 0; i < 3; i++) {
        const json_t *value = json_object_get(o, key[i]);
        deg[i] = json_number_value(value) * (180 / M_PI);
        if (!json_is_number(value) || !(fabs(deg[i]) <= 360))
            return false;
    }
    if (v->posed && memcmp(deg, v->attitude_deg, sizeof deg) == 0)
        return true;
    v->posed = true;
    memcpy(v->attitude_deg, deg, sizeof deg);
    snprintf(text, sizeof text, "{\"attitude_deg\":[%.6f,%.6f,%.6f],\"t_unix\":%" PRIu64 ".%09u}", deg[0], deg[1],
             deg[2], v->last_ns / 1000000000u, (unsigned)(v->last_ns % 1000000000u));
    v->out->stopped = !v->pose(v->sink->ctx, v->last_ns, text);
    return true;
}

static bool take_ping(struct viewer2 *v, enum part part, const json_t *o)
{
    uint8_t frame[PING_FRAME_MAX];
    const size_t n =
        part == PART_PING360 ? frame_of_ping360(o, frame, sizeof frame) : frame_of_ping1d(o, frame, sizeof frame);
    if (n == 0)
        return false;
    v->out->stopped = !v->sink->bytes(v->sink->ctx, v->last_ns, frame, n);
    v->out->records++;
    return true;
}

static void take_message(struct viewer2 *v, const struct mcap_message *m)
{
    size_t n = 0;
    const enum part part = part_of(m->channel, &n);
    if (part != PART_NONE && !v->device[0])
        memcpy(v->device, m->channel->topic, n);
    if (part == PART_NONE || strlen(v->device) != n || memcmp(v->device, m->channel->topic, n) != 0) {
        v->others++;
        return;
    }
    json_t *o = json_loadb((const char *)m->data, m->size, 0, NULL);
    v->last_ns = m->log_ns > v->last_ns ? m->log_ns : v->last_ns;
    if (!(part == PART_VEHICLE ? take_vehicle(v, o) : take_ping(v, part, o))) {
        v->malformed++;
        v->out->left_out_bytes += m->size;
    }
    json_decref(o);
}

static void tell_left_out(const struct viewer2 *v, uint64_t n, const char *what)
{
    char sentence[96];
    snprintf(sentence, sizeof sentence, "%" PRIu64 " messages %s are left out", n, what);
    if (n)
        v->sink->problem(v->sink->ctx, sentence);
}

void import_viewer2(const uint8_t *data, size_t size, const struct import_sink *sink,
                    bool (*pose)(void *ctx, uint64_t t_ns, const char *json), struct import_result *out)
{
    static struct viewer2 v;
    struct fault fault;
    struct mcap_message m;
    *out = (struct import_result){0};
    v = (struct viewer2){.sink = sink, .pose = pose, .out = out};
    struct mcap_reader *r = mcap_open_memory(data, size, sink->problem, sink->ctx, &fault);
    if (!r) {
        sink->problem(sink->ctx, fault.text);
        return;
    }
    while (!out->stopped && mcap_next(r, &m))
        take_message(&v, &m);
    tell_left_out(&v, v.others, "of other devices or kinds");
    tell_left_out(&v, v.malformed, "with a field missing or out of range");
    if (mcap_is_mostly_lost(mcap_info(r)))
        out->left_out_bytes = size;
    mcap_close(r);
}
