/* SPDX-License-Identifier: MIT */
/* template_file - see template_file.h. */
#include "template_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "core/atomic_file.h"

#define MAGIC        "SONARDBG"
#define MAGIC_BYTES  8
#define VERSION      1
#define HEADER_BYTES 48
#define CHECK_BYTES  4
#define FILE_MAX     (HEADER_BYTES + BACKGROUND_ROWS_MAX * (1 + (size_t)PING_MAX_BINS) + CHECK_BYTES)

/* ---- bytes ---- */

static void put_u32(uint8_t *at, uint32_t v)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(v >> (8 * i));
}

static uint32_t get_u32(const uint8_t *at)
{
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static void put_float(uint8_t *at, float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    put_u32(at, bits);
}

static float get_float(const uint8_t *at)
{
    uint32_t bits = get_u32(at);
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static size_t file_size(const struct background_shape *s)
{
    return HEADER_BYTES + s->rows + (size_t)s->rows * s->bins + CHECK_BYTES;
}

uint8_t *template_encode(const struct background *b, size_t *size)
{
    const struct background_shape *s = &b->shape;
    *size = file_size(s);
    uint8_t *bytes = malloc(*size);
    if (!bytes)
        return NULL;
    memcpy(bytes, MAGIC, MAGIC_BYTES);
    put_u32(bytes + 8, VERSION);
    put_u32(bytes + 12, s->head_turn);
    put_u32(bytes + 16, s->rows);
    put_u32(bytes + 20, s->bins);
    put_float(bytes + 24, s->r0_m);
    put_float(bytes + 28, s->dr_m);
    put_float(bytes + 32, s->az0_rad);
    put_float(bytes + 36, s->row_rad);
    put_float(bytes + 40, s->db_per_count);
    put_u32(bytes + 44, s->law);
    memcpy(bytes + HEADER_BYTES, b->learnt, s->rows);
    memcpy(bytes + HEADER_BYTES + s->rows, b->level, (size_t)s->rows * s->bins);
    put_u32(bytes + *size - CHECK_BYTES, (uint32_t)crc32(0, bytes, (uInt)(*size - CHECK_BYTES)));
    return bytes;
}

static bool header_good(const uint8_t *bytes, size_t size, struct background_shape *s)
{
    if (size < HEADER_BYTES + CHECK_BYTES || get_u32(bytes + 44) > AMPLITUDE_LOG)
        return false;
    *s = (struct background_shape){.head_turn = get_u32(bytes + 12),
                                   .rows = get_u32(bytes + 16),
                                   .bins = get_u32(bytes + 20),
                                   .r0_m = get_float(bytes + 24),
                                   .dr_m = get_float(bytes + 28),
                                   .az0_rad = get_float(bytes + 32),
                                   .row_rad = get_float(bytes + 36),
                                   .db_per_count = get_float(bytes + 40),
                                   .law = (uint8_t)get_u32(bytes + 44)};
    return background_shape_good(s) && size == file_size(s) &&
           crc32(0, bytes, (uInt)(size - CHECK_BYTES)) == get_u32(bytes + size - CHECK_BYTES);
}

/* A row that was not learnt says nothing. */
static bool rows_good(const struct background *b)
{
    for (uint32_t row = 0; row < b->shape.rows; row++) {
        uint8_t any = 0;
        for (uint32_t i = 0; i < b->shape.bins; i++)
            any |= b->level[(size_t)row * b->shape.bins + i];
        if (b->learnt[row] > BACKGROUND_LEARNT_MAX || (any && !b->learnt[row]))
            return false;
    }
    return true;
}

struct background *template_decode(const uint8_t *bytes, size_t size, uint8_t mask_above,
                                   enum template_fault *kind, struct fault *fault)
{
    struct background_shape s;
    if (size < MAGIC_BYTES + 4 || memcmp(bytes, MAGIC, MAGIC_BYTES) != 0 || get_u32(bytes + 8) != VERSION) {
        *kind = TEMPLATE_FOREIGN;
        fault_set(fault, "not a background template of version %d", VERSION);
        return NULL;
    }
    *kind = TEMPLATE_DAMAGED;
    fault_set(fault, "the background template is damaged");
    if (!header_good(bytes, size, &s))
        return NULL;
    void *mem = malloc(background_size(&s));
    if (!mem) {
        *kind = TEMPLATE_UNREAD;
        fault_set(fault, "out of memory");
        return NULL;
    }
    struct background *b = background_init(mem, &s, mask_above);
    memcpy(b->learnt, bytes + HEADER_BYTES, s.rows);
    memcpy(b->level, bytes + HEADER_BYTES + s.rows, (size_t)s.rows * s.bins);
    if (!rows_good(b)) {
        free(b);
        return NULL;
    }
    *kind = TEMPLATE_GOOD;
    return b;
}

/* ---- files ---- */

bool template_write(const uint8_t *bytes, size_t size, const char *path, struct fault *fault)
{
    return atomic_file_replace(path, bytes, size, MAGIC_BYTES, fault);
}

struct background *template_load(const char *path, uint8_t mask_above, enum template_fault *kind,
                                 struct fault *fault)
{
    struct fault why;
    size_t size;
    uint8_t *bytes = atomic_file_read(path, FILE_MAX, &size);
    if (!bytes) {
        *kind = errno == ENOENT ? TEMPLATE_MISSING : TEMPLATE_UNREAD;
        fault_set(fault, "%s: %s", path, strerror(errno));
        return NULL;
    }
    struct background *b = template_decode(bytes, size, mask_above, kind, &why);
    free(bytes);
    if (b)
        return b;
    fault_set(fault, "%s: %s", path, why.text);
    if (*kind == TEMPLATE_DAMAGED)
        atomic_file_set_aside(path, fault);
    return NULL;
}
