/* SPDX-License-Identifier: MIT */
/*
 * conf_fault - faults are kept until the end of the file, because some belong to lines long past: a key that is
 * missing in a section, values that do not go together.
 */
#include "conf_fault.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

void conf_fault_in(struct conf_faults *faults, unsigned file, const char *name)
{
    faults->file = file;
    faults->name = name;
}

void conf_fault_add(struct conf_faults *faults, unsigned line, const char *fmt, ...)
{
    const bool left_out = faults->left_out && line > 0;
    const int index = left_out ? 0 : faults->n++;
    if (index >= CONF_FAULTS_MAX)
        return;

    char *what = NULL, *message = NULL;
    va_list args;
    va_start(args, fmt);
    if (vasprintf(&what, fmt, args) < 0)
        what = NULL;
    va_end(args);
    int length = line > 0 ? asprintf(&message, "%s:%u: %s", faults->name, line, what ? what : "out of memory")
                          : asprintf(&message, "%s: %s", faults->name, what ? what : "out of memory");
    free(what);
    if (left_out) {
        faults->left_out(faults->left_out_ctx, length < 0 ? "out of memory" : message);
        free(length < 0 ? NULL : message);
        return;
    }
    faults->fault[index].file = faults->file;
    faults->fault[index].line = line;
    faults->fault[index].message = length < 0 ? NULL : message;
}

static bool is_later(const struct conf_faults *faults, int a, unsigned file, unsigned line)
{
    return faults->fault[a].file > file || (faults->fault[a].file == file && faults->fault[a].line > line);
}

/* Stable, and the lines are nearly in order already: by insertion. */
static void sort_by_line(struct conf_faults *faults, int n)
{
    for (int i = 1; i < n; i++) {
        const unsigned file = faults->fault[i].file, line = faults->fault[i].line;
        char *message = faults->fault[i].message;
        int k = i;
        for (; k > 0 && is_later(faults, k - 1, file, line); k--)
            faults->fault[k] = faults->fault[k - 1];
        faults->fault[k].file = file;
        faults->fault[k].line = line;
        faults->fault[k].message = message;
    }
}

int conf_fault_tell(struct conf_faults *faults, conf_fault_fn tell, void *ctx)
{
    int told = faults->n < CONF_FAULTS_MAX ? faults->n : CONF_FAULTS_MAX;
    sort_by_line(faults, told);
    for (int i = 0; i < told; i++) {
        tell(ctx, faults->fault[i].message ? faults->fault[i].message : "out of memory");
        free(faults->fault[i].message);
    }
    if (faults->n > told) {
        char more[64];
        snprintf(more, sizeof more, "and %d more faults", faults->n - told);
        tell(ctx, more);
    }
    return faults->n;
}
