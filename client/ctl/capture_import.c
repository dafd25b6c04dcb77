/* SPDX-License-Identifier: MIT */
/* capture_import - `sonarctl capture import`: a capture from a recording of another program. */
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "capture.h"
#include "capture_file.h"
#include "core/fault.h"
#include "drivers/capture/mcap.h"
#include "drivers/devices/ping_bytes.h"
#include "drivers/devices/ping_frame.h"
#include "drivers/devices/seanet_frame.h"
#include "gunzip.h"
#include "import.h"

#define RANGE_LEAST_M  0.75 /* as sonard.conf takes it */
#define RANGE_MOST_M   200.0
#define PING360_MOST_M 50.0 /* likewise */
#define LOOKED_AT      1000 /* messages, for one of a sonar */

struct content {
    const uint8_t *p;
    size_t n;
    bool unpacked;         /* on the heap; else mapped */
    bool is_mostly_lost;   /* in unpacking */
    const uint8_t *packed; /* mapped: p is the first piece of what is in it; NULL: p is all */
    size_t packed_n;
};

/* The file mapped into memory; false after a message. */
static bool load(const char *path, struct content *out)
{
    struct stat st;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    bool is_file = fd >= 0 && fstat(fd, &st) == 0 && S_ISREG(st.st_mode);
    void *p = MAP_FAILED;
    if (fd < 0)
        capture_failed("%s: %s", path, strerror(errno));
    else if (!is_file || st.st_size == 0)
        capture_failed(is_file ? "%s: the file is empty" : "%s: not a file", path);
    else if ((p = mmap(NULL, (size_t)st.st_size, PROT_READ, MAP_PRIVATE, fd, 0)) == MAP_FAILED)
        capture_failed("%s: %s", path, strerror(errno));
    else
        *out = (struct content){.p = p, .n = (size_t)st.st_size};
    if (fd >= 0)
        close(fd);
    return p != MAP_FAILED;
}

static void unload(struct content c)
{
    if (c.unpacked)
        free((void *)(uintptr_t)c.p);
    else if (c.p)
        munmap((void *)(uintptr_t)c.p, c.n);
    if (c.packed)
        munmap((void *)(uintptr_t)c.packed, c.packed_n);
}

static void tell_unpacked(const char *path, const struct unpacked *unpacked, size_t packed_n)
{
    if (unpacked->damaged && unpacked->lost > 0)
        fprintf(stderr, "%s: packed, and damaged: %" PRIu64 " bytes could be unpacked, %zu of %zu are left out\n",
                path, unpacked->n, unpacked->lost, packed_n);
    else if (unpacked->damaged)
        fprintf(stderr, "%s: packed, and cut off: %" PRIu64 " bytes could be unpacked\n", path, unpacked->n);
}

static bool is_mostly_lost(const struct unpacked *unpacked, size_t packed_n)
{
    return unpacked->lost > packed_n / 2;
}

static bool keep_first(void *ctx, const uint8_t *bytes, size_t n)
{
    struct content *first = ctx;
    uint8_t *p = malloc(n);
    if (p)
        memcpy(p, bytes, n);
    *first = (struct content){.p = p, .n = p ? n : 0, .unpacked = true};
    return false;
}

/* Long recordings are taken piece by piece. Of these *c becomes the first. */
static bool unpack_first(struct content *c)
{
    struct unpacked unpacked;
    struct content first = {0};
    struct fault fault;
    gunzip_pieces(c->p, c->n, keep_first, &first, &unpacked, &fault);
    if (!first.p || import_kind(first.p, first.n) != IMPORT_SVLOG) {
        unload(first);
        return false;
    }
    first.packed = c->p;
    first.packed_n = c->n;
    *c = first;
    return true;
}

/* What a packed file holds takes its place; false after a message. */
static bool unpack(const char *path, struct content *c)
{
    struct unpacked unpacked;
    struct fault fault;
    if (!gunzip_is(c->p, c->n) || unpack_first(c))
        return true;
    if (!gunzip(c->p, c->n, &unpacked, &fault)) {
        capture_failed("%s: %s", path, fault.text);
        return false;
    }
    tell_unpacked(path, &unpacked, c->n);
    const bool lost = is_mostly_lost(&unpacked, c->n);
    unload(*c);
    *c = (struct content){.p = unpacked.p, .n = (size_t)unpacked.n, .unpacked = true, .is_mostly_lost = lost};
    return true;
}

/* Is it a capture already? Then it has bytes of sonars as sonard records them. */
static bool is_own_capture(struct content c)
{
    struct fault fault;
    struct mcap_message m;
    bool found = false;
    struct mcap_reader *r = mcap_open_memory(c.p, c.n, NULL, NULL, &fault);
    for (unsigned i = 0; r && !found && i < LOOKED_AT && mcap_next(r, &m); i++) {
        const char *slash = strrchr(m.channel->topic, '/');
        found = slash && strcmp(slash, "/rx") == 0 && strcmp(m.channel->encoding, "octet-stream") == 0;
    }
    mcap_close(r);
    return found;
}

struct importing {
    const char *in;
    struct mcap_writer *w;
    int channel;
    uint32_t sequence;
    uint64_t first_ns, last_ns;
    uint64_t pings, poses, left_out_bytes;
    uint64_t content_bytes; /* unpacked */
    bool is_mostly_lost;    /* in unpacking */
    int pose_channel;       /* of the first pose on */
    const char *device;     /* of the newest ping, as in sonard.conf; NULL: none came */
    double range_m;         /* the longest; 0: unknown */
    bool has_atof;          /* points of the Surveyor's newer form, which the older one repeats */
    enum import_kind kind;
    struct ping_parser ping; /* only count: the bytes are kept as they are */
    struct seanet_parser seanet;
    struct fault fault;
};

#define RANGE_PER_S       750.0 /* metres of range in a second of listening, at 1500 m/s */
#define IMAGENEX_RANGE_AT 7     /* in a reply: metres */

enum { ECHOSOUNDER_DISTANCE = 1212, ECHOSOUNDER_PROFILE = 1300 }; /* messages of a Ping1D or Ping2 */

static void count_ping(struct importing *im, const char *device, double range_m)
{
    im->pings++;
    im->device = device;
    im->range_m = fmax(im->range_m, range_m);
}

/* How far a Surveyor listened: its end in the older form of points, the time in the newer one. */
static void count_points(struct importing *im, const struct ping_frame *f)
{
    const bool atof = f->id == SURVEYOR_ATOF_POINTS;
    im->has_atof |= atof;
    if (atof)
        count_ping(im, "surveyor", f->length < 16 ? 0 : (double)get_f32(f->payload + 12) * RANGE_PER_S);
    else if (!im->has_atof)
        count_ping(im, "surveyor", f->length < 96 ? 0 : (double)get_f32(f->payload + 92));
}

static void count_ping_frame(struct importing *im, const struct ping_frame *frame)
{
    struct ping360_data data;
    if (frame->id == SURVEYOR_ATOF_POINTS || frame->id == SURVEYOR_YZ_POINTS)
        count_points(im, frame);
    else if (ping360_decode_data(frame, &data))
        count_ping(im, "ping360", data.set.n_samples * data.set.sample_period * 25e-9 * RANGE_PER_S);
    else if (frame->id == PING360_DEVICE_DATA || frame->id == PING360_AUTO_DEVICE_DATA)
        im->pings++;
    else if (frame->id == ECHOSOUNDER_DISTANCE || frame->id == ECHOSOUNDER_PROFILE)
        count_ping(im, "ping1d", 0);
}

static void count_pings(struct importing *im, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    struct ping_frame frame;
    struct seanet_frame seanet;
    if (im->kind == IMPORT_IMAGENEX) { /* a record is a ping */
        count_ping(im, "imagenex852", n > IMAGENEX_RANGE_AT ? bytes[IMAGENEX_RANGE_AT] : 0);
        return;
    }
    if (im->kind == IMPORT_SEANET || im->kind == IMPORT_SEANET_RELAY) {
        while (seanet_parser_next(&im->seanet, &bytes, &n, t_ns, &seanet))
            if (seanet.id == SEANET_HEAD_DATA && seanet.last)
                count_ping(im, "micron", (double)import_listening_ns(&seanet) * 1e-9 * RANGE_PER_S);
        return;
    }
    while (ping_parser_next(&im->ping, &bytes, &n, t_ns, &frame))
        count_ping_frame(im, &frame);
}

static bool import_bytes(void *ctx, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    struct importing *im = ctx;
    if (im->sequence == 0)
        im->first_ns = t_ns;
    im->last_ns = t_ns;
    count_pings(im, t_ns, bytes, n);
    do {
        size_t part = n < MCAP_MESSAGE_BYTES ? n : MCAP_MESSAGE_BYTES;
        const struct mcap_message message = {
            .sequence = im->sequence++, .log_ns = t_ns, .publish_ns = t_ns, .data = bytes, .size = part};
        if (!mcap_write_message(im->w, im->channel, &message, &im->fault))
            return false;
        bytes += part;
        n -= part;
    } while (n > 0);
    return true;
}

/* The channel is made for the first one. */
static bool import_pose(void *ctx, uint64_t t_ns, const char *json)
{
    struct importing *im = ctx;
    if (im->poses == 0)
        im->pose_channel = mcap_add_channel(im->w, "/pose", "json", NULL, 0, &im->fault);
    const struct mcap_message message = {.sequence = (uint32_t)im->poses++,
                                         .log_ns = t_ns,
                                         .publish_ns = t_ns,
                                         .data = (const uint8_t *)json,
                                         .size = strlen(json)};
    return im->pose_channel >= 0 && mcap_write_message(im->w, im->pose_channel, &message, &im->fault);
}

static void import_problem(void *ctx, const char *sentence)
{
    fprintf(stderr, "%s: %s\n", ((const struct importing *)ctx)->in, sentence);
}

static const char *const source_name[] = {
    [IMPORT_PING_VIEWER] = "Ping-Viewer sensor log",    [IMPORT_TEXT] = "text dump",
    [IMPORT_SEANET_RELAY] = "log of relayed datagrams", [IMPORT_SEANET] = "raw bytes of a SeaNet line",
    [IMPORT_IMAGENEX] = "Imagenex .852 file",           [IMPORT_SVLOG] = "Cerulean .svlog file",
    [IMPORT_VIEWER2] = "Ping Viewer 2 MCAP file",
};

static bool take_piece(void *ctx, const uint8_t *bytes, size_t n)
{
    return import_svlog_take(ctx, bytes, n);
}

/* Of a packed file, piece by piece. */
static bool import_packed_svlog(struct importing *im, struct content in, const struct import_sink *sink,
                                struct import_result *result)
{
    static struct svlog_stream stream;
    struct unpacked unpacked;
    uint64_t start_ns = 0;
    import_svlog_start(in.p, in.n, &start_ns);
    import_svlog_begin(&stream, sink, start_ns, result);
    if (!gunzip_pieces(in.packed, in.packed_n, take_piece, &stream, &unpacked, &im->fault))
        return false;
    import_svlog_end(&stream);
    tell_unpacked(im->in, &unpacked, in.packed_n);
    im->content_bytes = unpacked.n;
    im->is_mostly_lost = is_mostly_lost(&unpacked, in.packed_n);
    return true;
}

/* All records of the file; false with a sentence in im->fault when it is not what it looked like. */
static bool import_records(struct importing *im, struct content in, const struct import_sink *sink,
                           struct import_result *result)
{
    switch (im->kind) {
    case IMPORT_TEXT:
        import_text(in.p, in.n, sink, result);
        return true;
    case IMPORT_SEANET:
        import_seanet(in.p, in.n, sink, result);
        return true;
    case IMPORT_IMAGENEX:
        import_imagenex(in.p, in.n, sink, result);
        return true;
    case IMPORT_VIEWER2:
        import_viewer2(in.p, in.n, sink, import_pose, result);
        return true;
    case IMPORT_SVLOG:
        if (in.packed)
            return import_packed_svlog(im, in, sink, result);
        import_svlog(in.p, in.n, sink, result);
        return true;
    case IMPORT_SEANET_RELAY:
        if (import_seanet_relay(in.p, in.n, sink, result))
            return true;
        fault_set(&im->fault, "%s: no datagram of the log holds the head of a SeaNet frame", im->in);
        return false;
    case IMPORT_PING_VIEWER:
    case IMPORT_UNKNOWN:
        break;
    }
    if (import_ping_viewer(in.p, in.n, sink, result))
        return true;
    fault_set(&im->fault, "%s: the head of the Ping-Viewer log is cut off or not of version 1", im->in);
    return false;
}

static bool write_conf(struct importing *im, const void *text, size_t size)
{
    const struct mcap_attachment attachment = {
        .name = "sonard.conf", .media_type = "text/plain", .data = text, .size = size};

    return mcap_attach(im->w, &attachment, &im->fault);
}

/* What a replay needs to know, from what the recording shows. */
static bool attach_conf(struct importing *im, const char *sensor)
{
    char text[512], range[64] = "";
    double range_m = ceil(im->range_m * 10) / 10;
    if (im->device && strcmp(im->device, "ping360") == 0) /* Ping-Viewer goes to 60 m, no configuration does */
        range_m = fmin(range_m, PING360_MOST_M);
    if (!im->device) {
        fprintf(stderr, "%s: no ping that names its device: give the configuration for the replay with --conf\n",
                im->in);
        return true;
    }
    if (range_m >= RANGE_LEAST_M && range_m <= RANGE_MOST_M)
        snprintf(range, sizeof range, "range = %.1f m", range_m);
    const int n =
        snprintf(text, sizeof text,
                 "# Made by `sonarctl capture import` from what the recording shows. Where the sonar is mounted "
                 "it does not show.\n[sonar %s]\ndevice = %s\n"
                 "port = serial:/dev/null:115200 ; a replay opens no port\n%s%s",
                 sensor, im->device, range, range[0] ? "          ; the longest of the recording\n" : "");
    printf("configuration attached: device = %s%s%s\n", im->device, range[0] ? ", " : "", range);
    return write_conf(im, text, (size_t)n);
}

/* What the times of the capture are. */
static const char *meaning_of_times(const struct importing *im, struct content in)
{
    uint64_t start_ns;

    if (im->kind == IMPORT_SEANET_RELAY ||
        (im->kind == IMPORT_IMAGENEX && import_imagenex_start(in.p, in.n, &start_ns)))
        return "Unix, the log's dates taken as UTC";
    return im->kind == IMPORT_VIEWER2 || (im->kind == IMPORT_SVLOG && import_svlog_start(in.p, in.n, &start_ns))
               ? "Unix"
               : "counts from the start of the recording";
}

/* Bytes that are part of no message. */
static uint64_t no_frame_bytes(const struct importing *im)
{
    return im->ping.garbage_bytes + im->seanet.garbage_bytes + im->seanet.cut_bytes;
}

/* Channel, attachment, all records. False with a sentence in im->fault. */
static bool import_all(struct importing *im, struct content in, const char *sensor, struct content conf)
{
    const struct import_sink sink = {im, import_bytes, import_problem};
    const struct mcap_pair metadata[] = {
        {"source", source_name[im->kind]},
        {"time", meaning_of_times(im, in)},
        {"line", "none"}, /* a replay does not reckon times from the baud rate of a port */
    };
    char topic[CAPTURE_SENSOR_MAX + 8];
    struct import_result result = {0};
    snprintf(topic, sizeof topic, "/%s/rx", sensor);
    im->channel = mcap_add_channel(im->w, topic, "octet-stream", metadata, 3, &im->fault);
    if (im->channel < 0 || (conf.p && !write_conf(im, conf.p, conf.n)))
        return false;
    if (!import_records(im, in, &sink, &result) || result.stopped || (!conf.p && !attach_conf(im, sensor)))
        return false;
    im->left_out_bytes = result.left_out_bytes;
    printf("%" PRIu64 " pings in %" PRIu64 " records, %.3f s%s\n", im->pings, result.records,
           (double)(im->last_ns - im->first_ns) * 1e-9,
           result.times_made_up ? " (no times in the source: made up from listening time and the head's pace)"
                                : "");
    if (im->poses)
        printf("%" PRIu64 " poses: attitude only\n", im->poses);
    seanet_parser_reset(&im->seanet); /* what is left of an unfinished frame */
    const uint64_t garbage = no_frame_bytes(im);
    if (garbage || im->ping.bad_checksum)
        printf("%" PRIu64 " bytes outside valid frames, %" PRIu64 " checksum errors; kept unchanged\n", garbage,
               im->ping.bad_checksum);
    return true;
}

/* The exit status of an import that was written: scripts are not to take next to nothing for a recording. */
static int judge_import(const struct importing *im)
{
    if (im->pings == 0)
        return capture_failed("%s: no ping in it; the capture holds its bytes as they are", im->in);
    if (im->is_mostly_lost || im->left_out_bytes + no_frame_bytes(im) > im->content_bytes / 2)
        return capture_failed("%s: most of it is lost: %" PRIu64 " pings could be read", im->in, im->pings);
    return 0;
}

int capture_import(const char *in_path, const char *out_path, const char *sensor, const char *conf_path)
{
    struct content in = {0}, conf = {0};
    char section[CAPTURE_SENSOR_MAX + 16];
    static struct importing im;
    int status = 1;
    if (!load(in_path, &in) || !unpack(in_path, &in) || (conf_path && !load(conf_path, &conf)))
        goto done;
    if (is_own_capture(in)) {
        capture_failed("%s: is a capture of sonard already; play it with `sonard --replay`", in_path);
        goto done;
    }
    enum import_kind kind = import_kind(in.p, in.n);
    if (kind == IMPORT_UNKNOWN) {
        capture_failed(
            "%s: neither a Ping-Viewer sensor log nor a text dump of Ping360 messages (\"ID: 2300\") nor bytes of "
            "a SeaNet line, nor a file of Ping Viewer 2 (.mcap), Imagenex (.852) or Cerulean (.svlog, .svlz)",
            in_path);
        goto done;
    }
    snprintf(section, sizeof section, "[sonar %s]", sensor);
    if (conf.p && !memmem(conf.p, conf.n, section, strlen(section)))
        fprintf(stderr, "%s: there is no %s: a replay will find no sensor for /%s/rx\n", conf_path, section,
                sensor);
    im = (struct importing){.in = in_path,
                            .kind = kind,
                            .content_bytes = in.n,
                            .is_mostly_lost = in.is_mostly_lost,
                            .w = capture_create(out_path, 0)};
    ping_parser_init(&im.ping, kind == IMPORT_SVLOG ? PING_PAYLOAD_LIMIT : PING_PAYLOAD_MAX);
    seanet_parser_init(&im.seanet);
    if (im.w) {
        bool ok = import_all(&im, in, sensor, conf);
        status = capture_finish(im.w, out_path, ok, &im.fault);
    }
    if (status == 0)
        status = judge_import(&im);
done:
    unload(in);
    unload(conf);
    return status;
}
