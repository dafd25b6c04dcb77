/* SPDX-License-Identifier: MIT */
/* sim - head, water and line together; see sim.h. */
#include "sim.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/geometry.h"

#define COMMAND_ARGS 4
#define LINE_OPEN_NS 10000000u /* how often to look whether somebody has opened the line */

/* ---- what the head calls ---- */

static uint64_t on_send(void *ctx, const uint8_t *frame, size_t n, uint64_t now_ns)
{
    struct sim *sim = ctx;
    return line_send(&sim->line, frame, n, now_ns);
}

#define FRAME_DEEP_M 0.06
#define FRAME_COUNT  220

static void add_frame(const struct sim_frame *frame, double azimuth_deg, double bin_m, uint32_t n,
                      uint8_t *samples)
{
    const double off_deg = geo_deg(geo_wrap_pi(geo_rad(azimuth_deg - frame->azimuth_deg)));
    if (!(frame->range_m > 0) || fabs(off_deg) > frame->width_deg / 2)
        return;
    for (uint32_t i = (uint32_t)(frame->range_m / bin_m); i < n && i * bin_m < frame->range_m + FRAME_DEEP_M; i++)
        samples[i] = samples[i] > FRAME_COUNT ? samples[i] : FRAME_COUNT;
}

#define AIR_RING_M 0.4

/* In place of what the water returned. */
static void break_receiver(const struct sim *sim, const struct water_shot *beam, uint8_t *samples)
{
    const double bin_m = beam->sample_s * sim->water.sound_speed_mps / 2.0,
                 pulse_m = beam->transmit_s * sim->water.sound_speed_mps / 2.0;
    const uint32_t ring = sim->hears == SIM_HEARS_AIR ? (uint32_t)(AIR_RING_M / bin_m) : 0,
                   leak = sim->hears == SIM_HEARS_LEAK ? (uint32_t)(pulse_m / bin_m) : 0;
    uint64_t dice = sim->water.seed + beam->number;
    for (uint32_t i = ring; i < beam->n_samples && sim->hears != SIM_HEARS; i++) {
        dice = dice * 6364136223846793005u + 1442695040888963407u;
        samples[i] = sim->hears == SIM_HEARS_ZEROS      ? 0
                     : sim->hears == SIM_HEARS_CONSTANT ? 7
                     : i < leak                         ? 255
                                : (uint8_t)((ring > 0 ? 5 : 2) + (dice >> 33) % (ring > 0 ? 8 : 3));
    }
}

static void on_listen(void *ctx, const struct head_shot *shot, uint8_t *samples)
{
    struct sim *sim = ctx;
    const struct ping360_settings *settings = &shot->settings;
    const double azimuth_deg = ((int)settings->angle - HEAD_AHEAD) * 360.0 / HEAD_TURN; /* from the bow */
    struct water_shot beam = {
        .az_rad = geo_rad(azimuth_deg + sim->pose.yaw_deg),
        .t_s = (double)(shot->t_ns - sim->start_ns) * 1e-9,
        .sample_s = settings->sample_period * PING360_TICK_S,
        .transmit_s = settings->transmit_us * 1e-6,
        .frequency_hz = settings->frequency_khz * 1e3,
        .gain = settings->gain,
        .n_samples = settings->n_samples,
        .number = sim->head.counts.pings,
    };
    memcpy(beam.origin_m, sim->pose.position_m, sizeof beam.origin_m);
    water_listen(&sim->water, &sim->scene, &beam, samples);
    add_frame(&sim->frame, azimuth_deg, beam.sample_s * sim->water.sound_speed_mps / 2.0, beam.n_samples, samples);
    break_receiver(sim, &beam, samples);
    if (sim->truth != NULL)
        water_write_truth(sim->truth, &sim->water, &sim->scene, &beam, shot->t_ns, settings->angle, azimuth_deg,
                          sim->pose.yaw_deg);
}

void sim_start(struct sim *sim, const struct head_conf *conf, uint64_t now_ns)
{
    const struct head_io io = {.ctx = sim, .send = on_send, .listen = on_listen};
    sim->start_ns = now_ns;
    head_init(&sim->head, conf, &io);
}

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

uint64_t sim_turn(struct sim *sim, uint64_t now_ns)
{
    uint8_t bytes[4096];
    size_t n;
    while ((n = line_read(&sim->line, bytes, sizeof bytes, now_ns)) > 0)
        head_feed(&sim->head, bytes, n, now_ns);
    head_tick(&sim->head, now_ns);
    uint64_t due_ns = earlier(line_pump(&sim->line, now_ns), head_deadline(&sim->head));
    if (now_ns < sim->line.faults.stall_ns)
        return earlier(due_ns, sim->line.faults.stall_ns);
    return line_connected(&sim->line) ? due_ns : earlier(due_ns, now_ns + LINE_OPEN_NS);
}

/* ---- commands ---- */

static uint64_t after(uint64_t now_ns, double s)
{
    return now_ns + (uint64_t)(s * 1e9);
}

/* Each returns NULL, or why it could not. */

static const char *do_drop(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->line.faults.drop = (uint64_t)arg[0];
    return NULL;
}

static const char *do_garbage(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->line.faults.garbage = (uint64_t)arg[0];
    return NULL;
}

static const char *do_corrupt(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->line.faults.corrupt = (uint64_t)arg[0];
    return NULL;
}

static const char *do_short(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->line.faults.cut = (uint64_t)arg[0];
    return NULL;
}

static const char *do_twice(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->line.faults.twice = (uint64_t)arg[0];
    return NULL;
}

static const char *do_swap(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->line.faults.swap = (uint64_t)arg[0];
    return NULL;
}

static const char *do_split(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->line.faults.split = arg[0] != 0.0;
    return NULL;
}

static const char *do_nack(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->head.nack_next = (uint64_t)arg[0];
    return NULL;
}

static const char *do_silent(struct sim *sim, const double *arg, uint64_t now_ns)
{
    sim->line.faults.silent_ns = after(now_ns, arg[0]);
    return NULL;
}

static const char *do_stall(struct sim *sim, const double *arg, uint64_t now_ns)
{
    sim->line.faults.stall_ns = after(now_ns, arg[0]);
    return NULL;
}

static const char *do_flood(struct sim *sim, const double *arg, uint64_t now_ns)
{
    sim->line.faults.flood_ns = after(now_ns, arg[0]);
    return NULL;
}

static const char *do_range(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->head.forced_range_m = arg[0];
    return NULL;
}

static const char *do_hears(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    sim->hears = (enum sim_hears)arg[0];
    return NULL;
}

static const char *do_unplug(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)arg;
    (void)now_ns;
    if (sim->line.fd < 0)
        return "is unplugged already";
    line_unplug(&sim->line);
    return NULL;
}

static const char *do_plug(struct sim *sim, const double *arg, uint64_t now_ns)
{
    static struct fault why;
    (void)arg;
    (void)now_ns;
    if (sim->line.fd >= 0)
        return "is plugged in already";
    return line_plug(&sim->line, &why) ? NULL : why.text;
}

static const char *do_reboot(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)arg;
    (void)now_ns;
    head_boot(&sim->head);
    return NULL;
}

static const char *do_pose(struct sim *sim, const double *arg, uint64_t now_ns)
{
    (void)now_ns;
    memcpy(sim->pose.position_m, arg, sizeof sim->pose.position_m);
    sim->pose.yaw_deg = arg[3];
    return NULL;
}

static const struct command {
    const char *name, *args, *what;
    int n_args;
    double lo, hi;
    const char *(*run)(struct sim *sim, const double *arg, uint64_t now_ns);
} commands[] = {
    {"drop", "N", "the next N frames are lost", 1, 0, 1e6, do_drop},
    {"corrupt", "N", "the next N frames have a wrong checksum", 1, 0, 1e6, do_corrupt},
    {"short", "N", "the next N frames end in the middle", 1, 0, 1e6, do_short},
    {"twice", "N", "the next N frames are sent twice", 1, 0, 1e6, do_twice},
    {"swap", "N", "the next N frames come behind the one that follows", 1, 0, 1e6, do_swap},
    {"garbage", "N", "N random bytes before the next frame", 1, 0, 60000, do_garbage},
    {"split", "on|off", "one byte per write", 1, 0, 1, do_split},
    {"nack", "N", "refuse the next N settings", 1, 0, 1e6, do_nack},
    {"silent", "S", "say nothing for S seconds", 1, 0, 3600, do_silent},
    {"stall", "S", "do not read the line for S seconds", 1, 0, 3600, do_stall},
    {"flood", "S", "random bytes without a pause for S seconds", 1, 0, 3600, do_flood},
    {"range", "M", "ping with a range of M metres whatever is asked for; 0: end that", 1, 0, 200, do_range},
    {"hears", "N", "1: noise alone, 2: a constant, 3: zeros, 4: air, 5: its transmission and noise; 0: the water",
     1, 0, SIM_HEARS_END - 1, do_hears},
    {"unplug", "", "pull the adapter: close the line, remove the link; the head keeps running", 0, 0, 0,
     do_unplug},
    {"plug", "", "put it back, as a new pseudo-terminal", 0, 0, 0, do_plug},
    {"reboot", "", "switch the head off and on", 0, 0, 0, do_reboot},
    {"pose", "N E D YAW", "move the vehicle there: metres, degrees", 4, -1e6, 1e6, do_pose},
};

static const struct command *command_find(const char *name)
{
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        if (strcmp(commands[i].name, name) == 0)
            return &commands[i];
    }
    return NULL;
}

static bool number_parse(const char *word, double lo, double hi, double *out)
{
    char *end;
    if (strcmp(word, "on") == 0 || strcmp(word, "off") == 0)
        *out = strcmp(word, "on") == 0;
    else if (*out = strtod(word, &end), end == word || *end != '\0')
        return false;
    return *out >= lo && *out <= hi;
}

bool sim_command(struct sim *sim, const char *text, uint64_t now_ns, char *answer, size_t answer_size)
{
    char copy[SIM_ANSWER_MAX], *save = NULL;
    double arg[COMMAND_ARGS] = {0};
    int n = 0;
    snprintf(copy, sizeof copy, "%s", text);
    const char *word = strtok_r(copy, " \t\r\n", &save);
    const struct command *command = word ? command_find(word) : NULL;
    if (command == NULL) {
        snprintf(answer, answer_size, "error: '%.40s' is no command; --help lists them", word ? word : "");
        return false;
    }
    while ((word = strtok_r(NULL, " \t\r\n", &save)) != NULL) {
        if (n == command->n_args || !number_parse(word, command->lo, command->hi, &arg[n]))
            break;
        n++;
    }
    if (word != NULL || n != command->n_args) {
        snprintf(answer, answer_size, "error: %s needs: %s %s (%g to %g)", command->name, command->name,
                 command->args, command->lo, command->hi);
        return false;
    }
    const char *why = command->run(sim, arg, now_ns);
    if (why != NULL)
        snprintf(answer, answer_size, "error: %s: %s", command->name, why);
    else
        snprintf(answer, answer_size, "ok %.*s", (int)strcspn(text, "\r\n"), text);
    return why == NULL;
}

void sim_print_commands(FILE *out)
{
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        fprintf(out, "  %-7s %-9s  %s\n", commands[i].name, commands[i].args, commands[i].what);
}

void sim_print_status(const struct sim *sim, FILE *out)
{
    static const char *const phases[] = {"idle", "listening", "between pings"};
    const struct head *head = &sim->head;
    fprintf(out, "%s, %s%s, angle %u, %llu pings, %llu requests, %llu nacks, %llu bytes sent, %llu lost",
            sim->line.fd < 0             ? "unplugged"
            : line_connected(&sim->line) ? "open"
                                         : "nobody there",
            head->automatic ? "auto-transmit, " : "", phases[head->phase], head->angle,
            (unsigned long long)head->counts.pings, (unsigned long long)head->counts.requests,
            (unsigned long long)head->counts.nacks, (unsigned long long)sim->line.sent_bytes,
            (unsigned long long)sim->line.lost_bytes);
}
