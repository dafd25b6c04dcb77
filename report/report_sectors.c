/* SPDX-License-Identifier: MIT */
/*
 * report_sectors - the ring of sectors that the whole daemon tells of drawn waters, after three turns, against the
 * truth as seen from where the vehicle is then: is what is clear said to be clear, is what is blocked by nothing, is
 * anything called free that is not. Beside it the same ring made of the last turn of each rival's beams, or of a fan's
 * last ping. Heads and fans that leave no gap between their beams (what stands in a gap nobody knows), vehicles that
 * stand or move slowly.
 *
 *   report_sectors table [FIRST [LAST]]  of seeds FIRST to LAST (1 to 8; quick: 1 and 2), for people
 *   report_sectors csv [FIRST [LAST]]    measure, method, percent
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lib/asked.h"
#include "lib/contest.h"
#include "lib/drawn_sound.h"
#include "lib/knob.h"
#include "lib/scans.h"

#define WORLDS    36
#define SEEDS     8
#define SECTORS   72
#define LOOK_M    3.0 /* what a vehicle asks for */
#define OWN_M     0.5 /* nearer water is the vehicle's own */
#define PAST_M    0.25
#define SLACK_M   0.3
#define LEVEL_RAD 0.0873 /* up and down: 5 degrees */

/* What is true of a sector, of beams all over it from where the vehicle is in the end. */
struct truth {
    bool looked;    /* by the last turn, at all of it */
    double wall_m;  /* nearest that is heard like a wall */
    double solid_m; /* nearest of anything, down to the beams' skirts */
    double plane_m; /* nearest of a surface, bottom or slope, heard or not, within the band that is asked about */
    double from_m, to_m; /* a wall would be heard from and to here, without a gap, before anything solid */
};

/* What is said of it. */
struct said {
    enum answer_state state;
    double range_m, free_to_m;
};

struct count {
    unsigned sectors, clear, said_clear, said_blocked, blocked, of_nothing, wrong, through;
    double free_m, said_m;
};

enum kind { HEAD_STANDS, HEAD_MOVES, FAN_STANDS, FAN_MOVES, KINDS };

static struct drawn_sound sound;
static struct truth truth[SECTORS];
static struct said said[CONTESTANTS][SECTORS];
static struct count counts[KINDS][CONTESTANTS];

static unsigned sector_of(double az_rad)
{
    return (unsigned)(geo_wrap(az_rad) / GEO_TURN * SECTORS + 0.5) % SECTORS;
}

static double look_m(void)
{
    return fmin(LOOK_M, 0.8 * sound.world.range_m);
}

/* The nearest point of the planes along az_rad, up or down by LEVEL_RAD at most. They keep their depth below the
 * head. */
static double nearest_plane(double az_rad)
{
    double nearest_m = INFINITY;
    for (unsigned i = 0; i < sound.world.planes; i++) {
        const struct drawn_plane *p = &sound.world.plane[i];
        const double rise = tan(p->slope_rad) * cos(az_rad - p->az_rad);
        for (int k = -1; k <= 1; k++) {
            const double down = sin(k * LEVEL_RAD) + cos(k * LEVEL_RAD) * rise;
            if (p->depth_m / down > 0.0)
                nearest_m = fmin(nearest_m, p->depth_m / down);
        }
    }
    return nearest_m;
}

/* What a beam that is sent now along az_rad adds to the truth of a sector. */
static void learn_truth(struct truth *of, double az_rad)
{
    static struct insonified beam;
    const double cell_m = sound.world.range_m / HEARABLE_CELLS;
    struct hearable hearable;
    int from = 0, to;
    insonify_beam(&sound.insonify, sound.ping.pose.position_m, az_rad, &beam);
    hearable_beam(&sound.insonify, &sound.margins, &beam, 1.0, true, &hearable);
    while (from < HEARABLE_CELLS && !(hearable.cell[from] >> DRAWN_WALL & 1))
        from++;
    for (to = from; to < HEARABLE_CELLS && hearable.cell[to] >> DRAWN_WALL & 1;)
        to++;
    of->wall_m = fmin(of->wall_m, hearable.target_m[DRAWN_WALL]);
    of->solid_m = fmin(of->solid_m, beam.skirt_m);
    of->plane_m = fmin(of->plane_m, nearest_plane(az_rad));
    of->from_m = fmax(of->from_m, from * cell_m);
    of->to_m = fmin(of->to_m, fmin(to * cell_m, beam.skirt_m));
}

#define RAYS 5 /* of a sector, from edge to edge */

static void learn_truths(void)
{
    for (int i = 0; i < SECTORS; i++) {
        struct truth *of = &truth[i];
        *of = (struct truth){
            .looked = of->looked, .wall_m = INFINITY, .solid_m = INFINITY, .plane_m = INFINITY, .to_m = INFINITY};
        for (int k = 0; k < RAYS && of->looked; k++)
            learn_truth(of, GEO_TURN / SECTORS * (i - 0.5 + (double)k / (RAYS - 1)));
    }
}

/* A head that turns looks at every sector, a fan at those that it holds from edge to edge. */
static bool looks_at(int sector)
{
    const struct drawn_world *w = &sound.world;
    const double off_rad = fabs(geo_wrap_pi(GEO_TURN * sector / SECTORS)) + GEO_TURN / SECTORS / 2;
    return w->beams == 1 || off_rad <= ((w->beams - 1) * w->beam_step_rad + w->az_aperture_rad) / 2;
}

/* A rival's beam narrows what it says of the sector. */
static void learn_beam(struct said *of, bool first, const struct beam_echoes *b)
{
    if (first)
        *of = (struct said){ANSWER_CLEAR, INFINITY, INFINITY};
    if (b->n > 0)
        of->range_m = fmin(of->range_m, (double)b->echo[0].range_m);
    of->free_to_m = fmin(of->free_to_m, b->free_to_m > b->blind_m ? (double)b->free_to_m : 0.0);
    of->state = isfinite(of->range_m) ? ANSWER_BLOCKED : of->free_to_m >= look_m() ? ANSWER_CLEAR : ANSWER_UNKNOWN;
}

/* What the rivals say of the beams of the last turn, or of a fan's newest ping. */
static void learn_rivals(void)
{
    static struct beam_echoes found[DRAWN_MAX_BEAMS];
    static bool begun[SECTORS];
    if (sound.world.beams > 1 || (sound.ping.flags & PING_NEW_TURN))
        memset(begun, 0, sizeof begun);
    for (enum contestant c = CONTEST_THRESHOLD; c < CONTESTANTS; c++) {
        bool seen[SECTORS];
        memcpy(seen, begun, sizeof seen);
        contest_detect(c, contest_standard(c), &sound.ping, found);
        for (unsigned b = 0; b < sound.world.beams; b++) {
            const unsigned sector = sector_of((double)sound.axis[b].az_rad);
            learn_beam(&said[c][sector], !seen[sector], &found[b]);
            seen[sector] = true;
        }
    }
    for (unsigned b = 0; b < sound.world.beams; b++)
        begun[sector_of((double)sound.axis[b].az_rad)] = true;
}

static void hear(struct pipeline *pipeline)
{
    struct ping *ping = pipeline_begin(pipeline);
    struct ping heard = sound.ping;
    heard.max_beams = ping->max_beams;
    heard.max_samples = ping->max_samples;
    heard.beam = ping->beam;
    heard.samples = ping->samples;
    memcpy(heard.samples, sound.samples, (size_t)heard.n_beams * heard.n_bins);
    memcpy(heard.beam, sound.axis, heard.n_beams * sizeof *heard.beam);
    *ping = heard;
    pipeline_submit(pipeline, ping);
    if (sound.turn == DRAWN_TURNS - 1)
        learn_rivals();
}

static void ask(struct pipeline *pipeline, const struct conf *conf)
{
    static struct answer answers[SECTORS];
    const struct asking asking = {
        pipeline_picture(pipeline),
        scans_limits(conf),
        {.now_ns = sound.ping.t_in_ns, .pose_fresh = sound.world.posed, .pose = sound.ping.pose},
        OWN_M};
    const struct obstacles_query query = {
        .around = true,
        .band = {.lo_rad = -LEVEL_RAD, .hi_rad = LEVEL_RAD, .reach_m = sound.world.range_m, .count = SECTORS}};
    asked_of_pipeline(pipeline, &asking, &query, answers);
    for (size_t i = 0; i < SECTORS; i++) {
        const struct answer *a = &answers[i];
        said[CONTEST_SONARD][i] = (struct said){a->state, a->state == ANSWER_BLOCKED ? a->range_m : INFINITY,
                                                a->free_to_m > a->blind_to_m ? a->free_to_m : 0.0};
    }
}

static void count_sector(struct count *n, const struct truth *t, const struct said *s)
{
    const bool clear = t->to_m >= look_m() + SLACK_M && t->from_m < look_m();
    const bool near = s->state == ANSWER_BLOCKED && s->range_m < look_m();
    n->sectors++;
    n->clear += clear;
    n->said_clear += clear && !near && s->free_to_m >= look_m() - 1e-3;
    n->said_blocked += clear && near;
    n->blocked += s->state == ANSWER_BLOCKED;
    n->of_nothing += s->state == ANSWER_BLOCKED && s->range_m < t->solid_m - SLACK_M - sound.world.pulse_m;
    n->wrong += s->free_to_m > t->wall_m + PAST_M || (s->state == ANSWER_CLEAR && t->wall_m < look_m() - PAST_M);
    n->through +=
        s->free_to_m > t->plane_m + PAST_M || (s->state == ANSWER_CLEAR && t->plane_m < look_m() - PAST_M);
    if (t->to_m > t->from_m) {
        n->free_m += t->to_m - t->from_m;
        n->said_m += fmax(0.0, fmin(s->free_to_m, t->to_m) - t->from_m);
    }
}

static enum kind kind_of(const struct drawn_world *w)
{
    const bool moves = hypot(w->velocity_mps[0], w->velocity_mps[1]) > 0.0;
    return w->beams > 1 ? (moves ? FAN_MOVES : FAN_STANDS) : moves ? HEAD_MOVES : HEAD_STANDS;
}

static void judge_world(uint64_t seed, unsigned number)
{
    static struct conf conf;
    drawn_sound_begin(&sound, seed, number);
    if (sound.world.beam_step_rad > (double)sound.ping.az_aperture_rad)
        return;
    contest_begin();
    knob_conf(NULL, &conf);
    conf.sonar[0].range_m = fmax(0.75, sound.world.range_m);
    struct pipeline *pipeline = scans_start(&conf, sound.world.beams);
    while (drawn_sound_next(&sound))
        hear(pipeline);
    ask(pipeline, &conf);
    pipeline_free(pipeline);
    for (int i = 0; i < SECTORS; i++)
        truth[i].looked = looks_at(i);
    learn_truths();
    for (int i = 0; i < SECTORS; i++)
        for (int c = 0; c < CONTESTANTS && truth[i].looked; c++)
            count_sector(&counts[kind_of(&sound.world)][c], &truth[i], &said[c][i]);
}

/* ---- what is told ---- */

static double percent(double part, double whole)
{
    return whole > 0.0 ? 100.0 * part / whole : 0.0;
}

static double said_clear(const struct count *n)
{
    return percent(n->said_clear, n->clear);
}

static double said_blocked(const struct count *n)
{
    return percent(n->said_blocked, n->clear);
}

static double free_metres(const struct count *n)
{
    return percent(n->said_m, n->free_m);
}

static double blocked(const struct count *n)
{
    return percent(n->blocked, n->sectors);
}

static double of_nothing(const struct count *n)
{
    return percent(n->of_nothing, n->sectors);
}

static double wrong(const struct count *n)
{
    return percent(n->wrong, n->sectors);
}

static double through(const struct count *n)
{
    return percent(n->through, n->sectors);
}

static const struct {
    const char *name;
    double (*of)(const struct count *n);
} measures[] = {
    {"clear sectors said free to 3 m: %", said_clear},
    {"clear sectors said blocked before that: %", said_blocked},
    {"free metres said free: %", free_metres},
    {"sectors blocked at any range: %", blocked},
    {"sectors blocked by nothing: %", of_nothing},
    {"sectors with free water past a wall that is heard: %", wrong},
    {"sectors with free water past a bottom or surface that is there: %", through},
};
#define MEASURES (sizeof measures / sizeof measures[0])

static const char *const kind_name[KINDS] = {"head that stands", "head that moves", "fan that stands",
                                             "fan that moves"};

/* Of heads and fans, standing and moving. */
static struct count all_of(int c)
{
    struct count all = {0};
    for (int k = 0; k < KINDS; k++) {
        const struct count *n = &counts[k][c];
        all.sectors += n->sectors;
        all.clear += n->clear;
        all.said_clear += n->said_clear;
        all.said_blocked += n->said_blocked;
        all.blocked += n->blocked;
        all.of_nothing += n->of_nothing;
        all.wrong += n->wrong;
        all.through += n->through;
        all.free_m += n->free_m;
        all.said_m += n->said_m;
    }
    return all;
}

typedef void print_value(const char *measure, const char *method, double percent);

/* Of all, and what matters most of each kind. */
static void print_each(print_value *print)
{
    char name[80];
    for (size_t m = 0; m < MEASURES; m++)
        for (int c = 0; c < CONTESTANTS; c++) {
            const struct count all = all_of(c);
            print(measures[m].name, contest_name[c], measures[m].of(&all));
        }
    for (int k = 0; k < KINDS; k++)
        for (int c = 0; c < CONTESTANTS; c++) {
            snprintf(name, sizeof name, "%s: free metres said free: %%", kind_name[k]);
            print(name, contest_name[c], free_metres(&counts[k][c]));
        }
}

static void print_cell(const char *measure, const char *method, double value)
{
    if (strcmp(method, contest_name[0]) == 0)
        printf("%-54s", measure);
    printf(" %13.2f%s", value, strcmp(method, contest_name[CONTESTANTS - 1]) == 0 ? "\n" : "");
}

static void print_row(const char *measure, const char *method, double value)
{
    printf("%s,%s,%.3g\n", measure, method, value);
}

static void print_table(void)
{
    const struct count all = all_of(0);
    printf("%u sectors, %u of them clear\n%-54s", all.sectors, all.clear, "");
    for (int c = 0; c < CONTESTANTS; c++)
        printf(" %13s", contest_name[c]);
    printf("\n");
    print_each(print_cell);
}

static void print_csv(void)
{
    printf("measure,method,percent\n");
    print_each(print_row);
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0, given = argc > 2 && argv[2][0] <= '9';
    const uint64_t first = given ? strtoull(argv[2], NULL, 10) : 1, usual = given ? first : quick ? 2 : SEEDS;
    const uint64_t last = given && argc > 3 ? strtoull(argv[3], NULL, 10) : usual;
    if (strcmp(what, "table") != 0 && strcmp(what, "csv") != 0) {
        fprintf(stderr, "usage: report_sectors table|csv [FIRST [LAST] | quick]\n");
        return 2;
    }
    contest_make(DRAWN_MAX_BINS);
    for (uint64_t seed = first; seed <= last; seed++)
        for (unsigned n = 0; n < WORLDS; n++)
            judge_world(seed, n);
    contest_free();
    if (strcmp(what, "table") == 0)
        print_table();
    else
        print_csv();
    return 0;
}
