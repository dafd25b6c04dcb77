/* SPDX-License-Identifier: MIT */
#include "mavlink_barometer.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define SECOND_NS      1000000000u
#define HULL_MAX_HPA   1300.0    /* a hull that was closed at 0 degC would have to heat up to 80 */
#define DEEP_NS        SECOND_NS /* a single wrong reading is no depth */
#define FRESH_NS       (2ull * SECOND_NS)
#define SILENT_NS      (6ull * SECOND_NS) /* longer than until a vehicle counts as gone: of that the link tells */
#define AIR_MIN_HPA    300.0              /* as --surface-pressure has it */
#define AIR_MAX_HPA    1100.0             /* the most ever measured is 1085 */
#define FOLLOW_M       1.0                /* the altitude has changed by so much ... */
#define FOLLOW_SHARE   0.25               /* ... and the depth by as much, up to this share ... */
#define FOLLOW_NS      (60ull * SECOND_NS) /* ... in less than this, in which a hull does not heat up by a metre ... */
#define FOLLOW_TIMES   2u                  /* ... so often */
#define DISAGREE_M     1.0
#define DISAGREE_SHARE 0.03 /* of the pressure */
#define UNKNOWN_NS     (10ull * SECOND_NS)
#define ASK_AGAIN      30 /* of so many seconds once, when it has answered */

/* Of ArduSub from 4.1 on, and before. */
static const char *const primaries[] = {"BARO_PRIMARY", "GND_PRIMARY"};
#define PRIMARIES (sizeof primaries / sizeof *primaries)

void mavlink_barometers_init(struct mavlink_barometers *b, int named, double m_per_hpa)
{
    *b = (struct mavlink_barometers){.named = named, .used = named, .m_per_hpa = m_per_hpa};
}

void mavlink_barometers_forget(struct mavlink_barometers *b)
{
    const struct mavlink_barometers was = *b;
    mavlink_barometers_init(b, was.named, was.m_per_hpa);
    for (int i = 0; i < MAVLINK_BAROMETERS; i++)
        b->of[i].first_hpa = was.of[i].first_hpa;
}

static bool is_fresh(const struct mavlink_barometer *of, uint64_t now_ns)
{
    return of->t_ns && now_ns <= of->t_ns + FRESH_NS;
}

static bool disagree(const struct mavlink_barometers *b, const struct mavlink_barometer *one,
                     const struct mavlink_barometer *other)
{
    return fabs(one->hpa - other->hpa) * b->m_per_hpa >
           DISAGREE_M + DISAGREE_SHARE * fmax(one->hpa, other->hpa) * b->m_per_hpa;
}

/* Is barometer i in the water, by what it has read or by the autopilot's word? */
static bool is_wet(const struct mavlink_barometers *b, int i)
{
    return b->of[i].wet || b->primary == i + 1;
}

static bool is_silent(const struct mavlink_barometer *of, uint64_t now_ns)
{
    return now_ns > of->t_ns + SILENT_NS;
}

/* One that was used and sends nothing any more. A named one is waited for. */
static void give_up_silent(struct mavlink_barometers *b, uint64_t now_ns)
{
    const int used = b->used;
    if (used == MAVLINK_BAROMETER_ANY || !b->of[used - 1].t_ns || !is_silent(&b->of[used - 1], now_ns))
        return;
    if (b->told_used == used) {
        b->silent = used;
        b->told_none = true;
    }
    b->told_used = MAVLINK_BAROMETER_ANY;
    b->used = b->named;
}

/* The first that is in the water and reads is used. Another that reads something else there speaks against it while it
 * reads. */
static void choose(struct mavlink_barometers *b, uint64_t now_ns)
{
    give_up_silent(b, now_ns);
    for (int i = 0; i < MAVLINK_BAROMETERS && b->used == MAVLINK_BAROMETER_ANY; i++)
        if (is_wet(b, i) && is_fresh(&b->of[i], now_ns))
            b->used = i + 1;
    b->against = MAVLINK_BAROMETER_ANY;
    if (b->used == MAVLINK_BAROMETER_ANY)
        return;

    const struct mavlink_barometer *used = &b->of[b->used - 1];

    for (int i = 0; i < MAVLINK_BAROMETERS; i++)
        if (&b->of[i] != used && is_wet(b, i) && is_fresh(&b->of[i], now_ns) && is_fresh(used, now_ns) &&
            disagree(b, used, &b->of[i]))
            b->against = i + 1;
}

void mavlink_barometers_pressure(struct mavlink_barometers *b, int number, double hpa, uint64_t now_ns)
{
    struct mavlink_barometer *of = &b->of[number - 1];
    if (hpa < HULL_MAX_HPA || !is_fresh(of, now_ns))
        of->deep_ns = 0;
    if (hpa >= HULL_MAX_HPA && !of->deep_ns)
        of->deep_ns = now_ns;
    of->wet |= of->deep_ns && now_ns >= of->deep_ns + DEEP_NS;
    of->hpa = hpa;
    of->t_ns = now_ns;
    of->first_hpa = of->first_hpa > 0 ? of->first_hpa : hpa;
    b->begin_ns = b->begin_ns ? b->begin_ns : now_ns;
    choose(b, now_ns);
}

static struct mavlink_altitude_mark mark_now(const struct mavlink_barometers *b, double altitude_m,
                                             uint64_t now_ns)
{
    struct mavlink_altitude_mark mark = {.t_ns = now_ns, .altitude_m = altitude_m};
    for (int i = 0; i < MAVLINK_BAROMETERS; i++)
        mark.hpa[i] = is_fresh(&b->of[i], now_ns) ? b->of[i].hpa : 0;
    return mark;
}

void mavlink_barometers_altitude(struct mavlink_barometers *b, enum mavlink_altitude from, double altitude_m,
                                 uint64_t now_ns)
{
    struct mavlink_altitude_mark *mark = &b->mark[from];
    if (!isfinite(altitude_m))
        return;

    const struct mavlink_altitude_mark now = mark_now(b, altitude_m, now_ns);
    const double sunk_m = mark->altitude_m - altitude_m;

    if (mark->t_ns && now_ns <= mark->t_ns + FOLLOW_NS && fabs(sunk_m) < FOLLOW_M)
        return;
    for (int i = 0; i < MAVLINK_BAROMETERS && mark->t_ns && now_ns <= mark->t_ns + FOLLOW_NS; i++) {
        const double deeper_m = (now.hpa[i] - mark->hpa[i]) * b->m_per_hpa;
        const bool follows =
            now.hpa[i] > 0 && mark->hpa[i] > 0 && fabs(deeper_m - sunk_m) <= FOLLOW_SHARE * fabs(sunk_m);

        b->of[i].follows[from] = follows ? b->of[i].follows[from] + 1 : 0;
        b->of[i].wet |= b->of[i].follows[from] >= FOLLOW_TIMES;
    }
    *mark = now;
    choose(b, now_ns);
}

void mavlink_barometers_primary(struct mavlink_barometers *b, int primary)
{
    const int number = primary >= 1 && primary < MAVLINK_BAROMETERS ? primary + 1 : MAVLINK_BAROMETER_ANY;
    b->answered = true;
    if (number == b->primary)
        return;
    if (b->used == b->primary && b->used != MAVLINK_BAROMETER_ANY && !b->of[b->used - 1].wet)
        b->used = b->named;
    b->primary = number;
}

void mavlink_barometers_unsay(struct mavlink_barometers *b)
{
    mavlink_barometers_primary(b, 0);
    b->answered = false;
}

const char *mavlink_barometers_ask(struct mavlink_barometers *b)
{
    const unsigned n = b->asks++;
    if (b->named != MAVLINK_BAROMETER_ANY || (b->answered && n % ASK_AGAIN != 0))
        return NULL;
    return primaries[(b->answered ? n / ASK_AGAIN : n) % PRIMARIES];
}

bool mavlink_barometers_is_primary(const char *name)
{
    for (size_t i = 0; i < PRIMARIES; i++)
        if (strcmp(name, primaries[i]) == 0)
            return true;
    return false;
}

int mavlink_barometers_depth(const struct mavlink_barometers *b)
{
    return b->named == MAVLINK_BAROMETER_ANY && b->against != MAVLINK_BAROMETER_ANY ? MAVLINK_BAROMETER_ANY
                                                                                    : b->used;
}

double mavlink_barometers_surface_hpa(const struct mavlink_barometers *b, int number)
{
    const double first_hpa = b->of[number - 1].first_hpa;
    return first_hpa >= AIR_MIN_HPA && first_hpa <= AIR_MAX_HPA ? first_hpa : 0;
}

const char *mavlink_barometers_name(const struct mavlink_barometers *b, int number,
                                    char out[MAVLINK_BAROMETER_NAME])
{
    snprintf(out, MAVLINK_BAROMETER_NAME, "SCALED_PRESSURE%s (%.0f hPa)",
             number == 1   ? ""
             : number == 2 ? "2"
                           : "3",
             b->of[number - 1].hpa);
    return out;
}

/* Why there is no depth, and what the barometers that there are read. */
static bool say_none(struct mavlink_barometers *b, char *text, size_t size)
{
    char list[MAVLINK_BAROMETERS * 50] = "", one[MAVLINK_BAROMETER_NAME];
    size_t n = 0;
    for (int i = 0; i < MAVLINK_BAROMETERS; i++)
        if (b->of[i].t_ns)
            n += (size_t)snprintf(list + n, sizeof list - n, "%s%s", n ? ", " : "",
                                  mavlink_barometers_name(b, i + 1, one));
    snprintf(text, size, "no depth: %s; received: %s",
             b->named ? "the barometer named by --barometer sends nothing"
             : b->primary
                 ? "the autopilot's depth sensor by BARO_PRIMARY sends nothing"
                 : "it is not known which barometer is in the water until one follows the altitude or is 3 m "
                   "deep; --barometer 2 names SCALED_PRESSURE2",
             n ? list : "no pressure");
    b->told_none = true;
    return true;
}

bool mavlink_barometers_news(struct mavlink_barometers *b, uint64_t now_ns, char *text, size_t size)
{
    char one[MAVLINK_BAROMETER_NAME], other[MAVLINK_BAROMETER_NAME];
    choose(b, now_ns);
    if (b->silent != MAVLINK_BAROMETER_ANY) {
        snprintf(text, size, "warning: %s, which gave the depth, is silent: no depth until %s",
                 mavlink_barometers_name(b, b->silent, one),
                 b->named ? "it reads again" : "it or another in the water reads");
        b->silent = MAVLINK_BAROMETER_ANY;
        return true;
    }
    if (b->used == MAVLINK_BAROMETER_ANY || is_silent(&b->of[b->used - 1], now_ns))
        return b->begin_ns && now_ns > b->begin_ns + UNKNOWN_NS && !b->told_none && say_none(b, text, size);

    const struct mavlink_barometer *used = &b->of[b->used - 1];

    if (b->told_used != b->used) {
        b->told_used = b->used;
        snprintf(text, size, "depth from %s, %s", mavlink_barometers_name(b, b->used, one),
                 b->named                ? "as --barometer says"
                 : used->deep_ns         ? "which reads more than a hull holds"
                 : b->primary == b->used ? "the autopilot's depth sensor by BARO_PRIMARY"
                                         : "which follows the altitude");
        return true;
    }
    if (b->against != MAVLINK_BAROMETER_ANY && b->told_against != b->against) {
        b->told_against = b->against;
        snprintf(text, size, "warning: barometers disagree: %s and %s are both in the water; %s",
                 mavlink_barometers_name(b, b->used, one), mavlink_barometers_name(b, b->against, other),
                 b->named ? "is --barometer right?"
                          : "no depth until they agree; --barometer N says which is right");
        return true;
    }
    return false;
}
