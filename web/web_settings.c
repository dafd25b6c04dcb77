/* SPDX-License-Identifier: MIT */
#include "web_settings.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "protocol/protocol.h"

#define NAME_CHARACTERS    "abcdefghijklmnopqrstuvwxyz0123456789_"
#define SECTION_CHARACTERS NAME_CHARACTERS "ABCDEFGHIJKLMNOPQRSTUVWXYZ- "
#define VALUE_CHARACTERS   SECTION_CHARACTERS ".,+/:"

bool web_settings_parse(const char *text, struct web_setting *setting, struct fault *fault)
{
    static const char wanted[] = "expected [section] key = value";
    const size_t n = strlen(text);
    const size_t section = text[0] == '[' ? 1 + strspn(text + 1, SECTION_CHARACTERS) : 0;
    if (n >= sizeof setting->text || section < 2 || strncmp(text + section, "] ", 2) != 0)
        return fault_set(fault, "%s", wanted);
    const size_t key = section + 2 + strspn(text + section + 2, NAME_CHARACTERS);
    const char *value = text + key + 3;

    if (key == section + 2 || strncmp(text + key, " = ", 3) != 0 || !value[0] || value[0] == ' ' ||
        value[strspn(value, VALUE_CHARACTERS)])
        return fault_set(fault, "%s", wanted);
    if (text[section - 1] == ' ' || strstr(text, "  ")) /* the daemon names a section without them */
        return fault_set(fault, "%s, and one blank at most", wanted);
    if (strspn(text + 1, " ") > 0 || strncmp(text + 1, "server", strlen("server")) == 0)
        return fault_set(fault, "[server] cannot be changed from here");
    memcpy(setting->text, text, n + 1);
    setting->section = section + 1;
    setting->key = key;
    return true;
}

static bool is_same_key(const struct web_setting *a, const struct web_setting *b)
{
    return a->key == b->key && memcmp(a->text, b->text, a->key) == 0;
}

static int by_text(const void *a, const void *b)
{
    return strcmp(((const struct web_setting *)a)->text, ((const struct web_setting *)b)->text);
}

static void write_lines(const struct web_settings *s, FILE *out)
{
    fputs(PROTOCOL_PAGE_FILE "\n", out);
    for (int i = 0; i < s->n; i++) {
        const struct web_setting *a = &s->setting[i];
        if (i == 0 || strncmp(a->text, a[-1].text, a->section) != 0)
            fprintf(out, "%.*s\n", (int)a->section, a->text);
        fprintf(out, "%s\n", a->text + a->section + 1);
    }
}

char *web_settings_text(const struct web_settings *s)
{
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return NULL;
    write_lines(s, out);
    if (fclose(out) == 0)
        return text;
    free(text);
    return NULL;
}

char *web_settings_file(const struct web_settings *s, struct fault *fault)
{
    const char *name = strrchr(s->path, '/'), *last = name ? name + 1 : s->path;
    char folder[PATH_MAX], real[PATH_MAX], *file;
    snprintf(folder, sizeof folder, "%.*s", name ? (int)(last - s->path) : 1, name ? s->path : ".");
    if (!realpath(folder, real)) {
        fault_set(fault, "%s: %s", folder, strerror(errno));
        return NULL;
    }
    if (asprintf(&file, "%s/%s", real, last) < 0) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    return file;
}

/* The new file takes the place of the old one as a whole. */
bool web_settings_save(const struct web_settings *s, struct fault *fault)
{
    char path[4096];
    if (snprintf(path, sizeof path, "%s.new", s->path) >= (int)sizeof path)
        return fault_set(fault, "the path of the settings is too long");
    FILE *out = fopen(path, "we");

    if (!out)
        return fault_set(fault, "%s: %s", path, strerror(errno));
    write_lines(s, out);
    fchmod(fileno(out), 0644);
    const bool good = !ferror(out) && fflush(out) == 0 && fsync(fileno(out)) == 0;

    if (fclose(out) != 0 || !good || rename(path, s->path) < 0) {
        fault_set(fault, "%s: %s", s->path, strerror(errno));
        unlink(path);
        return false;
    }
    return true;
}

/* Only what save writes. */
static bool read_file(struct web_settings *s, FILE *in, struct fault *fault)
{
    char line[WEB_SETTINGS_LINE], section[WEB_SETTINGS_LINE] = "", text[2 * WEB_SETTINGS_LINE];
    for (int number = 1; fgets(line, sizeof line, in); number++) {
        line[strcspn(line, "\n")] = '\0';
        if (line[0] == '#' || !line[0])
            continue;
        if (line[0] == '[') {
            memcpy(section, line, sizeof section);
            continue;
        }
        snprintf(text, sizeof text, "%s %s", section, line);
        if (s->n == WEB_SETTINGS_MAX || !web_settings_parse(text, &s->setting[s->n], fault))
            return fault_set(fault, "%s:%d is not of sonard-web: settings from the page need a file of their own",
                             s->path, number);
        s->n++;
    }
    return true;
}

static bool read_token(struct web_settings *s, const char *path, struct fault *fault)
{
    FILE *in = fopen(path, "re");
    struct stat st;
    if (!in)
        return fault_set(fault, "%s: %s", path, strerror(errno));
    if (!fgets(s->token, sizeof s->token, in))
        s->token[0] = '\0';
    s->token[strcspn(s->token, "\r\n")] = '\0';
    const bool open = fstat(fileno(in), &st) == 0 && (st.st_mode & 077);

    fclose(in);
    if (open)
        return fault_set(fault, "%s: others can read the token; chmod 600 it", path);
    if (strlen(s->token) < WEB_SETTINGS_LEAST)
        return fault_set(fault, "%s: a token has at least %d characters", path, WEB_SETTINGS_LEAST);
    return true;
}

bool web_settings_open(struct web_settings *s, const char *path, const char *token_path, struct fault *fault)
{
    *s = (struct web_settings){.path = path};
    if (!read_token(s, token_path, fault))
        return false;
    FILE *in = fopen(path, "re");

    if (!in)
        return errno == ENOENT || fault_set(fault, "%s: %s", path, strerror(errno));
    const bool good = read_file(s, in, fault);

    fclose(in);
    return good;
}

bool web_settings_token(const struct web_settings *s, const char *token)
{
    const size_t n = strlen(s->token);
    unsigned differs = strlen(token) != n;
    for (size_t i = 0, k = 0; i < n; i++, k += token[k] != '\0')
        differs |= (unsigned char)s->token[i] ^ (unsigned char)token[k];
    return n >= WEB_SETTINGS_LEAST && !differs;
}

void web_settings_forget(struct web_settings *s)
{
    memcpy(s->setting, s->before, sizeof s->setting);
    s->n = s->n_before;
}

bool web_settings_change(struct web_settings *s, const struct web_setting *setting, struct fault *fault)
{
    int at = 0;
    memcpy(s->before, s->setting, sizeof s->before);
    s->n_before = s->n;
    while (at < s->n && !is_same_key(&s->setting[at], setting))
        at++;
    if (at == WEB_SETTINGS_MAX)
        return fault_set(fault, "%s has %d keys already: remove some", s->path, WEB_SETTINGS_MAX);
    s->setting[at] = *setting;
    s->n = at == s->n ? s->n + 1 : s->n;
    qsort(s->setting, (size_t)s->n, sizeof *s->setting, by_text); /* a section stands in the file once */
    return true;
}

bool web_settings_take_back(struct web_settings *s, struct fault *fault)
{
    web_settings_forget(s);
    return web_settings_save(s, fault);
}
