/* SPDX-License-Identifier: MIT */
/* command_grid - the grids of directions: list, create, drop; lock and unlock cells of one. */
#include <stdio.h>
#include <string.h>

#include "command.h"

static int lock(struct context *context, bool locked)
{
    json_t *options = context->arguments.options;
    double azimuth_deg;

    if (!arguments_number(context->arguments.word[1], -360, 360, &azimuth_deg))
        return command_usage("grid", "AZ must be a number of degrees");
    json_object_set_new(options, "azimuth_deg", json_real(azimuth_deg));
    json_object_set_new(options, "locked", json_boolean(locked));
    return command_call_and_print(context, "grid_lock", options);
}

/* "range=100 m" becomes "range": "100 m"; false: a word without =. */
static bool take_setting(json_t *settings, const char *word)
{
    const char *value = strchr(word, '=');

    return value && json_object_setn_new(settings, word, (size_t)(value - word), json_string(value + 1)) == 0;
}

static int create(struct context *context)
{
    const struct arguments *a = &context->arguments;
    json_t *settings = json_object();

    json_object_set_new(a->options, "name", json_string(a->word[1]));
    json_object_set_new(a->options, "settings", settings);
    for (int i = 2; i < a->n_words; i++)
        if (!take_setting(settings, a->word[i]))
            return command_usage("grid", "want settings as in [grid] of the configuration: KEY=VALUE");
    return command_call_and_print(context, "grid_create", a->options);
}

int command_grid(struct context *context)
{
    const struct arguments *a = &context->arguments;
    const char *word = a->word[0];

    if (strcmp(word, "list") == 0 && a->n_words == 1)
        return command_call_and_print(context, "grid_list", a->options);
    if (strcmp(word, "create") == 0 && a->n_words >= 2)
        return create(context);
    if (strcmp(word, "drop") == 0 && a->n_words == 2) {
        json_object_set_new(a->options, "name", json_string(a->word[1]));
        return command_call_and_print(context, "grid_drop", a->options);
    }
    if ((strcmp(word, "lock") == 0 || strcmp(word, "unlock") == 0) && a->n_words == 2)
        return lock(context, strcmp(word, "lock") == 0);
    return command_usage("grid", "want one of list, create NAME [KEY=VALUE...], drop NAME, lock AZ, unlock AZ");
}
