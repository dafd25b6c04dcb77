/* SPDX-License-Identifier: MIT */
/* command_grid - the grids of directions: list them; lock, unlock and export cells of one. */
#include <string.h>

#include "command.h"

static int lock(struct context *context, bool locked)
{
    json_t *options = context->arguments.options;
    double azimuth_deg;
    if (!command_azimuth(context, 1, &azimuth_deg))
        return EXIT_USAGE;
    json_object_set_new(options, "azimuth_deg", json_real(azimuth_deg));
    json_object_set_new(options, "locked", json_boolean(locked));
    return command_call_and_print(context, "grid_lock", options);
}

int command_grid(struct context *context)
{
    const struct arguments *a = &context->arguments;
    const char *word = a->word[0];
    if (strcmp(word, "list") == 0 && a->n_words == 1)
        return command_call_and_print(context, "grid_list", a->options);
    if ((strcmp(word, "lock") == 0 || strcmp(word, "unlock") == 0) && a->n_words == 2)
        return lock(context, strcmp(word, "lock") == 0);
    if (strcmp(word, "export") == 0 && a->n_words == 2)
        return command_grid_export(context, a->word[1]);
    return command_usage("grid", "expected one of list, lock AZ, unlock AZ, export FILE");
}
