/* SPDX-License-Identifier: MIT */
#include "web_stranger.h"

#include <stdio.h>
#include <string.h>

/* The bytes come from outside: what a name cannot have is shown as a question mark, so nothing in it is markup. */
static void print_name(FILE *out, const char *host)
{
    static const char characters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._";
    for (const char *c = host; *c && *c != ':'; c++)
        fputc(strchr(characters, *c) ? *c : '?', out);
}

char *web_stranger_page(const char *host, const char *here)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return NULL;
    host = host && *host ? host : "that.name";
    fputs(
        "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>sonard: unknown name</title>"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"></head><body><h1>sonard-web does "
        "not answer to the name ",
        out);
    print_name(out, host);
    fprintf(out, "</h1><p>Type the address instead: <a href=\"http://%s/\">http://%s/</a></p>", here, here);
    fputs("<p>Or allow the name on the computer that runs sonard-web, and restart it:</p><pre>sonard-web --names ",
          out);
    print_name(out, host);
    fputs("</pre><p>For the service, add this option to SONARD_WEB in /etc/default/sonard-web. A name that is not "
          "allowed is refused so that a page of another site cannot reach the sonar by it.</p></body></html>\n",
          out);
    fclose(out);
    return text;
}
