#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""Who may only ask and who may change: other users and groups on the socket, as the kernel knows them."""
import os
import socket

from lib import ALL, SCHEMAS, Client, RpcError, Skipped, check, expect_refusal, run

# All methods, written out: what the table of methods says is not taken for true here.
CHANGES = ("pose", "pose_withdraw", "grid_lock", "background_learn", "background_stop", "background_save",
           "background_load", "background_forget", "map_new", "map_forget", "map_save", "map_load", "map_export", "map_move",
           "record_start", "record_stop", "reload", "reload_check", "replay")
ASKS = ("version", "status", "stats", "sensors", "plan", "sectors", "blocked", "explain", "nearest", "limit",
        "time_to_collision", "clusters", "next_look", "grid_list", "grid_cells", "image", "background", "map", "map_slice",
        "map_submaps", "surface", "point", "box", "path", "watch", "unwatch")
FORBIDDEN = -32001


class Somebody(Client):
    """A client whose connection was made by another user: the kernel keeps who connected, not who writes."""

    def __init__(self, path, user, group, groups):
        ours, theirs = socket.socketpair()
        child = os.fork()
        if child == 0:
            status = 1
            try:
                os.setgroups(groups)
                os.setresgid(group, group, group)
                os.setresuid(user, user, user)
                with socket.socket(socket.AF_UNIX) as made:
                    made.connect(path)
                    socket.send_fds(theirs, [b"x"], [made.fileno()])
                status = 0
            finally:
                os._exit(status)
        check(os.waitpid(child, 0)[1] == 0, "user %d cannot connect" % user)
        self.socket = socket.socket(fileno=socket.recv_fds(ours, 1, 1)[1][0])
        self.held = b""
        self.last_id = 0
        self.notifications = []
        ours.close()
        theirs.close()


def refusals(client, methods):
    """{method: what it says} of those that are forbidden; all the others may fail as they like."""
    said = {}
    for method in methods:
        try:
            client.call(method)
        except RpcError as error:
            if error.code == FORBIDDEN:
                said[method] = str(error)
    return said


def allowed(bench, user, group, groups=()):
    """True: may change all; False: nothing. Asking works in any case."""
    client = Somebody(bench.socket_path, user, group, groups)
    check(not refusals(client, ASKS), "asking is forbidden")
    said = refusals(client, CHANGES)
    client.close()
    check(len(said) in (0, len(CHANGES)), "some are refused and others are not: %s" % list(said))
    for text in said.values():
        check("user %d" % user in text and "change in [server]" in text, "it says only: " + text)
    return not said


def other_users(bench, change, *rows):
    """rows: (user, group, further groups, may change)."""
    if os.geteuid() != 0:
        raise Skipped("only root can be somebody else")
    os.chmod(bench.folder, 0o755)
    keys = {"mode": "0666"}
    if change:
        keys["change"] = change
    bench.conf(server=keys)
    daemon = bench.sonard()
    client = daemon.client()
    os.chown(bench.socket_path, 0, 0)
    for user, group, groups, may in rows:
        got = allowed(bench, user, group, groups)
        check(got == may, "change = %s: user %d, groups %s may%s change" %
              (change, user, [group, *groups], "" if got else " not"))
    check(allowed(bench, 0, 0), "root may not change")
    client.call("pose", attitude_deg=[0, 0, 0])
    return daemon


def unknown_name(bench):
    daemon = other_users(bench, "nobody-has-this-name, @nor-this", (4711, 4712, (), False))
    for what in ("no user 'nobody-has-this-name'", "no group 'nor-this'"):
        check(what in daemon.log(), "the log does not say: " + what)


def not_watched(bench):
    """A watch is no way around: what changes something cannot be watched by anybody."""
    bench.conf()
    client = bench.sonard().client()
    for method in CHANGES:
        expect_refusal(client, "watch", {"method": method}, "cannot be watched")


def every_method(bench):
    """A new method stands in one of the two lists above, so that somebody has thought about its right."""
    del bench
    check(set(CHANGES) | set(ASKS) == set(SCHEMAS.methods()) and not set(CHANGES) & set(ASKS),
          "in one of the lists alone: %s" % sorted((set(CHANGES) | set(ASKS)) ^ set(SCHEMAS.methods())))


run([
    ("rights_default", lambda bench: other_users(bench, None, (4711, 4712, (), False), (4711, 0, (), True),
                                                 (4711, 4712, (0,), True))),
    ("rights_user", lambda bench: other_users(bench, "4711", (4711, 4712, (), True), (4713, 4711, (), False))),
    ("rights_groups", lambda bench: other_users(bench, "@4712, @daemon", (4711, 4712, (), True),
                                                (4711, 1, (), True), (4711, 4713, (4714, 4712), True),
                                                (4712, 4713, (0,), False))),
    ("rights_all", lambda bench: other_users(bench, "all", (4711, 4712, (), True))),
    ("rights_unknown_name", unknown_name),
    ("rights_watch", not_watched),
    ("rights_every_method", every_method),
], gate=ALL)
