/* SPDX-License-Identifier: MIT */
#include "peer.h"

#include <fcntl.h>
#include <pwd.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define SEPARATORS " \t,"

/* The process may have ended by now, and another have its number: then it has that one's name. */
static void read_program(struct peer *peer)
{
    char path[32];
    snprintf(path, sizeof path, "/proc/%ld/comm", (long)peer->pid);
    const int fd = peer->pid > 0 ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (fd < 0)
        return;
    const ssize_t n = read(fd, peer->program, sizeof peer->program - 1);
    peer->program[n > 0 ? n : 0] = '\0';
    for (char *c = peer->program; *c; c++)
        if (*c == '\n')
            *c = '\0';
        else if (*c < ' ' || *c > '~')
            *c = '?';
    close(fd);
}

void peer_of(int fd, struct peer *out)
{
    struct ucred credentials;
    socklen_t size = sizeof credentials;
    *out = (struct peer){.uid = (uid_t)-1};
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &size) < 0)
        return;
    out->uid = credentials.uid;
    out->pid = credentials.pid;
    read_program(out);
}

const char *peer_who(const struct peer *peer, char text[PEER_WHO_SIZE])
{
    snprintf(text, PEER_WHO_SIZE, "process %lld of user %lld%s%s", (long long)peer->pid, (long long)peer->uid,
             peer->program[0] ? ", " : "", peer->program);
    return text;
}

int peer_order(const struct peer *a, const struct peer *b)
{
    if (a->uid != b->uid)
        return a->uid < b->uid ? -1 : 1;
    return strcmp(a->program, b->program);
}

bool peer_same_program(const struct peer *a, const struct peer *b)
{
    return peer_order(a, b) == 0;
}

void keep_set(struct keep *keep, const char *names, bool look_up)
{
    char text[KEEP_TEXT_MAX], *rest = NULL;
    *keep = (struct keep){.n = 0};
    snprintf(text, sizeof text, "%s", names ? names : "");
    for (char *name = strtok_r(text, SEPARATORS, &rest); name && keep->n < KEEP_MAX;
         name = strtok_r(NULL, SEPARATORS, &rest)) {
        const struct passwd *user = look_up ? getpwnam(name) : NULL;
        snprintf(keep->program[keep->n++], PEER_PROGRAM_SIZE, "%.*s", PEER_PROGRAM_SIZE - 1, name);
        if (user)
            keep->user[keep->n_users++] = user->pw_uid;
        else
            keep->unknown = true;
    }
}

bool keep_has(const struct keep *keep, const struct peer *peer)
{
    for (int i = 0; i < keep->n_users; i++)
        if (keep->user[i] == peer->uid)
            return true;
    for (int i = 0; i < keep->n; i++)
        if (strcmp(keep->program[i], peer->program) == 0)
            return true;
    return false;
}
