/* SPDX-License-Identifier: MIT */
#include "setup_check.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "daemon/settings.h"

/* FILE, if the folder is FILE.d and FILE is there. */
static bool whose_folder(const char *folder, char file[PATH_MAX])
{
    const size_t n = strlen(folder);
    if (n < 2 || n >= PATH_MAX || strcmp(folder + n - 2, ".d") != 0)
        return false;
    snprintf(file, PATH_MAX, "%.*s", (int)(n - 2), folder);
    return access(file, F_OK) == 0;
}

/* The FILE whose drop-in that would be, and the drop-in's name there; false: of none. The folder may be a link, by
 * whose name FILE is found, or the one in which the caller is. */
static bool drop_in_of(const char *path, char file[PATH_MAX], const char **name)
{
    char folder[PATH_MAX], real[PATH_MAX], whole[2 * PATH_MAX];
    const char *slash = strrchr(path, '/');
    *name = slash ? slash + 1 : path;
    snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) : 1, slash ? path : ".");
    if (!realpath(folder, real))
        return false;
    snprintf(whole, sizeof whole, "%s/%s", real, *name);
    return (whose_folder(folder, file) || whose_folder(real, file)) && conf_drop_in(file, whole);
}

bool setup_check(const struct conf_text *text, conf_fault_fn fault, void *fault_ctx)
{
    char file[PATH_MAX];
    struct conf_text drop_in = *text;
    struct conf conf;
    struct conf_source *source;
    const int faults =
        drop_in_of(text->name, file, &drop_in.name)
            ? conf_load_with(&conf, &source, &(struct conf_where){.path = file, .instead = &drop_in},
                             &settings_checks, fault, fault_ctx)
            : conf_load_text(&conf, &source, text, &settings_checks, fault, fault_ctx);
    conf_source_free(source);
    return faults == 0;
}
