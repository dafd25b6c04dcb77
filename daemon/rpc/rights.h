/* SPDX-License-Identifier: MIT */
/*
 * rights - who of those that may connect may also change something: users and groups by the credentials that the kernel
 * keeps of a connection (SO_PEERCRED, SO_PEERGROUPS). Knows no methods.
 */
#ifndef SONARD_RIGHTS_H
#define SONARD_RIGHTS_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

#include "core/fault.h"

#define RIGHTS_TEXT_MAX 512 /* of [server] change, with its NUL */
#define RIGHTS_MAX      64  /* users, and groups: more names than a configuration has room for */

struct rights {
    bool all;
    /* the names that the system does not know, for people; cut where there is no more room; empty: none */
    char unknown[256];
    int n_users, n_groups;
    uid_t user[RIGHTS_MAX];
    gid_t group[RIGHTS_MAX];
};

/**
 * rights_set - from [server] change: "" or NULL (group: the socket's, `socket_group`), "all", or names of users,
 * @groups and their numbers. Root and the user of this process always may. Names that the system does not know give
 * nobody a right. Looks into the user database, which may be far away: for the start, and for a worker.
 */
void rights_set(struct rights *r, const char *change, gid_t socket_group);

/** rights_set_numbers - the same without a look: names give nobody a right. False: there are some. */
bool rights_set_numbers(struct rights *r, const char *change, gid_t socket_group);

/**
 * rights_judge - may the peer of the connected UNIX socket change something? False with a sentence in fault that names
 * its user and the setting.
 */
bool rights_judge(const struct rights *r, int fd, struct fault *fault);

#endif
