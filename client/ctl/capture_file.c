/* SPDX-License-Identifier: MIT */
#include "capture_file.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdint.h>

#include "out_file.h"

#define INDEX_BYTES (16u << 20)

int capture_failed(const char *fmt, ...)
{
    va_list ap;
    va_start(ap, fmt);
    fputs("sonarctl capture: ", stderr);
    vfprintf(stderr, fmt, ap);
    fputc('\n', stderr);
    va_end(ap);
    return 1;
}

void capture_text(FILE *out, const char *text)
{
    for (; *text; text++) {
        if (*text >= ' ' && *text <= '~')
            fputc(*text, out);
        else
            fprintf(out, "\\x%02x", (unsigned char)*text);
    }
}

static void tell_problem(void *ctx, const char *sentence)
{
    fprintf(stderr, "%s: %s\n", (const char *)ctx, sentence);
}

struct mcap_reader *capture_open(const char *path)
{
    struct fault fault;
    struct mcap_reader *r = mcap_open(path, tell_problem, (void *)(uintptr_t)path, &fault);
    if (!r)
        capture_failed("%s", fault.text);
    return r;
}

struct mcap_writer *capture_create(const char *path, const char *profile, size_t message_bytes)
{
    const struct mcap_options options = {.library = "sonarctl " SONARD_VERSION,
                                         .profile = profile,
                                         .message_bytes = message_bytes,
                                         .index_bytes = INDEX_BYTES};
    struct fault fault;
    const int fd = out_file_create(path, false, &fault);
    if (fd < 0) {
        capture_failed("%s", fault.text);
        return NULL;
    }
    struct mcap_writer *w = mcap_create(fd, &options, &fault);
    if (!w) {
        out_file_drop(path);
        capture_failed("%s: %s", path, fault.text);
    }
    return w;
}

void capture_drop(struct mcap_writer *w, const char *path)
{
    struct fault ignored;
    mcap_finish(w, &ignored);
    out_file_drop(path);
}

int capture_finish(struct mcap_writer *w, const char *path, bool ok, struct fault *fault)
{
    if (!ok) {
        capture_drop(w, path);
        return capture_failed("%s: %s", path, fault->text);
    }
    if (mcap_finish(w, fault))
        return out_file_keep(path, false, fault) ? 0 : capture_failed("%s", fault->text);
    out_file_drop(path);
    return capture_failed("%s: %s", path, fault->text);
}

int capture_tell_exported(const char *path, const struct mcap_info *info)
{
    if (info->problems == 0 && info->complete)
        return 0;
    return capture_failed("%s: %s: what can be read is exported, %" PRIu64 " messages of %.1f s; %" PRIu64
                          " of %" PRIu64 " bytes are left out",
                          path, info->unclosed ? "still being written, or cut off" : "damaged", info->messages,
                          (double)(info->end_ns - info->start_ns) * 1e-9, info->left_out_bytes, info->file_bytes);
}
