/* SPDX-License-Identifier: MIT */
#include "web_files.h"

#include <string.h>

#define EMBED(name, file)                                                                                         \
    extern const char name##_start[], name##_end[];                                                               \
    __asm__(".pushsection .rodata\n" #name "_start:\n.incbin \"web/page/" file "\"\n" #name                       \
            "_end:\n.byte 0\n.popsection\n")

EMBED(web_page_html, "index.html");
EMBED(web_page_css, "style.css");
EMBED(web_page_app, "app.js");
EMBED(web_page_draw, "draw.js");
EMBED(web_page_console, "console.js");
EMBED(web_page_words, "words.js");
EMBED(web_page_image, "image.js");
EMBED(web_page_live, "live.js");
EMBED(web_page_panels, "panels.js");
EMBED(web_page_measure, "measure.js");
EMBED(web_page_pilot, "pilot.js");
EMBED(web_page_view, "view.js");
EMBED(web_page_why, "why.js");
EMBED(web_page_icon, "icon.svg");
EMBED(web_page_layout, "foxglove-layout.json");

#define FILE_AT(path, type, name)                                                                                 \
    {                                                                                                             \
        path, type, name##_start, name##_end                                                                      \
    }

static const struct web_file files[] = {
    FILE_AT("/", "text/html; charset=utf-8", web_page_html),
    FILE_AT("/style.css", "text/css; charset=utf-8", web_page_css),
    FILE_AT("/app.js", "text/javascript; charset=utf-8", web_page_app),
    FILE_AT("/draw.js", "text/javascript; charset=utf-8", web_page_draw),
    FILE_AT("/console.js", "text/javascript; charset=utf-8", web_page_console),
    FILE_AT("/words.js", "text/javascript; charset=utf-8", web_page_words),
    FILE_AT("/image.js", "text/javascript; charset=utf-8", web_page_image),
    FILE_AT("/live.js", "text/javascript; charset=utf-8", web_page_live),
    FILE_AT("/panels.js", "text/javascript; charset=utf-8", web_page_panels),
    FILE_AT("/measure.js", "text/javascript; charset=utf-8", web_page_measure),
    FILE_AT("/pilot.js", "text/javascript; charset=utf-8", web_page_pilot),
    FILE_AT("/view.js", "text/javascript; charset=utf-8", web_page_view),
    FILE_AT("/why.js", "text/javascript; charset=utf-8", web_page_why),
    FILE_AT("/icon.svg", "image/svg+xml", web_page_icon),
    FILE_AT("/foxglove-layout.json", "application/json", web_page_layout),
};

const struct web_file *web_files_find(const char *path)
{
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        if (strcmp(files[i].path, path) == 0)
            return &files[i];
    return NULL;
}
