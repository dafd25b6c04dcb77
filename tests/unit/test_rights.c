/* SPDX-License-Identifier: MIT */
/* test_rights - who may change something: from the setting to the credentials of a connection's peer. */
#include "../lib/test.h"

#include <pwd.h>
#include <semaphore.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "../../daemon/rights.h"
#include "../../daemon/rights_lookup.h"

#define SOCKET_GROUP 4242

TEST(nothing_said_means_the_sockets_group)
{
    struct rights said = {0}, unsaid = {0};
    rights_set(&said, "", SOCKET_GROUP);
    rights_set(&unsaid, NULL, SOCKET_GROUP);
    CHECK(memcmp(&said, &unsaid, sizeof said) == 0);
    CHECK(!unsaid.all);
    CHECK_INT(unsaid.n_groups, 1);
    CHECK_INT(unsaid.group[0], SOCKET_GROUP);
}

TEST(names_and_numbers)
{
    struct rights r;
    rights_set(&r, "123, @456 nobody-of-this-name", SOCKET_GROUP);
    CHECK_INT(r.n_users, 3); /* root and this process before */
    CHECK_INT(r.user[2], 123);
    CHECK_INT(r.n_groups, 1); /* not the socket's */
    CHECK_INT(r.group[0], 456);
    CHECK_STR(r.unknown, "no user 'nobody-of-this-name'");
}

TEST(without_a_look_names_give_nobody_a_right)
{
    struct rights r;
    CHECK(rights_set_numbers(&r, "all", SOCKET_GROUP) && r.all);
    CHECK(rights_set_numbers(&r, "123, @456", SOCKET_GROUP));
    CHECK_INT(r.n_users, 3);
    CHECK_INT(r.n_groups, 1);
    CHECK(!rights_set_numbers(&r, "123 daemon @daemon", SOCKET_GROUP));
    CHECK_INT(r.n_users, 3);
    CHECK_INT(r.n_groups, 0);
    rights_set(&r, "123 daemon @daemon", SOCKET_GROUP);
    CHECK_STR(r.unknown, "");
    CHECK_INT(r.n_users, 4);
    CHECK_INT(r.n_groups, 1);
}

static int n_told, n_failed;
static struct rights told;

static void tell(void *ctx, const struct rights *r)
{
    (void)ctx;
    if (r)
        told = *r;
    else
        n_failed++;
    n_told += r != NULL;
}

/* What is asked for while a look is under way comes after it, and only the last of it is told. */
TEST(names_are_looked_up_beside_the_loop)
{
    struct loop *loop = loop_new(false);
    struct rights_lookup lookup = {.loop = loop, .socket_group = SOCKET_GROUP, .done = tell};
    rights_lookup_begin(&lookup, "daemon, nobody-of-this-name");
    rights_lookup_begin(&lookup, "@nobody-of-this-name");
    rights_lookup_begin(&lookup, "123 daemon");
    for (int i = 0; i < 1000 && n_told == 0; i++)
        loop_turn(loop, 10000000);
    CHECK_INT(n_told, 1);
    CHECK_INT(told.n_users, 4);
    CHECK_STR(told.unknown, "");
    rights_lookup_begin(&lookup, "@nobody-of-this-name");
    rights_lookup_end(&lookup);
    CHECK_INT(n_told, 1);
    loop_free(loop);
}

/* In the place of the C library's: one name is never answered for, as where the user database is not reached. */
static sem_t never;

struct passwd *getpwnam(const char *name)
{
    static struct passwd user;
    static char text[4096];
    struct passwd *found = NULL;
    if (strcmp(name, "far-away") == 0)
        while (sem_wait(&never) != 0)
            ;
    getpwnam_r(name, &user, text, sizeof text, &found);
    return found;
}

/* The look that is left goes on for itself, and frees what it has. */
TEST(who_ends_does_not_wait_for_a_look)
{
    struct loop *loop = loop_new(false);
    struct rights_lookup lookup = {.loop = loop, .socket_group = SOCKET_GROUP, .done = tell};
    n_told = 0;
    rights_lookup_begin(&lookup, "far-away");
    loop_turn(loop, 0);
    rights_lookup_end(&lookup);
    CHECK_INT(sem_post(&never), 0);
    loop_turn(loop, 10000000);
    CHECK_INT(n_told, 0);
    loop_free(loop);
}

/* What was asked for while a look was under way cannot begin, for there is no descriptor: that is told, too. */
TEST(a_look_that_cannot_begin_is_told)
{
    struct loop *loop = loop_new(false);
    struct rights_lookup lookup = {.loop = loop, .socket_group = SOCKET_GROUP, .done = tell};
    struct rlimit before, none;
    n_told = n_failed = 0;
    rights_lookup_begin(&lookup, "far-away");
    rights_lookup_begin(&lookup, "daemon");
    CHECK_INT(getrlimit(RLIMIT_NOFILE, &before), 0);
    none = (struct rlimit){.rlim_cur = 3, .rlim_max = before.rlim_max}; /* those that every process has */
    CHECK_INT(setrlimit(RLIMIT_NOFILE, &none), 0);
    CHECK_INT(sem_post(&never), 0);
    for (int i = 0; i < 1000 && n_told + n_failed == 0; i++)
        loop_turn(loop, 10000000);
    CHECK_INT(setrlimit(RLIMIT_NOFILE, &before), 0);
    CHECK(n_told == 0 && n_failed == 1);
    rights_lookup_end(&lookup);
    loop_free(loop);
}

TEST(the_user_of_the_process_may_and_who_is_not_known_may_not)
{
    struct rights r;
    char why[128] = "";
    int end[2];
    rights_set(&r, NULL, SOCKET_GROUP);
    CHECK(socketpair(AF_UNIX, SOCK_STREAM, 0, end) == 0);
    CHECK(rights_judge(&r, end[0], why, sizeof why));
    r = (struct rights){0};
    CHECK(!rights_judge(&r, end[0], why, sizeof why));
    CHECK(strstr(why, "may ask but not change"));
    CHECK(!rights_judge(&r, STDIN_FILENO, why, sizeof why));
    close(end[0]);
    close(end[1]);
}

int main(void)
{
    RUN(nothing_said_means_the_sockets_group);
    RUN(names_and_numbers);
    RUN(without_a_look_names_give_nobody_a_right);
    RUN(names_are_looked_up_beside_the_loop);
    RUN(who_ends_does_not_wait_for_a_look);
    RUN(a_look_that_cannot_begin_is_told);
    RUN(the_user_of_the_process_may_and_who_is_not_known_may_not);
    return test_end();
}
