/* SPDX-License-Identifier: MIT */
/*
 * fuzz_web - any bytes as what a browser sends: "METHOD\nHOST\nORIGIN\nname=value\n..." as sonard-web takes a request
 * apart. A method that changes something is never found; what is accepted is an object of that method's parameters
 * only, on one line of JSON; a Host that is accepted is an address or one of four names. The same bytes as the image of
 * a daemon are written into the room that is said to suffice, and as a setting are one line or refused.
 */
#include <arpa/inet.h>
#include <stdlib.h>
#include <string.h>

#include "web/web_guard.h"
#include "web/web_metrics.h"
#include "web/web_query.h"
#include "client/view/view_rows.h"
#include "web/web_settings.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void must(bool fact)
{
    if (!fact)
        abort();
}

/* The next line, its NUL in place of the newline; "" at the end. */
static char *line(char **at)
{
    char *start = *at, *end = strchr(start, '\n');
    *at = end ? end + 1 : start + strlen(start);
    if (end)
        *end = '\0';
    return start;
}

static void guard(const char *host, const char *origin)
{
    static const struct web_guard us = {.machine = "rov", .names = "blueos.local", .origins = "https://a.example"};
    char name[300];
    struct in6_addr address;
    if (web_guard_host(&us, host)) {
        snprintf(name, sizeof name, "%s", host + (host[0] == '['));
        name[strcspn(name, host[0] == '[' ? "]" : ":")] = '\0';
        must(inet_pton(host[0] == '[' ? AF_INET6 : AF_INET, name, &address) == 1 || strcasecmp(name, "rov") == 0 ||
             strcasecmp(name, "rov.local") == 0 || strcasecmp(name, "localhost") == 0 ||
             strcasecmp(name, "blueos.local") == 0);
    }
    if (web_guard_origin(&us, origin, host))
        must(strcasecmp(origin, "https://a.example") == 0 || strlen(origin) == strlen(host) + 7 ||
             strlen(origin) == strlen(host) + 8);
}

static void query(const struct protocol_method *method, char *at)
{
    json_t *params = json_object();
    struct fault fault = {""};
    const char *key;
    json_t *value;
    while (*at) {
        const char *part = line(&at);
        must(web_query_add(method, params, part, strlen(part), &fault) || fault.text[0]);
    }
    json_object_foreach(params, key, value)
    {
        bool known = false;
        for (const struct protocol_param *p = method->params; p->name; p++)
            known = known || strcmp(p->name, key) == 0;
        must(known);
    }
    char *text = json_dumps(params, JSON_COMPACT);
    must(text && !strchr(text, '\n'));
    free(text);
    json_decref(params);
}

/* What is taken is one line, and none of [server]. */
static void setting(const char *text)
{
    struct web_setting taken;
    struct fault fault = {""};
    if (!web_settings_parse(text, &taken, &fault)) {
        must(fault.text[0] != '\0');
        return;
    }
    must(strcmp(taken.text, text) == 0 && !strpbrk(text, "\n\r;#\"\\"));
    must(taken.section < taken.key && taken.key < strlen(text) && text[taken.section - 1] == ']');
    must(strncmp(text + 1, "server", 6) != 0);
}

static void image(const uint8_t *data, size_t size)
{
    static struct view_rows rows;
    static uint8_t out[VIEW_ROWS_BYTES];
    json_t *said = json_loadb((const char *)data, size, 0, NULL);
    size_t n = 0, written;
    view_rows_take(&rows, said);
    for (uint64_t seen = 0; (written = view_rows_part(&rows, &seen, out)) > 0; n += out[2])
        must(written <= sizeof out && out[2] > 0);
    must(n <= VIEW_ROWS_MAX);
    view_rows_forget(&rows);
    FILE *sink = fopen("/dev/null", "w");
    if (sink) {
        web_metrics_print(sink, (json_t *const[WEB_METRICS_QUESTIONS]){said, said, said});
        fclose(sink);
    }
    json_decref(said);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *text = malloc(size + 1), *at = text;
    must(text != NULL);
    memcpy(text, data, size);
    text[size] = '\0';
    setting(text);
    const struct protocol_method *method = web_query_method(line(&at));
    const char *host = line(&at);
    guard(host, line(&at));
    if (method) {
        must(method->right == PROTOCOL_ASKS);
        query(method, at);
    }
    free(text);
    image(data, size);
    return 0;
}
