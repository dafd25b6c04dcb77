/* SPDX-License-Identifier: MIT */
/*
 * conf_value - one value of the configuration as text and as what struct conf holds: units, ranges, words. Knows a
 * key's row of the table, and nothing of files, sections and lines.
 */
#ifndef SONARD_CONF_VALUE_H
#define SONARD_CONF_VALUE_H

#include <locale.h>
#include <stdbool.h>
#include <stddef.h>

#include "conf_table.h"
#include "core/fault.h"

#define CONF_VALUE_MAX 320 /* room for any value as text, or for what is allowed */

/**
 * conf_value_read - put what `text` says into the key's place below `base` (struct conf or struct conf_sonar).
 * False, base untouched, with what was found in fault; conf_value_allowed has the other half of the message.
 */
bool conf_value_read(const struct conf_key *key, const char *text, void *base, struct fault *fault);

/**
 * conf_value_write - the value below `base` as it would stand in a file, with the fewest digits that read back to
 * the same bits. The key's own unit, another of its kind where only that one makes it short, or the SI unit where no
 * number in the key's own unit has exactly those bits.
 */
void conf_value_write(const struct conf_key *key, const void *base, char *text, size_t size);

/** conf_value_allowed - what may stand behind the '=', in a few words: "0.75 to 200 m (m, cm, mm or km)". */
void conf_value_allowed(const struct conf_key *key, char *text, size_t size);

/*
 * Numbers in a configuration have a point, whatever the locale of the process. The entrances of the module put
 * what they do between these two; they change this thread only.
 */
locale_t conf_locale_enter(void);
void conf_locale_leave(locale_t outside);

#endif
