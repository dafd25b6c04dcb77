/* SPDX-License-Identifier: MIT */
/*
 * conf - the entrances: defaults, a configuration from a file and its folder or from memory, its source. Lines and keys
 * are conf_parse's.
 */
#include "conf.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "conf_source.h"
#include "conf_suggest.h"
#include "conf_value.h"

#define FILE_SIZE_MAX ((size_t)1 << 20)

static void sonar_defaults(struct conf_sonar *sonar)
{
    struct fault fault;
    memset(sonar, 0, sizeof *sonar);
    for (const struct conf_key *key = conf_keys; key->name; key++)
        if (conf_key_is_sonar(key) && key->standard)
            conf_value_read(key, key->standard, sonar, &fault);
}

void conf_defaults(struct conf *conf)
{
    struct fault fault;
    locale_t outside = conf_locale_enter();
    memset(conf, 0, sizeof *conf);
    for (int i = 0; i < CONF_MAX_SONARS; i++)
        sonar_defaults(&conf->sonar[i]);
    for (const struct conf_key *key = conf_keys; key->name; key++)
        if (!conf_key_is_sonar(key))
            conf_value_read(key, key->standard, conf, &fault);
    conf_locale_leave(outside);
}

/* Behind the files that are there; false without memory. */
static bool add_file(struct conf_source *source, const char *name, const char *text, size_t size)
{
    struct conf_file *file = &source->file[source->n_files];
    file->name = strdup(name);
    file->text = malloc(size + 1);
    if (!file->name || !file->text) {
        free(file->name);
        free(file->text);
        return false;
    }
    if (size > 0)
        memcpy(file->text, text, size);
    file->text[size] = '\0';
    file->size = size;
    source->n_files++;
    return true;
}

/* A configuration under way. Any of the three is NULL without memory. */
struct load {
    struct conf *conf;
    struct conf_source *source;
    struct conf_faults *faults;
};

static struct load load_begin(struct conf *conf)
{
    struct load l = {conf, calloc(1, sizeof *l.source), calloc(1, sizeof *l.faults)};
    conf_defaults(conf);
    if (l.faults)
        return l;
    conf_source_free(l.source);
    l.source = NULL;
    return l;
}

/* What several files mean together, for those who keep one text. */
static bool write_whole(const struct conf *conf, struct conf_source *source)
{
    FILE *out = open_memstream(&source->whole, &source->whole_size);
    if (!out)
        return false;
    conf_print(conf, source, out);
    return fclose(out) == 0;
}

static int load_end(struct load *l, bool enough_memory, const struct conf_checks *checks, conf_fault_fn fault,
                    void *fault_ctx)
{
    int n = -1;
    if (enough_memory && l->faults->n == 0)
        conf_parse(l->conf, l->source, checks, l->faults);
    if (enough_memory && l->faults->n == 0 && l->source->n_files > 1)
        enough_memory = write_whole(l->conf, l->source);
    if (enough_memory)
        n = conf_fault_tell(l->faults, fault, fault_ctx);
    else
        fault(fault_ctx, "out of memory reading the configuration");
    free(l->faults);
    return n;
}

int conf_load_text(struct conf *conf, struct conf_source **source, const struct conf_text *text,
                   const struct conf_checks *checks, conf_fault_fn fault, void *fault_ctx)
{
    locale_t outside = conf_locale_enter();
    struct load l = load_begin(conf);
    bool enough_memory = l.source && add_file(l.source, text->name, text->bytes, text->size);
    if (enough_memory && text->size > FILE_SIZE_MAX) {
        conf_fault_in(l.faults, 0, text->name);
        conf_fault_add(l.faults, 0, "%zu bytes; expected at most %zu", text->size, FILE_SIZE_MAX);
    }
    int n = load_end(&l, enough_memory, checks, fault, fault_ctx);
    *source = l.source;
    conf_locale_leave(outside);
    return n;
}

/* Whoever may write into the folder must not make sonard wait: a FIFO is no drop-in. NULL with errno. */
static FILE *open_regular(const char *path)
{
    struct stat st;
    const int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return NULL;
    FILE *file = fstat(fd, &st) == 0 && S_ISREG(st.st_mode) ? fdopen(fd, "r") : NULL;
    if (!file) {
        close(fd);
        errno = EINVAL;
    }
    return file;
}

/* All of the file, or NULL with errno. One byte more than is allowed is enough to see that it is too large. */
static char *read_file(const char *path, bool is_drop_in_file, size_t *size)
{
    FILE *file = is_drop_in_file ? open_regular(path) : fopen(path, "re");
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

/* False without memory. A file that cannot be read is a fault, and an empty one. */
static bool take_file(struct load *l, const char *path, bool is_drop_in_file)
{
    size_t size = 0;
    char *text = read_file(path, is_drop_in_file, &size);
    const int cause = errno;
    if (!add_file(l->source, path, text ? text : "", size * (text != NULL))) {
        free(text);
        return false;
    }
    if (!text) {
        conf_fault_in(l->faults, l->source->n_files - 1, l->source->file[l->source->n_files - 1].name);
        conf_fault_add(l->faults, 0, "cannot be read: %s; expected a readable file of at most %zu bytes",
                       cause == EINVAL ? "not a regular file" : strerror(cause), FILE_SIZE_MAX);
    }
    free(text);
    return true;
}

static bool is_drop_in_name(const char *name)
{
    const char *ending = strrchr(name, '.');
    return ending && ending != name && name[0] != '.' && strcmp(ending, ".conf") == 0;
}

static int is_drop_in(const struct dirent *entry)
{
    return is_drop_in_name(entry->d_name);
}

/* By bytes, whatever the language of the system. */
static int by_name(const struct dirent **a, const struct dirent **b)
{
    return strcmp((*a)->d_name, (*b)->d_name);
}

static bool take_drop_in(struct load *l, const char *folder, const char *name)
{
    char path[2 * PATH_MAX];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return take_file(l, path, true);
}

/* The text, where it stands before that name; otherwise it waits for a later one. NULL: for the last. False without
 * memory. */
static bool take_instead(struct load *l, const char *folder, const struct conf_text **instead, const char *before)
{
    char path[2 * PATH_MAX];
    const struct conf_text *text = *instead;
    if (!text || (before && strcmp(text->name, before) > 0))
        return true;
    *instead = NULL;
    snprintf(path, sizeof path, "%s/%s", folder, text->name);
    return add_file(l->source, path, text->bytes, text->size);
}

/* The files of the folder that has the file's name with .d behind it. */
static bool take_drop_ins(struct load *l, const struct conf_where *where)
{
    char folder[PATH_MAX];
    struct dirent **entry = NULL;
    const struct conf_text *instead = where->instead;
    bool enough_memory = true;
    if (snprintf(folder, sizeof folder, "%s.d", where->path) >= (int)sizeof folder)
        return true;
    const int n = scandir(folder, &entry, is_drop_in, by_name);
    if (n < 0 && errno != ENOENT && errno != ENOTDIR) {
        conf_fault_in(l->faults, 0, l->source->file[0].name);
        conf_fault_add(l->faults, 0, "the folder %s cannot be read: %s", folder, strerror(errno));
    }
    const bool too_many = n + (instead != NULL) >= CONF_FILES_MAX;
    if (too_many) {
        conf_fault_in(l->faults, 0, l->source->file[0].name);
        conf_fault_add(l->faults, 0, "%d files in the folder %s; expected at most %d", n, folder,
                       CONF_FILES_MAX - 1);
    }
    for (int i = 0; i < n; i++) {
        const char *name = entry[i]->d_name;
        const bool replaced = where->instead && strcmp(where->instead->name, name) == 0;
        if (!too_many)
            enough_memory = enough_memory && take_instead(l, folder, &instead, name) &&
                            (replaced || take_drop_in(l, folder, name));
        free(entry[i]);
    }
    free(entry);
    return enough_memory && (too_many || take_instead(l, folder, &instead, NULL));
}

const char *conf_drop_in(const char *path, const char *file)
{
    char folder[PATH_MAX], real[PATH_MAX];
    const char *name = strrchr(file, '/');
    if (!name || snprintf(folder, sizeof folder, "%s.d", path) >= (int)sizeof folder || !realpath(folder, real))
        return NULL;
    const size_t n = strlen(real);
    return (size_t)(name - file) == n && memcmp(real, file, n) == 0 && is_drop_in_name(name + 1) ? name + 1 : NULL;
}

int conf_load(struct conf *conf, struct conf_source **source, const char *path, const struct conf_checks *checks,
              conf_fault_fn fault, void *fault_ctx)
{
    return conf_load_with(conf, source, &(struct conf_where){.path = path}, checks, fault, fault_ctx);
}

int conf_load_with(struct conf *conf, struct conf_source **source, const struct conf_where *where,
                   const struct conf_checks *checks, conf_fault_fn fault, void *fault_ctx)
{
    locale_t outside = conf_locale_enter();
    struct load l = load_begin(conf);
    bool enough_memory = l.source && take_file(&l, where->path, false) && take_drop_ins(&l, where);
    const bool unread = enough_memory && l.faults->n > 0;
    int n = load_end(&l, enough_memory, checks, fault, fault_ctx);
    *source = l.source;
    conf_locale_leave(outside);
    return unread ? -1 : n;
}

const char *conf_source_text(const struct conf_source *source, size_t *size)
{
    *size = 0;
    if (source && source->whole) {
        *size = source->whole_size;
        return source->whole;
    }
    if (!source || source->n_files == 0)
        return "";
    *size = source->file[0].size;
    return source->file[0].text;
}

void conf_source_override(struct conf_source *source, const char *section, const char *key, const char *option)
{
    source->origin[0][conf_key_find(section, key) - conf_keys].given = option;
}

void conf_source_free(struct conf_source *source)
{
    if (!source)
        return;
    for (unsigned i = 0; i < source->n_files; i++) {
        free(source->file[i].name);
        free(source->file[i].text);
    }
    free(source->whole);
    free(source);
}
