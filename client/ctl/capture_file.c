/* SPDX-License-Identifier: MIT */
#include "capture_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

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
    int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (fd < 0) {
        const int why = errno;
        capture_failed("%s: %s%s", path, strerror(why), why == EEXIST ? "; remove it first, or name another" : "");
        return NULL;
    }
    struct mcap_writer *w = mcap_create(fd, &options, &fault);
    if (!w) {
        unlink(path);
        capture_failed("%s: %s", path, fault.text);
    }
    return w;
}

int capture_finish(struct mcap_writer *w, const char *path, bool ok, struct fault *fault)
{
    struct fault ignored;
    if (ok)
        ok = mcap_finish(w, fault);
    else
        mcap_finish(w, &ignored);
    if (ok)
        return 0;
    unlink(path);
    return capture_failed("%s: %s", path, fault->text);
}
