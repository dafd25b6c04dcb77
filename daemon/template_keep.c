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

/* Copies every template that its file does not hold; how many. */
static int copy_changed(struct daemon *d)
{
    int n = 0;
    for (int i = 0; i < d->conf.n_sonars; i++) {
        const struct template *t = &d->template[i];
        struct template_copy *c = &d->keep.copy[i];
        if (!t->background || t->made == t->in_file || !d->conf.sonar[i].background[0])
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
            template_kept(d, i, c->made);
        else
            not_kept(d, i, c->message);
    }
}

void template_keep_wait(struct daemon *d)
{
    struct template_keep *k = &d->keep;
    uint64_t n;
    if (!k->running)
        return;
    pthread_join(k->thread, NULL);
    k->running = false;
    if (read(k->ended.fd, &n, sizeof n) < 0)
        return; /* it could not tell us either */
    settle(d);
}

static void on_ended(void *ctx, uint32_t events, uint64_t now_ns)
{
    (void)events;
    (void)now_ns;
    template_keep_wait(ctx);
}

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct daemon *d = ctx;
    struct template_keep *k = &d->keep;
    loop_arm(d->loop, &k->timer, now_ns + (uint64_t)(d->conf.background.save_every_s * 1e9));
    if (k->running || copy_changed(d) == 0)
        return;
    k->running = pthread_create(&k->thread, NULL, keep_thread, k) == 0;
    if (k->running)
        return;
    for (int i = 0; i < d->conf.n_sonars; i++)
        snprintf(k->copy[i].message, sizeof k->copy[i].message, "cannot start a thread");
    settle(d);
}

bool template_keep_start(struct daemon *d, char *err, size_t err_size)
{
    struct template_keep *k = &d->keep;
    if (d->replay || !(d->conf.background.save_every_s > 0))
        return true;
    k->ended = (struct loop_fd){.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), .ready = on_ended, .ctx = d};
    if (k->ended.fd < 0 || !loop_add(d->loop, &k->ended, EPOLLIN)) {
        snprintf(err, err_size, "background: %s", strerror(errno));
        return false;
    }
    k->timer = (struct loop_timer){.fire = on_timer, .ctx = d};
    loop_arm(d->loop, &k->timer, loop_now(d->loop) + (uint64_t)(d->conf.background.save_every_s * 1e9));
    return true;
}

void template_keep_end(struct daemon *d)
{
    struct template_keep *k = &d->keep;
    if (!k->timer.fire)
        return;
    template_keep_wait(d);
    if (copy_changed(d) > 0) {
        write_copies(k);
        settle(d);
    }
    loop_arm(d->loop, &k->timer, LOOP_NEVER);
    loop_remove(d->loop, &k->ended);
    close(k->ended.fd);
}
