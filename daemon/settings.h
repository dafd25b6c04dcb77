/* SPDX-License-Identifier: MIT */
/*
 * settings - the configuration of this process: read, checked against what only the daemon knows, with the options of
 * the command line over it.
 */
#ifndef SONARD_SETTINGS_H
#define SONARD_SETTINGS_H

#include <stdbool.h>
#include <stdio.h>

#include "config/conf.h"
#include "core/fault.h"
#include "core/log.h"
#include "options.h"

/* Devices, ports, lines: is there such a thing, can it do that? */
extern const struct conf_checks settings_checks;

/** settings_man - the tables of keys, and of the keys that each device takes, in man(7) macros. */
void settings_man(FILE *out);

/** settings_path - the file that is read; NULL: a replay has its configuration in its capture. */
const char *settings_path(const struct options *o);

struct settings_how {
    bool starts;                     /* a line that is wrong in a page's file is left out, with a warning */
    const struct conf_text *instead; /* see conf_load_with; NULL: the files as they are */
};

/** settings_load - that file and its folder, and the options over it, see conf_load; false with faults. */
bool settings_load(const struct options *o, const struct settings_how *how, struct conf *conf,
                   struct conf_source **source, conf_fault_fn fault, void *fault_ctx);

/** settings_override - put what the command line says instead over a configuration that was loaded. */
void settings_override(const struct options *o, struct conf *conf, struct conf_source *source);

/** settings_log_idle - keys that are set and have no effect, as warnings, event no_effect. */
void settings_log_idle(const struct conf *conf);

/** settings_log_level - least important lines to be written. */
enum log_level settings_log_level(const struct conf *conf);

#endif
