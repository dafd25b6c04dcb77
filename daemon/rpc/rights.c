/* SPDX-License-Identifier: MIT */
#include "rights.h"

#include <errno.h>
#include <grp.h>
#include <limits.h>
#include <pwd.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define SEPARATORS      " \t,"
#define PEER_GROUPS_MAX 1024 /* whoever is in more is judged by his user and first group alone */

/* A whole number, all of the text, that an id can have: not (id_t)-1, which means none. */
static bool id_in(const char *text, id_t *id)
{
    char *end;
    if (*text < '0' || *text > '9')
        return false;
    errno = 0;
    const unsigned long value = strtoul(text, &end, 10);
    *id = (id_t)value;
    return *end == '\0' && errno == 0 && value < UINT32_MAX;
}

static void add_user(struct rights *r, uid_t user)
{
    if (r->n_users < RIGHTS_MAX)
        r->user[r->n_users++] = user;
}

static void add_group(struct rights *r, gid_t group)
{
    if (r->n_groups < RIGHTS_MAX)
        r->group[r->n_groups++] = group;
}

/* The id of a name without its @; false: the system does not know it. */
static bool look_up(const char *name, bool is_group, id_t *id)
{
    const struct group *group = is_group ? getgrnam(name) : NULL;
    const struct passwd *user = is_group ? NULL : getpwnam(name);
    if (group)
        *id = group->gr_gid;
    if (user)
        *id = user->pw_uid;
    return group || user;
}

static void note_unknown(struct rights *r, const char *name, bool is_group)
{
    const size_t n = strlen(r->unknown);
    snprintf(r->unknown + n, sizeof r->unknown - n, "%sno %s '%s'", n > 0 ? ", " : "", is_group ? "group" : "user",
             name);
}

static void set(struct rights *r, const char *change, gid_t socket_group, bool with_names)
{
    char names[512], *rest = NULL;
    change = change ? change : "";
    *r = (struct rights){.all = strcmp(change, "all") == 0};
    add_user(r, 0);
    add_user(r, geteuid());
    if (*change == '\0')
        add_group(r, socket_group);
    if (r->all)
        return;
    snprintf(names, sizeof names, "%s", change);
    for (char *name = strtok_r(names, SEPARATORS, &rest); name; name = strtok_r(NULL, SEPARATORS, &rest)) {
        const bool is_group = *name == '@';
        id_t id;
        if (!id_in(name + is_group, &id) && !(with_names && look_up(name + is_group, is_group, &id)))
            note_unknown(r, name + is_group, is_group);
        else if (is_group)
            add_group(r, id);
        else
            add_user(r, id);
    }
}

void rights_set(struct rights *r, const char *change, gid_t socket_group)
{
    set(r, change, socket_group, true);
}

bool rights_set_numbers(struct rights *r, const char *change, gid_t socket_group)
{
    set(r, change, socket_group, false);
    return r->unknown[0] == '\0';
}

static bool has_group(const struct rights *r, gid_t group)
{
    for (int i = 0; i < r->n_groups; i++)
        if (r->group[i] == group)
            return true;
    return false;
}

static bool may(const struct rights *r, int fd, const struct ucred *peer)
{
    gid_t groups[PEER_GROUPS_MAX];
    socklen_t size = sizeof groups;
    for (int i = 0; i < r->n_users; i++)
        if (r->user[i] == peer->uid)
            return true;
    if (has_group(r, peer->gid))
        return true;
    if (getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, groups, &size) < 0)
        return false;
    for (size_t i = 0; i < size / sizeof *groups; i++)
        if (has_group(r, groups[i]))
            return true;
    return false;
}

bool rights_judge(const struct rights *r, int fd, struct fault *fault)
{
    struct ucred peer;
    socklen_t size = sizeof peer;
    if (r->all)
        return true;
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) < 0)
        return fault_set(fault, "no permission to make changes: the client is unknown (%s)", strerror(errno));
    if (may(r, fd, &peer))
        return true;
    return fault_set(fault,
                     "user %u, group %u may query but not make changes: see change in [server] of sonard.conf",
                     (unsigned)peer.uid, (unsigned)peer.gid);
}
