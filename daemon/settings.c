/* SPDX-License-Identifier: MIT */
#include "settings.h"

#include <stdio.h>

#include "../drivers/device.h"
#include "../drivers/gpio.h"
#include "../drivers/modbus_depth.h"
#include "../drivers/port.h"
#include "source.h"

static bool device_exists(const char *name, char *err, size_t err_size)
{
    if (device_find(name))
        return true;
    int n = snprintf(err, err_size, "there is no such device; there are:");
    for (const struct device_ops *const *ops = device_table; *ops && n > 0 && (size_t)n < err_size; ops++)
        n += snprintf(err + n, err_size - (size_t)n, " %s", (*ops)->name);
    return false;
}

static bool port_exists(const char *address, char *err, size_t err_size)
{
    const char *rest;
    return port_find(address, &rest, err, err_size) != NULL;
}

static bool line_exists(const char *name, char *err, size_t err_size)
{
    (void)name;
    return gpio_library.available(err, err_size);
}

const struct conf_checks settings_checks = {.device = device_exists,
                                            .port = port_exists,
                                            .depth = modbus_depth_check,
                                            .line = line_exists,
                                            .sonar = source_check};

const char *settings_path(const struct options *o)
{
    if (o->conf)
        return o->conf;
    return o->replay ? NULL : OPTIONS_CONF;
}

bool settings_load(const struct options *o, struct conf *conf, struct conf_source **source, conf_fault_fn fault,
                   void *fault_ctx)
{
    if (conf_load(conf, source, settings_path(o), &settings_checks, fault, fault_ctx) != 0)
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
