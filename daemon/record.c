/* SPDX-License-Identifier: MIT */
/*
 * record - see the header. A part that cannot be continued (disk full, file or folder gone) is closed as well as
 * it goes; the next one is tried after RECORD_RETRY_NS.
 */
#include "record.h"

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

struct record_topic {
    char topic[TOPIC_MAX], encoding[32];
    uint32_t sequence;
    int in_file; /* the channel's number in the open part */
};

struct record {
    char *directory, *conf_text;
    size_t conf_size;
    uint64_t file_size, unix_offset_ns;
    int files;
    char stamp[STAMP_SIZE]; /* of the start */
    unsigned part;          /* number of the newest */
    struct record_topic topic[RECORD_CHANNELS_MAX];
    int n_topics;
    struct mcap_writer *file; /* NULL: recording stands still */
    uint64_t chunk_since_ns;  /* of the oldest message in the open chunk */
    uint64_t lost_in_file;    /* what was already counted of the file's losses */
    uint64_t retry_ns;
    struct record_status status;
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
static int oldest_part(const struct record *rec, char *name, size_t name_size)
{
    DIR *dir = opendir(rec->directory);
    struct part oldest = {0}, part = {0};
    int n = 0;
    if (!dir)
        return 0;
    for (struct dirent *entry; (entry = readdir(dir)) != NULL;) {
        if (!parse_name(entry->d_name, &part))
            continue;
        part.this_run = strcmp(part.stamp, rec->stamp) == 0;
        if (n++ == 0 || older(&part, &oldest)) {
            oldest = part;
            snprintf(name, name_size, "%s", entry->d_name);
        }
    }
    closedir(dir);
    return n;
}

static void note_error(struct record *rec, const char *sentence)
{
    snprintf(rec->status.error, sizeof rec->status.error, "recording to %s: %s", rec->directory, sentence);
    rec->status.errors++;
}

static void remove_old_parts(struct record *rec)
{
    char name[NAME_MAX + 1], path[PATH_MAX], why[128];
    while (rec->files > 0 && oldest_part(rec, name, sizeof name) > rec->files) {
        snprintf(path, sizeof path, "%s/%s", rec->directory, name);
        if (unlink(path) != 0) {
            snprintf(why, sizeof why, "removing an old part: %s", strerror(errno));
            note_error(rec, why);
            return;
        }
    }
}

/* ---- parts ---- */

/* The new name in the folder survives a power cut. */
static void sync_directory(const struct record *rec)
{
    int fd = open(rec->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0)
        return;
    fsync(fd);
    close(fd);
}

/* A new file of the next free number; -1 with errno. */
static int create_file(struct record *rec)
{
    int fd = -1;
    for (int i = 0; fd < 0 && i < NAME_ATTEMPTS; i++) {
        snprintf(rec->status.path, sizeof rec->status.path, "%s/" FIRST_LETTERS "%s-%03u" LAST_LETTERS,
                 rec->directory, rec->stamp, ++rec->part);
        fd = open(rec->status.path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
        if (fd < 0 && errno != EEXIST) {
            rec->part--;
            break;
        }
    }
    return fd;
}

static bool add_topic(struct record *rec, struct record_topic *topic, char *err, size_t err_size)
{
    topic->in_file = mcap_add_channel(rec->file, topic->topic, topic->encoding, NULL, 0, err, err_size);
    return topic->in_file >= 0;
}

/* Begin the next part with channels and configuration. False with a sentence in err, and no part open. */
static bool begin_part(struct record *rec, uint64_t now_ns, char *err, size_t err_size)
{
    const struct mcap_options options = {.library = "sonard " SONARD_VERSION,
                                         .message_bytes = RECORD_MESSAGE_BYTES};
    int fd = create_file(rec);
    if (fd < 0) {
        snprintf(err, err_size, "a new file: %s", strerror(errno));
        return false;
    }
    rec->file = mcap_create(fd, &options, err, err_size);
    bool ok = rec->file && mcap_attach(rec->file, "sonard.conf", "text/plain", rec->unix_offset_ns + now_ns,
                                       rec->conf_text, rec->conf_size, err, err_size);
    for (int i = 0; ok && i < rec->n_topics; i++)
        ok = add_topic(rec, &rec->topic[i], err, err_size);
    if (!ok) {
        char ignored[256];
        if (rec->file)
            mcap_finish(rec->file, ignored, sizeof ignored);
        rec->file = NULL;
        unlink(rec->status.path); /* it holds nothing */
        return false;
    }
    rec->lost_in_file = 0;
    rec->status.recording = true;
    rec->status.parts++;
    sync_directory(rec);
    remove_old_parts(rec);
    return true;
}

static void count_lost(struct record *rec)
{
    uint64_t lost = mcap_written(rec->file).lost;
    rec->status.lost_messages += lost - rec->lost_in_file;
    rec->lost_in_file = lost;
}

/* Recording stands still from here on. */
static void stop(struct record *rec, uint64_t now_ns, const char *why)
{
    char ignored[256];
    note_error(rec, why);
    if (rec->file) {
        count_lost(rec);
        mcap_finish(rec->file, ignored, sizeof ignored);
    }
    rec->file = NULL;
    rec->status.recording = false;
    rec->retry_ns = now_ns + RECORD_RETRY_NS;
}

static void start_part(struct record *rec, uint64_t now_ns)
{
    char err[256];
    if (!begin_part(rec, now_ns, err, sizeof err))
        stop(rec, now_ns, err);
}

static void rotate(struct record *rec, uint64_t now_ns)
{
    char err[256];
    uint64_t waiting = mcap_written(rec->file).waiting;
    bool ok = mcap_finish(rec->file, err, sizeof err);
    rec->file = NULL;
    if (ok) {
        start_part(rec, now_ns);
    } else {
        rec->status.lost_messages += waiting;
        stop(rec, now_ns, err);
    }
}

/* After a chunk was written: is the part still to be found, and is it large enough? */
static void look_after_part(struct record *rec, uint64_t now_ns)
{
    struct stat st;
    struct mcap_written written = mcap_written(rec->file);
    int fd = mcap_fd(rec->file);
    sync_file_range(fd, 0, 0, SYNC_FILE_RANGE_WRITE);
    if (fstat(fd, &st) == 0 && st.st_nlink == 0)
        stop(rec, now_ns, "the file or the folder was removed");
    else if (written.bytes >= rec->file_size || written.full)
        rotate(rec, now_ns);
}

static void flush(struct record *rec, uint64_t now_ns)
{
    char err[256];
    if (mcap_flush(rec->file, err, sizeof err))
        look_after_part(rec, now_ns);
    else
        stop(rec, now_ns, err);
}

/* ---- the recorder ---- */

static bool copy_settings(struct record *rec, const char *directory, const char *conf_text, size_t conf_size)
{
    rec->directory = strdup(directory);
    rec->conf_text = malloc(conf_size + 1);
    if (!rec->directory || !rec->conf_text)
        return false;
    if (conf_size)
        memcpy(rec->conf_text, conf_text, conf_size);
    rec->conf_size = conf_size;
    return true;
}

struct record *record_open(const char *directory, uint64_t file_size, int files, const char *conf_text,
                           size_t conf_size, uint64_t unix_offset_ns, uint64_t now_ns, char *err, size_t err_size)
{
    struct record *rec = calloc(1, sizeof *rec);
    if (!rec || !copy_settings(rec, directory, conf_text, conf_size)) {
        snprintf(err, err_size, "recording: out of memory");
        record_close(rec);
        return NULL;
    }
    rec->file_size = file_size;
    rec->files = files;
    rec->unix_offset_ns = unix_offset_ns;
    time_t start = (time_t)((unix_offset_ns + now_ns) / 1000000000u);
    struct tm utc;
    if (!gmtime_r(&start, &utc) || strftime(rec->stamp, sizeof rec->stamp, "%Y%m%dT%H%M%SZ", &utc) == 0)
        snprintf(rec->stamp, sizeof rec->stamp, "00000000T000000Z");

    char why[256];
    if (mkdir(directory, 0750) != 0 && errno != EEXIST)
        snprintf(err, err_size, "recording to %s: making the folder: %s", directory, strerror(errno));
    else if (begin_part(rec, now_ns, why, sizeof why))
        return rec;
    else
        snprintf(err, err_size, "recording to %s: %s", directory, why);
    record_close(rec);
    return NULL;
}

int record_channel(struct record *rec, const char *topic, const char *encoding)
{
    struct record_topic *t = &rec->topic[rec->n_topics];
    char err[256];
    if (rec->n_topics == RECORD_CHANNELS_MAX || strlen(topic) >= sizeof t->topic ||
        strlen(encoding) >= sizeof t->encoding)
        return -1;
    snprintf(t->topic, sizeof t->topic, "%s", topic);
    snprintf(t->encoding, sizeof t->encoding, "%s", encoding);
    t->sequence = 0;
    rec->n_topics++;
    if (rec->file && !add_topic(rec, t, err, sizeof err))
        stop(rec, 0, err);
    return rec->n_topics - 1;
}

bool record_message(struct record *rec, int channel, uint64_t t_ns, const void *data, size_t n)
{
    char err[256];
    rec->status.messages++;
    if (!rec->file || channel < 0 || channel >= rec->n_topics || n > RECORD_MESSAGE_BYTES) {
        rec->status.lost_messages++;
        return false;
    }
    struct record_topic *topic = &rec->topic[channel];
    struct mcap_written before = mcap_written(rec->file);
    uint64_t log_ns = rec->unix_offset_ns + t_ns;
    bool ok =
        mcap_write_message(rec->file, topic->in_file, topic->sequence++, log_ns, log_ns, data, n, err, sizeof err);
    struct mcap_written after = mcap_written(rec->file);
    if (!ok) {
        if (after.lost - before.lost <= before.waiting)
            rec->status.lost_messages++; /* it did not get into the chunk that was lost */
        stop(rec, t_ns, err);
        return false;
    }
    if (after.waiting == 1)
        rec->chunk_since_ns = t_ns;
    if (after.chunks > before.chunks)
        look_after_part(rec, t_ns);
    return true;
}

void record_tick(struct record *rec, uint64_t now_ns)
{
    if (!rec->file) {
        if (now_ns >= rec->retry_ns)
            start_part(rec, now_ns);
    } else if (mcap_written(rec->file).waiting > 0 && now_ns >= rec->chunk_since_ns + RECORD_CHUNK_AGE_NS) {
        flush(rec, now_ns);
    }
}

const struct record_status *record_status(const struct record *rec)
{
    return &rec->status;
}

void record_close(struct record *rec)
{
    char err[256];
    if (!rec)
        return;
    if (rec->file && !mcap_finish(rec->file, err, sizeof err))
        note_error(rec, err);
    free(rec->directory);
    free(rec->conf_text);
    free(rec);
}
