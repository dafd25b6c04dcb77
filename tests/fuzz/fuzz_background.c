/* SPDX-License-Identifier: MIT */
/*
 * fuzz_background - any bytes as a template's file, as they are and with the checksum put right: what is accepted is
 * within its limits, becomes the same bytes again, and can be laid over a ping of any range.
 */
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "core/fault.h"
#include "daemon/background/template_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define BINS 700

static void must(bool fact)
{
    if (!fact)
        abort();
}

static void lay_over(const struct background *b)
{
    static uint8_t level[PING_MAX_BEAMS * BINS], blind[PING_MAX_BEAMS * BINS];
    static struct ping_beam beam[PING_MAX_BEAMS];
    const struct background_view view = {level, blind};
    struct ping p = {.kind = PING_PROFILE,
                     .law = b->shape.law,
                     .db_per_count = b->shape.db_per_count,
                     .sample_bytes = 1,
                     .n_beams = (uint16_t)(b->shape.head_turn ? 1 : b->shape.rows),
                     .n_bins = BINS,
                     .r0_m = 0.1f,
                     .dr_m = 0.017f,
                     .pulse_m = 0.05f,
                     .head_units = b->shape.head_turn / 3,
                     .head_turn = b->shape.head_turn,
                     .beam = beam};
    bool any;
    background_view(b, &p, &view, &any);
}

static void try(const uint8_t *data, size_t size)
{
    enum template_fault kind;
    struct fault fault;
    size_t again_size;
    struct background *b = template_decode(data, size, 64, &kind, &fault);
    must((b != NULL) == (kind == TEMPLATE_GOOD));
    if (!b)
        return;
    must(background_shape_good(&b->shape));
    uint8_t *again = template_encode(b, &again_size);
    must(again && again_size == size && memcmp(again, data, size) == 0);
    lay_over(b);
    free(again);
    free(b);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    try(data, size);
    if (size < 4)
        return 0;
    uint8_t *good = malloc(size);
    must(good != NULL);
    memcpy(good, data, size);
    uint32_t sum = (uint32_t)crc32(0, good, (uInt)(size - 4));
    for (int i = 0; i < 4; i++)
        good[size - 4 + (size_t)i] = (uint8_t)(sum >> (8 * i));
    try(good, size);
    free(good);
    return 0;
}
