/* SPDX-License-Identifier: MIT */
/*
 * conf_parse - lines, sections and keys. inih takes `key = value ; comment` apart; it is fed line by line through a
 * reader of ours, which knows the line's number, follows the [section] heads, and refuses what inih would cut or skip
 * in silence. What a single value means is conf_value's, what goes together conf_rules'.
 */
#include <ini.h>
#include <stdlib.h>
#include <string.h>

#include "conf_source.h"
#include "conf_suggest.h"
#include "conf_value.h"
#include "core/fault.h"

#define TITLE_MAX 64 /* of a section: what stands between the brackets */

/* One [section] line that was understood. */
struct head {
    char title[TITLE_MAX];
    unsigned line;
};

struct parse {
    struct conf *conf;
    struct conf_source *source;
    const struct conf_checks *checks;
    struct conf_faults *faults;

    const char *rest, *end; /* of the text */
    unsigned file, line;    /* being read; lines from 1 */
    bool lenient;           /* lines of this file that are wrong have no effect, and are no fault */
    const char *waiting;    /* the line when it is neither head nor comment and no key was found in it yet */
    size_t waiting_n;
    bool not_text; /* a line of some file; what follows there was not read */

    struct head head[CONF_MAX_SONARS + CONF_MAX_GRIDS + 16]; /* every good section of the file so far */
    int n_heads, sonar_heads;
    struct conf_origin first[CONF_MAX_SONARS]; /* heads of the sonars */

    /* The current section. */
    bool any_section;
    const struct conf_section *section; /* NULL: unknown, its keys say nothing */
    char title[TITLE_MAX];
    void *base;                 /* where values go ... */
    struct conf_origin *origin; /* ... and where their lines are noted */

    /* Keys of a section that cannot be had (a second one, one sonar too many) are still checked: into these. */
    struct conf scratch;
    struct conf_origin scratch_origin[CONF_KEYS_MAX];
};

/* What only the daemon knows: is there such a device, is the port's address well formed? */
static bool check_outside(const struct parse *p, const struct conf_key *key, const char *value,
                          struct fault *fault)
{
    static const char *const lines[] = {"power", "trigger", "leak"};
    if (!p->checks || (key->instead && strcmp(value, key->instead) == 0))
        return true;
    if (p->checks->device && strcmp(key->name, "device") == 0)
        return p->checks->device(value, fault);
    if (p->checks->port && strcmp(key->name, "port") == 0)
        return p->checks->port(value, fault);
    if (p->checks->depth && strcmp(key->section, "depth") == 0 && strcmp(key->name, "source") == 0)
        return p->checks->depth(value, fault);
    for (size_t i = 0; p->checks->line && i < sizeof lines / sizeof lines[0]; i++)
        if (strcmp(key->name, lines[i]) == 0)
            return p->checks->line(value, fault);
    return true;
}

static void take_value(struct parse *p, const struct conf_key *key, const char *value)
{
    struct fault fault;
    char allowed[CONF_VALUE_MAX];
    struct conf_origin *origin = &p->origin[key - conf_keys];
    void *aside = conf_key_is_sonar(key) ? (void *)&p->scratch.sonar[0] : (void *)&p->scratch;
    origin->bad = true;
    memmove((char *)aside + key->offset, (char *)p->base + key->offset, key->size);
    if (strstr(value, " #") || strstr(value, "\t#")) {
        conf_fault_add(p->faults, p->line, "[%s] %s = %s: a # after a value; start a comment with ;", p->title,
                       key->name, value);
    } else if (!conf_value_read(key, value, aside, &fault)) {
        conf_value_allowed(key, allowed, sizeof allowed);
        conf_fault_add(p->faults, p->line, "[%s] %s = %s: %s; expected %s", p->title, key->name, value, fault.text,
                       allowed);
    } else if (!check_outside(p, key, value, &fault)) {
        conf_fault_add(p->faults, p->line, "[%s] %s = %s: %s", p->title, key->name, value, fault.text);
    } else {
        memmove((char *)p->base + key->offset, (char *)aside + key->offset, key->size);
        origin->bad = false;
    }
}

/* inih's handler. Always 1: faults are ours to tell. inih's section is not used, heads never reach it. */
static int take_key(void *user, const char *inih_section, const char *name, const char *value)
{
    (void)inih_section;
    struct parse *p = user;
    if (*name == '\0')
        return 1;
    p->waiting = NULL;
    if (!p->any_section) {
        conf_fault_add(p->faults, p->line, "%s = %s: no section before it; put a [section] line above it", name,
                       value);
        return 1;
    }
    if (!p->section)
        return 1;
    const struct conf_key *key = conf_key_find(p->section->name, name);
    if (!key) {
        char hint[512];
        conf_suggest_key(p->section->name, name, hint, sizeof hint);
        conf_fault_add(p->faults, p->line, "[%s] %s = %s: unknown key; %s", p->title, name, value, hint);
        return 1;
    }
    struct conf_origin *origin = &p->origin[key - conf_keys];
    if (origin->line > 0 && origin->file == p->file) {
        conf_fault_add(p->faults, p->line, "[%s] %s = %s: duplicate key (first set on line %u)", p->title, name,
                       value, origin->line);
        return 1;
    }
    const struct conf_origin before = *origin;
    origin->file = p->file;
    origin->line = p->line;
    take_value(p, key, value);
    if (origin->bad && p->lenient)
        *origin = before; /* and the value is that of before, too */
    return 1;
}

/* Of a sonar or a grid. */
static bool is_name(const char *name)
{
    size_t n = strspn(name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_");
    return n > 0 && n < CONF_NAME_MAX && name[n] == '\0';
}

static void use_scratch(struct parse *p)
{
    memset(p->scratch_origin, 0, sizeof p->scratch_origin);
    p->base = strcmp(p->section->name, "sonar") == 0 ? (void *)&p->scratch.sonar[0] : (void *)&p->scratch;
    p->origin = p->scratch_origin;
}

/* -1: there is none of that name yet. */
static int sonar_find(const struct parse *p, const char *name)
{
    int i = p->conf->n_sonars;
    while (--i >= 0 && strcmp(p->conf->sonar[i].name, name) != 0) {
    }
    return i;
}

static void begin_sonar(struct parse *p, const char *name)
{
    int i = sonar_find(p, name); /* in an earlier file */
    if (i < 0 && p->lenient) {
        conf_fault_add(p->faults, p->line, "[%s]: no file before has this section", p->title);
        return;
    }
    p->sonar_heads++;
    if (!is_name(name)) {
        conf_fault_add(p->faults, p->line,
                       "[%s]: %s; expected [sonar NAME], NAME of 1 to %d letters, digits, - and _", p->title,
                       *name ? "bad name of a sonar" : "a sonar without a name", CONF_NAME_MAX - 1);
    } else if (i < 0 && p->conf->n_sonars == CONF_MAX_SONARS) {
        conf_fault_add(p->faults, p->line, "[%s]: too many sonars; expected at most %d", p->title,
                       CONF_MAX_SONARS);
    } else {
        if (i < 0) {
            i = p->conf->n_sonars++;
            p->first[i] = (struct conf_origin){.file = p->file, .line = p->line};
        }
        struct conf_sonar *sonar = &p->conf->sonar[i];
        snprintf(sonar->name, sizeof sonar->name, "%s", name);
        p->base = sonar;
        p->origin = p->source->origin[i];
    }
}

/* From 1; 0: there is none of that name yet. */
static int grid_find(const struct parse *p, const char *name)
{
    int i = p->conf->n_more_grids;
    while (i > 0 && strcmp(p->conf->more_grid[i - 1].name, name) != 0)
        i--;
    return i;
}

static void begin_grid(struct parse *p, const char *name)
{
    int i = grid_find(p, name); /* in an earlier file */
    if (!i && p->lenient) {
        conf_fault_add(p->faults, p->line, "[%s]: no file before has this section", p->title);
    } else if (!is_name(name) || strcmp(name, CONF_MAIN_GRID) == 0) {
        conf_fault_add(
            p->faults, p->line,
            "[%s]: bad name of a grid; expected 1 to %d letters, digits, - and _, other than " CONF_MAIN_GRID
            ", which is the plain [grid]",
            p->title, CONF_NAME_MAX - 1);
    } else if (!i && p->conf->n_more_grids == CONF_MAX_GRIDS) {
        conf_fault_add(p->faults, p->line, "[%s]: too many grids; expected at most %d besides [grid]", p->title,
                       CONF_MAX_GRIDS);
    } else {
        if (!i)
            i = ++p->conf->n_more_grids;
        struct conf_grid *grid = &p->conf->more_grid[i - 1];
        snprintf(grid->name, sizeof grid->name, "%s", name);
        p->base = (char *)p->conf + conf_base(conf_key_find("grid", "range"), i);
        p->origin = p->source->origin[i];
    }
}

static unsigned head_line(const struct parse *p, const char *title)
{
    for (int i = 0; i < p->n_heads; i++)
        if (strcmp(p->head[i].title, title) == 0)
            return p->head[i].line;
    return 0;
}

/* p->title is set: find out what section it is and where its values go. */
static void begin_section(struct parse *p)
{
    char kind[TITLE_MAX];
    const char *name = p->title + strcspn(p->title, " ");
    snprintf(kind, sizeof kind, "%.*s", (int)(name - p->title), p->title);
    name += strspn(name, " ");
    bool sonar = strcmp(kind, "sonar") == 0, more_grid = *name && strcmp(kind, "grid") == 0;

    p->any_section = true;
    p->section = conf_section_find(sonar || more_grid ? kind : p->title);
    if (!p->section) {
        char hint[512];
        conf_suggest_section(kind, hint, sizeof hint);
        conf_fault_add(p->faults, p->line, "[%s]: unknown section; %s", p->title, hint);
        return;
    }
    use_scratch(p);
    unsigned first = head_line(p, p->title);
    if (first > 0) {
        conf_fault_add(p->faults, p->line, "[%s]: duplicate section (first defined on line %u)", p->title, first);
        return;
    }
    if (sonar) {
        begin_sonar(p, name);
    } else if (more_grid) {
        begin_grid(p, name);
    } else {
        p->base = p->conf;
        p->origin = p->source->origin[0];
    }
    if (p->base != &p->scratch.sonar[0] && p->base != &p->scratch) {
        struct head *head = &p->head[p->n_heads++];
        snprintf(head->title, sizeof head->title, "%s", p->title);
        head->line = p->line;
    }
}

/* "[title]", perhaps with a comment behind it; blanks in the title become one space each. */
static void take_head(struct parse *p, const char *s, size_t n)
{
    const char *close = memchr(s, ']', n);
    const char *behind = close ? close + 1 : s + n;
    while (behind < s + n && (*behind == ' ' || *behind == '\t'))
        behind++;
    if (!close || (behind < s + n && *behind != ';' && *behind != '#')) {
        conf_fault_add(p->faults, p->line, "%.*s: %s; expected [section] alone on its line", (int)n, s,
                       close ? "more than a section" : "no ] at the end of the section");
        p->any_section = true;
        p->section = NULL;
        return;
    }
    size_t used = 0;
    bool gap = false;
    for (s++; s < close && used + 2 < sizeof p->title; s++) {
        if (*s == ' ' || *s == '\t') {
            gap = used > 0;
            continue;
        }
        if (gap)
            p->title[used++] = ' ';
        gap = false;
        p->title[used++] = *s;
    }
    p->title[used] = '\0';
    begin_section(p);
}

/* Length of the UTF-8 character at s, 0 when it is none or a control character other than tab. */
static size_t character(const unsigned char *s, size_t n)
{
    static const unsigned lowest[5] = {0, 0, 0x80, 0x800, 0x10000}; /* shorter forms are forbidden */
    if (s[0] < 0x80)
        return (s[0] >= 0x20 && s[0] != 0x7f) || s[0] == '\t';
    size_t length = s[0] >= 0xf8 ? 0 : s[0] >= 0xf0 ? 4 : s[0] >= 0xe0 ? 3 : s[0] >= 0xc0 ? 2 : 0;
    if (length == 0 || length > n)
        return 0;
    unsigned code = s[0] & (0x7fu >> length);
    for (size_t i = 1; i < length; i++) {
        if ((s[i] & 0xc0) != 0x80)
            return 0;
        code = code << 6 | (s[i] & 0x3fu);
    }
    bool valid = code >= lowest[length] && code <= 0x10ffff && (code < 0xd800 || code > 0xdfff);
    return valid ? length : 0;
}

static bool is_text(struct parse *p, const char *s, size_t n)
{
    const unsigned char *u = (const unsigned char *)s;
    for (size_t i = 0; i < n;) {
        size_t length = character(u + i, n - i);
        if (length == 0) {
            conf_fault_add(p->faults, p->line,
                           "byte 0x%02x in column %zu; expected text in UTF-8; the rest was not checked", u[i],
                           i + 1);
            return false;
        }
        i += length;
    }
    return true;
}

/*
 * inih's reader, in the manner of fgets: the next line that may hold a key, or an empty one in place of the others.
 * Blanks at the front are taken off: inih would take the line for a continuation.
 */
static char *next_line(char *str, int num, void *stream)
{
    struct parse *p = stream;
    if (p->waiting)
        conf_fault_add(p->faults, p->line, "%.*s: not a key and its value; expected key = value",
                       (int)p->waiting_n, p->waiting);
    p->waiting = NULL;
    if (p->rest == p->end)
        return NULL;

    const char *s = p->rest;
    const char *newline = memchr(s, '\n', (size_t)(p->end - s));
    const char *end = newline ? newline : p->end;
    p->rest = newline ? newline + 1 : p->end;
    p->line++;
    if (end > s && end[-1] == '\r')
        end--;
    size_t room = (size_t)num - 3; /* inih: the longest line is three less than its buffer */
    snprintf(str, (size_t)num, "\n");
    if (!is_text(p, s, (size_t)(end - s))) {
        p->not_text |= !p->lenient; /* of a picture or a program every line is wrong: one fault says it */
        return NULL;
    }
    while (s < end && (*s == ' ' || *s == '\t'))
        s++;
    size_t n = (size_t)(end - s);
    if (n == 0 || *s == '#' || *s == ';')
        return str;
    if (n > room) {
        conf_fault_add(p->faults, p->line, "%zu bytes in this line; expected at most %zu", n, room);
        return str;
    }
    if (*s == '[') {
        take_head(p, s, n);
        return str;
    }
    p->waiting = s;
    p->waiting_n = n;
    if (memchr(s, '=', n)) /* inih would take a colon as well */
        snprintf(str, (size_t)num, "%.*s\n", (int)n, s);
    return str;
}

/* What a [grid NAME] leaves out is as in [grid], wherever in the file that stands. */
static void inherit_grid(struct parse *p)
{
    for (int i = 1; i <= p->conf->n_more_grids; i++) {
        for (const struct conf_key *key = conf_keys; key->name; key++) {
            struct conf_origin *from = &p->source->origin[0][key - conf_keys];
            struct conf_origin *to = &p->source->origin[i][key - conf_keys];
            if (strcmp(key->section, "grid") != 0 || to->line > 0)
                continue;
            memcpy((char *)p->conf + conf_base(key, i) + key->offset, (char *)p->conf + key->offset, key->size);
            *to = *from;
        }
    }
}

static void check_complete(struct parse *p)
{
    conf_fault_in(p->faults, 0, p->source->file[0].name);
    if (p->sonar_heads == 0 && !p->conf->depth.source[0] && !p->conf->nmea.port[0])
        conf_fault_add(p->faults, 0,
                       "no sonar; expected 1 to %d sections [sonar NAME], or [depth] or [nmea] to try that alone",
                       CONF_MAX_SONARS);
    for (int i = 0; i < p->conf->n_sonars; i++) {
        char title[TITLE_MAX];
        snprintf(title, sizeof title, "sonar %s", p->conf->sonar[i].name);
        for (const struct conf_key *key = conf_keys; key->name; key++) {
            if (!conf_key_is_sonar(key) || key->standard || p->source->origin[i][key - conf_keys].line > 0)
                continue;
            conf_fault_in(p->faults, p->first[i].file, p->source->file[p->first[i].file].name);
            conf_fault_add(p->faults, p->first[i].line, "[%s] %s: missing; expected %s", title, key->name,
                           key->form);
        }
    }
}

/* A key that its device has no use for changes nothing: whoever wrote it expects something else. */
static void drop_unused(struct parse *p, int sonar, const struct conf_key *key)
{
    struct conf_origin *origin = &p->source->origin[sonar][key - conf_keys];
    struct conf_sonar *to = &p->conf->sonar[sonar];
    struct fault fault;
    if (origin->line > 0 && !origin->bad && !p->checks->recorded) {
        char value[CONF_VALUE_MAX];
        conf_value_write(key, to, value, sizeof value);
        conf_fault_in(p->faults, origin->file, p->source->file[origin->file].name);
        conf_fault_add(p->faults, origin->line, "[sonar %s] %s = %s: %s does not use this key; remove it",
                       to->name, key->name, value, to->device);
    }
    conf_value_read(key, key->standard, to, &fault);
    *origin = (struct conf_origin){.bad = origin->bad, .unused = true};
}

static void check_uses(struct parse *p)
{
    const struct conf_key *device = conf_key_find("sonar", "device");
    for (int i = 0; p->checks && p->checks->uses && i < p->conf->n_sonars; i++) {
        const struct conf_origin *named = &p->source->origin[i][device - conf_keys];
        for (const struct conf_key *key = conf_keys; key->name && named->line > 0 && !named->bad; key++)
            if (key->of_device && !p->checks->uses(p->conf->sonar[i].device, key->name))
                drop_unused(p, i, key);
    }
}

static bool is_page_file(const struct parse *p, unsigned i)
{
    const struct conf_file *file = &p->source->file[i];
    const char *line = p->checks ? p->checks->page_file : NULL;
    const size_t n = line ? strlen(line) : 0;
    return i > 0 && n > 0 && file->size > n && memcmp(file->text, line, n) == 0 && file->text[n] == '\n';
}

static void parse_file(struct parse *p, unsigned i)
{
    const struct conf_file *file = &p->source->file[i];
    p->lenient = is_page_file(p, i) && p->checks->left_out;
    p->faults->left_out = p->lenient ? p->checks->left_out : NULL;
    p->faults->left_out_ctx = p->lenient ? p->checks->left_out_ctx : NULL;
    conf_fault_in(p->faults, i, file->name);
    p->file = i;
    p->line = 0;
    p->n_heads = 0;
    p->any_section = false;
    p->section = NULL;
    p->rest = file->text;
    p->end = p->rest + file->size;
    if (file->size >= 3 && memcmp(p->rest, "\xef\xbb\xbf", 3) == 0)
        p->rest += 3;
    if (ini_parse_stream(next_line, p, take_key, p) == -2)
        conf_fault_add(p->faults, 0, "out of memory");
    p->faults->left_out = NULL;
}

void conf_parse(struct conf *conf, struct conf_source *source, const struct conf_checks *checks,
                struct conf_faults *faults)
{
    struct parse *p = calloc(1, sizeof *p);
    if (!p) {
        conf_fault_add(faults, 0, "out of memory");
        return;
    }
    *p = (struct parse){.conf = conf, .source = source, .checks = checks, .faults = faults};
    for (unsigned i = 0; i < source->n_files; i++)
        parse_file(p, i);
    inherit_grid(p);
    if (!p->not_text) {
        check_complete(p);
        check_uses(p);
        conf_rules_check(conf, source, checks, faults);
    }
    free(p);
}
