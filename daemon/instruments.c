/* SPDX-License-Identifier: MIT */
#include "instruments.h"

#include <math.h>
#include <string.h>

bool instruments_make(struct daemon *d, char *err, size_t err_size)
{
    d->pose_input = (struct pose_input){.loop = d->loop,
                                        .poses = &d->poses,
                                        .record = d->record,
                                        .channel = d->pose_channel,
                                        .unix_offset_ns = d->unix_offset_ns,
                                        .taken = places_pose,
                                        .d = d};
    for (int i = 0; i < d->conf.n_sonars; i++) {
        const struct conf_sonar *sonar = &d->conf.sonar[i];
        char topic[CONF_NAME_MAX + 16];
        trigger_init(&d->trigger[i], sonar, d->conf.water.sound_speed_mps);
        snprintf(topic, sizeof topic, "/%s/trigger", sonar->name);
        if (d->record && sonar->trigger[0])
            d->trigger_channel[i] = record_channel(d->record, topic, "json");
    }
    if (d->replay)
        return true;
    if (d->conf.depth.source[0] &&
        !(d->depth = depth_new(&d->conf.depth, d->conf.water.density_kgpm3, &d->pose_input, err, err_size)))
        return false;
    if (d->conf.nmea.port[0] && !(d->nmea = nmea_new(&d->conf.nmea, &d->pose_input, err, err_size)))
        return false;
    return true;
}

static void leak_changed(void *ctx)
{
    struct daemon *d = ctx;
    if (d->server)
        server_tell(d->server, "status");
}

static uint64_t last_ping_ns(void *ctx)
{
    struct source_stats stats;
    source_stats(ctx, &stats);
    return stats.device.last_ping_ns;
}

/* The edge is some time before the moment at which it is recorded, if not just after; a replay takes it from there. */
static void record_edge(void *ctx, struct trigger *trigger, uint64_t t_ns)
{
    struct daemon *d = ctx;
    char text[64];
    uint64_t now = loop_now(d->loop);
    if (!d->record)
        return;
    int n = snprintf(text, sizeof text, "{\"age_ns\":%llu}", (unsigned long long)(now > t_ns ? now - t_ns : 0));
    record_message(d->record, d->trigger_channel[trigger - d->trigger], now, text, (size_t)n);
}

static void start_lines(struct daemon *d)
{
    const char *chip = d->conf.gpio.chip;
    if (d->conf.gpio.leak[0])
        leak_start(&d->leak, d->loop, &gpio_library, &d->conf.gpio, leak_changed, d);
    for (int i = 0; i < d->conf.n_sonars; i++) {
        const struct conf_sonar *sonar = &d->conf.sonar[i];
        if (sonar->power[0])
            power_start(&d->power[i], d->loop, &gpio_library, chip, sonar, last_ping_ns, d->source[i]);
        if (sonar->trigger[0])
            trigger_start(&d->trigger[i], d->loop, &gpio_library, chip, sonar->trigger, record_edge, d);
    }
}

bool instruments_start(struct daemon *d, char *err, size_t err_size)
{
    if (!d->replay)
        start_lines(d);
    if (d->nmea)
        nmea_start(d->nmea);
    return !d->depth || depth_start(d->depth, err, err_size);
}

void instruments_end(struct daemon *d)
{
    depth_free(d->depth);
    nmea_free(d->nmea);
    leak_stop(&d->leak);
    for (int i = 0; i < d->conf.n_sonars; i++) {
        trigger_stop(&d->trigger[i]);
        power_stop(&d->power[i]);
    }
}

bool instruments_feed(struct daemon *d, const char *topic, const void *data, size_t size)
{
    for (int i = 0; i < d->conf.n_sonars; i++) {
        char own[CONF_NAME_MAX + 16];
        json_int_t age_ns = -1;
        snprintf(own, sizeof own, "/%s/trigger", d->conf.sonar[i].name);
        if (strcmp(topic, own) != 0)
            continue;
        json_t *edge = json_loadb(data, size, 0, NULL);
        uint64_t now = loop_now(d->loop);
        if (edge && json_unpack(edge, "{s:I}", "age_ns", &age_ns) == 0 && age_ns >= 0 && (uint64_t)age_ns <= now)
            trigger_edge(&d->trigger[i], now - (uint64_t)age_ns);
        json_decref(edge);
        return true;
    }
    return false;
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

static json_t *leak_json(const struct daemon *d)
{
    static const char *const states[] = {[LEAK_UNKNOWN] = "unknown", [LEAK_DRY] = "dry", [LEAK_WET] = "wet"};
    if (!d->conf.gpio.leak[0])
        return json_null();
    return json_pack("{s:s, s:s, s:o, s:I, s:s}", "line", d->conf.gpio.leak, "state", states[d->leak.state],
                     "age_s", age(d, d->leak.t_change_ns), "alarms", (json_int_t)d->leak.alarms, "error",
                     d->leak.pin.error);
}

static json_t *power_json(const struct daemon *d, int i)
{
    const struct power *p = &d->power[i];
    return json_pack("{s:s, s:s, s:s, s:I, s:s}", "sensor", d->conf.sonar[i].name, "line", d->conf.sonar[i].power,
                     "state",
                     !p->pin.open ? "unknown"
                     : p->off     ? "off"
                                  : "on",
                     "cycles", (json_int_t)p->cycles, "error", p->pin.error);
}

static json_t *trigger_json(const struct daemon *d, int i)
{
    const struct trigger *t = &d->trigger[i];
    return json_pack("{s:s, s:s, s:I, s:I, s:I, s:s}", "sensor", d->conf.sonar[i].name, "line",
                     d->conf.sonar[i].trigger, "edges", (json_int_t)t->edges, "used", (json_int_t)t->used,
                     "not_used", (json_int_t)t->not_used, "error", t->pin.error);
}

static json_t *gpio_json(const struct daemon *d)
{
    json_t *power = json_array(), *trigger = json_array();
    for (int i = 0; i < d->conf.n_sonars; i++) {
        if (d->conf.sonar[i].power[0])
            json_array_append_new(power, power_json(d, i));
        if (d->conf.sonar[i].trigger[0])
            json_array_append_new(trigger, trigger_json(d, i));
    }
    return json_pack("{s:s, s:o, s:o}", "library", gpio_library.library, "power", power, "trigger", trigger);
}

void instruments_status(const struct daemon *d, json_t *status)
{
    json_object_set_new(status, "depth", depth_json(d));
    json_object_set_new(status, "nmea", nmea_json(d));
    json_object_set_new(status, "leak", leak_json(d));
    json_object_set_new(status, "gpio", gpio_json(d));
}
