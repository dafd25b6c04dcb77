/* SPDX-License-Identifier: MIT */
/*
 * hearing - see hearing.h. The figures behind the constants are in docs/extract.md (Does the receiver hear?). Powers
 * are compared as ratios only, so it does not matter in which unit they are.
 */
#include "hearing.h"

#include <math.h>
#include <string.h>

#define BEAMS 16

/* The loudest part of a ring-down is among the first ones: within five guard lengths of the transmission. */
#define PEAK_PARTS 10

/* It decays to the mean of so many parts: by 6 dB in one ping, whose speckle may hide more; by 8 dB in the mean of
 * HEARING_LEAST beams. In noise alone a ping reaches 6 dB often, and the mean hardly ever reaches 4 dB. */
#define VALLEY_PARTS 4
#define DECAYS       4.0
#define DECAYS_USUAL 6.3

/* Its core: the parts around the loudest that are within 10 dB of it. What stands beside the head raises its tail, and
 * hardly its core. */
#define CORE 10.0

/* A part so many times (8 dB) quieter than usual is missing; a ping is doubted where most parts of the core are. */
#define MISSING 6.3

/* A ring-down that is usual may grow so much quieter (3 dB), as slowly as it likes, and no more. */
#define WORST 2.0

/* Noise so many times less than it ever was (20 dB), four pings in a row, is an amplifier's that has died, and not a
 * thruster's that has stopped. Where the ring-down cannot be seen the noise is all there is: 12 dB, at once. */
#define NOISE_LOST        100.0
#define NOISE_LOST_PINGS  4
#define NOISE_LOST_HIDDEN 16.0
#define NOISE_WINDOWS     16
#define NOISE_LEAST       64 /* beams before the noise is usual */

/*
 * A ring-down outlasts the transmission, which comes to a receiver whose transducer or cable is off as well: by 5 cm at
 * least on all recorded heads. Longer parts than this may hold both.
 */
#define COARSE_M   0.1001
#define LATE_PARTS 0.25 /* the first sample may be taken so late */

/* A ring-down ends later than this on any head; one that hears nothing nearer may hide it. */
#define HIDDEN_M 0.1

/* Fewer samples that are not zero may be alike by chance, and quieter ones by rounding. */
#define VARIES_BINS 64
#define FEW_COUNTS  2

/* So many samples that differ from the one before do not come again by chance. */
#define TELLING_BINS 64

/* Of the alarm's pings. */
#define LATEST ((UINT64_C(1) << HEARING_LEAST) - 1)

void hearing_clear(struct hearing *h)
{
    memset(h, 0, sizeof *h);
}

/* ---- what a ping shows ---- */

static uint32_t count_at(const struct amplitude *law, const void *samples, uint32_t i)
{
    return law->sample_bytes == 1 ? ((const uint8_t *)samples)[i] : ((const uint16_t *)samples)[i];
}

static double power_from(const struct amplitude *law, const void *samples, uint32_t begin, uint32_t bins)
{
    uint64_t sum = 0; /* 8192 bins of less than 2^48 */
    for (uint32_t i = begin; i < begin + bins; i++)
        sum += amplitude_of(law, count_at(law, samples, i));
    return (double)(int64_t)sum / bins;
}

/*
 * Zeros are legitimate samples at low gain, and so are ones and twos of a noise that hardly reaches a count. Louder
 * noise takes more than two values, and values that differ by more than the rounding of something constant would
 * make them.
 */
bool hearing_varies(const struct amplitude *law, const void *samples, uint32_t from, uint32_t n)
{
    uint32_t low = UINT32_MAX, high = 0, other = UINT32_MAX, loud = 0;
    bool many = false; /* more than two values */
    if (n < from + VARIES_BINS)
        return true;
    const uint32_t first = count_at(law, samples, from);
    for (uint32_t i = from; i < n; i++) {
        const uint32_t count = count_at(law, samples, i);
        low = count > 0 && count < low ? count : low;
        high = count > high ? count : high;
        loud += count > 0;
        many |= count != first && count != other && other != UINT32_MAX;
        other = count != first ? count : other;
        if (many && high > low && high - low > low / 8)
            return true;
    }
    return loud < VARIES_BINS || (high <= FEW_COUNTS && other != UINT32_MAX);
}

/* Mean power of the quarter-quietest of the windows behind bin `begin`. */
static double noise_of(const struct amplitude *law, const void *samples, uint32_t begin, uint32_t n)
{
    const uint32_t bins = n > begin ? (n - begin) / NOISE_WINDOWS : 0;
    double window[NOISE_WINDOWS];
    if (bins == 0)
        return -1.0;
    for (uint32_t w = 0; w < NOISE_WINDOWS; w++) {
        const double power = power_from(law, samples, begin + w * bins, bins);
        uint32_t at = w;
        for (; at > 0 && window[at - 1] > power; at--)
            window[at] = window[at - 1];
        window[at] = power;
    }
    return window[NOISE_WINDOWS / 4];
}

/* FNV-1a, one beam on. */
static uint64_t print_on(uint64_t print, const struct amplitude *law, const uint8_t *samples, uint32_t n)
{
    for (uint32_t i = 0; i < n * law->sample_bytes; i++)
        print = (print ^ samples[i]) * UINT64_C(0x100000001b3);
    return print;
}

static uint32_t changes_of(const struct amplitude *law, const void *samples, uint32_t from, uint32_t n)
{
    uint32_t changes = 0;
    for (uint32_t i = from + 1; i < n; i++)
        changes += count_at(law, samples, i) != count_at(law, samples, i - 1);
    return changes;
}

struct hearing_levels hearing_levels_of(const struct profile_axis *axis, const struct amplitude *law,
                                        const void *samples, uint32_t n_beams, double deaf_m,
                                        uint32_t floor_counts)
{
    const uint32_t bins = axis->guard > 2 ? axis->guard / 2 : 1, room = axis->n / bins;
    const uint32_t beams = n_beams < BEAMS ? n_beams : BEAMS;
    struct hearing_levels out = {.beams = beams,
                                 .parts = room < HEARING_PARTS ? room : HEARING_PARTS,
                                 .least = fmax((double)(int64_t)amplitude_of(law, floor_counts), 1.0),
                                 .count = fmax((double)(int64_t)amplitude_of(law, 1), 1.0),
                                 .hidden = axis->r0 > HIDDEN_M || deaf_m > HIDDEN_M};
    if (bins * axis->dr <= COARSE_M)
        out.behind_pulse = (uint32_t)ceil(axis->resolution_bins / bins + LATE_PARTS);
    uint64_t print = UINT64_C(0xcbf29ce484222325);
    uint32_t constant = 0, changes = 0;

    for (uint32_t k = 0; k < beams; k++) {
        const uint8_t *beam =
            (const uint8_t *)samples + (size_t)(k * n_beams / beams) * axis->n * law->sample_bytes;
        for (uint32_t i = 0; i < out.parts; i++)
            out.part[i] += power_from(law, beam, i * bins, bins) / beams;
        out.noise += noise_of(law, beam, out.parts * bins, axis->n) / beams;
        constant += !hearing_varies(law, beam, out.parts * bins, axis->n);
        changes += changes_of(law, beam, out.parts * bins, axis->n);
        print = print_on(print, law, beam, axis->n);
    }
    out.varies = 2 * constant <= beams;
    out.print = changes >= TELLING_BINS ? print : 0;
    return out;
}

bool hearing_repeats(struct hearing_prints *prints, uint64_t print)
{
    const bool repeats = print != 0 && (print == prints->last[0] || print == prints->last[1]);
    prints->last[1] = prints->last[0];
    prints->last[0] = print;
    return repeats;
}

/* ---- what it says ---- */

static double above(double power, double least)
{
    return power > least ? power : least;
}

static uint32_t loudest_part(const double *part, uint32_t from, uint32_t parts)
{
    uint32_t at = from;
    for (uint32_t i = from + 1; i < parts && i < PEAK_PARTS; i++)
        at = part[i] > part[at] ? i : at;
    return at;
}

/*
 * A ring-down is loudest near the transmission, and decays by so many times. A constant level does not, however loud,
 * and noise that the time-varied gain raises does the opposite.
 */
static bool decays(const double *part, const struct hearing_levels *levels, uint32_t from, double times)
{
    const uint32_t peak = loudest_part(part, from, levels->parts);
    const double most = above(part[peak], levels->least) / times;
    for (uint32_t i = peak; i + VALLEY_PARTS <= levels->parts; i++) {
        double valley = 0.0;
        for (uint32_t k = i; k < i + VALLEY_PARTS; k++)
            valley += above(part[k], levels->least) / VALLEY_PARTS;
        if (valley <= most)
            return true;
    }
    return false;
}

/*
 * Most parts of the usual ring-down's core are far quieter in this ping. In the first turn what is usual may be what
 * stands beside the head, as the vehicle's frame does at some bearings.
 */
static bool core_is_missing(const struct hearing *h, const struct hearing_levels *levels)
{
    if (h->rings < HEARING_TURN)
        return false;
    const uint32_t peak = loudest_part(h->ring, 0, levels->parts);
    uint32_t begin = peak, end = peak + 1, missing = 0;

    while (begin > 0 && h->ring[begin - 1] * CORE >= h->ring[peak])
        begin--;
    while (end < levels->parts && h->ring[end] * CORE >= h->ring[peak])
        end++;
    for (uint32_t i = begin; i < end; i++)
        missing += above(levels->part[i], levels->least) * MISSING < h->ring[i];
    return 2 * missing > end - begin;
}

/* The noise of this ping is far below the least that it ever was. */
static bool noise_is_lost(const struct hearing *h, const struct hearing_levels *levels)
{
    const double lost = levels->hidden ? NOISE_LOST_HIDDEN : NOISE_LOST;
    return levels->noise >= 0.0 && h->noises >= NOISE_LEAST &&
           lost * above(levels->noise, levels->count) < h->noise;
}

/* Of a ping that lacks nothing. */
static enum hearing_doubt what_is_known(const struct hearing *h, const struct hearing_levels *levels)
{
    if (levels->hidden || h->shown)
        return HEARING_HEARS;
    return h->refused ? HEARING_NO_RING : HEARING_NOT_LEARNT;
}

static enum hearing_doubt what_it_lacks(const struct hearing *h, const struct hearing_levels *levels)
{
    if (!levels->varies)
        return HEARING_CONSTANT;
    if (levels->repeats)
        return HEARING_FROZEN;
    if (!levels->hidden && (!decays(levels->part, levels, 0, DECAYS) || core_is_missing(h, levels)))
        return HEARING_NO_RING;
    if (noise_is_lost(h, levels) && (levels->hidden || h->faint + 1 >= NOISE_LOST_PINGS))
        return HEARING_FAINT;
    return HEARING_HEARS;
}

/* ---- what is usual ---- */

/* The power below which an eighth of the pings lie goes towards a power by so many times at most, down seven times as
 * far as up. The first pings move it by more. */
static double eighth_toward(double usual, double power, uint32_t beams)
{
    const double step = fmax(8.0 / (beams + 1), 0.02);
    return power > usual ? fmin(power, usual * (1.0 + step)) : fmax(power, usual / (1.0 + 7.0 * step));
}

static void learn_ring(struct hearing *h, const struct hearing_levels *levels)
{
    const uint32_t before = h->rings;
    h->rings += before < UINT32_MAX / 2 ? levels->beams : 0;
    for (uint32_t i = 0; i < levels->parts; i++) {
        const double power = above(levels->part[i], levels->least);
        h->mean[i] += (power - h->mean[i]) * levels->beams / h->rings;
        h->ring[i] = before == 0 ? power : fmax(eighth_toward(h->ring[i], power, before), h->worst[i]);
        h->worst[i] = before < HEARING_TURN && h->rings >= HEARING_TURN ? h->ring[i] / WORST : h->worst[i];
    }
    if (h->shown || h->rings < HEARING_LEAST)
        return;
    const bool rings = decays(h->mean, levels, 0, DECAYS_USUAL);
    h->shown = rings && decays(h->mean, levels, levels->behind_pulse, DECAYS);
    h->refused = rings && !h->shown;
    h->rings = h->shown ? h->rings : 0;
}

static void learn_noise(struct hearing *h, const struct hearing_levels *levels)
{
    h->faint = noise_is_lost(h, levels) ? h->faint + 1 : 0;
    if (levels->noise < 0.0 || h->faint > 0)
        return;
    const double power = above(levels->noise, levels->count);
    h->noise_now = h->noises == 0 ? power : eighth_toward(h->noise_now, power, h->noises);
    h->noises += h->noises < UINT32_MAX / 2 ? levels->beams : 0;
    if (h->noises <= NOISE_LEAST || h->noise_now < h->noise)
        h->noise = h->noise_now;
}

enum hearing_doubt hearing_take(struct hearing *h, const struct hearing_levels *levels)
{
    const enum hearing_doubt doubt = what_it_lacks(h, levels);
    if (doubt != HEARING_HEARS)
        return doubt;
    h->proofs = 0;
    learn_noise(h, levels);
    if (!levels->hidden)
        learn_ring(h, levels);
    return what_is_known(h, levels);
}

void hearing_prove(struct hearing *h, const struct hearing_levels *levels)
{
    if (levels->varies && !levels->repeats && decays(levels->part, levels, 0, DECAYS) &&
        ++h->proofs >= HEARING_LEAST)
        hearing_clear(h);
}

static int bits_of(uint64_t set)
{
    int n = 0;
    for (; set; set &= set - 1)
        n++;
    return n;
}

void hearing_alarm_take(struct hearing_alarm *alarm, enum hearing_doubt doubt)
{
    const bool doubted = doubt > HEARING_NOT_LEARNT;
    alarm->last = doubted ? doubt : alarm->last;
    alarm->doubted = alarm->doubted << 1 | doubted;
    const uint64_t latest = alarm->doubted & LATEST;
    if (latest == 0)
        alarm->doubt = HEARING_HEARS;
    else if (alarm->doubt == HEARING_HEARS && (latest == LATEST || bits_of(alarm->doubted) >= HEARING_OFTEN))
        alarm->doubt = alarm->last;
}

const char *hearing_doubt_text(enum hearing_doubt doubt)
{
    switch (doubt) {
    case HEARING_CONSTANT:
        return "its samples do not vary: the receiver is stuck";
    case HEARING_FROZEN:
        return "it sends the same samples again and again: the receiver is stuck";
    case HEARING_NO_RING:
        return "the ring-down of its own pulse is missing: the transducer, its cable or the receiver has failed";
    case HEARING_FAINT:
        return "its noise is far below what it was: the receiver has failed";
    case HEARING_LOST:
        return "the echoes of many directions are gone at once, and the vehicle has not moved: the receiver may "
               "have "
               "failed, or the head is out of the water";
    case HEARING_AIR:
        return "by depth and mount the head is out of the water";
    case HEARING_NOT_LEARNT:
    case HEARING_HEARS:
        break;
    }
    return NULL;
}
