/* SPDX-License-Identifier: MIT */
#include "aux_sensors.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

static bool make_sources_of_poses(struct aux_sensors *a, struct fault *fault)
{
    const struct conf *conf = a->env.conf;
    if (conf->depth.source[0] &&
        !(a->depth = depth_new(&conf->depth, conf->water.density_kgpm3, &a->pose_input, fault)))
        return false;
    return !conf->nmea.port[0] || (a->nmea = nmea_new(&conf->nmea, &a->pose_input, a->env.worker, fault));
}

bool aux_sensors_make(struct aux_sensors *a, const struct aux_sensors_env *env, struct fault *fault)
{
    a->env = *env;
    a->pose_input = (struct pose_input){.loop = env->loop,
                                        .poses = env->poses,
                                        .record = env->record,
                                        .channel = env->pose_channel,
                                        .unix_offset_ns = env->unix_offset_ns,
                                        .taken = env->pose_taken,
                                        .ctx = env->ctx};
    for (int i = 0; i < env->conf->n_sonars; i++) {
        const struct conf_sonar *sonar = &env->conf->sonar[i];
        char topic[CONF_NAME_MAX + 16];
        trigger_init(&a->trigger[i], sonar, env->conf->water.sound_speed_mps);
        snprintf(topic, sizeof topic, "/%s/trigger", sonar->name);
        if (env->record && sonar->trigger[0])
            a->trigger_channel[i] = record_channel(env->record, topic, "json");
    }
    return env->replay || make_sources_of_poses(a, fault);
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
    struct aux_sensors *a = ctx;
    char text[64];
    uint64_t now = loop_now(a->env.loop);
    if (!a->env.record)
        return;
    int n = snprintf(text, sizeof text, "{\"age_ns\":%llu}", (unsigned long long)(now > t_ns ? now - t_ns : 0));
    record_message(a->env.record, a->trigger_channel[trigger - a->trigger], now, text, (size_t)n);
}

static void start_lines(struct aux_sensors *a)
{
    const struct pin_chip chip = {a->env.loop, &gpio_library, a->env.conf->gpio.chip};
    if (a->env.conf->gpio.leak[0])
        leak_start(&a->leak, a->env.loop, &gpio_library, &a->env.conf->gpio, a->env.leak_changed, a->env.ctx);
    for (int i = 0; i < a->env.conf->n_sonars; i++) {
        const struct conf_sonar *sonar = &a->env.conf->sonar[i];
        if (sonar->power[0])
            power_start(&a->power[i], &chip, sonar, last_ping_ns, a->env.source[i]);
        if (sonar->trigger[0])
            trigger_start(&a->trigger[i], &chip, sonar->trigger, record_edge, a);
    }
}

bool aux_sensors_start(struct aux_sensors *a, struct fault *fault)
{
    if (!a->env.replay)
        start_lines(a);
    if (a->nmea)
        nmea_start(a->nmea);
    return !a->depth || depth_start(a->depth, fault);
}

void aux_sensors_end(struct aux_sensors *a)
{
    depth_free(a->depth);
    nmea_free(a->nmea);
    leak_stop(&a->leak);
    for (int i = 0; i < CONF_MAX_SONARS; i++) {
        trigger_stop(&a->trigger[i]);
        power_stop(&a->power[i]);
    }
}

bool aux_sensors_feed(struct aux_sensors *a, const char *topic, const void *data, size_t size)
{
    for (int i = 0; i < a->env.conf->n_sonars; i++) {
        char own[CONF_NAME_MAX + 16];
        json_int_t age_ns = -1;
        snprintf(own, sizeof own, "/%s/trigger", a->env.conf->sonar[i].name);
        if (strcmp(topic, own) != 0)
            continue;
        json_t *edge = json_loadb(data, size, 0, NULL);
        uint64_t now = loop_now(a->env.loop);
        if (edge && json_unpack(edge, "{s:I}", "age_ns", &age_ns) == 0 && age_ns >= 0 && (uint64_t)age_ns <= now)
            trigger_edge(&a->trigger[i], now - (uint64_t)age_ns);
        json_decref(edge);
        return true;
    }
    return false;
}
