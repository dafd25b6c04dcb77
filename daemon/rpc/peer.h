/* SPDX-License-Identifier: MIT */
/*
 * peer - who is at the other end of a UNIX socket: the user and the process by the kernel's credentials (SO_PEERCRED),
 * and the program by the name that /proc gives the process. A program can choose its name: what goes by it guards
 * against greed, not against malice. And the list of those for whom places are kept. Knows no sessions.
 */
#ifndef SONARD_PEER_H
#define SONARD_PEER_H

#include <stdbool.h>
#include <sys/types.h>

#define PEER_PROGRAM_SIZE 16 /* of a name in /proc/PID/comm, with its NUL */
#define PEER_WHO_SIZE     80
#define KEEP_TEXT_MAX     512 /* of [server] keep, with its NUL */
#define KEEP_MAX          64

struct peer {
    uid_t uid;                       /* (uid_t)-1: not known */
    pid_t pid;                       /* 0: not known, or of another container */
    char program[PEER_PROGRAM_SIZE]; /* "": not known; such processes of a user count as one program */
};

/** peer_of - of the connected socket. */
void peer_of(int fd, struct peer *out);

/** peer_who - "process 12 of user 1000, sonard-web". */
const char *peer_who(const struct peer *peer, char text[PEER_WHO_SIZE]);

/** peer_order - by user and program, below, at or above 0 as of strcmp; peer_same_program - is it 0? */
int peer_order(const struct peer *a, const struct peer *b);
bool peer_same_program(const struct peer *a, const struct peer *b);

struct keep {
    int n, n_users;
    char program[KEEP_MAX][PEER_PROGRAM_SIZE];
    uid_t user[KEEP_MAX];
    bool unknown; /* some names are those of no user, as far as known */
};

/** keep_set - from [server] keep: names of programs, and of users, with blanks or commas between; names of users only
 * when they are looked up, which may take long. */
void keep_set(struct keep *keep, const char *names, bool look_up);

/** keep_has - is a place kept for it? */
bool keep_has(const struct keep *keep, const struct peer *peer);

#endif
