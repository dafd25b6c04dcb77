/* SPDX-License-Identifier: MIT */
/* test_rights - who may change something: from the setting to the credentials of a connection's peer. */
#include "tests/lib/test.h"

#include <grp.h>
#include <pwd.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "daemon/rpc/rights.h"

#define SOCKET_GROUP 4242

/* In the place of the C library's: one user and one group, whoever this machine has and wherever it asks for them. */
struct passwd *getpwnam(const char *name)
{
    static struct passwd user = {.pw_uid = 1001};
    return strcmp(name, "daemon") == 0 ? &user : NULL;
}

struct group *getgrnam(const char *name)
{
    static struct group group = {.gr_gid = 1002};
    return strcmp(name, "daemon") == 0 ? &group : NULL;
}

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
    CHECK_INT(r.user[3], 1001);
    CHECK_INT(r.n_groups, 1);
    CHECK_INT(r.group[0], 1002);
}

TEST(the_user_of_the_process_may_and_who_is_not_known_may_not)
{
    struct rights r;
    struct fault why = {""};
    int end[2];
    rights_set(&r, NULL, SOCKET_GROUP);
    CHECK(socketpair(AF_UNIX, SOCK_STREAM, 0, end) == 0);
    CHECK(rights_judge(&r, end[0], &why));
    r = (struct rights){0};
    CHECK(!rights_judge(&r, end[0], &why));
    CHECK(strstr(why.text, "may query but not make changes"));
    CHECK(!rights_judge(&r, STDIN_FILENO, &why));
    close(end[0]);
    close(end[1]);
}

int main(void)
{
    RUN(nothing_said_means_the_sockets_group);
    RUN(names_and_numbers);
    RUN(without_a_look_names_give_nobody_a_right);
    RUN(the_user_of_the_process_may_and_who_is_not_known_may_not);
    return test_end();
}
