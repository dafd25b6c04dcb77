/* SPDX-License-Identifier: MIT */
/*
 * setup_check - would sonard accept the configuration that is about to be written? By the daemon's own reader and
 * checks: there is no second set of rules that could differ from them.
 */
#ifndef SONARD_SETUP_CHECK_H
#define SONARD_SETUP_CHECK_H

#include "config/conf.h"

/**
 * setup_check - text->name is the file to be: a drop-in of a configuration (FILE.d/NAME.conf, where FILE exists) is
 * read with FILE and the other drop-ins, anything else by itself. `fault` sees each fault as `sonard --check` words
 * it. False with faults.
 */
bool setup_check(const struct conf_text *text, conf_fault_fn fault, void *fault_ctx);

#endif
