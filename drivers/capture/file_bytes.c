/* SPDX-License-Identifier: MIT */
#include "file_bytes.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#define BLOCK_BYTES ((size_t)1 << 18)

enum block { BLOCK_AWAY, BLOCK_THERE, BLOCK_KEPT };

struct file_bytes {
    int fd;
    uint8_t *data; /* anonymous memory, which costs only what is read into it */
    size_t size;
    size_t dropped; /* blocks before it were given back */
    uint8_t *block; /* enum block of each */
    bool lost;
};

static size_t block_count(size_t size)
{
    return (size + BLOCK_BYTES - 1) / BLOCK_BYTES;
}

static struct file_bytes *new_bytes(int fd, size_t size)
{
    struct file_bytes *f = calloc(1, sizeof *f);
    if (!f)
        return NULL;
    void *data = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    uint8_t *block = calloc(block_count(size), 1);
    if (data == MAP_FAILED || !block) {
        if (data != MAP_FAILED)
            munmap(data, size);
        free(block);
        free(f);
        errno = ENOMEM;
        return NULL;
    }
    *f = (struct file_bytes){.fd = fd, .data = data, .size = size, .block = block};
    return f;
}

struct file_bytes *file_bytes_open(const char *path, struct fault *fault)
{
    struct stat st;
    struct file_bytes *f = NULL;
    const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0 || fstat(fd, &st) != 0)
        fault_set(fault, "%s: %s", path, strerror(errno));
    else if (!S_ISREG(st.st_mode) || st.st_size == 0)
        fault_set(fault, S_ISREG(st.st_mode) ? "%s: the file is empty" : "%s: not a file", path);
    else if ((uint64_t)st.st_size > SIZE_MAX / 2)
        fault_set(fault, "%s: too large for a processor of 32 bits", path);
    else if (!(f = new_bytes(fd, (size_t)st.st_size)))
        fault_set(fault, "%s: %s", path, strerror(errno));
    if (!f && fd >= 0)
        close(fd);
    return f;
}

const uint8_t *file_bytes_data(const struct file_bytes *f)
{
    return f->data;
}

size_t file_bytes_size(const struct file_bytes *f)
{
    return f->size;
}

static bool read_at(int fd, size_t from, uint8_t *out, size_t n)
{
    for (size_t done = 0; done < n;) {
        const ssize_t got = pread(fd, out + done, n - done, (off_t)(from + done));
        if (got == 0 || (got < 0 && errno != EINTR))
            return false;
        done += got > 0 ? (size_t)got : 0;
    }
    return true;
}

static bool need(struct file_bytes *f, size_t from, size_t to, enum block as)
{
    bool whole = true;
    for (size_t i = from / BLOCK_BYTES; i * BLOCK_BYTES < to; i++) {
        const size_t at = i * BLOCK_BYTES, n = f->size - at < BLOCK_BYTES ? f->size - at : BLOCK_BYTES;
        if (f->block[i] == BLOCK_AWAY)
            whole &= read_at(f->fd, at, f->data + at, n);
        if (f->block[i] < as)
            f->block[i] = (uint8_t)as;
    }
    f->lost |= !whole;
    return whole;
}

bool file_bytes_need(struct file_bytes *f, size_t from, size_t to)
{
    return need(f, from, to, BLOCK_THERE);
}

bool file_bytes_keep(struct file_bytes *f, size_t from, size_t to)
{
    return need(f, from, to, BLOCK_KEPT);
}

bool file_bytes_peek(struct file_bytes *f, size_t from, uint8_t *out, size_t n)
{
    if (from > f->size || n > f->size - from)
        return false;
    const bool there = read_at(f->fd, from, out, n);
    f->lost |= !there;
    return there;
}

bool file_bytes_lost(const struct file_bytes *f)
{
    return f->lost;
}

void file_bytes_drop(struct file_bytes *f, size_t to)
{
    for (; (f->dropped + 1) * BLOCK_BYTES <= to; f->dropped++) {
        uint8_t *block = &f->block[f->dropped];
        if (*block != BLOCK_THERE)
            continue;
        madvise(f->data + f->dropped * BLOCK_BYTES, BLOCK_BYTES, MADV_DONTNEED);
        *block = BLOCK_AWAY;
    }
}

void file_bytes_close(struct file_bytes *f)
{
    if (!f)
        return;
    munmap(f->data, f->size);
    close(f->fd);
    free(f->block);
    free(f);
}
