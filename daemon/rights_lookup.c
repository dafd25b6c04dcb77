/* SPDX-License-Identifier: MIT */
#include "rights_lookup.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

/* One look: of its thread until that says so in fd, ... */
struct rights_look {
    char change[RIGHTS_TEXT_MAX];
    gid_t socket_group;
    struct rights found;
    int fd;           /* an eventfd */
    atomic_bool left; /* ... and there as long as the thread or the loop has not left it */
};

static void leave(struct rights_look *look)
{
    if (!atomic_exchange(&look->left, true))
        return;
    close(look->fd);
    free(look);
}

static void *look_up(void *arg)
{
    struct rights_look *look = arg;
    const uint64_t one = 1;
    rights_set(&look->found, look->change, look->socket_group);
    while (write(look->fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
    leave(look);
    return NULL;
}

/* The loop has what it wanted, or wants it no more. */
static void take_leave(struct rights_lookup *l)
{
    loop_remove(l->loop, &l->ended);
    leave(l->look);
    l->look = NULL;
}

static void on_ended(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct rights_lookup *l = ctx;
    uint64_t n;
    (void)events, (void)now_ns;
    if (read(l->ended.fd, &n, sizeof n) != sizeof n)
        return;
    const struct rights found = l->look->found;
    take_leave(l);
    if (l->again)
        rights_lookup_begin(l, l->wanted);
    else
        l->done(l->ctx, &found);
}

/* A look that is under way; NULL: it cannot be had (errno). */
static struct rights_look *begin(const char *change, gid_t socket_group)
{
    struct rights_look *look = calloc(1, sizeof *look);
    pthread_t thread;
    if (!look)
        return NULL;
    snprintf(look->change, sizeof look->change, "%s", change);
    look->socket_group = socket_group;
    look->fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (look->fd >= 0 && (errno = pthread_create(&thread, NULL, look_up, look)) == 0) {
        pthread_detach(thread);
        return look;
    }
    if (look->fd >= 0)
        close(look->fd);
    free(look);
    return NULL;
}

/* False: it cannot be had (errno). */
static bool look(struct rights_lookup *l)
{
    l->look = begin(l->wanted, l->socket_group);
    if (!l->look)
        return false;
    l->ended = (struct loop_fd){.fd = l->look->fd, .ready = on_ended, .ctx = l};
    if (loop_add(l->loop, &l->ended, EPOLLIN))
        return true;
    leave(l->look);
    l->look = NULL;
    return false;
}

void rights_lookup_begin(struct rights_lookup *l, const char *change)
{
    l->again = l->look != NULL;
    if (change != l->wanted)
        snprintf(l->wanted, sizeof l->wanted, "%s", change);
    if (!l->look && !look(l))
        l->done(l->ctx, NULL);
}

void rights_lookup_end(struct rights_lookup *l)
{
    if (l->look)
        take_leave(l);
}
