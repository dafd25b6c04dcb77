/* SPDX-License-Identifier: MIT */
/*
 * daemon_rig.h - the daemon's methods over the pipeline that a configuration makes, in the time of the test: pings and
 * poses go in, questions are asked as a client asks them.
 */
#ifndef SONARD_TEST_DAEMON_RIG_H
#define SONARD_TEST_DAEMON_RIG_H

#include "test.h"

#include "config/conf.h"
#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/methods/methods.h"
#include "daemon/wiring.h"

static struct methods_env d;

/* False: it cannot start with this configuration, which is the text of a file. */
static inline bool rig_start(const char *conf)
{
    struct pipeline_conf c;
    struct conf_source *source;
    struct pose_drift unseen;
    struct fault fault = {""};
    memset(&d, 0, sizeof d);
    if (conf_load_text(&d.conf, &source, &(struct conf_text){"test", conf, strlen(conf)}, NULL, NULL, NULL) != 0)
        return false;
    conf_source_free(source);
    d.conf_name = "test";
    d.replay = true;
    d.loop = loop_new(true);
    plan_make(&d.conf, &d.plan);
    wiring_pipeline(&d.conf, &d.plan, true, &c);
    c.threads = 0;
    d.pipeline = pipeline_new(&c, &fault);
    if (!d.pipeline)
        printf("%s\n", fault.text);
    memcpy(d.mount, c.mount, sizeof c.mount);
    d.map_service.env = (struct map_service_env){.loop = d.loop, .pipeline = d.pipeline, .conf = &d.conf};
    pose_log_init(&d.poses, (uint64_t)(d.conf.pose.max_age_s * 1e9));
    pose_log_set_most(&d.poses, d.conf.vehicle.max_speed_mps, d.conf.vehicle.max_turn_radps);
    wiring_drift(&d.conf, &unseen);
    pose_log_set_drift(&d.poses, 0, &unseen);
    return d.loop && d.pipeline;
}

static inline void rig_end(void)
{
    pipeline_free(d.pipeline);
    loop_free(d.loop);
}

/* A ping of one beam, which picks the range of what it hears: 0, nothing within 10 m. */
struct rig_ping {
    uint64_t t_ns;
    uint32_t seq;
    bool new_turn;
    uint32_t head_units, head_turn; /* 0: no head that turns */
    double az_rad, wide_deg, high_deg, range_m;
};

static inline void rig_send(const struct rig_ping *p)
{
    struct ping *ping = pipeline_begin(d.pipeline);
    loop_advance(d.loop, p->t_ns);
    ping->t_ns = ping->t_in_ns = p->t_ns;
    ping->kind = PING_RANGES;
    ping->seq = p->seq;
    ping->flags = p->new_turn ? PING_NEW_TURN : 0;
    ping->head_units = p->head_units;
    ping->head_turn = p->head_turn;
    ping->n_beams = 1;
    ping->n_bins = 1000;
    ping->dr_m = 0.01f;
    ping->az_aperture_rad = (float)geo_rad(p->wide_deg);
    ping->el_aperture_rad = (float)geo_rad(p->high_deg);
    ping->beam[0] = (struct ping_beam){
        .az_rad = (float)p->az_rad, .range_m = (float)p->range_m, .range_sd_m = 0.01f, .confidence = 0.95f};
    pose_log_at(&d.poses, p->t_ns, &ping->pose);
    pipeline_submit(d.pipeline, ping);
}

/* As a client's line; the result, or null when it was refused. */
static inline json_t *ask(const char *method, json_t *params)
{
    const struct rpc_call call = {.daemon = &d, .now_ns = loop_now(d.loop)};
    json_t *request =
        json_pack("{s:s, s:i, s:s, s:o}", "jsonrpc", "2.0", "id", 1, "method", method, "params", params);
    char *line = json_dumps(request, JSON_COMPACT), *text = NULL;
    struct rpc_job *job = rpc_begin(&call, line, strlen(line));
    while (rpc_step(job, daemon_methods, &call))
        ;
    rpc_end(job, &text);
    json_t *reply = json_loads(text, 0, NULL), *answer = json_incref(json_object_get(reply, "result"));
    if (!answer) {
        printf("%s\n%s\n", line, text);
        test_case_failed = true;
    }
    json_decref(reply);
    json_decref(request);
    free(line);
    free(text);
    return answer;
}

static inline double number(const json_t *answer, const char *key)
{
    return json_number_value(json_object_get(answer, key));
}

static inline bool says(const json_t *answer, const char *state)
{
    const char *s = json_string_value(json_object_get(answer, "state"));
    return s && strcmp(s, state) == 0;
}

#endif
