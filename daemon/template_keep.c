/* SPDX-License-Identifier: MIT */
/* template_keep - see template_keep.h. */
#include "template_keep.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "daemon.h"
#include "template_file.h"

/* ---- the thread ---- */

static void write_copies(struct template_keep *k)
{
    for (struct template_copy *c = k->copy; c < k->copy + CONF_MAX_SONARS; c++)
        if (c->bytes)
            c->good = template_write(c->bytes, c->size, c->path, c->message, sizeof c->message);
}

static void *keep_thread(void *arg)
{
    struct template_keep *k = arg;
    const uint64_t one = 1;
    write_copies(k);
    while (write(k->ended.fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
    return NULL;
}

/* ---- the loop ---- */

static void not_kept(const struct daemon *d, int sensor, const char *why)
{
    log_limited(loop_now(d->loop), LOG_ERR,
                LOG_ABOUT(.event = "background_not_kept", .sonar = d->conf.sonar[sensor].name),
                "background: not kept: %s", why);
}

static bool is_asked_for(const struct daemon *d, int sensor)
{
    for (const struct template_saving *s = d->keep.asked; s; s = s->next)
        if (s->sensor == sensor)
            return true;
    return false;
}

/* Copies every template that somebody asks for, and if it is time for that those that their files do not hold. */
static int copy_wanted(struct daemon *d, bool changed)
{
    int n = 0;
    for (int i = 0; i < d->conf.n_sonars; i++) {
        const struct template *t = &d->template[i];
        struct template_copy *c = &d->keep.copy[i];
        if (!t->background || !d->conf.sonar[i].background[0] ||
            !((changed && t->made != t->in_file) || is_asked_for(d, i)))
            continue;
        *c = (struct template_copy){.made = t->made};
        snprintf(c->path, sizeof c->path, "%s", d->conf.sonar[i].background);
        c->bytes = template_encode(t->background, &c->size);
        if (!c->bytes)
            not_kept(d, i, "out of memory");
        n += c->bytes != NULL;
    }
    return n;
}

/* Those who wait for this sonar's file, which is under way or is not, have waited long enough. */
static void tell(struct template_keep *k, int sensor, bool under_way, bool good, const char *why)
{
    for (struct template_saving **at = &k->asked; *at;) {
        struct template_saving *s = *at;
        if (s->sensor != sensor || s->under_way != under_way) {
            at = &s->next;
            continue;
        }
        *at = s->next;
        s->done = true;
        s->good = good;
        snprintf(s->message, sizeof s->message, "%s", why);
    }
}

/* The copies have been written, or not. */
static void settle(struct daemon *d)
{
    for (int i = 0; i < d->conf.n_sonars; i++) {
        struct template_copy *c = &d->keep.copy[i];
        if (!c->bytes)
            continue;
        free(c->bytes);
        c->bytes = NULL;
        if (c->good)
            template_kept(d, i, c->made, c->path);
        else
            not_kept(d, i, c->message);
        tell(&d->keep, i, true, c->good, c->message);
    }
}

/* What is asked for and cannot be copied is told at once. */
static void mark_under_way(struct daemon *d)
{
    for (struct template_saving *s = d->keep.asked; s; s = s->next)
        s->under_way = d->keep.copy[s->sensor].bytes != NULL;
    for (int i = 0; i < d->conf.n_sonars; i++)
        tell(&d->keep, i, false, false,
             d->template[i].background ? "out of memory" : "there is no template to save");
}

static void begin(struct daemon *d, bool changed)
{
    struct template_keep *k = &d->keep;
    const int n = copy_wanted(d, changed);
    mark_under_way(d);
    if (n == 0)
        return;
    k->running = pthread_create(&k->thread, NULL, keep_thread, k) == 0;
    if (k->running)
        return;
    for (int i = 0; i < d->conf.n_sonars; i++)
        snprintf(k->copy[i].message, sizeof k->copy[i].message, "cannot start a thread");
    settle(d);
}

static void wait_for_thread(struct daemon *d)
{
    struct template_keep *k = &d->keep;
    uint64_t n;
    if (!k->running)
        return;
    pthread_join(k->thread, NULL);
    k->running = false;
    while (read(k->ended.fd, &n, sizeof n) < 0 && errno == EINTR) {
    }
    settle(d);
}

static void on_ended(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct daemon *d = ctx;
    (void)events;
    (void)now_ns;
    wait_for_thread(d);
    if (d->keep.asked)
        begin(d, false);
    if (d->server)
        server_go_on(d->server);
}

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct daemon *d = ctx;
    loop_arm(d->loop, &d->keep.timer, now_ns + (uint64_t)(d->conf.background.save_every_s * 1e9));
    if (!d->keep.running)
        begin(d, true);
}

void template_keep_save(struct daemon *d, int sensor, struct template_saving *saving)
{
    struct template_keep *k = &d->keep;
    *saving = (struct template_saving){.d = d, .sensor = sensor, .next = k->asked};
    k->asked = saving;
    if (!k->running)
        begin(d, false);
}

void template_keep_forget(struct template_saving *saving)
{
    struct template_saving **at = &saving->d->keep.asked;
    while (*at && *at != saving)
        at = &(*at)->next;
    if (*at)
        *at = saving->next;
}

bool template_keep_start(struct daemon *d, char *err, size_t err_size)
{
    struct template_keep *k = &d->keep;
    k->ended = (struct loop_fd){.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), .ready = on_ended, .ctx = d};
    if (k->ended.fd < 0 || !loop_add(d->loop, &k->ended, EPOLLIN)) {
        snprintf(err, err_size, "background: %s", strerror(errno));
        return false;
    }
    if (d->replay || !(d->conf.background.save_every_s > 0))
        return true;
    k->timer = (struct loop_timer){.fire = on_timer, .ctx = d};
    loop_arm(d->loop, &k->timer, loop_now(d->loop) + (uint64_t)(d->conf.background.save_every_s * 1e9));
    return true;
}

void template_keep_end(struct daemon *d)
{
    struct template_keep *k = &d->keep;
    if (!k->ended.ready)
        return;
    wait_for_thread(d);
    if (k->timer.fire && copy_wanted(d, true) > 0) {
        write_copies(k);
        settle(d);
    }
    loop_arm(d->loop, &k->timer, LOOP_NEVER);
    loop_remove(d->loop, &k->ended);
    if (k->ended.fd >= 0)
        close(k->ended.fd);
}
