/* SPDX-License-Identifier: MIT */
#include "command.h"
#include "core/fault.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "plot.h"
#include "show.h"
#include "show_background.h"
#include "client/lib/sonard_json.h"

int command_fail(const struct sonard_error *error)
{
    static const int status[] = {[SONARD_NO_DAEMON] = EXIT_NO_DAEMON, [SONARD_NO_PERMISSION] = EXIT_NO_DAEMON,
                                 [SONARD_SILENT] = EXIT_SILENT,       [SONARD_LOST] = EXIT_SILENT,
                                 [SONARD_REFUSED] = EXIT_REFUSED,     [SONARD_INVALID] = EXIT_USAGE};
    fprintf(stderr, "sonarctl: ");
    for (const char *c = error->message; *c; c++)
        fputc((unsigned char)*c < 0x20 || *c == 0x7f ? '?' : *c, stderr);
    fputc('\n', stderr);
    return status[error->status];
}

int command_usage(const char *command, const char *message)
{
    char help[64];
    snprintf(help, sizeof help, "sonarctl %s%s", command ? command : "help", command ? " --help" : "");
    arguments_tell("sonarctl", message, help);
    return EXIT_USAGE;
}

bool command_refuses_picture(const struct context *context, const char *path)
{
    static const char *const endings[] = {".png", ".jpg", ".jpeg", ".pdf"};
    const char *ending = path ? strrchr(path, '.') : NULL;
    for (size_t i = 0; ending && i < sizeof endings / sizeof *endings; i++)
        if (strcasecmp(ending, endings[i]) == 0) {
            command_usage(context->command, "the command writes SVG; convert it with rsvg-convert");
            return true;
        }
    return false;
}

void command_print(const struct context *context, const char *method, const json_t *result)
{
    if (context->json) {
        json_dumpf(result, stdout, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(13));
        putchar('\n');
    } else {
        show_result(stdout, method, result, context->colour);
    }
}

json_t *command_call(struct context *context, const char *method, json_t *params, int *status)
{
    struct sonard_error error;
    json_t *result = NULL;
    if (!context->client)
        context->client = sonard_connect(context->socket, context->timeout_s, &error);
    if (context->client)
        result = sonard_json_call(context->client, method, params, &error);
    *status = result ? EXIT_CLEAR : command_fail(&error);
    return result;
}

int command_call_and_print(struct context *context, const char *method, json_t *params)
{
    int status;
    json_t *result = command_call(context, method, params, &status);
    if (result)
        command_print(context, method, result);
    json_decref(result);
    return status;
}

bool command_azimuth(const struct context *context, int index, double *azimuth_deg)
{
    const char *word = context->arguments.word[index];
    struct fault fault;
    if (arguments_number(word, -360, 360, azimuth_deg))
        return true;
    fault_set(&fault, "AZ '%.100s': expected degrees, -360 to 360", word);
    command_usage(context->command, fault.text);
    return false;
}

int command_write_plot(const char *path, json_t *image, json_t *sectors, double range_m, const double *heading_deg)
{
    const struct plot_conf conf = {.range_m = range_m, .heading_deg = heading_deg};
    const bool to_stdout = strcmp(path, "-") == 0;
    FILE *out = to_stdout ? stdout : fopen(path, "w");
    bool ok = out && (sectors ? plot_svg(out, image, sectors, &conf) : show_background_svg(out, image));
    if (out && (to_stdout ? fflush(out) : fclose(out)) != 0)
        ok = false;
    if (!ok)
        fprintf(stderr, "sonarctl: %s: %s\n", path, strerror(errno));
    return ok ? EXIT_CLEAR : EXIT_OUTPUT;
}
