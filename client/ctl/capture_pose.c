/* SPDX-License-Identifier: MIT */
/*
 * capture_pose - `sonarctl capture add-pose`: a capture together with the poses of another log, as if they had been
 * sent to the daemon while it recorded. The poses are lines of JSON, each with t_unix and what the method `pose` takes;
 * sonard-poses(1) makes them of an autopilot's log.
 */
#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "capture.h"
#include "capture_clock.h"
#include "capture_file.h"
#include "core/fault.h"
#include "drivers/capture/mcap.h"

#define LINE_BYTES  4096
#define UNIX_MOST_S 9e9         /* so that nanoseconds fit, and to spare */
#define BEFORE_NS   1000000000u /* poses of the second before the first message count too: a ping may need them */

/* The capture that poses are to meet. */
struct span {
    uint64_t start_ns, end_ns;
    size_t largest; /* message */
    struct capture_clock clock;
};

struct pose_line {
    uint64_t t_ns;
    char *text;
};

struct poses {
    struct pose_line *line;
    size_t n, room;
    uint64_t left_out; /* not within the capture */
    enum capture_clock_of of;
};

static void free_poses(struct poses *poses)
{
    for (size_t i = 0; i < poses->n; i++)
        free(poses->line[i].text);
    free(poses->line);
}

/* From when on a pose can be of use. */
static uint64_t from_ns(const struct span *span)
{
    return span->start_ns > BEFORE_NS ? span->start_ns - BEFORE_NS : 0;
}

static bool keep_pose(struct poses *poses, json_t *pose, double t_unix)
{
    if (poses->n == poses->room) {
        const size_t room = poses->room ? 2 * poses->room : 1024;
        struct pose_line *more = realloc(poses->line, room * sizeof *more);
        if (!more)
            return false;
        poses->line = more;
        poses->room = room;
    }
    json_object_set_new(pose, "t_unix", json_real(t_unix));
    poses->line[poses->n] =
        (struct pose_line){(uint64_t)(t_unix * 1e9), json_dumps(pose, JSON_COMPACT | JSON_REAL_PRECISION(17))};
    return poses->line[poses->n].text != NULL && ++poses->n > 0;
}

static bool take_line(struct poses *poses, const char *text, double offset_s, double *last_s, struct fault *fault)
{
    json_t *pose = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    const json_t *t = json_object_get(pose, "t_unix");
    const double t_unix = json_number_value(t) + offset_s;
    bool good = false;
    if (!json_is_number(t) || json_object_size(pose) < 2)
        fault_set(fault, "expected a JSON object with t_unix and attitude_deg, quaternion, position_m, depth_m, "
                         "velocity_mps or altitude_m, as sonard-poses prints them");
    else if (!(t_unix >= 0 && t_unix <= UNIX_MOST_S))
        fault_set(fault, "t_unix and --offset make %g s: expected 0 to %g", t_unix, UNIX_MOST_S);
    else if (t_unix < *last_s)
        fault_set(fault, "t_unix is before that of the line before: expected the lines in order of time");
    else if (!(good = keep_pose(poses, pose, t_unix)))
        fault_set(fault, "out of memory");
    *last_s = t_unix;
    json_decref(pose);
    return good;
}

static bool read_poses(const char *path, double offset_s, struct poses *poses, struct fault *fault)
{
    FILE *file = fopen(path, "re");
    char text[LINE_BYTES];
    double last_s = 0;
    struct fault why;
    if (!file)
        return fault_set(fault, "%s: %s", path, strerror(errno));
    for (unsigned line = 1; fgets(text, sizeof text, file); line++) {
        if (text[strspn(text, " \t\r\n")] == '\0' || take_line(poses, text, offset_s, &last_s, &why))
            continue;
        fclose(file);
        return fault_set(fault, "%s:%u: %s", path, line, why.text);
    }
    fclose(file);
    return poses->n > 0 || fault_set(fault, "%s: no pose in it", path);
}

struct copying {
    struct mcap_reader *r;
    struct mcap_writer *w;
    int channel[MCAP_CHANNELS_MAX]; /* of the new file, by those met so far: */
    size_t met;
    int pose_channel;
    uint32_t sequence;
};

static bool copy_new_channels(struct copying *c, struct fault *fault)
{
    const struct mcap_channel *from;
    for (; (from = mcap_channel_at(c->r, c->met)) != NULL; c->met++) {
        if (strcmp(from->topic, "/pose") == 0)
            return fault_set(fault, "it has poses of its own");
        c->channel[c->met] =
            mcap_add_channel(c->w, from->topic, from->encoding, from->metadata, from->n_metadata, fault);
        if (c->channel[c->met] < 0)
            return false;
    }
    return true;
}

static bool write_pose(struct copying *c, const struct pose_line *pose, struct fault *fault)
{
    const struct mcap_message message = {.sequence = c->sequence++,
                                         .log_ns = pose->t_ns,
                                         .publish_ns = pose->t_ns,
                                         .data = (const uint8_t *)pose->text,
                                         .size = strlen(pose->text)};
    return mcap_write_message(c->w, c->pose_channel, &message, fault);
}

/* All messages, and the poses between them. */
static bool copy_all(struct copying *c, const struct poses *poses, struct fault *fault)
{
    struct mcap_message m;
    size_t next = 0;
    c->pose_channel = mcap_add_channel(c->w, "/pose", "json", NULL, 0, fault);
    if (c->pose_channel < 0)
        return false;
    while (mcap_next(c->r, &m)) {
        if (!copy_new_channels(c, fault))
            return false;
        for (; next < poses->n && poses->line[next].t_ns <= m.log_ns; next++)
            if (!write_pose(c, &poses->line[next], fault))
                return false;
        if (!mcap_write_message(c->w, c->channel[m.channel->index], &m, fault))
            return false;
    }
    return true;
}

/* When the capture begins and ends, its largest message, and its clock. */
static bool survey(const char *path, struct span *span)
{
    struct mcap_reader *r = capture_open(path);
    struct mcap_message m;
    const bool opened = r != NULL;
    bool any = false;
    while (opened && mcap_next(r, &m)) {
        span->start_ns = !any || m.log_ns < span->start_ns ? m.log_ns : span->start_ns;
        span->end_ns = !any || m.log_ns > span->end_ns ? m.log_ns : span->end_ns;
        span->largest = m.size > span->largest ? m.size : span->largest;
        capture_clock_take(&span->clock, &m);
        any = true;
    }
    mcap_close(r);
    return opened;
}

/* Does a pose that the log dates t_unix_ns fall into the capture? *t_ns: the capture's time of it. */
static bool meets(const struct span *span, enum capture_clock_of of, uint64_t t_unix_ns, uint64_t *t_ns)
{
    *t_ns = t_unix_ns;
    return (!span->clock.noted || capture_clock_date(&span->clock, of, (int64_t)t_unix_ns, t_ns)) &&
           *t_ns >= from_ns(span) && *t_ns <= span->end_ns;
}

/* A log says nothing of its clock. Of those it may have been dated by, the one by which most poses meet the capture:
 * this computer's shows no time that it was set past, and other logs have poses there. A right clock goes first. */
static enum capture_clock_of clock_of(const struct span *span, const struct poses *poses)
{
    static const enum capture_clock_of all[] = {CAPTURE_CLOCK_RIGHT, CAPTURE_CLOCK_OWN, CAPTURE_CLOCK_NONE};
    enum capture_clock_of best = all[0];
    size_t best_n = 0;
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        uint64_t t_ns;
        size_t n = 0;
        for (size_t i = 0; i < poses->n; i++)
            n += meets(span, all[k], poses->line[i].t_ns, &t_ns);
        if (n > best_n + (best_n > 0 ? span->clock.n : 0)) { /* a pose at each step counts for rounding */
            best = all[k];
            best_n = n;
        }
    }
    return best;
}

static bool redate(struct pose_line *line, uint64_t t_ns)
{
    if (t_ns == line->t_ns)
        return true;
    json_t *pose = json_loads(line->text, 0, NULL);
    json_object_set_new(pose, "t_unix", json_real((double)t_ns / 1e9));
    free(line->text);
    *line = (struct pose_line){t_ns, json_dumps(pose, JSON_COMPACT | JSON_REAL_PRECISION(17))};
    json_decref(pose);
    return line->text != NULL;
}

/* A log of a clock that was set back has come by the same time twice. */
static int by_time(const void *a, const void *b)
{
    const struct pose_line *one = a, *other = b;
    return (one->t_ns > other->t_ns) - (one->t_ns < other->t_ns);
}

/* Those that fall into the capture, by its times; false with a sentence where none does. */
static bool cut_to(const struct span *span, struct poses *poses, struct fault *fault)
{
    const double first_s = (double)poses->line[0].t_ns * 1e-9,
                 last_s = (double)poses->line[poses->n - 1].t_ns * 1e-9;
    const size_t n = poses->n;
    bool good = true;
    poses->of = clock_of(span, poses);
    poses->n = 0;
    for (size_t i = 0; i < n; i++) {
        uint64_t t_ns;
        struct pose_line line = poses->line[i];
        if (meets(span, poses->of, line.t_ns, &t_ns)) {
            good = redate(&line, t_ns) && good;
            poses->line[poses->n++] = line;
        } else {
            free(line.text);
        }
    }
    poses->left_out = n - poses->n;
    if (!good)
        return fault_set(fault, "out of memory");
    if (poses->n == 0)
        return fault_set(fault,
                         "no pose falls into the capture: it is from %.3f to %.3f s, they are from %.3f to %.3f "
                         "s; --offset S moves them",
                         (double)span->start_ns * 1e-9, (double)span->end_ns * 1e-9, first_s, last_s);
    qsort(poses->line, poses->n, sizeof *poses->line, by_time);
    return true;
}

/* Nobody can know by which clock: whoever reads this may, and has --offset. */
static void tell_clock(const struct span *span, const struct poses *poses)
{
    static const char *const whose[] = {[CAPTURE_CLOCK_RIGHT] = "a clock that was right all the time",
                                        [CAPTURE_CLOCK_OWN] =
                                            "this computer's clock, which was not right at first",
                                        [CAPTURE_CLOCK_NONE] = "the capture's own times"};
    if (span->clock.noted)
        printf("the computer's clock was set, by %+.3f s in all; the poses are taken to be dated by %s\n",
               (double)capture_clock_ahead_ns(&span->clock) * 1e-9, whose[poses->of]);
}

static bool copy_attachments(const struct copying *c, struct fault *fault)
{
    struct mcap_attachment a;
    for (uint64_t at = 0; mcap_next_attachment(c->r, &at, &a);)
        if (a.crc_good && !mcap_attach(c->w, &a, fault))
            return false;
    return true;
}

static int write_capture(const char *path, const char *out_path, const struct poses *poses, size_t largest)
{
    static struct copying c;
    struct fault fault;
    int status = 1;
    c = (struct copying){.r = capture_open(path)};
    c.w = c.r ? capture_create(out_path, NULL, largest > MCAP_MESSAGE_BYTES ? largest : 0) : NULL;
    if (c.w)
        status =
            capture_finish(c.w, out_path, copy_attachments(&c, &fault) && copy_all(&c, poses, &fault), &fault);
    mcap_close(c.r);
    return status;
}

int capture_add_pose(const char *path, const char *poses_path, const char *out_path, double offset_s)
{
    struct span span = {0};
    struct poses poses = {0};
    struct fault fault;
    int status = 1;
    if (!survey(path, &span))
        return 1;
    if (!read_poses(poses_path, offset_s, &poses, &fault) || !cut_to(&span, &poses, &fault))
        fprintf(stderr, "sonarctl capture: %s\n", fault.text);
    else
        status = write_capture(path, out_path, &poses, span.largest);
    if (status == 0) {
        tell_clock(&span, &poses);
        printf("%zu poses added, %" PRIu64 " are of other times\n", poses.n, poses.left_out);
    }
    free_poses(&poses);
    return status;
}
