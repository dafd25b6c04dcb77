/* SPDX-License-Identifier: MIT */
#include "schema.h"

#include <stdlib.h>
#include <string.h>

#include "protocol.h"

/* The types of fields that are no shapes. */
static const struct {
    const char *name, *schema;
} types[] = {
    {"number", "\"type\":\"number\""},
    {"amount", "\"type\":\"number\",\"minimum\":0"},
    {"integer", "\"type\":\"integer\""},
    {"text", "\"type\":\"string\""},
    {"flag", "\"type\":\"boolean\""},
    {"count",
     "\"description\":\"how many there are, or were since the start\",\"type\":\"integer\",\"minimum\":0"},
    {"misses", "\"description\":\"beams since the last echo; 15: or more\",\"type\":\"integer\",\"minimum\":0,"
               "\"maximum\":15"},
    {"share", "\"type\":\"number\",\"minimum\":0,\"maximum\":1"},
    {"age", "\"description\":\"seconds; null: never\",\"type\":[\"number\",\"null\"],\"minimum\":0"},
    {"triple", "\"description\":\"three axes: forward, right, down or north, east, down\",\"type\":\"array\","
               "\"items\":{\"type\":\"number\"},\"minItems\":3,\"maxItems\":3"},
    {"frame", "\"enum\":[\"body\",\"ned\"]"},
    {"direction_state", "\"enum\":[\"blocked\",\"clear\",\"unknown\"]"},
    {"place_state", "\"enum\":[\"free\",\"occupied\",\"unknown\"]"},
    {"samples", "\"description\":\"two hexadecimal digits for each bin\",\"type\":\"string\","
                "\"pattern\":\"^([0-9a-f]{2})*$\""},
    {"cursor", "\"type\":\"string\",\"pattern\":\"^[0-9]+(\\\\.[0-9]+){3}$\""},
    {"map_name", "\"type\":\"string\",\"pattern\":\"^[A-Za-z0-9_-]{1,64}$\""},
    {"grid_name", "\"type\":\"string\",\"pattern\":\"^[A-Za-z0-9_-]{1,31}$\""},
    {"metric_name", "\"type\":\"string\",\"pattern\":\"^sonard_[a-z0-9_]+$\""},
    {"slice_row", "\"type\":\"string\",\"pattern\":\"^[.# ]*$\""},
    {"labels", "\"type\":\"object\",\"additionalProperties\":{\"type\":\"string\"}"},
};

/* What a list is separated by: nothing before its first. */
static const char *comma(bool *first)
{
    const char *before = *first ? "" : ",";
    *first = false;
    return before;
}

/* ---- fields of results ---- */

/* A type of n bytes without suffixes: words, a name, or one of two. */
static void print_base(FILE *out, const char *type, size_t n)
{
    const char *slash = type[0] == '=' ? NULL : memchr(type, '/', n);
    if (type[0] == '=') {
        bool first = true;
        fputs("{\"enum\":[", out);
        for (const char *word = type + 1, *end = type + n; word < end; word += strcspn(word, "|[?") + 1)
            fprintf(out, "%s\"%.*s\"", comma(&first), (int)strcspn(word, "|[?"), word);
        fputs("]}", out);
    } else if (slash) {
        fputs("{\"anyOf\":[", out);
        print_base(out, type, (size_t)(slash - type));
        fputc(',', out);
        print_base(out, slash + 1, n - (size_t)(slash + 1 - type));
        fputs("]}", out);
    } else {
        bool method = false;
        for (const struct protocol_method *m = protocol_methods; m->name; m++)
            method |= strlen(m->name) == n && strncmp(m->name, type, n) == 0;
        for (const struct protocol_shape *s = protocol_shapes; s->name; s++)
            method &= !(strlen(s->name) == n && strncmp(s->name, type, n) == 0);
        fprintf(out, "{\"$ref\":\"#/$defs/%.*s%s\"}", (int)n, type, method ? ".result" : "");
    }
}

/* A type of n bytes: its last suffix goes around what is before it. */
static void print_type(FILE *out, const char *type, size_t n)
{
    if (type[n - 1] == '?') {
        fputs("{\"anyOf\":[", out);
        print_type(out, type, n - 1);
        fputs(",{\"type\":\"null\"}]}", out);
    } else if (type[n - 1] == ']') {
        size_t bracket = n - 1;
        while (type[bracket] != '[')
            bracket--;
        const long count = strtol(type + bracket + 1, NULL, 10);
        fputs("{\"type\":\"array\",\"items\":", out);
        print_type(out, type, bracket);
        if (count > 0)
            fprintf(out, ",\"minItems\":%ld,\"maxItems\":%ld", count, count);
        fputc('}', out);
    } else {
        print_base(out, type, n);
    }
}

static void print_fields(FILE *out, const struct protocol_field *fields)
{
    bool first = true;
    fputs("{\"type\":\"object\",\"properties\":{", out);
    for (const struct protocol_field *f = fields; f->name; f++) {
        fprintf(out, "%s\"%s\":", comma(&first), f->name);
        print_type(out, f->type, strlen(f->type));
    }
    fputs("},\"additionalProperties\":false,\"required\":[", out);
    first = true;
    for (const struct protocol_field *f = fields; f->name; f++)
        if (!f->maybe)
            fprintf(out, "%s\"%s\"", comma(&first), f->name);
    fputs("]}", out);
}

/* ---- parameters ---- */

static void print_number(FILE *out, const struct protocol_param *p)
{
    fprintf(out, "\"type\":\"%s\",\"minimum\":%.15g,\"maximum\":%.15g",
            p->type == PROTOCOL_INTEGER ? "integer" : "number", p->lo, p->hi);
}

static void print_array(FILE *out, const struct protocol_param *p)
{
    fputs("\"type\":\"array\",\"items\":{", out);
    print_number(out, p);
    fprintf(out, "},\"minItems\":%u,\"maxItems\":%u", p->type == PROTOCOL_PLACES ? 3 : p->count,
            p->type == PROTOCOL_PLACES ? 3 : p->count);
}

static void print_words(FILE *out, const struct protocol_param *p)
{
    bool first = true;
    fputs("\"type\":\"string\",\"enum\":[", out);
    for (int i = 0; p->words[i]; i++)
        fprintf(out, "%s\"%s\"", comma(&first), p->words[i]);
    fputc(']', out);
}

static void print_default(FILE *out, const struct protocol_param *p)
{
    fputs(",\"default\":", out);
    if (p->type == PROTOCOL_WORD)
        fprintf(out, "\"%s\"", p->words[(int)p->initial[0]]);
    else if (p->type == PROTOCOL_FLAG)
        fputs(p->initial[0] != 0 ? "true" : "false", out);
    else if (p->type == PROTOCOL_BAND)
        fprintf(out, "[%.15g,%.15g]", p->initial[0], p->initial[1]);
    else
        fprintf(out, "%.15g", p->initial[0]);
}

static void print_param(FILE *out, const struct protocol_param *p)
{
    fprintf(out, "{\"description\":\"%s%s%s\",", p->help, p->unit[0] ? "; in " : "", p->unit);
    switch (p->type) {
    case PROTOCOL_NUMBER:
    case PROTOCOL_INTEGER:
        print_number(out, p);
        break;
    case PROTOCOL_NUMBERS:
    case PROTOCOL_BAND:
        print_array(out, p);
        break;
    case PROTOCOL_PLACES:
        fputs("\"type\":\"array\",\"items\":{", out);
        print_array(out, p);
        fprintf(out, "},\"minItems\":1,\"maxItems\":%u", p->count);
        break;
    case PROTOCOL_WORD:
        print_words(out, p);
        break;
    case PROTOCOL_FLAG:
        fputs("\"type\":\"boolean\"", out);
        break;
    case PROTOCOL_MAP:
        fputs("\"$ref\":\"#/$defs/map_name\"", out);
        break;
    case PROTOCOL_CURSOR:
        fputs("\"anyOf\":[{\"$ref\":\"#/$defs/cursor\"},{\"type\":\"null\"}]", out);
        break;
    case PROTOCOL_OBJECT:
        fputs("\"type\":\"object\"", out);
        break;
    default:
        fputs("\"type\":\"string\"", out);
    }
    if (p->need == PROTOCOL_DEFAULT)
        print_default(out, p);
    fputc('}', out);
}

static void print_params(FILE *out, const struct protocol_method *method)
{
    const struct protocol_param *params = method->params;
    bool first = true;
    fprintf(out, "{\"description\":\"%s\",\"type\":\"object\",\"properties\":{", method->help);
    for (const struct protocol_param *p = params; p->name; p++) {
        fprintf(out, "%s\"%s\":", comma(&first), p->name);
        print_param(out, p);
    }
    fputs("},\"additionalProperties\":false,\"required\":[", out);
    first = true;
    for (const struct protocol_param *p = params; p->name; p++)
        if (p->need == PROTOCOL_REQUIRED)
            fprintf(out, "%s\"%s\"", comma(&first), p->name);
    fputs("]}", out);
}

/* ---- messages ---- */

static void print_method_names(FILE *out, bool watchable)
{
    bool first = true;
    for (const struct protocol_method *m = protocol_methods; m->name; m++)
        if (!watchable || m->right == PROTOCOL_ASKS)
            fprintf(out, "%s\"%s\"", comma(&first), m->name);
}

static void print_messages(FILE *out)
{
    bool first = true;
    fputs("\"error\":{\"type\":\"object\",\"properties\":{\"code\":{\"type\":\"integer\"},\"message\":{\"type\":"
          "\"string\",\"maxLength\":639}},\"additionalProperties\":false,\"required\":[\"code\",\"message\"]},\n"
          "\"request\":{\"type\":\"object\",\"properties\":{\"jsonrpc\":{\"const\":\"2.0\"},\"id\":{\"type\":"
          "[\"string\",\"number\",\"null\"]},\"method\":{\"enum\":[",
          out);
    print_method_names(out, false);
    fputs("]},\"params\":{\"type\":\"object\"}},\"required\":[\"jsonrpc\",\"method\"],"
          "\"additionalProperties\":false,\"allOf\":[",
          out);
    for (const struct protocol_method *m = protocol_methods; m->name; m++)
        fprintf(out,
                "%s\n{\"if\":{\"properties\":{\"method\":{\"const\":\"%s\"}}},\"then\":{\"properties\":"
                "{\"params\":{\"$ref\":\"#/$defs/%s.params\"}}}}",
                comma(&first), m->name, m->name);
    fputs("]},\n\"reply\":{\"type\":\"object\",\"properties\":{\"jsonrpc\":{\"const\":\"2.0\"},\"id\":{\"type\":"
          "[\"string\",\"number\",\"null\"]},\"result\":{\"type\":\"object\"},\"error\":{\"$ref\":"
          "\"#/$defs/error\"}},\"additionalProperties\":false,\"required\":[\"jsonrpc\",\"id\"],\"oneOf\":"
          "[{\"required\":[\"result\"]},{\"required\":[\"error\"]}]},\n"
          "\"notification\":{\"type\":\"object\",\"properties\":{\"jsonrpc\":{\"const\":\"2.0\"},\"method\":"
          "{\"const\":\"watch\"},\"params\":{\"type\":\"object\",\"properties\":{\"watch\":{\"$ref\":"
          "\"#/$defs/count\"},\"method\":{\"enum\":[",
          out);
    print_method_names(out, true);
    fputs("]},\"result\":{\"type\":\"object\"},\"error\":{\"$ref\":\"#/$defs/error\"},\"skipped\":{\"$ref\":"
          "\"#/$defs/count\"}},\"required\":[\"watch\",\"method\"],\"oneOf\":[{\"required\":[\"result\"]},"
          "{\"required\":[\"error\"]}],\"additionalProperties\":false}},\"additionalProperties\":false,"
          "\"required\":[\"jsonrpc\",\"method\",\"params\"]}",
          out);
}

void schema_print(FILE *out)
{
    static const char message[] =
        "{\"$ref\":\"#/$defs/request\"},{\"$ref\":\"#/$defs/reply\"},{\"$ref\":\"#/$defs/notification\"}";
    fprintf(out,
            "{\"$schema\":\"https://json-schema.org/draft/2020-12/schema\",\n"
            "\"title\":\"What sonard and its clients say: see sonard-protocol(7)\",\n"
            "\"description\":\"Every line is one of these, or a batch of them. The parameters of a method are "
            "$defs/METHOD.params, what it answers is $defs/METHOD.result.\",\n"
            "\"anyOf\":[%s,{\"type\":\"array\",\"items\":{\"anyOf\":[%s]},\"minItems\":1,\"maxItems\":16}],\n"
            "\"$defs\":{\n",
            message, message);
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        fprintf(out, "\"%s\":{%s},\n", types[i].name, types[i].schema);
    for (const struct protocol_shape *s = protocol_shapes; s->name; s++) {
        fprintf(out, "\"%s\":", s->name);
        print_fields(out, s->fields);
        fputs(",\n", out);
    }
    for (const struct protocol_method *m = protocol_methods; m->name; m++) {
        fprintf(out, "\"%s.params\":", m->name);
        print_params(out, m);
        fprintf(out, ",\n\"%s.result\":", m->name);
        if (m->result_of)
            print_type(out, m->result_of, strlen(m->result_of));
        else
            print_fields(out, m->result);
        fputs(",\n", out);
    }
    print_messages(out);
    fputs("}}\n", out);
}
