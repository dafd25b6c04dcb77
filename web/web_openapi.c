/* SPDX-License-Identifier: MIT */
#include "web_openapi.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/schema.h"
#include "web_query.h"

/* The schemas of all parameters and results, whose references lead to where OpenAPI has schemas. */
static json_t *read_schemas(void)
{
    static const char from[] = "\"#/$defs/", to[] = "\"#/components/schemas/";
    char *text = NULL, *moved = NULL;
    size_t n;
    FILE *out = open_memstream(&text, &n), *copy = NULL;
    json_t *schema = NULL;
    if (out) {
        schema_print(out);
        fclose(out);
    }
    if (text)
        copy = open_memstream(&moved, &n);
    if (copy) {
        for (const char *at = text, *next; at; at = next ? next + sizeof from - 1 : NULL) {
            next = strstr(at, from);
            fprintf(copy, "%.*s%s", (int)(next ? next - at : (long)strlen(at)), at, next ? to : "");
        }
        fclose(copy);
        schema = json_loads(moved, 0, NULL);
    }
    free(text);
    free(moved);
    json_t *definitions = json_incref(json_object_get(schema, "$defs"));
    json_decref(schema);
    return definitions;
}

static bool is_json(const struct protocol_param *p)
{
    return p->type == PROTOCOL_PLACES || p->type == PROTOCOL_OBJECT;
}

static json_t *describe_param(const struct protocol_param *p, const json_t *schemas, const char *method)
{
    char name[80];
    json_t *schema;
    snprintf(name, sizeof name, "%s.params", method);
    schema = json_object_get(json_object_get(json_object_get(schemas, name), "properties"), p->name);
    json_t *param = json_pack("{s:s, s:s, s:s, s:b}", "name", p->name, "in", "query", "description", p->help,
                              "required", p->need == PROTOCOL_REQUIRED);
    if (is_json(p)) {
        json_object_set_new(param, "content", json_pack("{s:{s:O}}", "application/json", "schema", schema));
    } else {
        json_object_set(param, "schema", schema);
        json_object_set_new(param, "style", json_string("form"));
        json_object_set_new(param, "explode", json_false()); /* numbers of an array are separated by commas */
    }
    return param;
}

static json_t *describe_answer(const char *what, const char *schema)
{
    char reference[120];
    snprintf(reference, sizeof reference, "#/components/schemas/%s", schema);
    return json_pack("{s:s, s:{s:{s:{s:s}}}}", "description", what, "content", "application/json", "schema",
                     "$ref", reference);
}

static json_t *describe_method(const struct protocol_method *method, const json_t *schemas)
{
    char result[80];
    json_t *params = json_array(), *answers = json_object();
    snprintf(result, sizeof result, "%s.result", method->name);
    if (!web_query_is_cheap(method))
        json_array_append_new(params,
                              json_pack("{s:s, s:s, s:s, s:b, s:{s:s}}", "name", "X-Sonard", "in", "header",
                                        "description", "any value: a page of another site cannot send it",
                                        "required", true, "schema", "type", "string"));
    for (const struct protocol_param *p = method->params; p->name; p++)
        json_array_append_new(params, describe_param(p, schemas, method->name));
    json_object_set_new(answers, "200", describe_answer("the result", result));
    json_object_set_new(answers, "400", describe_answer("a parameter is missing, unknown or wrong", "refusal"));
    json_object_set_new(
        answers, "403",
        describe_answer("the Host or the Origin is not accepted, or X-Sonard is missing", "refusal"));
    json_object_set_new(answers, "429", describe_answer("a limit was reached", "refusal"));
    json_object_set_new(answers, "503", describe_answer("the daemon does not answer", "refusal"));
    return json_pack("{s:{s:s, s:s, s:o, s:o}}", "get", "operationId", method->name, "summary", method->help,
                     "parameters", params, "responses", answers);
}

char *web_openapi(void)
{
    json_t *schemas = read_schemas(), *paths = json_object();
    char path[80], *text = NULL;
    if (schemas) {
        json_object_set_new(schemas, "refusal",
                            json_pack("{s:s, s:{s:{s:s}}, s:[s]}", "type", "object", "properties", "error", "$ref",
                                      "#/components/schemas/error", "required", "error"));
        for (const struct protocol_method *m = protocol_methods; m->name; m++) {
            if (!web_query_method(m->name))
                continue;
            snprintf(path, sizeof path, "/api/%s", m->name);
            json_object_set_new(paths, path, describe_method(m, schemas));
        }
        json_t *document = json_pack("{s:s, s:{s:s, s:s, s:s}, s:O, s:{s:O}}", "openapi", "3.1.0", "info", "title",
                                     "sonard", "version", SONARD_VERSION, "description",
                                     "Every method of sonard-protocol(7) that asks and changes nothing. Angles "
                                     "are degrees, lengths metres. "
                                     "An array is given as numbers separated by commas.",
                                     "paths", paths, "components", "schemas", schemas);
        text = json_dumps(document, JSON_COMPACT);
        json_decref(document);
    }
    json_decref(paths);
    json_decref(schemas);
    return text;
}
