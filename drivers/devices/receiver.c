/* SPDX-License-Identifier: MIT */
#include "receiver.h"

#include <math.h>

#define NEVER      UINT64_MAX
#define CONFIDENCE 0.9f

void receiver_init(struct receiver *l, const struct device_conf *conf, const char *subject, uint64_t patience_ns)
{
    *l = (struct receiver){.conf = *conf, .subject = subject, .patience_ns = patience_ns, .due_ns = NEVER};
}

/* Where the bytes alone were recorded, nothing else is waited for. */
static void wait_for_more(struct receiver *l, uint64_t now_ns)
{
    l->due_ns = l->conf.listen_only ? NEVER : now_ns + l->patience_ns;
}

bool receiver_talks(const struct receiver *l, uint64_t now_ns, unsigned *talker)
{
    *talker = l->talker;
    return l->talking && now_ns - l->t_talker_ns <= l->patience_ns;
}

bool receiver_hears(struct receiver *l, unsigned talker, uint64_t now_ns)
{
    unsigned held;
    if (receiver_talks(l, now_ns, &held) && held != talker) {
        l->status.strangers++;
        return false;
    }
    l->talking = true;
    l->talker = talker;
    l->t_talker_ns = now_ns;
    return true;
}

void receiver_heard(struct receiver *l, uint64_t now_ns, const struct device_io *io)
{
    if (!l->heard || l->silent)
        io->note(io->ctx, NOTE_INFO, "%s heard", l->status.what[0] ? l->status.what : l->subject);
    l->heard = true;
    l->silent = false;
    l->status.frames++;
    wait_for_more(l, now_ns);
}

void receiver_ping(struct receiver *l, const struct receiver_range *range, uint64_t now_ns,
                   const struct device_io *io)
{
    double range_max_m = range->range_max_m > 0 ? range->range_max_m : l->conf.range_m;
    double travel_ns = 2e9 * range->range_m / l->conf.sound_speed_mps;
    l->status.pings++;
    l->status.last_ping_ns = now_ns;
    l->status.range_m = range_max_m;
    struct ping *ping = io->ping_begin(io->ctx);
    if (!ping)
        return;
    ping->t_ns = (double)now_ns > travel_ns ? now_ns - (uint64_t)travel_ns : 0;
    ping->t_in_ns = now_ns;
    ping->kind = PING_RANGES;
    ping->flags = (uint8_t)(PING_NEW_TURN | (range->unheard ? PING_UNHEARD : 0));
    ping->n_beams = 1;
    ping->n_bins = 1;
    ping->r0_m = (float)range->range_min_m;
    ping->dr_m = (float)range_max_m - ping->r0_m;
    ping->az_aperture_rad = ping->el_aperture_rad = (float)range->aperture_rad;
    ping->beam[0] = (struct ping_beam){
        .range_m = (float)range->range_m,
        .range_sd_m = (float)fmax(fmax(0.01 * range->range_m, 0.02), range->resolution_m),
        .confidence = CONFIDENCE,
    };
    io->ping_done(io->ctx, ping);
}

void receiver_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct receiver *l = state;
    (void)io;
    l->open = true;
    l->heard = l->silent = false;
    wait_for_more(l, now_ns);
}

void receiver_closed(void *state, uint64_t now_ns)
{
    struct receiver *l = state;
    (void)now_ns;
    l->open = false;
    l->due_ns = NEVER;
}

void receiver_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct receiver *l = state;
    if (now_ns < l->due_ns)
        return;
    l->due_ns = NEVER;
    l->silent = true;
    l->status.timeouts++;
    io->note(io->ctx, NOTE_WARNING, "no data from a %s; still listening", l->subject);
}

uint64_t receiver_deadline(const void *state)
{
    const struct receiver *l = state;
    return l->due_ns;
}

void receiver_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    (void)io;
    receiver_closed(state, now_ns);
}

void receiver_status(const void *state, struct device_status *out)
{
    const struct receiver *l = state;
    *out = l->status;
    out->state = !l->open    ? DEVICE_CLOSED
                 : l->silent ? DEVICE_SILENT
                 : l->heard  ? DEVICE_RUNNING
                             : DEVICE_IDENTIFY;
}
