/* SPDX-License-Identifier: MIT */
/*
 * fuzz_candump - any text as a log of candump: every frame that comes out is one that a kernel could have handed out.
 */
#include <stdlib.h>
#include <string.h>

#include "drivers/capture/candump.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile uint64_t sink;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *text = (const char *)data, *end = text + size;
    while (text < end) {
        const char *newline = memchr(text, '\n', (size_t)(end - text));
        size_t n = (size_t)((newline ? newline : end) - text);
        struct candump_frame f;
        struct canfd_frame read;
        if (candump_line(text, n, &f)) {
            if (!can_frame_read((const uint8_t *)&f.frame, f.n, &read) ||
                memcmp(&read, &f.frame, sizeof read) != 0 || strlen(f.name) == 0 || strlen(f.name) >= IFNAMSIZ)
                abort();
            sink = sink + f.t_ns + f.frame.can_id;
        }
        text += n + 1;
    }
    return 0;
}
