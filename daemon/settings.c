/* SPDX-License-Identifier: MIT */
#include "settings.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "wiring.h"
#include "config/word.h"
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/gpio/gpio.h"
#include "drivers/pose/modbus_depth.h"
#include "drivers/ports/port.h"
#include "daemon/input/source.h"
#include "protocol/protocol.h"

static bool device_exists(const char *name, struct fault *fault)
{
    const char *nearest = NULL;
    char lower[WORD_FAR];
    size_t best = WORD_FAR, n = 0;
    if (device_find(name))
        return true;
    for (; name[n] && n < sizeof lower - 1; n++)
        lower[n] = (char)tolower((unsigned char)name[n]);
    lower[n] = '\0';
    for (const struct device_ops *const *ops = device_table; *ops; ops++)
        if (word_is_nearest(lower, (*ops)->name, &best))
            nearest = (*ops)->name;
    fault_set(fault,
              nearest ? "unknown device; did you mean %s? Supported:" : "unknown device; supported:", nearest);
    for (const struct device_ops *const *ops = device_table; *ops; ops++)
        fault_add(fault, " %s", (*ops)->name);
    return false;
}

static bool port_exists(const char *address, struct fault *fault)
{
    const char *rest;
    return port_find(address, &rest, fault) != NULL;
}

static bool device_uses(const char *device, const char *key)
{
    return device_key_find(device_find(device), key) != NULL;
}

static void key_users(const char *key, char *text, size_t size)
{
    size_t n = 0;
    for (const struct device_ops *const *ops = device_table; *ops; ops++)
        if (device_key_find(*ops, key) && n < size)
            n += (size_t)snprintf(text + n, size - n, "%s%s", n > 0 ? ", " : "", (*ops)->name);
}

/* A head that is steered is asked for every ping, whatever its mode. */
static bool sonar_retunes(const struct conf *conf, int sonar, const char *key)
{
    return device_find(conf->sonar[sonar].device)->retune &&
           (strcmp(key, "mode") != 0 || !plan_is_steered(conf, sonar));
}

static void key_retuners(const char *key, char *text, size_t size)
{
    size_t n = 0;
    for (const struct device_ops *const *ops = device_table; *ops; ops++)
        if ((*ops)->retune && device_key_find(*ops, key) && n < size)
            n += (size_t)snprintf(text + n, size - n, "%s%s", n > 0 ? ", " : "", (*ops)->name);
}

static bool line_exists(const char *name, struct fault *fault)
{
    (void)name;
    return gpio_library.available(fault);
}

/* As the start makes it, but nothing is allocated. */
static bool whole_check(const struct conf *conf, struct fault *fault)
{
    struct plan plan;
    struct pipeline_conf pipeline;
    plan_make(conf, &plan);
    wiring_pipeline(conf, &plan, false, &pipeline);
    return wiring_check(conf, &pipeline, fault);
}

const struct conf_checks settings_checks = {.device = device_exists,
                                            .port = port_exists,
                                            .depth = modbus_depth_check,
                                            .line = line_exists,
                                            .sonar = source_check,
                                            .whole = whole_check,
                                            .uses = device_uses,
                                            .users = key_users,
                                            .retunes = sonar_retunes,
                                            .retuners = key_retuners,
                                            .page_file = PROTOCOL_PAGE_FILE};

void settings_man(FILE *out)
{
    char text[DEVICE_KEY_TEXT_MAX];
    conf_table_man(&settings_checks, out);
    fputs(".SH KEYS OF DEVICES\n"
          "What a device takes in\n.BR \"[sonar NAME]\" ,\nbeside the keys that all of them have.\n"
          "Any other key there is refused.\n",
          out);
    for (const struct device_ops *const *ops = device_table; *ops; ops++) {
        fprintf(out, ".TP\n.B %s\n%s", (*ops)->name, (*ops)->keys ? "" : "none\n");
        for (const struct device_key *key = (*ops)->keys; key && key->name; key++) {
            device_key_text(key, text, sizeof text);
            fprintf(out, "%s%s\n", text, key[1].name ? ";" : ".");
        }
    }
}

static void log_idle(void *ctx, const char *sentence)
{
    (void)ctx;
    log_line(LOG_WARNING, "no_effect", "%s", sentence);
}

void settings_log_idle(const struct conf *conf)
{
    conf_idle(conf, &settings_checks, log_idle, NULL);
}

const char *settings_path(const struct options *o)
{
    if (o->conf)
        return o->conf;
    return o->replay ? NULL : OPTIONS_CONF;
}

static void log_left_out(void *ctx, const char *message)
{
    (void)ctx;
    log_line(LOG_WARNING, "page_setting", "this setting from the page has no effect: %s", message);
}

bool settings_load(const struct options *o, const struct settings_how *how, struct conf *conf,
                   struct conf_source **source, conf_fault_fn fault, void *fault_ctx)
{
    const struct conf_where where = {.path = settings_path(o), .instead = how->instead};
    struct conf_checks checks = settings_checks;
    checks.left_out = how->starts ? log_left_out : NULL;
    if (!o->conf && access(settings_path(o), F_OK) != 0 && errno == ENOENT) {
        *source = NULL;
        fault(fault_ctx, "no configuration at " OPTIONS_CONF
                         "; name one with -c FILE (`sonarctl setup --output FILE` writes it)");
        return false;
    }
    if (conf_load_with(conf, source, &where, &checks, fault, fault_ctx) != 0)
        return false;
    settings_override(o, conf, *source);
    return true;
}

void settings_override(const struct options *o, struct conf *conf, struct conf_source *source)
{
    if (o->record) {
        snprintf(conf->record.directory, sizeof conf->record.directory, "%s", o->record);
        conf_source_override(source, "record", "directory", "--record");
    }
    if (o->socket) {
        snprintf(conf->server.socket, sizeof conf->server.socket, "%s", o->socket);
        conf_source_override(source, "server", "socket", "--socket");
    }
    if (o->threads >= 0) {
        conf->pipeline.threads = o->threads;
        conf_source_override(source, "pipeline", "threads", "--threads");
    }
}

enum log_level settings_log_level(const struct conf *conf)
{
    static const enum log_level levels[] = {[CONF_LOG_ERR] = LOG_ERR,
                                            [CONF_LOG_WARNING] = LOG_WARNING,
                                            [CONF_LOG_NOTICE] = LOG_NOTICE,
                                            [CONF_LOG_INFO] = LOG_INFO,
                                            [CONF_LOG_DEBUG] = LOG_DEBUG};
    return levels[conf->log.level];
}
