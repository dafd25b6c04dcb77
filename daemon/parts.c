/* SPDX-License-Identifier: MIT */
/*
 * parts - see the header. A part that cannot be continued (disk full, file or folder gone) is closed as well as
 * it goes; the next one is tried after PARTS_RETRY_NS.
 */
#include "parts.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "../drivers/mcap.h"

#define STAMP_SIZE    sizeof "YYYYmmddTHHMMSSZ"
#define NAME_ATTEMPTS 1000 /* parts of an earlier start in the same second */
#define TOPIC_MAX     96
#define FIRST_LETTERS "sonard-"
#define LAST_LETTERS  ".mcap"

struct topic {
    char topic[TOPIC_MAX], encoding[32];
    uint32_t sequence;
    int in_file; /* the channel's number in the open part */
};

struct parts {
    char *directory, *conf_text;
    size_t conf_size;
    uint64_t file_size, unix_offset_ns;
    int files;
    char stamp[STAMP_SIZE]; /* of the start */
    unsigned part;          /* number of the newest */
    struct topic topic[PARTS_CHANNELS_MAX];
    int n_topics;
    struct mcap_writer *file; /* NULL: recording stands still */
    uint64_t chunk_since_ns;  /* of the oldest message in the open chunk */
    uint64_t lost_in_file;    /* what was already counted of the file's losses */
    uint64_t retry_ns;
    struct parts_status status;
};

/* ---- old parts ---- */

/* A part in the folder, as far as its age goes. */
struct part {
    bool this_run;
    char stamp[STAMP_SIZE];
    unsigned number;
};

/* sonard-YYYYmmddTHHMMSSZ-NNN.mcap, exactly: nobody else's file is ever touched. */
static bool parse_name(const char *name, struct part *out)
{
    const char *stamp = name + strlen(FIRST_LETTERS);
    if (strncmp(name, FIRST_LETTERS, strlen(FIRST_LETTERS)) != 0)
        return false;
    for (size_t i = 0; i < STAMP_SIZE - 1; i++) {
        char c = stamp[i];
        if (i == 8 ? c != 'T' : i == STAMP_SIZE - 2 ? c != 'Z' : !isdigit((unsigned char)c))
            return false;
    }
    const char *number = stamp + STAMP_SIZE - 1;
    size_t digits = strspn(number + (*number == '-'), "0123456789");
    if (*number != '-' || digits < 3 || digits > 6 || strcmp(number + 1 + digits, LAST_LETTERS) != 0)
        return false;
    memcpy(out->stamp, stamp, STAMP_SIZE - 1);
    out->stamp[STAMP_SIZE - 1] = '\0';
    out->number = (unsigned)strtoul(number + 1, NULL, 10);
    return true;
}

/* A clock that was wrong at start-up must not make this run's parts the oldest. */
static bool older(const struct part *a, const struct part *b)
{
    if (a->this_run != b->this_run)
        return b->this_run;
    int order = strcmp(a->stamp, b->stamp);
    return order < 0 || (order == 0 && a->number < b->number);
}

/* One look through the folder: how many parts there are, and the name of the oldest. */
static int oldest_part(const struct parts *parts, char *name, size_t name_size)
{
    DIR *dir = opendir(parts->directory);
    struct part oldest = {0}, part = {0};
    int n = 0;
    if (!dir)
        return 0;
    for (struct dirent *entry; (entry = readdir(dir)) != NULL;) {
        if (!parse_name(entry->d_name, &part))
            continue;
        part.this_run = strcmp(part.stamp, parts->stamp) == 0;
        if (n++ == 0 || older(&part, &oldest)) {
            oldest = part;
            snprintf(name, name_size, "%s", entry->d_name);
        }
    }
    closedir(dir);
    return n;
}

static void note_error(struct parts *parts, const char *sentence)
{
    snprintf(parts->status.error, sizeof parts->status.error, "recording to %s: %s", parts->directory, sentence);
    parts->status.errors++;
}

static void remove_old_parts(struct parts *parts)
{
    char name[NAME_MAX + 1], path[PATH_MAX], why[128];
    while (parts->files > 0 && oldest_part(parts, name, sizeof name) > parts->files) {
        snprintf(path, sizeof path, "%s/%s", parts->directory, name);
        if (unlink(path) != 0) {
            snprintf(why, sizeof why, "removing an old part: %s", strerror(errno));
            note_error(parts, why);
            return;
        }
    }
}

/* ---- parts ---- */

/* The new name in the folder survives a power cut. */
static void sync_directory(const struct parts *parts)
{
    int fd = open(parts->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0)
        return;
    fsync(fd);
    close(fd);
}

/* A new file of the next free number; -1 with errno. */
static int create_file(struct parts *parts)
{
    int fd = -1;
    for (int i = 0; fd < 0 && i < NAME_ATTEMPTS; i++) {
        snprintf(parts->status.path, sizeof parts->status.path, "%s/" FIRST_LETTERS "%s-%03u" LAST_LETTERS,
                 parts->directory, parts->stamp, ++parts->part);
        fd = open(parts->status.path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
        if (fd < 0 && errno != EEXIST) {
            parts->part--;
            break;
        }
    }
    return fd;
}

static bool add_topic(struct parts *parts, struct topic *topic, char *err, size_t err_size)
{
    topic->in_file = mcap_add_channel(parts->file, topic->topic, topic->encoding, NULL, 0, err, err_size);
    return topic->in_file >= 0;
}

/* Begin the next part with channels and configuration. False with a sentence in err, and no part open. */
static bool begin_part(struct parts *parts, uint64_t now_ns, char *err, size_t err_size)
{
    const struct mcap_options options = {.library = "sonard " SONARD_VERSION,
                                         .message_bytes = PARTS_MESSAGE_BYTES};
    int fd = create_file(parts);
    if (fd < 0) {
        snprintf(err, err_size, "a new file: %s", strerror(errno));
        return false;
    }
    parts->file = mcap_create(fd, &options, err, err_size);
    bool ok = parts->file && mcap_attach(parts->file, "sonard.conf", "text/plain", parts->unix_offset_ns + now_ns,
                                         parts->conf_text, parts->conf_size, err, err_size);
    for (int i = 0; ok && i < parts->n_topics; i++)
        ok = add_topic(parts, &parts->topic[i], err, err_size);
    if (!ok) {
        char ignored[256];
        if (parts->file)
            mcap_finish(parts->file, ignored, sizeof ignored);
        parts->file = NULL;
        unlink(parts->status.path); /* it holds nothing */
        return false;
    }
    parts->lost_in_file = 0;
    parts->status.recording = true;
    parts->status.parts++;
    sync_directory(parts);
    remove_old_parts(parts);
    return true;
}

static void count_lost(struct parts *parts)
{
    uint64_t lost = mcap_written(parts->file).lost;
    parts->status.lost_messages += lost - parts->lost_in_file;
    parts->lost_in_file = lost;
}

/* Recording stands still from here on. */
static void stop(struct parts *parts, uint64_t now_ns, const char *why)
{
    char ignored[256];
    note_error(parts, why);
    if (parts->file) {
        count_lost(parts);
        mcap_finish(parts->file, ignored, sizeof ignored);
    }
    parts->file = NULL;
    parts->status.recording = false;
    parts->retry_ns = now_ns + PARTS_RETRY_NS;
}

static void start_part(struct parts *parts, uint64_t now_ns)
{
    char err[256];
    if (!begin_part(parts, now_ns, err, sizeof err))
        stop(parts, now_ns, err);
}

static void rotate(struct parts *parts, uint64_t now_ns)
{
    char err[256];
    uint64_t waiting = mcap_written(parts->file).waiting;
    bool ok = mcap_finish(parts->file, err, sizeof err);
    parts->file = NULL;
    if (ok) {
        start_part(parts, now_ns);
    } else {
        parts->status.lost_messages += waiting;
        stop(parts, now_ns, err);
    }
}

/* After a chunk was written: is the part still to be found, and is it large enough? */
static void look_after_part(struct parts *parts, uint64_t now_ns)
{
    struct stat st;
    struct mcap_written written = mcap_written(parts->file);
    int fd = mcap_fd(parts->file);
    sync_file_range(fd, 0, 0, SYNC_FILE_RANGE_WRITE);
    if (fstat(fd, &st) == 0 && st.st_nlink == 0)
        stop(parts, now_ns, "the file or the folder was removed");
    else if (written.bytes >= parts->file_size || written.full)
        rotate(parts, now_ns);
}

static void flush(struct parts *parts, uint64_t now_ns)
{
    char err[256];
    if (mcap_flush(parts->file, err, sizeof err))
        look_after_part(parts, now_ns);
    else
        stop(parts, now_ns, err);
}

/* ---- the writer ---- */

static bool copy_settings(struct parts *parts, const char *directory, const char *conf_text, size_t conf_size)
{
    parts->directory = strdup(directory);
    parts->conf_text = malloc(conf_size + 1);
    if (!parts->directory || !parts->conf_text)
        return false;
    if (conf_size)
        memcpy(parts->conf_text, conf_text, conf_size);
    parts->conf_size = conf_size;
    return true;
}

struct parts *parts_open(const char *directory, uint64_t file_size, int files, const char *conf_text,
                         size_t conf_size, uint64_t unix_offset_ns, uint64_t now_ns, char *err, size_t err_size)
{
    struct parts *parts = calloc(1, sizeof *parts);
    if (!parts || !copy_settings(parts, directory, conf_text, conf_size)) {
        snprintf(err, err_size, "recording: out of memory");
        parts_close(parts);
        return NULL;
    }
    parts->file_size = file_size;
    parts->files = files;
    parts->unix_offset_ns = unix_offset_ns;
    time_t start = (time_t)((unix_offset_ns + now_ns) / 1000000000u);
    struct tm utc;
    if (!gmtime_r(&start, &utc) || strftime(parts->stamp, sizeof parts->stamp, "%Y%m%dT%H%M%SZ", &utc) == 0)
        snprintf(parts->stamp, sizeof parts->stamp, "00000000T000000Z");

    char why[256];
    if (mkdir(directory, 0750) != 0 && errno != EEXIST)
        snprintf(err, err_size, "recording to %s: making the folder: %s", directory, strerror(errno));
    else if (begin_part(parts, now_ns, why, sizeof why))
        return parts;
    else
        snprintf(err, err_size, "recording to %s: %s", directory, why);
    parts_close(parts);
    return NULL;
}

int parts_channel(struct parts *parts, const char *topic, const char *encoding)
{
    struct topic *t = &parts->topic[parts->n_topics];
    char err[256];
    if (parts->n_topics == PARTS_CHANNELS_MAX || strlen(topic) >= sizeof t->topic ||
        strlen(encoding) >= sizeof t->encoding)
        return -1;
    snprintf(t->topic, sizeof t->topic, "%s", topic);
    snprintf(t->encoding, sizeof t->encoding, "%s", encoding);
    t->sequence = 0;
    parts->n_topics++;
    if (parts->file && !add_topic(parts, t, err, sizeof err))
        stop(parts, 0, err);
    return parts->n_topics - 1;
}

bool parts_message(struct parts *parts, int channel, uint64_t t_ns, const void *data, size_t n)
{
    char err[256];
    parts->status.messages++;
    if (!parts->file || channel < 0 || channel >= parts->n_topics || n > PARTS_MESSAGE_BYTES) {
        parts->status.lost_messages++;
        return false;
    }
    struct topic *topic = &parts->topic[channel];
    struct mcap_written before = mcap_written(parts->file);
    uint64_t log_ns = parts->unix_offset_ns + t_ns;
    bool ok = mcap_write_message(parts->file, topic->in_file, topic->sequence++, log_ns, log_ns, data, n, err,
                                 sizeof err);
    struct mcap_written after = mcap_written(parts->file);
    if (!ok) {
        if (after.lost - before.lost <= before.waiting)
            parts->status.lost_messages++; /* it did not get into the chunk that was lost */
        stop(parts, t_ns, err);
        return false;
    }
    if (after.waiting == 1)
        parts->chunk_since_ns = t_ns;
    if (after.chunks > before.chunks)
        look_after_part(parts, t_ns);
    return true;
}

void parts_tick(struct parts *parts, uint64_t now_ns)
{
    if (!parts->file) {
        if (now_ns >= parts->retry_ns)
            start_part(parts, now_ns);
    } else if (mcap_written(parts->file).waiting > 0 && now_ns >= parts->chunk_since_ns + PARTS_CHUNK_AGE_NS) {
        flush(parts, now_ns);
    }
}

const struct parts_status *parts_status(const struct parts *parts)
{
    return &parts->status;
}

void parts_close(struct parts *parts)
{
    char err[256];
    if (!parts)
        return;
    if (parts->file && !mcap_finish(parts->file, err, sizeof err))
        note_error(parts, err);
    free(parts->directory);
    free(parts->conf_text);
    free(parts);
}
