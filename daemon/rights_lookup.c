/* SPDX-License-Identifier: MIT */
#include "rights_lookup.h"

#include <errno.h>
#include <stdio.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

static void *look(void *arg)
{
    struct rights_lookup *l = arg;
    const uint64_t one = 1;
    rights_set(&l->found, l->change, l->socket_group);
    while (write(l->ended.fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
    return NULL;
}

/* The thread has ended, or is about to. */
static void take_end(struct rights_lookup *l)
{
    pthread_join(l->thread, NULL);
    loop_remove(l->loop, &l->ended);
    close(l->ended.fd);
    l->running = false;
}

static void on_ended(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct rights_lookup *l = ctx;
    (void)events, (void)now_ns;
    take_end(l);
    if (l->again)
        rights_lookup_begin(l, l->wanted);
    else
        l->done(l->ctx, &l->found);
}

bool rights_lookup_begin(struct rights_lookup *l, const char *change)
{
    l->again = l->running;
    if (change != l->wanted)
        snprintf(l->wanted, sizeof l->wanted, "%s", change);
    if (l->running)
        return true;
    snprintf(l->change, sizeof l->change, "%s", l->wanted);
    l->ended = (struct loop_fd){.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), .ready = on_ended, .ctx = l};
    l->running = l->ended.fd >= 0 && loop_add(l->loop, &l->ended, EPOLLIN);
    if (l->running && (errno = pthread_create(&l->thread, NULL, look, l)) != 0) {
        loop_remove(l->loop, &l->ended);
        l->running = false;
    }
    if (!l->running && l->ended.fd >= 0)
        close(l->ended.fd);
    return l->running;
}

void rights_lookup_end(struct rights_lookup *l)
{
    if (l->running)
        take_end(l);
}
