/* SPDX-License-Identifier: MIT */
/* web_files - the files of web/page, which are built into the program: no path of a request leads to a disk. */
#ifndef SONARD_WEB_FILES_H
#define SONARD_WEB_FILES_H

#include <stddef.h>

struct web_file {
    const char *path; /* of the URL */
    const char *type;
    const char *start, *end;
};

/** web_files_find - the file of a path of a URL, or NULL. */
const struct web_file *web_files_find(const char *path);

#endif
