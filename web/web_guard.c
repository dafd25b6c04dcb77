/* SPDX-License-Identifier: MIT */
#include "web_guard.h"

#include <arpa/inet.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#define NAME_MAX_BYTES 255

/* Is the text one of the words of a list separated by commas? Names of machines have no case. */
static bool listed(const char *list, const char *text)
{
    const size_t n = strlen(text);
    for (const char *word = list; word && *word; word += strcspn(word, ",") + (word[strcspn(word, ",")] == ','))
        if (strcspn(word, ",") == n && strncasecmp(word, text, n) == 0 && n > 0)
            return true;
    return false;
}

static bool is_address(const char *name, bool bracketed)
{
    unsigned char address[sizeof(struct in6_addr)];
    return inet_pton(bracketed ? AF_INET6 : AF_INET, name, address) == 1;
}

/* The name in NAME, NAME:PORT or [ADDRESS]:PORT; false: it is none of these. */
static bool split_host(const char *host, char name[NAME_MAX_BYTES + 1], bool *bracketed)
{
    const char *start = host, *end, *port;
    *bracketed = host[0] == '[';
    if (*bracketed) {
        start++;
        end = strchr(start, ']');
        port = end ? end + 1 : NULL;
    } else {
        end = start + strcspn(start, ":");
        port = end;
    }
    if (!end || end == start || (size_t)(end - start) > NAME_MAX_BYTES)
        return false;
    if (*port && (*port != ':' || port[1 + strspn(port + 1, "0123456789")]))
        return false;
    memcpy(name, start, (size_t)(end - start));
    name[end - start] = '\0';
    return true;
}

bool web_guard_host(const struct web_guard *guard, const char *host)
{
    char name[NAME_MAX_BYTES + 1], local[sizeof guard->machine + sizeof ".local"];
    bool bracketed;
    if (!split_host(host, name, &bracketed))
        return false;
    if (is_address(name, bracketed))
        return true;
    snprintf(local, sizeof local, "%s.local", guard->machine);
    return !bracketed && (strcasecmp(name, "localhost") == 0 || strcasecmp(name, guard->machine) == 0 ||
                          strcasecmp(name, local) == 0 || listed(guard->names, name));
}

bool web_guard_origin(const struct web_guard *guard, const char *origin, const char *host)
{
    static const char *const schemes[] = {"http://", "https://"};

    if (!origin || listed(guard->origins, origin))
        return true;
    for (size_t i = 0; i < sizeof schemes / sizeof *schemes; i++) {
        const size_t n = strlen(schemes[i]);
        if (strncasecmp(origin, schemes[i], n) == 0 && strcasecmp(origin + n, host) == 0)
            return true;
    }
    return false;
}
