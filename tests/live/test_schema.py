#!/usr/bin/env -S python3 -B
# SPDX-License-Identifier: MIT
"""The schema of the protocol: sound, whole, and at one with the daemon about what is refused. All other live tests hold
what they hear against it (lib.py)."""
import json
import os
import re

from lib import ALL, BUILD, SCHEMAS, RpcError, check, jsonschema, run

DEFS = SCHEMAS.document["$defs"]
METHODS = SCHEMAS.methods()


def refused(client, method, params):
    try:
        client.call(method, **params)
    except RpcError as error:
        codes = (-32602, -32600) if "name" in params else (-32602,) # a file's name is refused by who opens it
        return error.code in codes and str(error)
    return None


def whole(bench):
    """Every method is in the request, and in the manual with all of its fields."""
    check(sorted(DEFS["request"]["properties"]["method"]["enum"]) == METHODS, "request has not all methods")
    with open(os.path.join(BUILD, "sonard-protocol.7"), encoding="utf-8") as f:
        sections = re.split(r"^\.SS ", f.read(), flags=re.M)
    for method in METHODS:
        text = [s for s in sections if method in re.split(r"[ ,]+", s.split("\n", 1)[0])]
        check(len(text) == 1, "%s is in %d sections of the manual" % (method, len(text)))
        fields = list(DEFS[method + ".params"]["properties"]) + list(DEFS[method + ".result"].get("properties", ()))
        missing = [name for name in fields if not re.search(r"\b%s\b" % name, text[0])]
        check(not missing, "the manual does not tell of %s of %s" % (missing, method))


def sound(bench):
    """It is a schema, and it refuses what it should."""
    jsonschema.Draft202012Validator.check_schema(SCHEMAS.document)
    validator = jsonschema.Draft202012Validator(SCHEMAS.document)
    good = {"jsonrpc": "2.0", "id": 1, "method": "blocked", "params": {"azimuth_deg": 0, "distance_m": 5}}
    for change in ({}, {"id": "a"}, {"params": {"azimuth_deg": 0, "distance_m": 5, "frame": "ned"}}):
        check(validator.is_valid(dict(good, **change)), "refuses %s" % change)
    for change in ({"jsonrpc": "1.0"}, {"method": "nothing"}, {"params": {"azimuth_deg": 0}}, {"id": []},
                   {"params": {"azimuth_deg": 0, "distance_m": "5"}}, {"more": 1}):
        check(not validator.is_valid(dict(good, **change)), "takes %s" % change)
    check(not validator.is_valid({"jsonrpc": "2.0", "id": 1}), "a reply of nothing")
    check(validator.is_valid([good, good]) and not validator.is_valid([]), "batches")
    dangling = set(re.findall(r'"#/\$defs/([^"]+)"', json.dumps(SCHEMAS.document))) - set(DEFS)
    check(not dangling, "types that protocol/schema.c does not know: %s" % dangling)
    for name in DEFS:
        open_ends = [d for d in objects(DEFS[name]) if d.get("additionalProperties") is None]
        check(name in ("request", "reply") or not open_ends, "%s is open: %s" % (name, open_ends))


def objects(schema):
    if isinstance(schema, dict):
        if schema.get("properties"):
            yield schema
        for value in schema.values():
            yield from objects(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from objects(value)


def beyond(schema):
    """Values that a parameter's schema refuses."""
    for key, step in (("minimum", -1), ("maximum", 1)):
        if key in schema:
            yield schema[key] + step
    if "enum" in schema:
        yield "nonsense"
    if schema.get("type") == "array":
        yield []
        if "minimum" in schema["items"]:
            yield [schema["items"]["maximum"] * 2] * schema["minItems"]
    if "pattern" in schema:
        yield "a/b"
    if schema.get("type") != "object":
        yield {"no": "object"}
    yield 1 if schema.get("type") in ("object", "string", "array") else "text"


def same_limits(bench):
    """What the schema refuses the daemon refuses, too: each parameter that is needed, unknown, or out of its range; and
    they know the same ones."""
    bench.conf(map={"voxel": "0.2 m", "memory": "8 MiB", "directory": bench.folder}, grid={"max_cells": 1024})
    client = bench.sonard().client()
    for method in METHODS:
        schema = DEFS[method + ".params"]
        given = SCHEMAS.needed(method)
        said = refused(client, method, dict(given, nonsense=1))
        check(said, "%s takes an unknown parameter" % method)
        known = set(said.split("allowed: ")[1].split(", ")) - {"no parameters"}
        check(known == set(schema["properties"]), "%s: daemon and schema differ by %s" %
              (method, sorted(known ^ set(schema["properties"]))))
        for key in schema.get("required", []):
            short = {k: v for k, v in given.items() if k != key}
            check(refused(client, method, short), "%s goes without %s" % (method, key))
        for key, one in schema["properties"].items():
            if "$ref" in one:
                one = DEFS[one["$ref"].rsplit("/", 1)[1]]
            if method == "watch" and key == "params":
                continue  # goes by the method that is watched
            for value in beyond(one):
                check(refused(client, method, dict(given, **{key: value})), "%s takes %s = %s" % (method, key, value))


run([("schema_" + f.__name__, f) for f in (whole, sound, same_limits)], gate=ALL)
