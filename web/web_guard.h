/* SPDX-License-Identifier: MIT */
/*
 * web_guard - who may talk to sonard-web, by the headers that a browser sends and a page cannot forge. A name in Host
 * that is not ours means DNS rebinding; an Origin that is not ours means another site's page. Pure.
 */
#ifndef SONARD_WEB_GUARD_H
#define SONARD_WEB_GUARD_H

#include <stdbool.h>

struct web_guard {
    char machine[256]; /* host name of this machine, which is accepted with and without ".local" */
    const char *names; /* more accepted names, separated by commas; NULL: none */
    const char
        *origins; /* accepted origins of other pages, as https://host:port, separated by commas; NULL: none */
};

/**
 * web_guard_host - is `host`, the value of a Host header, a name of this server? Addresses are (a rebinding attack
 * needs a name), localhost is, and so are the names of the guard. A port after it does not matter.
 */
bool web_guard_host(const struct web_guard *guard, const char *host);

/**
 * web_guard_origin - may a page of `origin` (the value of an Origin header; NULL: the header is not there) talk to the
 * server that it called `host`? Programs send none; a page of this server sends its own.
 */
bool web_guard_origin(const struct web_guard *guard, const char *origin, const char *host);

#endif
