/* SPDX-License-Identifier: MIT */
/*
 * mavlink_pipe - our MAVLink on a pipe, for tests against other implementations:
 *
 *   mavlink_pipe list           every message of the tables: a line with its number and the names of its fields
 *   mavlink_pipe write [KEY]    every message of the tables once, as frames of system 1, component 196
 *   mavlink_pipe read [KEY]     frames from standard input: a line for each, then the counters
 *
 * KEY is 64 hexadecimal digits. Element k of a field holds (sum of the bytes of its name) % 100 + k; floats 0.25 more,
 * integers of 64 bits 2^40 more, characters 'A' plus the remainder by 26. Read holds frames against the same rule.
 */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "client/mavlink/mavlink_frame.h"

union content {
    uint64_t align;
    char bytes[256];
};

static void put_element(const struct mavlink_field *field, unsigned k, char *to)
{
    unsigned value = 0;
    for (const char *c = field->name; *c; c++)
        value += (unsigned char)*c;
    value = value % 100 + k;

    const float real = (float)value + 0.25f;
    const uint64_t big = (1ull << 40) + value;
    const uint32_t word = value;
    const uint16_t half = (uint16_t)value;
    const uint8_t byte = (uint8_t)(field->type == MAVLINK_CHAR ? 'A' + value % 26 : value);

    switch (field->type) {
    case MAVLINK_F32:
        memcpy(to, &real, sizeof real);
        break;
    case MAVLINK_U64:
    case MAVLINK_I64:
        memcpy(to, &big, sizeof big);
        break;
    case MAVLINK_I32:
    case MAVLINK_U32:
        memcpy(to, &word, sizeof word);
        break;
    case MAVLINK_U16:
    case MAVLINK_I16:
        memcpy(to, &half, sizeof half);
        break;
    case MAVLINK_U8:
    case MAVLINK_CHAR:
        memcpy(to, &byte, sizeof byte);
        break;
    }
}

static void fill(const struct mavlink_message *message, union content *content)
{
    memset(content, 0, sizeof *content);
    for (const struct mavlink_field *f = message->fields; f->name; f++)
        for (unsigned k = 0; k < (f->count ? f->count : 1u); k++)
            put_element(f, k, content->bytes + f->member + k * mavlink_type_size(f->type));
}

static int list_all(void)
{
    for (size_t i = 0; i < mavlink_message_count; i++) {
        printf("%u", (unsigned)mavlink_messages[i].id);
        for (const struct mavlink_field *f = mavlink_messages[i].fields; f->name; f++)
            printf(" %s", f->name);
        printf("\n");
    }
    return fflush(stdout) == 0 ? 0 : 1;
}

static int write_all(struct mavlink_signing *signing)
{
    struct mavlink_sender sender = {.system_id = 1, .component_id = 196, .signing = signing};
    for (size_t i = 0; i < mavlink_message_count; i++) {
        uint8_t frame[MAVLINK_FRAME_MAX];
        union content content;
        fill(&mavlink_messages[i], &content);
        fwrite(frame, 1, mavlink_build(&sender, &mavlink_messages[i], &content, frame), stdout);
    }
    return fflush(stdout) == 0 ? 0 : 1;
}

static int read_all(struct mavlink_signing *signing)
{
    struct mavlink_parser parser = {.signing = signing};
    const struct mavlink_counters *c = &parser.counters;
    uint8_t buffer[512];
    size_t n;
    while ((n = fread(buffer, 1, sizeof buffer, stdin)) > 0) {
        const uint8_t *bytes = buffer;
        struct mavlink_frame frame;
        while (mavlink_parser_next(&parser, &bytes, &n, &frame)) {
            union content got = {0}, want;
            mavlink_unpack(frame.message, frame.payload, got.bytes);
            fill(frame.message, &want);
            printf("%s %s version %d from %d/%d\n", memcmp(&got, &want, sizeof got) == 0 ? "good" : "wrong",
                   frame.message->name, frame.version, frame.system_id, frame.component_id);
        }
    }
    printf("frames %" PRIu64 " unknown %" PRIu64 " bad_crc %" PRIu64 " bad_signature %" PRIu64 " garbage %" PRIu64
           "\n",
           c->frames, c->unknown, c->bad_crc, c->bad_signature, c->garbage_bytes);
    return 0;
}

int main(int argc, char **argv)
{
    struct mavlink_signing signing = {.link_id = 5};
    struct timespec now;
    if (argc == 2 && strcmp(argv[1], "list") == 0)
        return list_all();
    clock_gettime(CLOCK_REALTIME, &now);
    mavlink_signing_clock(&signing, (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u);
    if (argc == 2 || (argc == 3 && mavlink_signing_key(&signing, argv[2]))) {
        if (strcmp(argv[1], "write") == 0)
            return write_all(argc == 3 ? &signing : NULL);
        if (strcmp(argv[1], "read") == 0)
            return read_all(argc == 3 ? &signing : NULL);
    }
    fprintf(stderr, "usage: mavlink_pipe list, or write|read [KEY of 64 hexadecimal digits]\n");
    return 2;
}
