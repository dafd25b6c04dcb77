/* SPDX-License-Identifier: MIT */
#include "instruments.h"

#include <math.h>

bool instruments_make(struct daemon *d, char *err, size_t err_size)
{
    d->pose_input = (struct pose_input){.loop = d->loop,
                                        .poses = &d->poses,
                                        .record = d->record,
                                        .channel = d->pose_channel,
                                        .unix_offset_ns = d->unix_offset_ns};
    if (d->replay)
        return true;
    if (d->conf.depth.source[0] &&
        !(d->depth = depth_new(&d->conf.depth, d->conf.water.density_kgpm3, &d->pose_input, err, err_size)))
        return false;
    if (d->conf.nmea.port[0] && !(d->nmea = nmea_new(&d->conf.nmea, &d->pose_input, err, err_size)))
        return false;
    return true;
}

bool instruments_start(struct daemon *d, char *err, size_t err_size)
{
    if (d->nmea)
        nmea_start(d->nmea);
    return !d->depth || depth_start(d->depth, err, err_size);
}

void instruments_end(struct daemon *d)
{
    depth_free(d->depth);
    nmea_free(d->nmea);
}

/* ---- status ---- */

struct counter {
    const char *name;
    uint64_t value;
};

static void set_counters(json_t *j, const struct counter *c, size_t n)
{
    for (size_t i = 0; i < n; i++)
        json_object_set_new(j, c[i].name, json_integer((json_int_t)c[i].value));
}

/* Seconds since t_ns with three places; null: never. */
static json_t *age(const struct daemon *d, uint64_t t_ns)
{
    uint64_t now = loop_now(d->loop);
    return t_ns ? json_real(round(now > t_ns ? (double)(now - t_ns) * 1e-6 : 0) * 1e-3) : json_null();
}

static json_t *depth_json(const struct daemon *d)
{
    static const char *const states[] = {[DEPTH_STARTING] = "starting",
                                         [DEPTH_NO_LINK] = "no link",
                                         [DEPTH_SILENT] = "silent",
                                         [DEPTH_RUNNING] = "running"};
    struct depth_status s;
    if (!d->depth)
        return json_null();
    depth_status(d->depth, &s);
    const struct counter counters[] = {
        {"samples", s.samples},       {"implausible", s.implausible}, {"timeouts", s.timeouts},
        {"exceptions", s.exceptions}, {"bad_answers", s.bad_answers}, {"out_of_step", s.out_of_step},
        {"no_number", s.no_number},   {"reconnects", s.reconnects},   {"dropped", s.dropped},
    };
    json_t *j = json_pack("{s:s, s:s, s:o, s:o, s:s}", "source", d->conf.depth.source, "state", states[s.state],
                          "depth_m", s.t_depth_ns ? json_real(round(s.depth_m * 1e4) / 1e4) : json_null(), "age_s",
                          age(d, s.t_depth_ns), "error", s.error);
    set_counters(j, counters, sizeof counters / sizeof counters[0]);
    return j;
}

static json_t *nmea_json(const struct daemon *d)
{
    struct nmea_status s;
    if (!d->nmea)
        return json_null();
    nmea_status(d->nmea, &s);
    const struct counter counters[] = {
        {"sentences", s.counts.sentences},
        {"values", s.counts.values},
        {"not_available", s.counts.not_available},
        {"other", s.counts.other},
        {"bad_checksum", s.counts.bad_checksum},
        {"bad_sentence", s.counts.bad_sentence},
        {"overlong", s.counts.overlong},
        {"garbage_bytes", s.counts.garbage_bytes},
        {"no_variation", s.no_variation},
        {"heading_not_used", d->pose_input.heading_not_used},
        {"bytes_in", s.bytes_in},
        {"reconnects", s.reconnects},
    };
    json_t *j = json_pack("{s:s, s:s, s:o, s:s}", "port", d->conf.nmea.port, "state", s.open ? "open" : "no port",
                          "age_s", age(d, s.t_value_ns), "error", s.port_error);
    set_counters(j, counters, sizeof counters / sizeof counters[0]);
    return j;
}

void instruments_status(const struct daemon *d, json_t *status)
{
    json_object_set_new(status, "depth", depth_json(d));
    json_object_set_new(status, "nmea", nmea_json(d));
}
