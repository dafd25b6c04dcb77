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
    uint64_t left_out;       /* not within the capture */
    const struct span *span; /* by whose clock they are dated */
    double offset_s;
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

/* By the capture's clock. */
static double date(const struct poses *poses, double t_unix)
{
    const struct span *span = poses->span;
    const int64_t given_ns = (int64_t)(t_unix * 1e9),
                  t_ns = capture_clock_date(&span->clock, given_ns, from_ns(span), span->end_ns);
    return t_ns == given_ns ? t_unix : (double)t_ns * 1e-9;
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
    const double t_s = date(poses, t_unix);
    if (t_s < 0) { /* long before the capture */
        poses->left_out++;
        return true;
    }
    json_object_set_new(pose, "t_unix", json_real(t_s));
    poses->line[poses->n] =
        (struct pose_line){(uint64_t)(t_s * 1e9), json_dumps(pose, JSON_COMPACT | JSON_REAL_PRECISION(17))};
    return poses->line[poses->n].text != NULL && ++poses->n > 0;
}

static bool take_line(struct poses *poses, const char *text, double *last_s, struct fault *fault)
{
    json_t *pose = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
    const json_t *t = json_object_get(pose, "t_unix");
    const double t_unix = json_number_value(t) + poses->offset_s;
    bool good = false;

    if (!json_is_number(t) || json_object_size(pose) < 2)
        fault_set(fault, "want a JSON object with t_unix and attitude_deg, quaternion, position_m, depth_m or "
                         "velocity_mps, as sonard-poses prints them");
    else if (!(t_unix >= 0 && t_unix <= UNIX_MOST_S))
        fault_set(fault, "t_unix and --offset make %g s: want 0 to %g", t_unix, UNIX_MOST_S);
    else if (t_unix < *last_s)
        fault_set(fault, "t_unix is before that of the line before: want the lines in order of time");
    else if (!(good = keep_pose(poses, pose, t_unix)))
        fault_set(fault, "out of memory");
    *last_s = t_unix;
    json_decref(pose);
    return good;
}

/* Before and after a step of the clock they may be dated by different ones. */
static int by_time(const void *a, const void *b)
{
    const struct pose_line *one = a, *other = b;
    return (one->t_ns > other->t_ns) - (one->t_ns < other->t_ns);
}

static bool read_poses(const char *path, struct poses *poses, struct fault *fault)
{
    FILE *file = fopen(path, "re");
    char text[LINE_BYTES];
    double last_s = 0;
    struct fault why;

    if (!file)
        return fault_set(fault, "%s: %s", path, strerror(errno));
    for (unsigned line = 1; fgets(text, sizeof text, file); line++) {
        if (text[strspn(text, " \t\r\n")] == '\0' || take_line(poses, text, &last_s, &why))
            continue;
        fclose(file);
        return fault_set(fault, "%s:%u: %s", path, line, why.text);
    }
    fclose(file);
    if (poses->n > 0)
        qsort(poses->line, poses->n, sizeof *poses->line, by_time);
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

/* Those that fall into the capture; false with a sentence where none does. */
static bool cut_to(struct poses *poses, struct fault *fault)
{
    const struct span *span = poses->span;
    const double first_s = (double)poses->line[0].t_ns * 1e-9,
                 last_s = (double)poses->line[poses->n - 1].t_ns * 1e-9;
    size_t kept = 0;

    for (size_t i = 0; i < poses->n; i++) {
        if (poses->line[i].t_ns >= from_ns(span) && poses->line[i].t_ns <= span->end_ns)
            poses->line[kept++] = poses->line[i];
        else
            free(poses->line[i].text);
    }
    poses->left_out += poses->n - kept;
    poses->n = kept;
    return kept > 0 ||
           fault_set(fault,
                     "no pose falls into the capture: it is from %.3f to %.3f s, they are from %.3f to %.3f "
                     "s; --offset S moves them",
                     (double)span->start_ns * 1e-9, (double)span->end_ns * 1e-9, first_s, last_s);
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
    c.w = c.r ? capture_create(out_path, largest > MCAP_MESSAGE_BYTES ? largest : 0) : NULL;
    if (c.w)
        status =
            capture_finish(c.w, out_path, copy_attachments(&c, &fault) && copy_all(&c, poses, &fault), &fault);
    mcap_close(c.r);
    return status;
}

int capture_add_pose(const char *path, const char *poses_path, const char *out_path, double offset_s)
{
    struct span span = {0};
    struct poses poses = {.span = &span, .offset_s = offset_s};
    struct fault fault;
    int status = 1;

    if (!survey(path, &span))
        return 1;
    if (!read_poses(poses_path, &poses, &fault) || !cut_to(&poses, &fault))
        fprintf(stderr, "sonarctl capture: %s\n", fault.text);
    else
        status = write_capture(path, out_path, &poses, span.largest);
    if (status == 0 && span.clock.n)
        printf("the computer's clock was set during the capture, %+.3f s in all: poses are dated by it\n",
               (double)capture_clock_ahead_ns(&span.clock) * 1e-9);
    if (status == 0)
        printf("%zu poses added, %" PRIu64 " are of other times\n", poses.n, poses.left_out);
    free_poses(&poses);
    return status;
}
