/* SPDX-License-Identifier: MIT */
/*
 * segments - see the header. A segment that cannot be continued (disk full or broken, file or folder gone) is closed as
 * well as it goes, and the next one is tried soon, then less and less often until a chunk of one is on disk.
 */
#include "segments.h"

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

#include "drivers/capture/mcap.h"

#define STAMP_SIZE    sizeof "YYYYmmddTHHMMSSZ"
#define NAME_ATTEMPTS 1000 /* segments of an earlier start in the same second */
#define TOPIC_MAX     96
#define FIRST_LETTERS "sonard-"
#define LAST_LETTERS  ".mcap"

struct topic {
    char topic[TOPIC_MAX], encoding[32];
    uint32_t sequence;
    int in_file; /* the channel's number in the open segment */
};

struct segments {
    char *directory, *conf_text;
    size_t conf_size;
    uint64_t file_size, unix_offset_ns;
    int files;
    bool on_request;        /* each recording by itself: its segments push out no other's */
    bool own_disk;          /* the folder was at first on another than the system's */
    char stamp[STAMP_SIZE]; /* of the recording's start */
    unsigned segment;       /* number of the newest */
    struct topic topic[SEGMENTS_CHANNELS_MAX];
    int n_topics;
    struct mcap_writer *file; /* NULL: recording stands still */
    uint64_t chunk_since_ns;  /* of the oldest message in the open chunk */
    uint64_t lost_in_file;    /* what was already counted of the file's losses */
    uint64_t kept_in_file;    /* messages on disk when the file was last seen in its place */
    uint64_t retry_ns;        /* the next segment is tried then, ... */
    uint64_t wait_ns; /* ... and the one after that so much later; 0: a chunk is on disk since the last error */
    uint64_t lost_at_good; /* lost_messages when the last chunk went to disk, ... */
    uint64_t lost_before;  /* ... before recording stopped */
    struct segments_status status;
};

/* ---- old segments ---- */

/* A segment in the folder, as far as its age goes. */
struct segment {
    bool this_run;
    char stamp[STAMP_SIZE];
    unsigned number;
};

/* sonard-YYYYmmddTHHMMSSZ-NNN.mcap, exactly: nobody else's file is ever touched. */
static bool parse_name(const char *name, struct segment *out)
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

/* A clock that was wrong at start-up must not make this run's segments the oldest. */
static bool older(const struct segment *a, const struct segment *b)
{
    if (a->this_run != b->this_run)
        return b->this_run;
    int order = strcmp(a->stamp, b->stamp);
    return order < 0 || (order == 0 && a->number < b->number);
}

/* A folder of such a name is nobody's segment, and could not be removed as one. */
static bool is_file(int directory, const char *name)
{
    struct stat st;
    return fstatat(directory, name, &st, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(st.st_mode);
}

/* One look through the folder: how many segments there are, and the name of the oldest. */
static int oldest_segment(const struct segments *segments, char *name, size_t name_size)
{
    DIR *dir = opendir(segments->directory);
    struct segment oldest = {0}, segment = {0};
    int n = 0;
    if (!dir)
        return 0;
    for (struct dirent *entry; (entry = readdir(dir)) != NULL;) {
        if (!parse_name(entry->d_name, &segment) || !is_file(dirfd(dir), entry->d_name))
            continue;
        segment.this_run = strcmp(segment.stamp, segments->stamp) == 0;
        if (segments->on_request && !segment.this_run)
            continue;
        if (n++ == 0 || older(&segment, &oldest)) {
            oldest = segment;
            snprintf(name, name_size, "%s", entry->d_name);
        }
    }
    closedir(dir);
    return n;
}

/* What failed with which numbers differs from try to try; the cause comes last. */
static const char *cause_in(const char *sentence)
{
    const char *colon = strrchr(sentence, ':');
    return colon ? colon : sentence;
}

/* While one cause lasts, the tries in between are no news. */
static void note_error(struct segments *segments, const char *sentence)
{
    struct fault *error = &segments->status.error;
    const bool news = !segments->wait_ns || strcmp(cause_in(error->text), cause_in(sentence)) != 0;
    fault_set(error, "recording to %s: %s", segments->directory, sentence);
    segments->status.errors += news;
}

static void remove_old_segments(struct segments *segments)
{
    char name[NAME_MAX + 1], path[PATH_MAX], why[128];
    while (segments->files > 0 && oldest_segment(segments, name, sizeof name) > segments->files) {
        snprintf(path, sizeof path, "%s/%s", segments->directory, name);
        if (unlink(path) != 0) {
            snprintf(why, sizeof why, "removing an old segment: %s", strerror(errno));
            note_error(segments, why);
            return;
        }
    }
}

/* ---- segments ---- */

/* The new name in the folder survives a power cut. */
static void sync_directory(const struct segments *segments)
{
    int fd = open(segments->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0)
        return;
    fsync(fd);
    close(fd);
}

/* A new file of the next free number; -1 with errno. */
static int create_file(struct segments *segments)
{
    int fd = -1;
    for (int i = 0; fd < 0 && i < NAME_ATTEMPTS; i++) {
        snprintf(segments->status.path, sizeof segments->status.path, "%s/" FIRST_LETTERS "%s-%03u" LAST_LETTERS,
                 segments->directory, segments->stamp, ++segments->segment);
        fd = open(segments->status.path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
        if (fd < 0 && errno != EEXIST) {
            segments->segment--;
            break;
        }
    }
    return fd;
}

static bool add_topic(struct segments *segments, struct topic *topic, struct fault *fault)
{
    topic->in_file = mcap_add_channel(segments->file, topic->topic, topic->encoding, NULL, 0, fault);
    return topic->in_file >= 0;
}

static bool in_its_place(const struct segments *segments)
{
    struct stat open, there;
    return fstat(mcap_fd(segments->file), &open) == 0 && stat(segments->status.path, &there) == 0 &&
           there.st_ino == open.st_ino && there.st_dev == open.st_dev;
}

/* Close a segment that cannot be continued. One of which the disk has kept nothing is removed: while it takes none,
 * such files would gather, and push out the older ones. */
static void give_up_part(struct segments *segments)
{
    struct fault ignored;
    const bool empty = segments->kept_in_file == 0 && in_its_place(segments);
    mcap_finish(segments->file, &ignored);
    segments->file = NULL;
    if (empty && unlink(segments->status.path) == 0)
        segments->segment--;
}

/* The folder, or the one that it would be made in: is it on the disk of the root folder? */
static bool on_system_disk(const struct segments *segments)
{
    char parent[PATH_MAX];
    struct stat there, root;
    snprintf(parent, sizeof parent, "%s", segments->directory);
    char *slash = strrchr(parent, '/');
    if (slash)
        slash[slash == parent] = '\0';
    return (stat(segments->directory, &there) == 0 || stat(parent, &there) == 0) && stat("/", &root) == 0 &&
           there.st_dev == root.st_dev;
}

/* Begin the next segment with channels and configuration. False with a sentence in fault, and no segment open. */
static bool begin_part(struct segments *segments, uint64_t now_ns, struct fault *fault)
{
    const struct mcap_options options = {.library = "sonard " SONARD_VERSION,
                                         .message_bytes = SEGMENTS_MESSAGE_BYTES};
    if (segments->own_disk && on_system_disk(segments))
        return fault_set(fault, "the folder's disk is not mounted: the captures would fill the system's");
    if (mkdir(segments->directory, 0750) != 0 && errno != EEXIST)
        return fault_set(fault, "making the folder: %s", strerror(errno));
    int fd = create_file(segments);
    if (fd < 0)
        return fault_set(fault, "a new file: %s", strerror(errno));
    segments->file = mcap_create(fd, &options, fault);
    bool ok = segments->file && mcap_attach(segments->file,
                                            &(struct mcap_attachment){.log_ns = segments->unix_offset_ns + now_ns,
                                                                      .name = "sonard.conf",
                                                                      .media_type = "text/plain",
                                                                      .data = (const uint8_t *)segments->conf_text,
                                                                      .size = segments->conf_size},
                                            fault);
    for (int i = 0; ok && i < segments->n_topics; i++)
        ok = add_topic(segments, &segments->topic[i], fault);
    if (!ok) {
        struct fault ignored;
        if (segments->file)
            mcap_finish(segments->file, &ignored);
        segments->file = NULL;
        if (unlink(segments->status.path) == 0) /* it holds nothing */
            segments->segment--;
        return false;
    }
    segments->lost_in_file = segments->kept_in_file = 0;
    segments->status.recording = segments->wait_ns == 0; /* else when the disk has taken something */
    if (segments->status.segments++ == 0)
        segments->own_disk = segments->own_disk || !on_system_disk(segments);
    sync_directory(segments);
    remove_old_segments(segments);
    return true;
}

/* What a chunk took along that could not be written, or went to a file that nobody finds any more. */
static void count_lost(struct segments *segments, bool gone)
{
    const struct mcap_written written = mcap_written(segments->file);
    segments->status.lost_messages += written.lost - segments->lost_in_file;
    segments->lost_in_file = written.lost;
    if (gone)
        segments->status.lost_messages += written.messages - segments->kept_in_file + written.waiting;
}

/* Recording stands still from here on, until the next try. */
static void stop(struct segments *segments, uint64_t now_ns, const char *why)
{
    note_error(segments, why);
    if (!segments->wait_ns) {
        segments->lost_before = segments->lost_at_good;
        segments->wait_ns = SEGMENTS_RETRY_FIRST_NS;
    }
    if (segments->file) {
        count_lost(segments, false);
        give_up_part(segments);
    }
    segments->status.recording = false;
    segments->retry_ns = now_ns + segments->wait_ns;
    segments->wait_ns =
        2 * segments->wait_ns < SEGMENTS_RETRY_MOST_NS ? 2 * segments->wait_ns : SEGMENTS_RETRY_MOST_NS;
}

/* A chunk is on disk, and the file in its place. */
static void kept(struct segments *segments, uint64_t messages)
{
    segments->kept_in_file = messages;
    if (segments->wait_ns) {
        segments->status.lost_in_gap = segments->status.lost_messages - segments->lost_before;
        segments->status.resumed++;
    }
    segments->wait_ns = 0;
    segments->status.recording = true;
    segments->lost_at_good = segments->status.lost_messages;
}

static void start_part(struct segments *segments, uint64_t now_ns)
{
    struct fault fault;
    if (!begin_part(segments, now_ns, &fault))
        stop(segments, now_ns, fault.text);
}

static void rotate(struct segments *segments, uint64_t now_ns)
{
    struct fault fault;
    const uint64_t waiting = mcap_written(segments->file).waiting;
    const bool good = mcap_finish(segments->file, &fault);
    segments->file = NULL;
    if (good) {
        start_part(segments, now_ns);
    } else {
        segments->status.lost_messages += waiting;
        stop(segments, now_ns, fault.text);
    }
}

/* What became of a file that is not where it was. */
static const char *misplaced(const struct segments *segments)
{
    struct stat st;
    if (fstat(mcap_fd(segments->file), &st) == 0 && st.st_nlink == 0)
        return "the file or the folder was removed";
    return stat(segments->status.path, &st) == 0 ? "another file or folder is in its place"
                                                 : "the file or the folder was moved";
}

/*
 * After a chunk was written. The disk begins to write it; how it fared with the chunk before, which the kernel had
 * taken into its memory, shows now.
 */
static void look_after_part(struct segments *segments, uint64_t now_ns)
{
    char text[96];
    const struct mcap_written written = mcap_written(segments->file);
    const bool failed =
        sync_file_range(mcap_fd(segments->file), 0, 0, SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE) != 0 &&
        (errno == EIO || errno == ENOSPC);
    snprintf(text, sizeof text, "the disk took a chunk and lost it: %s", strerror(errno));
    const char *why = failed ? text : in_its_place(segments) ? NULL : misplaced(segments);
    if (why) {
        count_lost(segments, true);
        stop(segments, now_ns, why);
        return;
    }
    kept(segments, written.messages);
    if (written.bytes >= segments->file_size || written.full)
        rotate(segments, now_ns);
}

static void flush(struct segments *segments, uint64_t now_ns)
{
    struct fault fault;
    if (mcap_flush(segments->file, &fault))
        look_after_part(segments, now_ns);
    else
        stop(segments, now_ns, fault.text);
}

/* ---- the writer ---- */

static bool copy_settings(struct segments *segments, const struct segments_conf *conf)
{
    segments->directory = strdup(conf->directory);
    segments->conf_text = malloc(conf->conf_size + 1);
    if (!segments->directory || !segments->conf_text)
        return false;
    if (conf->conf_size)
        memcpy(segments->conf_text, conf->conf_text, conf->conf_size);
    segments->conf_size = conf->conf_size;
    return true;
}

static void set_stamp(struct segments *segments, uint64_t now_ns)
{
    const time_t start = (time_t)((segments->unix_offset_ns + now_ns) / 1000000000u);
    struct tm utc;
    if (!gmtime_r(&start, &utc) || strftime(segments->stamp, sizeof segments->stamp, "%Y%m%dT%H%M%SZ", &utc) == 0)
        snprintf(segments->stamp, sizeof segments->stamp, "00000000T000000Z");
    segments->segment = 0;
}

struct segments *segments_open(const struct segments_conf *conf, uint64_t now_ns, struct fault *fault)
{
    struct segments *segments = calloc(1, sizeof *segments);
    if (!segments || !copy_settings(segments, conf)) {
        fault_set(fault, "recording: out of memory");
        segments_close(segments);
        return NULL;
    }
    segments->file_size = conf->file_size;
    segments->files = conf->files;
    segments->unix_offset_ns = conf->unix_offset_ns;
    segments->on_request = segments->status.paused = conf->paused;
    if (conf->paused) {
        segments->own_disk = access(conf->directory, F_OK) == 0 && !on_system_disk(segments);
        return segments;
    }
    struct fault why;
    set_stamp(segments, now_ns);
    if (begin_part(segments, now_ns, &why))
        return segments;
    fault_set(fault, "recording to %s: %s", conf->directory, why.text);
    segments_close(segments);
    return NULL;
}

int segments_channel(struct segments *segments, const char *topic, const char *encoding)
{
    struct topic *t = &segments->topic[segments->n_topics];
    struct fault fault;
    if (segments->n_topics == SEGMENTS_CHANNELS_MAX || strlen(topic) >= sizeof t->topic ||
        strlen(encoding) >= sizeof t->encoding)
        return -1;
    snprintf(t->topic, sizeof t->topic, "%s", topic);
    snprintf(t->encoding, sizeof t->encoding, "%s", encoding);
    t->sequence = 0;
    segments->n_topics++;
    if (segments->file && !add_topic(segments, t, &fault))
        stop(segments, 0, fault.text);
    return segments->n_topics - 1;
}

bool segments_message(struct segments *segments, int channel, const struct record_time *then, const void *data,
                      size_t n)
{
    struct fault fault;
    if (segments->status.paused)
        return true;
    segments->status.messages++;
    if (!segments->file || channel < 0 || channel >= segments->n_topics || n > SEGMENTS_MESSAGE_BYTES) {
        segments->status.lost_messages++;
        return false;
    }
    struct topic *topic = &segments->topic[channel];
    struct mcap_written before = mcap_written(segments->file);
    const struct mcap_message message = {.sequence = topic->sequence++,
                                         .log_ns = segments->unix_offset_ns + then->t_ns,
                                         .publish_ns = segments->unix_offset_ns + then->since_ns,
                                         .data = data,
                                         .size = n};
    bool ok = mcap_write_message(segments->file, topic->in_file, &message, &fault);
    struct mcap_written after = mcap_written(segments->file);
    if (!ok) {
        if (after.lost - before.lost <= before.waiting)
            segments->status.lost_messages++; /* it did not get into the chunk that was lost */
        stop(segments, then->t_ns, fault.text);
        return false;
    }
    if (after.waiting == 1)
        segments->chunk_since_ns = then->t_ns;
    if (after.chunks > before.chunks)
        look_after_part(segments, then->t_ns);
    return true;
}

void segments_conf(struct segments *segments, const char *text, size_t n)
{
    char *copy = malloc(n + 1);
    if (!copy)
        return;
    memcpy(copy, text, n);
    free(segments->conf_text);
    segments->conf_text = copy;
    segments->conf_size = n;
}

void segments_tick(struct segments *segments, uint64_t now_ns)
{
    if (segments->status.paused)
        return;
    if (!segments->file) {
        if (now_ns >= segments->retry_ns)
            start_part(segments, now_ns);
    } else if (mcap_written(segments->file).waiting > 0 &&
               now_ns >= segments->chunk_since_ns + SEGMENTS_CHUNK_AGE_NS) {
        flush(segments, now_ns);
    }
}

/* Of a segment that is open. */
static void complete_part(struct segments *segments)
{
    struct fault fault;
    const bool flushed = mcap_written(segments->file).waiting == 0 || mcap_flush(segments->file, &fault);
    const char *why = !flushed ? fault.text : in_its_place(segments) ? NULL : misplaced(segments);
    if (why) {
        note_error(segments, why);
        count_lost(segments, flushed);
        give_up_part(segments);
    } else if (mcap_written(segments->file).messages == 0) {
        give_up_part(segments);
    } else if (!mcap_finish(segments->file, &fault)) {
        note_error(segments, fault.text);
    }
    segments->file = NULL;
}

void segments_pause(struct segments *segments, bool paused, uint64_t now_ns)
{
    if (paused == segments->status.paused)
        return;
    segments->status.paused = paused;
    segments->status.recording = false;
    segments->wait_ns = 0;
    if (paused) {
        if (segments->file)
            complete_part(segments);
        return;
    }
    set_stamp(segments, now_ns);
    start_part(segments, now_ns);
}

const struct segments_status *segments_status(const struct segments *segments)
{
    return &segments->status;
}

void segments_close(struct segments *segments)
{
    struct fault fault;
    if (!segments)
        return;
    if (segments->file && !mcap_finish(segments->file, &fault))
        note_error(segments, fault.text);
    free(segments->directory);
    free(segments->conf_text);
    free(segments);
}
