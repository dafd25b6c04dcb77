/* SPDX-License-Identifier: MIT */
/* template_file - see template_file.h. */
#include "template_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#define MAGIC        "SONARDBG"
#define MAGIC_BYTES  8
#define VERSION      1
#define HEADER_BYTES 48
#define CHECK_BYTES  4
#define FILE_MAX     (HEADER_BYTES + BACKGROUND_ROWS_MAX * (1 + (size_t)PING_MAX_BINS) + CHECK_BYTES)
#define PATH_ROOM    320

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
                                   enum template_fault *fault, char *err, size_t err_size)
{
    struct background_shape s;
    if (size < MAGIC_BYTES + 4 || memcmp(bytes, MAGIC, MAGIC_BYTES) != 0 || get_u32(bytes + 8) != VERSION) {
        *fault = TEMPLATE_FOREIGN;
        snprintf(err, err_size, "not a background template of version %d", VERSION);
        return NULL;
    }
    *fault = TEMPLATE_DAMAGED;
    snprintf(err, err_size, "the background template is damaged");
    if (!header_good(bytes, size, &s))
        return NULL;
    void *mem = malloc(background_size(&s));
    if (!mem) {
        *fault = TEMPLATE_UNREAD;
        snprintf(err, err_size, "out of memory");
        return NULL;
    }
    struct background *b = background_init(mem, &s, mask_above);
    memcpy(b->learnt, bytes + HEADER_BYTES, s.rows);
    memcpy(b->level, bytes + HEADER_BYTES + s.rows, (size_t)s.rows * s.bins);
    if (!rows_good(b)) {
        free(b);
        return NULL;
    }
    *fault = TEMPLATE_GOOD;
    return b;
}

/* ---- files ---- */

/* All of a regular file of at most FILE_MAX bytes, one more where it is longer; NULL with errno. */
static uint8_t *read_all(const char *path, size_t *size)
{
    int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    struct stat st;
    uint8_t *bytes = NULL;
    *size = 0;
    if (fd < 0)
        return NULL;
    if (fstat(fd, &st) == 0 && !S_ISREG(st.st_mode))
        errno = EINVAL;
    else
        bytes = malloc(FILE_MAX + 1);
    for (ssize_t n = 1; bytes && n > 0 && *size <= FILE_MAX; *size += n > 0 ? (size_t)n : 0) {
        n = read(fd, bytes + *size, FILE_MAX + 1 - *size);
        if (n < 0) {
            free(bytes);
            bytes = NULL;
        }
    }
    close(fd);
    return bytes;
}

static bool write_all(int fd, const uint8_t *bytes, size_t size)
{
    for (size_t done = 0; done < size;) {
        ssize_t n = write(fd, bytes + done, size - done);
        if (n < 0 && errno != EINTR)
            return false;
        done += n > 0 ? (size_t)n : 0;
    }
    return fsync(fd) == 0;
}

/* The name itself must be on the disk as well. */
static bool sync_folder(const char *path)
{
    char folder[PATH_ROOM];
    snprintf(folder, sizeof folder, "%s", path);
    char *slash = strrchr(folder, '/');
    if (!slash)
        return true;
    slash[slash == folder] = '\0';
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool ok = fd >= 0 && fsync(fd) == 0;
    if (fd >= 0)
        close(fd);
    return ok;
}

/* Nobody's own file is lost to a wrong path in the configuration. */
static bool may_replace(const char *path)
{
    size_t size;
    uint8_t *old = read_all(path, &size);
    bool may = old ? size >= MAGIC_BYTES && memcmp(old, MAGIC, MAGIC_BYTES) == 0 : errno == ENOENT;
    free(old);
    return may;
}

bool template_save(const struct background *background, const char *path, char *err, size_t err_size)
{
    char beside[PATH_ROOM];
    size_t size;
    if (!may_replace(path)) {
        snprintf(err, err_size, "%s: something is there that is not a background template", path);
        return false;
    }
    snprintf(beside, sizeof beside, "%s.new", path);
    uint8_t *bytes = template_encode(background, &size);
    int fd = bytes ? open(beside, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644) : -1;
    bool ok = fd >= 0 && write_all(fd, bytes, size);
    int fault = errno;
    if (fd >= 0)
        close(fd);
    if (ok && (rename(beside, path) != 0 || !sync_folder(path))) {
        fault = errno;
        ok = false;
    }
    if (!ok) {
        snprintf(err, err_size, "%s: %s", path, strerror(fault));
        if (fd >= 0)
            unlink(beside);
    }
    free(bytes);
    return ok;
}

struct background *template_load(const char *path, uint8_t mask_above, enum template_fault *fault, char *err,
                                 size_t err_size)
{
    char why[160], aside[PATH_ROOM];
    size_t size;
    uint8_t *bytes = read_all(path, &size);
    if (!bytes) {
        *fault = errno == ENOENT ? TEMPLATE_MISSING : TEMPLATE_UNREAD;
        snprintf(err, err_size, "%s: %s", path, strerror(errno));
        return NULL;
    }
    struct background *b = template_decode(bytes, size, mask_above, fault, why, sizeof why);
    free(bytes);
    if (b)
        return b;
    snprintf(aside, sizeof aside, "%s.damaged", path);
    if (*fault == TEMPLATE_DAMAGED && rename(path, aside) == 0)
        snprintf(err, err_size, "%s: %s; it is now %s", path, why, aside);
    else
        snprintf(err, err_size, "%s: %s", path, why);
    return NULL;
}
