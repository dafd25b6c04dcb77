/* SPDX-License-Identifier: MIT */
#include "man.h"

#include <string.h>

#include "protocol.h"

#define ENDLESS 1e8 /* a limit that only keeps numbers sane is not worth telling */

/* Text with a minus for every hyphen that is none. */
static void put_text(FILE *out, const char *text)
{
    for (const char *c = text; *c; c++)
        fprintf(out, *c == '-' ? "\\%c" : "%c", *c);
}

static void put_words(FILE *out, const char *const *words)
{
    for (int i = 0; words[i]; i++) {
        put_text(out, i == 0 ? "" : words[i + 1] ? ", " : " or ");
        put_text(out, words[i]);
    }
}

static void put_range(FILE *out, const struct protocol_param *p)
{
    char text[64] = "";
    if (p->hi < ENDLESS)
        snprintf(text, sizeof text, "; %g to %g", p->lo, p->hi);
    put_text(out, text);
    if (p->unit[0])
        fprintf(out, "%s%s", text[0] ? " " : "; in ", p->unit);
}

static void put_type(FILE *out, const struct protocol_param *p)
{
    switch (p->type) {
    case PROTOCOL_INTEGER:
        fputs("; whole", out);
        break;
    case PROTOCOL_NUMBERS:
    case PROTOCOL_BAND:
        fprintf(out, "; [%u numbers]", p->count);
        break;
    case PROTOCOL_PLACES:
        fprintf(out, "; 1 to %u of [3 numbers]", p->count);
        break;
    case PROTOCOL_WORD:
        fputs("; ", out);
        put_words(out, p->words);
        break;
    case PROTOCOL_FLAG:
        fputs("; true or false", out);
        break;
    case PROTOCOL_OBJECT:
        fputs("; an object", out);
        break;
    default:
        break;
    }
    if (p->hi > p->lo)
        put_range(out, p);
}

static void begin_table(FILE *out)
{
    fputs(".TS\ntab(|);\nl lx.\n", out);
}

static void put_params(FILE *out, const struct protocol_method *m)
{
    char without[64];
    if (!m->params->name) {
        fprintf(out, ".PP\n.B %s\nhas no parameters.\n", m->name);
        return;
    }
    fprintf(out, ".PP\nParameters of\n.BR %s :\n", m->name);
    begin_table(out);
    for (const struct protocol_param *p = m->params; p->name; p++) {
        fprintf(out, "%s|T{\n", p->name);
        put_text(out, p->help);
        put_type(out, p);
        protocol_without(p, without, sizeof without);
        if (p->need == PROTOCOL_REQUIRED)
            fputs("; must be given", out);
        else if (without[0]) {
            fputs(" (", out);
            put_text(out, without);
            fputc(')', out);
        }
        fputs("\nT}\n", out);
    }
    fputs(".TE\n.PP\n", out);
}

/* "=a|b|c" as "a, b or c" */
static void put_choice(FILE *out, const char *type)
{
    for (const char *word = type + 1, *before = ""; *word;) {
        const size_t n = strcspn(word, "|?[");
        const char *next = word[n] == '|' ? word + n + 1 : "";
        fprintf(out, "%s%.*s", before, (int)n, word);
        before = strchr(next, '|') ? ", " : " or ";
        word = next;
    }
}

static void put_result(FILE *out, const struct protocol_method *m)
{
    fprintf(out, ".PP\nResult of\n.BR %s :\n", m->name);
    begin_table(out);
    for (const struct protocol_field *f = m->result; f->name; f++) {
        fprintf(out, "%s|T{\n", f->name);
        if (f->type[0] == '=')
            put_choice(out, f->type);
        fputs(f->type[0] == '=' && f->help[0] ? "; " : "", out);
        put_text(out, f->help);
        fputs("\nT}\n", out);
    }
    fputs(".TE\n.PP\n", out);
}

static void put_changes(FILE *out)
{
    const char *before = "";
    for (const struct protocol_method *m = protocol_methods; m->name; m++) {
        if (m->right != PROTOCOL_CHANGES)
            continue;
        fprintf(out, "%s.BR %s", before, m->name);
        before = " ,\n";
    }
    fputs(" .\n", out);
}

static void put_section(FILE *out, const struct protocol_method *m)
{
    fprintf(out, ".SS %s\n", m->name);
    put_text(out, m->help);
    fputc('\n', out);
    put_params(out, m);
    if (m->result)
        put_result(out, m);
    else
        fprintf(out, ".PP\nAnswers as\n.BR %s .\n", m->result_of);
}

bool man_fill(FILE *page, FILE *out)
{
    char line[512], name[64];
    bool told[PROTOCOL_METHODS] = {false};
    while (fgets(line, sizeof line, page)) {
        const bool params = sscanf(line, "@PARAMS %63[a-z_]@", name) == 1;
        const bool result = !params && sscanf(line, "@RESULT %63[a-z_]@", name) == 1;
        const struct protocol_method *m = params || result ? protocol_find(name) : NULL;
        if (m)
            told[m - protocol_methods] = true;
        if (strcmp(line, "@CHANGES@\n") == 0) {
            put_changes(out);
        } else if (strcmp(line, "@OTHERS@\n") == 0) {
            for (int i = 0; i < PROTOCOL_METHODS; i++)
                if (!told[i])
                    put_section(out, &protocol_methods[i]);
        } else if (params && m) {
            put_params(out, m);
        } else if (result && m && m->result) {
            put_result(out, m);
        } else if (line[0] == '@') {
            return false;
        } else {
            fputs(line, out);
        }
    }
    return true;
}
