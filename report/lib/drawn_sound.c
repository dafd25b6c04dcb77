/* SPDX-License-Identifier: MIT */
/* drawn_sound - see drawn_sound.h. */
#include "drawn_sound.h"

#include <string.h>

#include "tests/sound/sound.h"

#define SOUND_MPS      1500.0
#define SOUND_STREAM   1000000u
#define TIMING_STREAM  3000000u
#define NORMALS        65536u /* drawn once and taken in ever new orders: a million bins are made of them */
#define STRAY_MOST     22.0
#define BEFORE_M       0.3
#define OTHER_SIDE_DB  (-25.0)
#define OTHER_HALF_RAD 0.4

/* What one ping has for itself. */
struct moment {
    double t_s, raised;
    bool heard;
    double place_m[2];
    float other[DRAWN_MAX_BINS]; /* of other sonars, before the beam's pattern */
    bool any_other;
    double ring;
    double complex ring_phase;
};

static double complex normals[NORMALS];

void drawn_sound_begin(struct drawn_sound *s, uint64_t seed, unsigned number)
{
    if (normals[0] == 0.0) {
        struct dice dice = dice_of(1, 1);
        for (uint32_t i = 0; i < NORMALS; i++)
            normals[i] = dice_normal(&dice);
    }
    s->world = drawn_world_of(seed, number);
    s->dice = dice_of(seed, SOUND_STREAM + number);
    s->timing = dice_of(seed, TIMING_STREAM + number);
    s->t_s = 1.0;
    for (unsigned k = 0; k < s->world.others; k++)
        s->other_s[k] = s->world.other[k].phase_s;
    s->margins = hearable_margins_of(s->world.texture);
    s->turn = 0;
    s->pings = 0;
    insonify_init(&s->insonify, &s->world);
    const struct drawn_world *w = &s->world;
    s->ping = (struct ping){.kind = PING_PROFILE,
                            .law = (uint8_t)w->told,
                            .sample_bytes = 1,
                            .gain_db = (float)w->gain_db,
                            .n_beams = (uint16_t)w->beams,
                            .n_bins = w->bins,
                            .db_per_count = w->told == AMPLITUDE_LOG ? (float)w->db_per_count : 0.0f,
                            .dr_m = (float)s->insonify.bin_m,
                            .pulse_m = (float)w->pulse_m,
                            .az_aperture_rad = (float)w->az_aperture_rad,
                            .el_aperture_rad = (float)w->el_aperture_rad,
                            .head_turn = w->turn_units,
                            .max_beams = DRAWN_MAX_BEAMS,
                            .max_samples = sizeof s->samples,
                            .beam = s->axis,
                            .samples = s->samples};
}

/* ---- one ping ---- */

/* How late it comes: seldom by much. */
static double lateness(struct drawn_sound *s, double mean_s)
{
    return mean_s > 0.0 ? -mean_s * log(dice_uniform(&s->timing)) : 0.0;
}

static void other_pings(struct drawn_sound *s, unsigned k)
{
    s->other_s[k] += s->world.other[k].period_s + lateness(s, s->world.other[k].late_s);
}

/* Other sonars send when they like. */
static void hear_others(struct drawn_sound *s, struct moment *m)
{
    const struct drawn_world *w = &s->world;
    m->any_other = false;
    for (unsigned k = 0; k < w->others; k++) {
        const struct drawn_other *o = &w->other[k];
        if (!m->any_other)
            memset(m->other, 0, w->bins * sizeof(float));
        m->any_other = true;
        for (; s->other_s[k] < m->t_s + 2.0 * w->range_m / SOUND_MPS; other_pings(s, k)) {
            const double r_m = (s->other_s[k] - m->t_s) * SOUND_MPS / 2.0;
            if (r_m < 0.0)
                continue;
            const double level = sound_power(o->level_db + w->gain_db + dice_between(&s->dice, -3.0, 3.0));
            const double length_m = fmax(o->length_m, w->pulse_m);
            insonify_add(&s->insonify, m->other, r_m, r_m + length_m, level * length_m / w->pulse_m);
        }
    }
}

static double other_pattern(const struct drawn_world *w, double az_rad)
{
    const double off = geo_wrap_pi(az_rad - w->other[0].az_rad) / OTHER_HALF_RAD;
    return sound_power(fmax(-3.0 * off * off, OTHER_SIDE_DB));
}

/* Mean power of speckle in each bin, and what is loudest there. */
static void mix(struct drawn_sound *s, const struct moment *m, unsigned beam, double az_rad, float *mean)
{
    const struct drawn_world *w = &s->world;
    struct drawn_truth *truth = &s->truth[beam];
    struct insonified *b = &s->beam;
    double texture = 1.0;
    if (m->any_other) {
        const float pattern = (float)other_pattern(w, az_rad);
        for (uint32_t i = 0; i < w->bins; i++)
            b->mean[CAUSE_OTHER_SONAR][i] = m->other[i] * pattern;
    }
    for (uint32_t i = 0; i < w->bins; i++) {
        b->mean[CAUSE_NOISE][i] *= (float)m->raised;
        if (w->texture > 0 && i % w->pulse_bins == 0)
            texture = sound_texture(&s->dice, w->texture);
        b->mean[CAUSE_VOLUME][i] *= (float)texture;
        b->mean[CAUSE_PLANE][i] *= (float)texture;
        b->mean[CAUSE_SIDE_LOBE][i] *= (float)texture;
    }
    memset(mean, 0, w->bins * sizeof *mean);
    memset(truth->power, 0, w->bins * sizeof(float));
    for (int c = 0; c < CAUSES; c++)
        for (uint32_t i = 0; i < w->bins; i++) {
            const float power = b->mean[c][i];
            mean[i] += c == CAUSE_RING || c == CAUSE_TARGET ? 0.0f : power;
            truth->cause[i] = power > truth->power[i] ? (uint8_t)c : truth->cause[i];
            truth->power[i] = power > truth->power[i] ? power : truth->power[i];
        }
    for (unsigned t = 0; t < w->targets; t++) {
        texture = 1.0;
        for (uint32_t i = b->first[t]; i < b->end[t]; i++) {
            if (w->target[t].class == DRAWN_NET && w->texture > 0 && i % w->pulse_bins == 0)
                texture = sound_texture(&s->dice, w->texture);
            mean[i] += b->target[t][i] * (float)texture;
        }
    }
}

/* From mean powers to counts: scatterers of random phase and what comes in one piece, heard through a pulse; the
 * ringing; the receiver. */
static void receive(struct drawn_sound *s, const struct moment *m, const float *mean, uint8_t *samples)
{
    const struct drawn_world *w = &s->world;
    const uint32_t p = w->pulse_bins, stride = (uint32_t)dice_bits(&s->dice) | 1u;
    uint32_t at = (uint32_t)dice_bits(&s->dice);
    double complex field[DRAWN_MAX_BINS];
    double tremble = 0.0;
    for (uint32_t i = 0; i < w->bins; i++, at += stride)
        field[i] = sqrt((double)mean[i]) * normals[at % NORMALS];
    for (unsigned t = 0; t < w->targets; t++)
        if (s->beam.glint[t].power > 0.0)
            field[s->beam.glint[t].bin] +=
                sqrt(s->beam.glint[t].power) * cexp(GEO_TURN * dice_uniform(&s->dice) * (double complex)I);
    sound_pulse(field, w->bins, p);
    for (uint32_t i = 0; i < w->bins; i++, at += stride) {
        double complex total = field[i];
        const double ring = (double)s->insonify.ring[i] * m->ring;
        if (ring > 1e-9) {
            if (i % p == 0)
                tremble = sqrt(2.0) * creal(normals[at % NORMALS]);
            total += sqrt(ring) * fmax(0.0, 1.0 + w->ring_speckle * tremble) * m->ring_phase;
        }
        samples[i] = drawn_count(w, sound_intensity(total));
    }
    for (double n = w->stray_share * w->bins; dice_uniform(&s->dice) < n; n -= 1.0) {
        const uint32_t i = (uint32_t)(dice_uniform(&s->dice) * w->bins);
        const uint8_t stray = (uint8_t)dice_between(&s->dice, 1.0, STRAY_MOST);
        samples[i] = samples[i] < stray ? stray : samples[i];
    }
    memset(samples, 0, w->dead_bins);
    if (!m->heard)
        memset(samples, 0, w->bins);
}

/* Where a target is loudest in a pulse, and how loud; and the water before its near edge. */
static void tell_rise(const struct drawn_sound *s, unsigned k, struct drawn_truth *truth)
{
    const struct insonified *b = &s->beam;
    const uint32_t p = s->world.pulse_bins, end = b->end[k] + p < s->world.bins ? b->end[k] + p : s->world.bins;
    const double bin_m = s->insonify.bin_m, before_m = fmax(0.0, b->near_m[k] - BEFORE_M);
    double sum = 0.0;
    uint32_t loudest = b->first[k];
    truth->peak[k] = 0.0;
    for (uint32_t i = b->first[k]; i < end; i++) {
        sum += i < b->end[k] ? (double)b->target[k][i] : 0.0;
        sum -= i >= b->first[k] + p ? (double)b->target[k][i - p] : 0.0;
        if (sum > truth->peak[k]) {
            truth->peak[k] = sum;
            loudest = i;
        }
    }
    truth->rise_m[k] = loudest * bin_m - b->near_m[k];
    truth->before[k] =
        hearable_background_at(&s->insonify, &s->margins, b, (uint32_t)(before_m / bin_m), 1.0).mean;
}

static void tell_truth(struct drawn_sound *s, const struct moment *m, struct drawn_truth *truth)
{
    hearable_beam(&s->insonify, &s->margins, &s->beam, m->raised, m->heard, &truth->hearable);
    truth->solid_m = s->beam.solid_m;
    truth->skirt_m = s->beam.skirt_m;
    memcpy(truth->near_m, s->beam.near_m, sizeof truth->near_m);
    memcpy(truth->far_m, s->beam.far_m, sizeof truth->far_m);
    for (unsigned k = 0; k < s->world.targets; k++)
        if (isfinite(truth->hearable.by_m[k]))
            tell_rise(s, k, truth);
}

static void listen(struct drawn_sound *s, const struct moment *m, unsigned beam, double az_rad)
{
    float mean[DRAWN_MAX_BINS];
    /* samples lie one beam after the other, without gaps */
    uint8_t *samples = (uint8_t *)s->samples + (size_t)beam * s->world.bins;

    s->axis[beam] = (struct ping_beam){.az_rad = (float)geo_wrap(az_rad)};
    insonify_beam(&s->insonify, m->place_m, az_rad, &s->beam);
    tell_truth(s, m, &s->truth[beam]);
    mix(s, m, beam, az_rad, mean);
    receive(s, m, mean, samples);
}

static struct pose pose_of(const struct drawn_world *w, const struct moment *m)
{
    struct pose pose = pose_identity;
    if (!w->posed)
        return pose;
    pose.t_ns = (uint64_t)(m->t_s * 1e9);
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH | POSE_VELOCITY;
    for (int i = 0; i < 2; i++) {
        pose.position_m[i] = m->place_m[i];
        pose.velocity_mps[i] = w->velocity_mps[i];
    }
    pose.path_m = hypot(m->place_m[0], m->place_m[1]);
    return pose;
}

bool drawn_sound_next(struct drawn_sound *s)
{
    const struct drawn_world *w = &s->world;
    static struct moment m;
    bool lost;
    do {
        if (s->pings == DRAWN_TURNS * w->pings)
            return false;
        lost = dice_uniform(&s->dice) < w->lost_share;
        m.t_s = s->t_s;
        s->t_s += w->ping_s + lateness(s, w->asked_late_s);
        s->pings++;
    } while (lost);
    const uint32_t n = s->pings - 1, step = n % w->pings;
    s->turn = n / w->pings;
    m.heard = dice_uniform(&s->dice) >= w->dead_share;
    m.raised = dice_uniform(&s->dice) < w->raised_share ? sound_power(w->raised_db) : 1.0;
    m.ring = sound_power(dice_between(&s->dice, -0.5, 0.5));
    m.ring_phase = cexp(GEO_TURN * dice_uniform(&s->dice) * (double complex)I);
    for (int i = 0; i < 2; i++)
        m.place_m[i] = w->velocity_mps[i] * (m.t_s - 1.0);
    hear_others(s, &m);
    s->ping.t_ns = (uint64_t)((m.t_s + lateness(s, w->dated_late_s)) * 1e9);
    s->ping.t_in_ns = s->ping.t_ns + (uint64_t)(w->ping_s * 0.9e9);
    s->ping.seq++;
    s->ping.flags = step == 0 ? PING_NEW_TURN : 0;
    s->ping.head_units = w->turn_units ? step * w->step_units : 0;
    s->ping.pose = pose_of(w, &m);
    for (unsigned b = 0; b < w->beams; b++)
        listen(s, &m, b,
               w->beams > 1 ? (b - 0.5 * (w->beams - 1)) * w->beam_step_rad : (double)step * w->beam_step_rad);
    return true;
}

enum insonify_cause drawn_sound_cause(const struct drawn_sound *s, unsigned beam, double range_m)
{
    const struct drawn_truth *truth = &s->truth[beam];
    const double last = range_m / s->insonify.bin_m, length = 2.0 * s->world.pulse_bins;
    const uint32_t end = (uint32_t)fmin(last + 2.0, s->world.bins), first = (uint32_t)fmax(0.0, last - length);
    uint32_t loudest = first < end ? first : end - 1;
    for (uint32_t i = first; i < end; i++)
        if (truth->power[i] > truth->power[loudest])
            loudest = i;
    return (enum insonify_cause)truth->cause[loudest];
}
