/* SPDX-License-Identifier: MIT */
/*
 * web_settings - a file of sonard.conf.d that a page may change, with a token: one "[section] key = value" at a time.
 * The daemon judges the value before it is in the file: it is asked what it would say to the text, and then to reload.
 * [server] cannot be changed, because it says who may change something.
 */
#ifndef SONARD_WEB_SETTINGS_H
#define SONARD_WEB_SETTINGS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/fault.h"

#define WEB_SETTINGS_MAX   32  /* keys in the file */
#define WEB_SETTINGS_LINE  160 /* bytes of "[section] key = value", with its NUL */
#define WEB_SETTINGS_TOKEN 128
#define WEB_SETTINGS_LEAST 16 /* characters of a token */

struct web_setting {
    char text[WEB_SETTINGS_LINE]; /* "[section] key = value" */
    size_t section, key;          /* bytes of "[section]", and of "[section] key" */
};

struct web_settings {
    const char *path; /* NULL: nothing can be changed */
    char token[WEB_SETTINGS_TOKEN + 1];
    struct web_setting setting[WEB_SETTINGS_MAX], before[WEB_SETTINGS_MAX];
    int n, n_before;
};

/**
 * web_settings_open - the file, which need not be there yet, and the token in the first line of another one. False with
 * a sentence: one cannot be read, the token is short, or the file has lines that are not of this program.
 */
bool web_settings_open(struct web_settings *s, const char *path, const char *token_path, struct fault *fault);

/** web_settings_token - is it the token? As long as it takes for any of that length. */
bool web_settings_token(const struct web_settings *s, const char *token);

/** web_settings_parse - text into *setting; false with a sentence: it is none, or one of [server]. */
bool web_settings_parse(const char *text, struct web_setting *setting, struct fault *fault);

/** web_settings_change - put it in, instead of the same key; the file stays until web_settings_save. False: all is as
 * before. */
bool web_settings_change(struct web_settings *s, const struct web_setting *setting, struct fault *fault);

/** web_settings_text - what the file would hold, for free(); NULL: no memory. */
char *web_settings_text(const struct web_settings *s);

/** web_settings_file - its absolute path, without links, for free(); NULL: it has no folder. */
char *web_settings_file(const struct web_settings *s, struct fault *fault);

/** web_settings_save - write the file; false: it is as before. */
bool web_settings_save(const struct web_settings *s, struct fault *fault);

/** web_settings_forget - all as it was before the last change, which was not saved. */
void web_settings_forget(struct web_settings *s);

/** web_settings_take_back - the file, too. */
bool web_settings_take_back(struct web_settings *s, struct fault *fault);

#endif
