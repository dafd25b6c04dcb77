/* SPDX-License-Identifier: MIT */
/*
 * conf_suggest - what the writer of an unknown key or section may have meant.
 */
#ifndef SONARD_CONF_SUGGEST_H
#define SONARD_CONF_SUGGEST_H

#include <stddef.h>

/** conf_suggest_key - "did you mean window?", "it belongs in [grid]" or the keys that `section` has. */
void conf_suggest_key(const char *section, const char *name, char *text, size_t size);

/** conf_suggest_section - "did you mean [extract]?" or the sections that there are. */
void conf_suggest_section(const char *name, char *text, size_t size);

#endif
