/* SPDX-License-Identifier: MIT */
/* command_grid_export - every cell of a spherical grid into a file: CSV, or a point cloud as MCAP. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "cells_file.h"
#include "command.h"
#include "out_file.h"

#define TRIES 5 /* pages are asked for anew when the grid's centre or axes move between them */

/* All pages: an object with frame, t_unix of the first and all cells. NULL: *status is what to exit with. */
static json_t *ask_once(struct context *context, int *status)
{
    json_t *all = NULL, *page, *cursor = NULL, *params = json_deep_copy(context->arguments.options);
    json_object_set_new(params, "count", json_integer(1024));
    do {
        if (cursor)
            json_object_set(params, "cursor", cursor);
        if (!(page = command_call(context, "grid_cells", params, status))) {
            json_decref(all);
            all = NULL;
            break;
        }
        if (all) {
            json_array_extend(json_object_get(all, "cells"), json_object_get(page, "cells"));
            json_object_set(all, "changed", json_object_get(page, "changed"));
            json_object_set(all, "cursor", json_object_get(page, "cursor"));
            json_decref(page);
        } else {
            all = page;
        }
        cursor = json_object_get(all, "cursor");
    } while (json_is_string(cursor) && !json_is_true(json_object_get(all, "changed")));
    json_decref(params);
    return all;
}

static json_t *ask_page(struct context *context, int *status)
{
    json_t *all = NULL;
    for (int i = 0; i < TRIES; i++) {
        json_decref(all);
        all = ask_once(context, status);
        if (!all || !json_is_true(json_object_get(all, "changed")))
            return all;
    }
    fprintf(stderr, "sonarctl: the grid moved while it was read, %d times: try again while the vehicle stands\n",
            TRIES);
    json_decref(all);
    *status = EXIT_REFUSED;
    return NULL;
}

static bool is_ned(const json_t *all)
{
    const char *frame = json_string_value(json_object_get(all, "frame"));
    return frame && strcmp(frame, "ned") == 0;
}

static bool write_csv(FILE *out, const json_t *all)
{
    const json_t *cell;
    size_t i;
    cells_csv_head(out, is_ned(all));
    json_array_foreach(json_object_get(all, "cells"), i, cell)
        cells_csv_row(out, cell, json_number_value(json_object_get(all, "t_unix")));
    return !ferror(out);
}

static bool write_fd(int fd, const json_t *all, bool csv, struct fault *fault)
{
    FILE *out = csv ? fdopen(fd, "w") : NULL;
    if (!csv)
        return cells_capture(json_object_get(all, "cells"), is_ned(all),
                             json_number_value(json_object_get(all, "t_unix")), fd, fault);
    if (!out)
        return fault_set(fault, "%s", strerror(errno));
    const bool ok = write_csv(out, all);
    return (fclose(out) == 0 && ok) || fault_set(fault, "%s", strerror(errno));
}

/* False after a message. */
static bool write_file(const char *path, const json_t *all, bool csv)
{
    struct fault fault;
    const int fd = out_file_create(path, true, &fault);
    if (fd >= 0 && !write_fd(fd, all, csv, &fault)) {
        out_file_drop(path);
        fprintf(stderr, "sonarctl: %s: %s\n", path, fault.text);
        return false;
    }
    if (fd >= 0 && out_file_keep(path, true, &fault))
        return true;
    fprintf(stderr, "sonarctl: %s\n", fault.text);
    return false;
}

int command_grid_export(struct context *context, const char *path)
{
    const size_t n = strlen(path);
    const bool to_stdout = strcmp(path, "-") == 0;
    const bool csv = to_stdout || (n > 4 && strcmp(path + n - 4, ".csv") == 0);
    json_t *all;
    int status = EXIT_CLEAR;
    if (!csv && (n < 6 || strcmp(path + n - 5, ".mcap") != 0))
        return command_usage("grid", "export: FILE must end in .csv or .mcap, or be - for CSV on standard output");
    if (!(all = ask_page(context, &status)))
        return status;
    const size_t cells = json_array_size(json_object_get(all, "cells"));
    if (to_stdout)
        write_csv(stdout, all);
    else if (!write_file(path, all, csv))
        status = EXIT_OUTPUT;
    else if (context->json)
        printf("{\"cells\":%zu}\n", cells);
    else
        printf("%zu cells written to %s\n", cells, path);
    json_decref(all);
    return status;
}
