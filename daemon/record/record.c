/* SPDX-License-Identifier: MIT */
#include "record.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "core/log.h"
#include "core/loop.h"
#include "core/ring.h"
#include "core/snapshot.h"

#define BLOCKS      64
#define BLOCK_BYTES (2u * SEGMENTS_MESSAGE_BYTES)
#define NO_BLOCK    UINT32_MAX
#define TICK_MS     250

/* A message, or the configuration that is in force, or that from here on nothing is kept, or all is again. Not told by
 * the channel: -1 is that of a topic that was refused. */
enum kind { MESSAGE, CONF, PAUSE, GO_ON };

/* What stands before the bytes of each message in a block. */
struct entry {
    struct record_time then;
    int32_t channel;
    uint32_t n;
    enum kind kind;
};

struct block {
    uint32_t used;
    uint8_t bytes[BLOCK_BYTES];
};

struct record {
    /* the loop's */
    uint32_t filling; /* the block that messages go to, or NO_BLOCK */
    uint64_t messages, overflows, taken_bytes;
    uint64_t messages_before; /* the present recording ... */
    uint64_t since_ns;        /* ... which was asked for then; 0: none was */
    int conf_channel;
    bool paused, told; /* as asked for, and as the thread was told in order with the messages */

    /* the thread's, once it runs */
    struct segments *segments;
    pthread_t thread;
    bool started;

    /* between them: indices of blocks */
    struct ring idle, ready;
    struct block *block;
    int wake_fd, end_fd;
    _Atomic bool ending;
    _Atomic bool left; /* by record_close, for want of patience, or by the writer: the second of them releases */
    _Atomic uint64_t written_bytes;
    SNAPSHOT_OF(struct segments_status) status;
};

/* ---- the thread ---- */

static void write_block(struct record *rec, const struct block *block)
{
    for (uint32_t at = 0; at < block->used;) {
        struct entry e;
        memcpy(&e, block->bytes + at, sizeof e);
        const uint8_t *bytes = block->bytes + at + sizeof e;
        if (e.kind == PAUSE || e.kind == GO_ON)
            segments_pause(rec->segments, e.kind == PAUSE, e.then.t_ns);
        if (e.kind == CONF)
            segments_conf(rec->segments, (const char *)bytes, e.n);
        if (e.kind == CONF || e.kind == MESSAGE)
            segments_message(rec->segments, e.channel, &e.then, bytes, e.n);
        at += (uint32_t)sizeof e + e.n;
    }
    atomic_fetch_add_explicit(&rec->written_bytes, block->used, memory_order_relaxed);
}

static void publish(struct record *rec)
{
    snapshot_publish(&rec->status, segments_status(rec->segments));
}

static void release(struct record *rec);

static void *writer(void *ctx)
{
    struct record *rec = ctx;
    uint64_t one = 1;
    for (bool ending = false; !ending;) {
        struct pollfd wake = {.fd = rec->wake_fd, .events = POLLIN};
        uint64_t count;
        uint32_t i;
        poll(&wake, 1, TICK_MS);
        (void)!read(rec->wake_fd, &count, sizeof count);
        ending = atomic_load_explicit(&rec->ending, memory_order_acquire);
        while (ring_take(&rec->ready, &i)) {
            write_block(rec, &rec->block[i]);
            ring_put(&rec->idle, i);
        }
        segments_tick(rec->segments, loop_clock());
        publish(rec);
    }
    segments_close(rec->segments);
    rec->segments = NULL;
    (void)!write(rec->end_fd, &one, sizeof one);
    if (atomic_exchange(&rec->left, true))
        release(rec);
    return NULL;
}

/* ---- the loop ---- */

static void hand_over(struct record *rec)
{
    uint64_t one = 1;
    if (rec->filling == NO_BLOCK)
        return;
    ring_put(&rec->ready, rec->filling);
    rec->filling = NO_BLOCK;
    (void)!write(rec->wake_fd, &one, sizeof one);
}

/* A block with room for so many bytes; NULL: all wait for the disk. */
static struct block *block_for(struct record *rec, size_t bytes)
{
    if (rec->filling != NO_BLOCK && rec->block[rec->filling].used + bytes > BLOCK_BYTES)
        hand_over(rec);
    if (rec->filling == NO_BLOCK) {
        if (!ring_take(&rec->idle, &rec->filling))
            return NULL;
        rec->block[rec->filling].used = 0;
    }
    return &rec->block[rec->filling];
}

/* False: there is no room for it yet, and messages that come are lost. */
static bool tell(struct record *rec)
{
    const uint64_t now_ns = loop_clock();
    const struct entry e = {.then = {now_ns, now_ns}, .kind = rec->paused ? PAUSE : GO_ON};
    struct block *block = rec->told == rec->paused ? NULL : block_for(rec, sizeof e);
    if (!block)
        return rec->told == rec->paused;
    memcpy(block->bytes + block->used, &e, sizeof e);
    block->used += (uint32_t)sizeof e;
    rec->taken_bytes += sizeof e;
    rec->told = rec->paused;
    return true;
}

bool record_message(struct record *rec, int channel, uint64_t t_ns, const void *data, size_t n)
{
    return record_message_of(rec, channel, &(struct record_time){t_ns, t_ns}, data, n);
}

/* In order with what was told before. False: there is no room. */
static bool put(struct record *rec, const struct entry *e, const void *data)
{
    struct block *block = tell(rec) && e->n <= SEGMENTS_MESSAGE_BYTES ? block_for(rec, sizeof *e + e->n) : NULL;
    if (!block) {
        rec->overflows++;
        return false;
    }
    memcpy(block->bytes + block->used, e, sizeof *e);
    memcpy(block->bytes + block->used + sizeof *e, data, e->n);
    block->used += (uint32_t)(sizeof *e + e->n);
    rec->taken_bytes += sizeof *e + e->n;
    if (ring_count(&rec->ready) == 0) /* otherwise the thread is busy: in company it costs less */
        hand_over(rec);
    return true;
}

bool record_message_of(struct record *rec, int channel, const struct record_time *then, const void *data, size_t n)
{
    if (rec->paused)
        return true;
    rec->messages++;
    return put(rec, &(struct entry){.then = *then, .channel = channel, .n = (uint32_t)n}, data);
}

bool record_conf(struct record *rec, uint64_t t_ns, const char *text, size_t n)
{
    rec->messages += !rec->paused;
    return put(rec,
               &(struct entry){.then = {t_ns, t_ns}, .channel = rec->conf_channel, .n = (uint32_t)n, .kind = CONF},
               text);
}

void record_tick(struct record *rec)
{
    tell(rec);
    hand_over(rec);
}

void record_pause(struct record *rec, bool paused, uint64_t now_ns)
{
    if (rec->paused && !paused) {
        rec->messages_before = rec->messages;
        rec->since_ns = now_ns;
    }
    rec->paused = paused;
    tell(rec);
    hand_over(rec);
}

bool record_paused(const struct record *rec)
{
    return rec->paused;
}

void record_status(struct record *rec, struct record_status *out)
{
    snapshot_read(&rec->status, &out->segments);
    out->overflows = rec->overflows;
    out->since_ns = rec->since_ns;
    out->segments.messages = rec->messages;
    out->messages_here = rec->messages - rec->messages_before;
    out->segments.lost_messages += rec->overflows;
    out->waiting_bytes = rec->taken_bytes - atomic_load_explicit(&rec->written_bytes, memory_order_relaxed);
}

/* ---- life ---- */

static void release(struct record *rec)
{
    segments_close(rec->segments);
    if (rec->wake_fd >= 0)
        close(rec->wake_fd);
    if (rec->end_fd >= 0)
        close(rec->end_fd);
    free(rec->block);
    free(rec);
}

static bool make_blocks(struct record *rec)
{
    rec->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    rec->end_fd = eventfd(0, EFD_CLOEXEC);
    rec->block = malloc(BLOCKS * sizeof *rec->block);
    if (rec->wake_fd < 0 || rec->end_fd < 0 || !rec->block)
        return false;
    /* No page of it faults later. Not with zeros: a compiler may make calloc of malloc and that,
     * which touches nothing. */
    memset(rec->block, 0xff, BLOCKS * sizeof *rec->block);
    ring_init(&rec->idle, BLOCKS, 0);
    ring_init(&rec->ready, BLOCKS, 0);
    for (uint32_t i = 0; i < BLOCKS; i++)
        ring_put(&rec->idle, i);
    rec->filling = NO_BLOCK;
    return true;
}

struct record *record_open(const struct segments_conf *conf, uint64_t now_ns, struct fault *fault)
{
    struct record *rec = aligned_alloc(RING_CACHE_LINE, sizeof *rec);
    if (!rec) {
        fault_set(fault, "recording: out of memory");
        return NULL;
    }
    memset(rec, 0, sizeof *rec);
    if (!make_blocks(rec))
        fault_set(fault, "recording: %s", strerror(errno));
    else
        rec->segments = segments_open(conf, now_ns, fault);
    if (!rec->segments) {
        release(rec);
        return NULL;
    }
    rec->conf_channel = segments_channel(rec->segments, RECORD_CONF_TOPIC, "text");
    rec->paused = rec->told = conf->paused;
    rec->since_ns = conf->paused ? 0 : now_ns;
    publish(rec);
    return rec;
}

int record_channel(struct record *rec, const char *topic, const char *encoding)
{
    return segments_channel(rec->segments, topic, encoding);
}

bool record_start(struct record *rec, struct fault *fault)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    int cause = pthread_create(&rec->thread, NULL, writer, rec);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    rec->started = cause == 0;
    if (cause != 0)
        fault_set(fault, "recording: cannot start: %s", strerror(cause));
    return rec->started;
}

/* What a stalled disk holds up is left to the writer, memory and all. */
void record_close(struct record *rec, int patience_ms)
{
    uint64_t one = 1;
    if (!rec)
        return;
    if (rec->started) {
        hand_over(rec);
        atomic_store_explicit(&rec->ending, true, memory_order_release);
        (void)!write(rec->wake_fd, &one, sizeof one);
        struct pollfd end = {.fd = rec->end_fd, .events = POLLIN};
        const bool stalled = poll(&end, 1, patience_ms) == 0;
        const pthread_t thread = rec->thread;
        if (stalled && !atomic_exchange(&rec->left, true)) {
            log_line(LOG_ERR, "record_failed",
                     "recording: the disk does not respond; unwritten messages are lost");
            pthread_detach(thread);
            return;
        }
        pthread_join(thread, NULL);
    }
    release(rec);
}
