/* SPDX-License-Identifier: MIT */
/*
 * conf - the entrances: defaults, a configuration from a file or from memory, its source. Lines and keys are
 * conf_parse's.
 */
#include "conf.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "conf_source.h"
#include "conf_value.h"

#define FILE_SIZE_MAX ((size_t)1 << 20)

static void sonar_defaults(struct conf_sonar *sonar)
{
    char err[CONF_VALUE_MAX];
    memset(sonar, 0, sizeof *sonar);
    for (const struct conf_key *key = conf_keys; key->name; key++)
        if (conf_key_is_sonar(key) && key->standard)
            conf_value_read(key, key->standard, sonar, err, sizeof err);
}

void conf_defaults(struct conf *conf)
{
    char err[CONF_VALUE_MAX];
    locale_t outside = conf_locale_enter();
    memset(conf, 0, sizeof *conf);
    for (int i = 0; i < CONF_MAX_SONARS; i++)
        sonar_defaults(&conf->sonar[i]);
    for (const struct conf_key *key = conf_keys; key->name; key++)
        if (!conf_key_is_sonar(key))
            conf_value_read(key, key->standard, conf, err, sizeof err);
    conf_locale_leave(outside);
}

static struct conf_source *source_new(const char *name, const char *text, size_t size)
{
    struct conf_source *source = calloc(1, sizeof *source);
    if (!source)
        return NULL;
    source->name = strdup(name);
    source->text = malloc(size + 1);
    if (!source->name || !source->text) {
        conf_source_free(source);
        return NULL;
    }
    if (size > 0)
        memcpy(source->text, text, size);
    source->text[size] = '\0';
    source->size = size;
    return source;
}

int conf_load_text(struct conf *conf, struct conf_source **source, const char *name, const char *text, size_t size,
                   const struct conf_checks *checks, conf_fault_fn fault, void *fault_ctx)
{
    int n = -1;
    locale_t outside = conf_locale_enter();
    conf_defaults(conf);
    *source = source_new(name, text, size);
    struct conf_faults *faults = calloc(1, sizeof *faults);
    if (*source && faults) {
        faults->name = name;
        if (size > FILE_SIZE_MAX)
            conf_fault_add(faults, 0, "%zu bytes; want at most %zu", size, FILE_SIZE_MAX);
        else
            conf_parse(conf, *source, checks, faults);
        n = conf_fault_tell(faults, fault, fault_ctx);
    } else {
        fault(fault_ctx, "out of memory while the configuration is read");
    }
    free(faults);
    conf_locale_leave(outside);
    return n;
}

/* All of the file, or NULL with errno. One byte more than is allowed is enough to see that it is too large. */
static char *read_file(const char *path, size_t *size)
{
    FILE *file = fopen(path, "re");
    if (!file)
        return NULL;
    char *text = malloc(FILE_SIZE_MAX + 1);
    errno = ENOMEM;
    if (text) {
        errno = 0;
        *size = fread(text, 1, FILE_SIZE_MAX + 1, file);
        if (!ferror(file))
            errno = *size > FILE_SIZE_MAX ? EFBIG : 0;
    }
    int cause = errno;
    fclose(file);
    if (cause != 0) {
        free(text);
        text = NULL;
    }
    errno = cause;
    return text;
}

int conf_load(struct conf *conf, struct conf_source **source, const char *path, const struct conf_checks *checks,
              conf_fault_fn fault, void *fault_ctx)
{
    size_t size = 0;
    char *text = read_file(path, &size);
    if (!text) {
        char *message = NULL;
        int cause = errno;
        conf_defaults(conf);
        *source = source_new(path, "", 0);
        int length = asprintf(&message, "%s: cannot be read: %s; want a readable file of at most %zu bytes", path,
                              strerror(cause), FILE_SIZE_MAX);
        fault(fault_ctx, length < 0 ? "out of memory while the configuration is read" : message);
        if (length >= 0)
            free(message);
        return -1;
    }
    int n = conf_load_text(conf, source, path, text, size, checks, fault, fault_ctx);
    free(text);
    return n;
}

const char *conf_source_text(const struct conf_source *source, size_t *size)
{
    *size = source ? source->size : 0;
    return source ? source->text : "";
}

void conf_source_override(struct conf_source *source, const char *section, const char *key, const char *option)
{
    source->origin[0][conf_key_find(section, key) - conf_keys].given = option;
}

void conf_source_free(struct conf_source *source)
{
    if (!source)
        return;
    free(source->name);
    free(source->text);
    free(source);
}
