/* SPDX-License-Identifier: MIT */
#include "aux_status.h"

#include "json_units.h"

/* Seconds since t_ns; null: never. */
static void write_age(struct json_out *out, const struct methods_env *d, uint64_t t_ns)
{
    const uint64_t now = loop_now(d->loop);
    json_member_age(out, "age_s", t_ns == 0 ? -1 : now > t_ns ? (double)(now - t_ns) * 1e-9 : 0);
}

static void write_depth(struct json_out *out, const struct methods_env *d)
{
    static const char *const states[] = {[DEPTH_STARTING] = "starting",
                                         [DEPTH_NO_LINK] = "no link",
                                         [DEPTH_SILENT] = "silent",
                                         [DEPTH_REFUSED] = "refused",
                                         [DEPTH_RUNNING] = "running"};
    struct depth_status s;
    struct fault oddities;
    if (!d->aux.depth) {
        json_member_null(out, "depth");
        return;
    }
    depth_status(d->aux.depth, &s);
    json_member_open(out, "depth", '{');
    json_member_text(out, "source", d->conf.depth.source);
    json_member_word(out, "state", states[s.state]);
    json_member_known(out, "depth_m", s.t_depth_ns != 0, s.depth_m, PER_METRES);
    write_age(out, d, s.t_depth_ns);
    json_member_text(out, "error", s.error.text);
    depth_oddities_text(s.oddities, &oddities);
    json_member_text(out, "oddities", oddities.text);
    json_member_count(out, "samples", s.samples);
    json_member_count(out, "implausible", s.implausible);
    json_member_count(out, "timeouts", s.timeouts);
    json_member_count(out, "exceptions", s.exceptions);
    json_member_count(out, "bad_answers", s.bad_answers);
    json_member_count(out, "out_of_step", s.out_of_step);
    json_member_count(out, "no_number", s.no_number);
    json_member_count(out, "reconnects", s.reconnects);
    json_member_count(out, "dropped", s.dropped);
    json_out_close(out, '}');
}

static void write_nmea(struct json_out *out, const struct methods_env *d)
{
    struct nmea_status s;
    if (!d->aux.nmea) {
        json_member_null(out, "nmea");
        return;
    }
    nmea_status(d->aux.nmea, &s);
    json_member_open(out, "nmea", '{');
    json_member_text(out, "port", d->conf.nmea.port);
    json_member_word(out, "state", s.open ? "open" : "no port");
    write_age(out, d, s.t_value_ns);
    json_member_text(out, "error", s.port_error.text);
    json_member_text(out, "unused", s.unused.text);
    json_member_count(out, "sentences", s.counts.sentences);
    json_member_count(out, "values", s.counts.values);
    json_member_count(out, "odd", s.counts.odd);
    json_member_count(out, "not_available", s.counts.not_available);
    json_member_count(out, "other", s.counts.other);
    json_member_count(out, "bad_checksum", s.counts.bad_checksum);
    json_member_count(out, "no_checksum", s.counts.no_checksum);
    json_member_count(out, "bad_sentence", s.counts.bad_sentence);
    json_member_count(out, "overlong", s.counts.overlong);
    json_member_count(out, "garbage_bytes", s.counts.garbage_bytes);
    json_member_count(out, "no_variation", s.no_variation);
    json_member_count(out, "excluded", s.excluded);
    json_member_count(out, "heading_not_used", d->aux.pose_input.heading_not_used);
    json_member_count(out, "late_bytes", s.late_bytes);
    json_member_count(out, "bytes_in", s.bytes_in);
    json_member_count(out, "strangers", s.strangers);
    json_member_count(out, "reconnects", s.reconnects);
    json_out_close(out, '}');
}

static void write_leak(struct json_out *out, const struct methods_env *d)
{
    static const char *const states[] = {[LEAK_UNKNOWN] = "unknown", [LEAK_DRY] = "dry", [LEAK_WET] = "wet"};
    if (!d->conf.gpio.leak[0]) {
        json_member_null(out, "leak");
        return;
    }
    json_member_open(out, "leak", '{');
    json_member_text(out, "line", d->conf.gpio.leak);
    json_member_word(out, "state", states[d->aux.leak.state]);
    write_age(out, d, d->aux.leak.t_change_ns);
    json_member_count(out, "alarms", d->aux.leak.alarms);
    json_member_text(out, "error", d->aux.leak.pin.error.text);
    json_out_close(out, '}');
}

static void write_power(struct json_out *out, const struct methods_env *d, int i)
{
    const struct power *p = &d->aux.power[i];
    json_out_open(out, '{');
    json_member_text(out, "sensor", d->conf.sonar[i].name);
    json_member_text(out, "line", d->conf.sonar[i].power);
    json_member_word(out, "state", !p->pin.open ? "unknown" : p->off ? "off" : "on");
    json_member_count(out, "cycles", p->cycles);
    json_member_text(out, "error", p->pin.error.text);
    json_out_close(out, '}');
}

static void write_trigger(struct json_out *out, const struct methods_env *d, int i)
{
    const struct trigger *t = &d->aux.trigger[i];
    json_out_open(out, '{');
    json_member_text(out, "sensor", d->conf.sonar[i].name);
    json_member_text(out, "line", d->conf.sonar[i].trigger);
    json_member_count(out, "edges", t->edges);
    json_member_count(out, "used", t->used);
    json_member_count(out, "not_used", t->not_used);
    json_member_text(out, "error", t->pin.error.text);
    json_out_close(out, '}');
}

static void write_gpio(struct json_out *out, const struct methods_env *d)
{
    json_member_open(out, "gpio", '{');
    json_member_text(out, "library", gpio_library.library);
    json_member_open(out, "power", '[');
    for (int i = 0; i < d->conf.n_sonars; i++)
        if (d->conf.sonar[i].power[0])
            write_power(out, d, i);
    json_out_close(out, ']');
    json_member_open(out, "trigger", '[');
    for (int i = 0; i < d->conf.n_sonars; i++)
        if (d->conf.sonar[i].trigger[0])
            write_trigger(out, d, i);
    json_out_put(out, "]}");
}

void aux_status_write(struct json_out *out, const struct methods_env *d)
{
    write_depth(out, d);
    write_nmea(out, d);
    write_leak(out, d);
    write_gpio(out, d);
}
