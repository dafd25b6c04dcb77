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

static void move(struct template_copy *c)
{
    enum template_fault fault;
    if (c->way == TEMPLATE_TO_FILE)
        c->good = template_write(c->bytes, c->size, c->path, c->message, sizeof c->message);
    else if (c->way == TEMPLATE_FROM_FILE)
        c->read = template_load(c->path, c->mask, &fault, c->message, sizeof c->message);
}

static void move_all(struct template_keep *k)
{
    for (struct template_copy *c = k->copy; c < k->copy + CONF_MAX_SONARS; c++)
        move(c);
}

static void *keep_thread(void *arg)
{
    struct template_keep *k = arg;
    const uint64_t one = 1;
    move_all(k);
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

static bool is_asked_for(const struct daemon *d, int sensor, enum template_way way)
{
    for (const struct template_wait *s = d->keep.asked; s; s = s->next)
        if (s->sensor == sensor && s->way == way)
            return true;
    return false;
}

static void copy_one(struct daemon *d, int sensor)
{
    const struct template *t = &d->template[sensor];
    struct template_copy *c = &d->keep.copy[sensor];
    c->made = t->made;
    c->bytes = template_encode(t->background, &c->size);
    if (c->bytes)
        c->way = TEMPLATE_TO_FILE;
    else
        not_kept(d, sensor, "out of memory");
}

/* Copies every template that somebody wants saved, and if it is time for that those that their files do not hold; where
 * there is none of a sonar, its file may be read. How many are on their way. */
static int copy_wanted(struct daemon *d, bool changed)
{
    int n = 0;
    for (int i = 0; i < d->conf.n_sonars; i++) {
        const struct template *t = &d->template[i];
        struct template_copy *c = &d->keep.copy[i];
        *c = (struct template_copy){.mask = (uint8_t)d->conf.background.mask};
        snprintf(c->path, sizeof c->path, "%s", d->conf.sonar[i].background);
        if (t->background && c->path[0] &&
            ((changed && t->made != t->in_file) || is_asked_for(d, i, TEMPLATE_TO_FILE)))
            copy_one(d, i);
        if (c->way == TEMPLATE_STAYS && is_asked_for(d, i, TEMPLATE_FROM_FILE))
            c->way = TEMPLATE_FROM_FILE;
        n += c->way != TEMPLATE_STAYS;
    }
    return n;
}

/* Those who wait for this sonar's file, which is under way or is not, have waited long enough. */
static void tell(struct template_keep *k, int sensor, enum template_way way, bool under_way, bool good,
                 const char *why)
{
    for (struct template_wait **at = &k->asked; *at;) {
        struct template_wait *s = *at;
        if (s->sensor != sensor || s->way != way || s->under_way != under_way) {
            at = &s->next;
            continue;
        }
        *at = s->next;
        s->done = true;
        s->good = good;
        snprintf(s->message, sizeof s->message, "%s", why);
    }
}

/* It has been written or read, or not. */
static void settle_one(struct daemon *d, int sensor)
{
    struct template_copy *c = &d->keep.copy[sensor];
    if (c->way == TEMPLATE_FROM_FILE)
        c->good = c->read && template_put(d, sensor, c->read, c->path, c->message, sizeof c->message);
    else if (c->good)
        template_kept(d, sensor, c->made, c->path);
    else
        not_kept(d, sensor, c->message);
    free(c->bytes);
    c->bytes = NULL;
    tell(&d->keep, sensor, c->way, true, c->good, c->message);
    c->way = TEMPLATE_STAYS;
}

static void settle(struct daemon *d)
{
    for (int i = 0; i < d->conf.n_sonars; i++)
        if (d->keep.copy[i].way != TEMPLATE_STAYS)
            settle_one(d, i);
}

/* What is asked for and cannot be copied is told at once. */
static void mark_under_way(struct daemon *d)
{
    for (struct template_wait *s = d->keep.asked; s; s = s->next)
        s->under_way = d->keep.copy[s->sensor].way == s->way;
    for (int i = 0; i < d->conf.n_sonars; i++)
        tell(&d->keep, i, TEMPLATE_TO_FILE, false, false,
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
}

/* There is no pipeline any more that a template could be put in force in. */
static void drop_what_was_read(struct template_keep *k)
{
    for (struct template_copy *c = k->copy; c < k->copy + CONF_MAX_SONARS; c++)
        if (c->way == TEMPLATE_FROM_FILE) {
            free(c->read);
            c->way = TEMPLATE_STAYS;
        }
}

static void on_ended(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct daemon *d = ctx;
    (void)events;
    (void)now_ns;
    wait_for_thread(d);
    settle(d);
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

void template_keep_ask(struct daemon *d, int sensor, enum template_way way, struct template_wait *wait)
{
    struct template_keep *k = &d->keep;
    *wait = (struct template_wait){.d = d, .sensor = sensor, .way = way, .next = k->asked};
    k->asked = wait;
    if (!k->running)
        begin(d, false);
}

void template_keep_forget(struct template_wait *wait)
{
    struct template_wait **at = &wait->d->keep.asked;
    while (*at && *at != wait)
        at = &(*at)->next;
    if (*at)
        *at = wait->next;
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
    drop_what_was_read(k);
    settle(d);
    if (k->timer.fire && copy_wanted(d, true) > 0) {
        move_all(k);
        settle(d);
    }
    loop_arm(d->loop, &k->timer, LOOP_NEVER);
    loop_remove(d->loop, &k->ended);
    if (k->ended.fd >= 0)
        close(k->ended.fd);
}
