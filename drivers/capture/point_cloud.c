/* SPDX-License-Identifier: MIT */
#include "point_cloud.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "mcap.h"

#define HEAD_MAX  512 /* of the message, before its fields ... */
#define FIELD_MAX 96  /* ... and of each of them */

static const char schema[] =
    "{\"title\":\"foxglove.PointCloud\",\"description\":\"A collection of N-dimensional "
    "points\",\"type\":\"object\","
    "\"properties\":{"
    "\"timestamp\":{\"type\":\"object\",\"title\":\"time\",\"properties\":{\"sec\":{\"type\":\"integer\","
    "\"minimum\":0},"
    "\"nsec\":{\"type\":\"integer\",\"minimum\":0,\"maximum\":999999999}}},"
    "\"frame_id\":{\"type\":\"string\"},"
    "\"pose\":{\"title\":\"foxglove.Pose\",\"type\":\"object\",\"properties\":{"
    "\"position\":{\"title\":\"foxglove.Vector3\",\"type\":\"object\",\"properties\":{\"x\":{\"type\":\"number\"},"
    "\"y\":{\"type\":\"number\"},\"z\":{\"type\":\"number\"}}},"
    "\"orientation\":{\"title\":\"foxglove.Quaternion\",\"type\":\"object\",\"properties\":{\"x\":{\"type\":"
    "\"number\"},"
    "\"y\":{\"type\":\"number\"},\"z\":{\"type\":\"number\"},\"w\":{\"type\":\"number\"}}}}},"
    "\"point_stride\":{\"type\":\"integer\",\"minimum\":0},"
    "\"fields\":{\"type\":\"array\",\"items\":{\"title\":\"foxglove.PackedElementField\",\"type\":\"object\","
    "\"properties\":{\"name\":{\"type\":\"string\"},\"offset\":{\"type\":\"integer\",\"minimum\":0},"
    "\"type\":{\"title\":\"foxglove.NumericType\",\"oneOf\":[{\"title\":\"UNKNOWN\",\"const\":0},"
    "{\"title\":\"UINT8\",\"const\":1},{\"title\":\"INT8\",\"const\":2},{\"title\":\"UINT16\",\"const\":3},"
    "{\"title\":\"INT16\",\"const\":4},{\"title\":\"UINT32\",\"const\":5},{\"title\":\"INT32\",\"const\":6},"
    "{\"title\":\"FLOAT32\",\"const\":7},{\"title\":\"FLOAT64\",\"const\":8}]}}}},"
    "\"data\":{\"type\":\"string\",\"contentEncoding\":\"base64\"}}}";

uint8_t *point_put(uint8_t *at, uint64_t bits, int n)
{
    for (int i = 0; i < n; i++)
        at[i] = (uint8_t)(bits >> (8 * i));
    return at + n;
}

uint8_t *point_put_double(uint8_t *at, double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    return point_put(at, bits, 8);
}

uint8_t *point_put_float(uint8_t *at, double v)
{
    const float f = (float)v;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return point_put(at, bits, 4);
}

static size_t type_bytes(enum point_type type)
{
    switch (type) {
    case POINT_UINT8:
        return 1;
    case POINT_UINT16:
        return 2;
    case POINT_UINT32:
    case POINT_FLOAT32:
        return 4;
    case POINT_FLOAT64:
        break;
    }
    return 8;
}

size_t point_bytes(const struct point_field *fields)
{
    size_t bytes = 0;
    for (; fields->name; fields++)
        bytes += type_bytes(fields->type);
    return bytes;
}

/* Returns the bytes written: four for each three, rounded up. */
static size_t base64(uint8_t *out, const uint8_t *in, size_t n)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t written = 0;
    for (size_t i = 0; i < n; i += 3) {
        const uint32_t left = n - i < 3 ? (uint32_t)(n - i) : 3;
        uint32_t group = (uint32_t)in[i] << 16;
        group |= left > 1 ? (uint32_t)in[i + 1] << 8 : 0;
        group |= left > 2 ? in[i + 2] : 0;
        for (uint32_t d = 0; d < 4; d++)
            out[written++] = d <= left ? (uint8_t)digits[group >> (18 - 6 * d) & 63] : '=';
    }
    return written;
}

/* All before the points; returns its length. */
static size_t write_head(const struct point_cloud *cloud, char *out, size_t room)
{
    size_t offset = 0;
    size_t n = (size_t)snprintf(
        out, room,
        "{\"timestamp\":{\"sec\":%llu,\"nsec\":%llu},\"frame_id\":\"%s\",\"pose\":{\"position\":{\"x\":0,"
        "\"y\":0,\"z\":0},\"orientation\":{\"x\":0,\"y\":0,\"z\":0,\"w\":1}},\"point_stride\":%zu,"
        "\"fields\":[",
        (unsigned long long)(cloud->t_unix_ns / 1000000000u), (unsigned long long)(cloud->t_unix_ns % 1000000000u),
        cloud->frame_id, point_bytes(cloud->fields));
    for (const struct point_field *f = cloud->fields; f->name; f++) {
        n += (size_t)snprintf(out + n, room - n, "%s{\"name\":\"%s\",\"offset\":%zu,\"type\":%d}",
                              f == cloud->fields ? "" : ",", f->name, offset, (int)f->type);
        offset += type_bytes(f->type);
    }
    return n + (size_t)snprintf(out + n, room - n, "],\"data\":\"");
}

uint8_t *point_cloud_message(const struct point_cloud *cloud, size_t *size, struct fault *fault)
{
    size_t n_fields = 0;
    while (cloud->fields[n_fields].name)
        n_fields++;
    const size_t room = HEAD_MAX + FIELD_MAX * n_fields;
    uint8_t *json = malloc(room + (cloud->bytes + 2) / 3 * 4 + 2);
    if (!json) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    *size = write_head(cloud, (char *)json, room);
    *size += base64(json + *size, cloud->points, cloud->bytes);
    memcpy(json + *size, "\"}", 2);
    *size += 2;
    return json;
}

static bool write_capture(struct mcap_writer *w, const struct point_cloud *cloud, const char *topic,
                          const uint8_t *json, size_t size, struct fault *fault)
{
    const int schema_id = mcap_add_schema(w, "foxglove.PointCloud", "jsonschema", schema, strlen(schema), fault);
    const int channel = schema_id > 0 ? mcap_add_channel_of(w, schema_id, topic, "json", fault) : -1;
    const struct mcap_message message = {
        .log_ns = cloud->t_unix_ns, .publish_ns = cloud->t_unix_ns, .data = json, .size = size};
    return channel >= 0 && mcap_write_message(w, channel, &message, fault);
}

bool point_cloud_capture(const struct point_cloud *cloud, const char *topic, const char *library, int fd,
                         struct fault *fault)
{
    size_t size = 0;
    struct fault more;
    uint8_t *json = point_cloud_message(cloud, &size, fault);
    if (!json) {
        close(fd);
        return false;
    }
    const struct mcap_options options = {.library = library,
                                         .compression = MCAP_ZSTD,
                                         .message_bytes = size > MCAP_MESSAGE_BYTES ? size : MCAP_MESSAGE_BYTES};
    struct mcap_writer *w = mcap_create(fd, &options, fault);
    bool ok = w && write_capture(w, cloud, topic, json, size, fault);
    if (w)
        ok = mcap_finish(w, ok ? fault : &more) && ok;
    free(json);
    return ok;
}
