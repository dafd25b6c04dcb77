/* SPDX-License-Identifier: MIT */
/*
 * test_depth - what becomes of a depth sensor's values on their way to the pose log: the sensor's place in the vehicle
 * is taken off, lies are kept out, and failures say what is the matter. The slave is this test's own, without a line.
 */
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#include <semaphore.h>
#include <string.h>

#include "daemon/input/depth.h"

#define SECOND 1000000000ull

/* ---- in the place of drivers/pose/modbus_depth.c: a slave that answers what and when the test says ---- */

static sem_t asked;
static enum modbus_result result;
static double value;
static int stop_fd;
static _Atomic unsigned disconnects;
static uint64_t takes_ns; /* it answers so late */

/* The thread's clock runs ahead by what the test says (linked with --wrap=loop_clock). */
static _Atomic uint64_t ahead_ns;

uint64_t __real_loop_clock(void);
uint64_t __wrap_loop_clock(void);
uint64_t __wrap_loop_clock(void)
{
    return __real_loop_clock() + ahead_ns;
}

bool modbus_depth_check(const char *source, struct fault *fault)
{
    (void)source;
    (void)fault;
    return true;
}

double modbus_depth_number(enum modbus_type type, bool little, const uint16_t reg[2])
{
    (void)type;
    (void)little;
    return reg[0];
}

struct modbus_depth *modbus_depth_new(const struct modbus_depth_conf *conf, struct fault *fault)
{
    static char slave;
    (void)fault;
    stop_fd = conf->stop_fd;
    return (struct modbus_depth *)&slave;
}

enum modbus_result modbus_depth_prepare(struct modbus_depth *m, struct fault *fault)
{
    (void)m;
    while (sem_trywait(&asked) != 0) {
        struct pollfd stop = {.fd = stop_fd, .events = POLLIN};
        if (poll(&stop, 1, 1) > 0)
            return MODBUS_STOPPED;
    }
    if (result != MODBUS_NO_LINK)
        return MODBUS_OK;
    fault_set(fault, "no line");
    return result;
}

enum modbus_result modbus_depth_read(struct modbus_depth *m, double *v, struct fault *fault)
{
    (void)m;
    ahead_ns += takes_ns;
    *v = value;
    fault_set(fault, "%s", result == MODBUS_OK ? "" : "no answer");
    return result;
}

unsigned modbus_depth_oddities(const struct modbus_depth *m)
{
    (void)m;
    return 0;
}

void modbus_depth_disconnect(struct modbus_depth *m)
{
    (void)m;
    disconnects++;
}

void modbus_depth_free(struct modbus_depth *m)
{
    (void)m;
}

/* ---- a source of depths, and what it says ---- */

static struct loop *loop;
static struct pose_log poses;
static struct pose_input input;
static struct depth *depth;
static int taken;

static void count_taken(void *ctx, const struct pose *pose)
{
    (void)ctx;
    (void)pose;
    taken++;
}

/* In metres, mounted there. */
static void begin(const double mount_m[3])
{
    struct conf conf;
    struct fault fault;
    conf_defaults(&conf);
    conf.depth.unit = CONF_UNIT_M;
    conf.depth.rate_hz = 50;
    conf.depth.timeout_s = 2; /* however slow the machine is */
    memcpy(conf.depth.mount_m, mount_m, sizeof conf.depth.mount_m);
    loop = loop_new(false);
    pose_log_init(&poses, 3600 * SECOND);
    input = (struct pose_input){.loop = loop, .poses = &poses, .taken = count_taken};
    taken = 0;
    sem_init(&asked, 0, 0);
    depth = depth_new(&conf.depth, 1025, &input, &fault);
    if (!depth || !depth_start(depth, &fault)) {
        printf("FAIL %s\n", fault.text);
        exit(1);
    }
}

static void end(void)
{
    depth_free(depth);
    loop_free(loop);
    sem_destroy(&asked);
}

static void turn_to(double roll_deg, double pitch_deg)
{
    struct pose pose = pose_identity;
    pose.t_ns = loop_clock();
    pose.has = POSE_ATTITUDE;
    quat_from_rpy(geo_rad(roll_deg), geo_rad(pitch_deg), geo_rad(40), pose.attitude);
    CHECK(pose_log_put(&poses, &pose));
}

/* What came of all questions so far but those without a link. */
static uint64_t answers(void)
{
    struct depth_status s;
    depth_status(depth, &s);
    return s.samples + s.timeouts + s.exceptions + s.bad_answers + s.out_of_step + s.no_number;
}

/* One question; its answer is on its way. */
static void ask(enum modbus_result how, double metres)
{
    result = how;
    value = metres;
    sem_post(&asked);
}

/* One question, and its answer's way to the log. */
static struct depth_status hear(enum modbus_result how, double metres)
{
    struct depth_status s;
    const uint64_t before = answers();
    ask(how, metres);
    TURN_UNTIL(loop, answers() > before);
    depth_status(depth, &s);
    return s;
}

static double vehicle_m(void)
{
    struct pose pose;
    CHECK(pose_log_at(&poses, loop_clock(), &pose) && (pose.has & POSE_DEPTH));
    return pose.position_m[2];
}

TEST(the_depth_is_that_of_the_vehicle)
{
    static const struct {
        const char *name;
        double mount_m[3], roll_deg, pitch_deg, want_m;
    } row[] = {{"at its middle", {0, 0, 0}, 0, 0, 10},
               {"below it", {0, 0, 0.5}, 0, 0, 9.5},
               {"below it, upside down", {0, 0, 0.5}, 180, 0, 10.5},
               {"before it, bow up", {1, 0, 0}, 0, 90, 11},
               {"to its right, listing to the right", {0, 1, 0}, 30, 0, 9.5}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(row[i].mount_m);
        turn_to(row[i].roll_deg, row[i].pitch_deg);
        const struct depth_status s = hear(MODBUS_OK, 10);
        if (!(fabs(vehicle_m() - row[i].want_m) < 1e-9) || s.depth_m != 10) {
            printf("%s: %g m, of %g m\n", row[i].name, vehicle_m(), s.depth_m);
            test_case_failed = true;
        }
        end();
    }
}

TEST(a_lie_is_counted_and_goes_no_farther)
{
    begin((const double[3]){0, 0, 0});
    hear(MODBUS_OK, 10);
    const struct depth_status s = hear(MODBUS_OK, 1000);
    CHECK_INT(s.samples, 2);
    CHECK_INT(s.implausible, 1);
    CHECK(s.depth_m == 10 && vehicle_m() == 10);
    CHECK_INT(taken, 1);
    CHECK_INT(s.state, DEPTH_RUNNING);
    end();
}

TEST(failures_in_a_row_are_silence_and_one_answer_ends_it)
{
    static const enum modbus_result how[] = {MODBUS_TIMEOUT, MODBUS_EXCEPTION, MODBUS_BAD_ANSWER};
    struct depth_status s;
    begin((const double[3]){0, 0, 0});
    CHECK_INT(hear(MODBUS_OK, 10).state, DEPTH_RUNNING);
    for (int i = 0; i < 3; i++)
        CHECK_INT(hear(how[i], 0).state, i < 2 ? DEPTH_RUNNING : DEPTH_SILENT);
    s = hear(MODBUS_OK, 10);
    CHECK_INT(s.state, DEPTH_RUNNING);
    CHECK(s.timeouts == 1 && s.exceptions == 1 && s.bad_answers == 1 && s.reconnects == 0);
    for (int i = 0; i < 2; i++)
        CHECK_INT(hear(MODBUS_TIMEOUT, 0).state, DEPTH_RUNNING); /* they are counted anew */
    CHECK_INT(taken, 2);
    end();
}

TEST(a_link_that_comes_back_is_counted)
{
    struct depth_status s;
    begin((const double[3]){0, 0, 0});
    hear(MODBUS_OK, 10);
    ask(MODBUS_NO_LINK, 0);
    TURN_UNTIL(loop, (depth_status(depth, &s), s.state == DEPTH_NO_LINK));
    CHECK_INT(s.state, DEPTH_NO_LINK);
    CHECK_STR(s.error.text, "no line");
    s = hear(MODBUS_OK, 10);
    CHECK_INT(s.state, DEPTH_RUNNING);
    CHECK_INT(s.reconnects, 1);
    CHECK_STR(s.error.text, "");
    end();
}

/* Nobody knows when within it the sensor measured: halfway, or too long ago. */
TEST(a_depth_is_of_the_middle_between_question_and_answer)
{
    begin((const double[3]){0, 0, 0});
    takes_ns = SECOND;
    const uint64_t before_ns = loop_clock();
    struct depth_status s = hear(MODBUS_OK, 10);
    CHECK(s.t_depth_ns >= before_ns + SECOND / 2 && s.t_depth_ns <= loop_clock() - SECOND / 2);
    CHECK_INT(pose_log_last_ns(&poses, POSE_DEPTH), s.t_depth_ns);
    takes_ns = 9 * SECOND;
    const uint64_t last_ns = s.t_depth_ns;
    s = hear(MODBUS_OK, 11);
    CHECK(s.timeouts == 1 && s.t_depth_ns == last_ns && s.depth_m == 10);
    CHECK(strstr(s.error.text, "s after the question"));
    CHECK_INT(taken, 1);
    end();
    takes_ns = 0;
    ahead_ns = 0;
}

/* As behind a USB adapter whose transfers have stopped. */
TEST(a_line_that_answers_nothing_for_10_s_is_opened_anew)
{
    begin((const double[3]){0, 0, 0});
    disconnects = 0;
    hear(MODBUS_OK, 10);
    for (int i = 1; i <= 3; i++) {
        ahead_ns += 3 * SECOND;
        CHECK_INT(hear(MODBUS_TIMEOUT, 0).timeouts, i);
        CHECK_INT(disconnects, 0);
    }
    ahead_ns += 3 * SECOND;
    hear(MODBUS_TIMEOUT, 0);
    CHECK_INT(disconnects, 1);
    for (int i = 0; i < 8; i++) {
        ahead_ns += 3 * SECOND;
        hear(MODBUS_EXCEPTION, 0); /* it refuses, and so it is there */
    }
    CHECK_INT(disconnects, 1);
    end();
    ahead_ns = 0;
}

TEST(whatever_a_sensor_answers_it_is_there)
{
    static const enum modbus_result how[] = {MODBUS_OK, MODBUS_EXCEPTION, MODBUS_NO_NUMBER};
    for (int k = 0; k < 3; k++) {
        begin((const double[3]){0, 0, 0});
        disconnects = 0;
        for (int i = 0; i < 5; i++) {
            ahead_ns += 4 * SECOND;
            hear(how[k], 10);
        }
        CHECK_INT(disconnects, 0);
        end();
        ahead_ns = 0;
    }
}

/* Behind "skipped:" in status. */
TEST(what_is_skipped_is_named)
{
    struct fault text;
    depth_oddities_text(0, &text);
    CHECK_STR(text.text, "");
    depth_oddities_text(MODBUS_QUESTION_ECHOED, &text);
    CHECK_STR(text.text, "echoes of the questions");
    depth_oddities_text(MODBUS_STRAY_BEFORE | MODBUS_STRAY_BEHIND | MODBUS_QUESTION_ECHOED, &text);
    CHECK_STR(text.text, "stray bytes before answers, stray bytes behind answers, echoes of the questions");
}

int main(void)
{
    RUN(the_depth_is_that_of_the_vehicle);
    RUN(a_lie_is_counted_and_goes_no_farther);
    RUN(failures_in_a_row_are_silence_and_one_answer_ends_it);
    RUN(a_link_that_comes_back_is_counted);
    RUN(a_depth_is_of_the_middle_between_question_and_answer);
    RUN(a_line_that_answers_nothing_for_10_s_is_opened_anew);
    RUN(whatever_a_sensor_answers_it_is_there);
    RUN(what_is_skipped_is_named);
    return test_end();
}
