/* SPDX-License-Identifier: MIT */
/*
 * test_pins - leak probe, sonar power and trigger on a GPIO chip that the test owns, on a clock that the test moves.
 */
#include <unistd.h>

#include "core/fault.h"
#include "daemon/input/leak.h"
#include "core/log.h"
#include "daemon/input/power.h"
#include "daemon/input/trigger.h"
#include "tests/lib/test.h"

#define MS 1000000ull
#define S  (1000 * MS)

/* ---- the chip: one line, edges through a pipe ---- */

static struct {
    bool there, busy, open;
    int level, opens;
    bool initial;
    int pipe[2];
} chip;

static bool fake_available(struct fault *fault)
{
    (void)fault;
    return true;
}

static bool fake_open(struct gpio_line *line, const struct gpio_want *want, struct fault *fault)
{
    *line = (struct gpio_line){.fd = -1};
    if (!chip.there || chip.busy)
        return fault_set(fault, chip.busy ? "in use by 'other'" : "no such chip");
    if (want->output)
        chip.level = chip.initial = want->value;
    else
        line->fd = chip.pipe[0];
    chip.open = true;
    chip.opens++;
    return true;
}

static int fake_get(const struct gpio_line *line)
{
    (void)line;
    return chip.there ? chip.level : -1;
}

static bool fake_set(const struct gpio_line *line, bool on)
{
    (void)line;
    if (chip.there)
        chip.level = on;
    return chip.there;
}

static int fake_edges(const struct gpio_line *line, struct gpio_edge edges[GPIO_EDGES_MAX])
{
    ssize_t n = read(line->fd, edges, GPIO_EDGES_MAX * sizeof edges[0]);
    return n > 0 ? (int)((size_t)n / sizeof edges[0]) : 0;
}

static void fake_close(struct gpio_line *line)
{
    chip.open = false;
    line->fd = -1;
}

static const struct gpio_ops fake = {"fake",   fake_available, fake_open, fake_get,
                                     fake_set, fake_edges,     fake_close};

static struct loop *loop;

static void begin(int level)
{
    log_set_level(LOG_ERR);
    if (chip.pipe[1]) {
        close(chip.pipe[0]);
        close(chip.pipe[1]);
    }
    memset(&chip, 0, sizeof chip);
    chip.there = true;
    chip.level = level;
    CHECK(pipe(chip.pipe) == 0);
    loop = loop_new(true);
    loop_advance(loop, 1 * S); /* long before now, however lately this machine was started */
}

/* The level changes, and the kernel tells. */
static void edge(int level)
{
    struct gpio_edge e = {loop_now(loop), level > 0};
    chip.level = level;
    CHECK(write(chip.pipe[1], &e, sizeof e) == sizeof e);
    loop_turn(loop, 0);
}

static void pass(uint64_t ns)
{
    loop_advance(loop, loop_now(loop) + ns);
}

/* ---- leak ---- */

static int told;

static void count(void *ctx)
{
    (void)ctx;
    told++;
}

static struct conf_gpio leak_conf(void)
{
    struct conf conf;
    conf_defaults(&conf);
    snprintf(conf.gpio.leak, sizeof conf.gpio.leak, "leak");
    return conf.gpio;
}

static struct leak leak;

static void start_leak(int level)
{
    struct conf_gpio conf = leak_conf();
    begin(level);
    told = 0;
    leak_start(&leak, loop, &fake, &conf, count, NULL);
}

static void stop_leak(void)
{
    leak_stop(&leak);
    CHECK(!chip.open);
    loop_free(loop);
}

TEST(a_leak_that_holds_is_told_once)
{
    start_leak(0);
    CHECK_INT(leak.state, LEAK_DRY);
    edge(1);
    CHECK_INT(leak.state, LEAK_DRY);
    pass(LEAK_HOLD_NS);
    CHECK_INT(leak.state, LEAK_WET);
    pass(10 * S);
    CHECK_INT(leak.alarms, 1);
    CHECK_INT(told, 2); /* dry at the start, and wet */
    stop_leak();
}

TEST(a_leak_before_the_start_is_seen)
{
    start_leak(1);
    CHECK_INT(leak.state, LEAK_WET);
    CHECK_INT(leak.alarms, 1);
    stop_leak();
}

TEST(bouncing_is_no_leak)
{
    start_leak(0);
    for (int i = 0; i < 20; i++) {
        edge(1 - i % 2);
        pass(LEAK_HOLD_NS / 2);
    }
    pass(LEAK_HOLD_NS);
    CHECK_INT(leak.state, LEAK_DRY);
    CHECK_INT(leak.alarms, 0);
    stop_leak();
}

TEST(an_edge_that_got_lost_is_found_by_asking)
{
    start_leak(0);
    chip.level = 1;
    pass(PIN_ASK_NS + LEAK_HOLD_NS);
    CHECK_INT(leak.state, LEAK_WET);
    stop_leak();
}

TEST(a_chip_that_vanishes_is_noticed_and_taken_back)
{
    start_leak(0);
    chip.there = false;
    pass(PIN_ASK_NS);
    CHECK_INT(leak.state, LEAK_UNKNOWN);
    CHECK(leak.pin.error.text[0]);
    chip.there = true;
    pass(PIN_ASK_NS);
    CHECK_INT(leak.state, LEAK_DRY);
    CHECK_STR(leak.pin.error.text, "");
    stop_leak();
}

TEST(a_busy_line_is_tried_again)
{
    struct conf_gpio conf = leak_conf();
    begin(0);
    chip.busy = true;
    leak_start(&leak, loop, &fake, &conf, count, NULL);
    CHECK_STR(leak.pin.error.text, "in use by 'other'");
    CHECK_INT(leak.state, LEAK_UNKNOWN);
    chip.busy = false;
    pass(PIN_ASK_NS);
    CHECK_INT(leak.state, LEAK_DRY);
    stop_leak();
}

/* ---- power ---- */

static uint64_t last_ping;

static uint64_t get_last_ping(void *ctx)
{
    (void)ctx;
    return last_ping;
}

static struct power power;

static void start_power(double cycle_after_s, int at_stop)
{
    struct conf_sonar conf = {
        .name = "front", .power = "power", .power_cycle_after_s = cycle_after_s, .power_at_stop = at_stop};
    begin(0);
    last_ping = 0;
    power_start(&power, &(struct pin_chip){loop, &fake, ""}, &conf, get_last_ping, NULL);
}

TEST(power_is_on_from_the_start_and_as_configured_at_the_end)
{
    for (int at_stop = CONF_ON; at_stop <= CONF_OFF; at_stop++) {
        start_power(0, at_stop);
        CHECK(chip.initial);
        pass(1000 * S);
        CHECK_INT(chip.level, 1);
        CHECK_INT(power.cycles, 0);
        power_stop(&power);
        CHECK_INT(chip.level, at_stop == CONF_ON);
        CHECK(!chip.open);
        loop_free(loop);
    }
}

TEST(a_silent_sonar_is_switched_off_and_on)
{
    start_power(30, CONF_OFF);
    pass(20 * S);
    last_ping = loop_now(loop);
    pass(29 * S);
    CHECK_INT(chip.level, 1);
    pass(2 * S);
    CHECK_INT(chip.level, 0);
    pass(POWER_OFF_NS);
    CHECK_INT(chip.level, 1);
    pass(29 * S); /* to boot */
    CHECK_INT(chip.level, 1);
    CHECK_INT(power.cycles, 1);
    pass(2 * S);
    CHECK_INT(power.cycles, 2);
    power_stop(&power);
    loop_free(loop);
}

TEST(a_chip_that_is_back_gets_the_level_again)
{
    start_power(0, CONF_OFF);
    chip.there = false;
    pass(PIN_ASK_NS);
    CHECK(!power.pin.open);
    chip.there = true;
    chip.level = 0;
    pass(PIN_ASK_NS);
    CHECK_INT(chip.level, 1);
    power_stop(&power);
    loop_free(loop);
}

/* ---- trigger ---- */

static struct trigger trigger;
static uint64_t recorded;

static void record(void *ctx, struct trigger *t, uint64_t t_ns)
{
    (void)ctx, (void)t;
    recorded = t_ns;
}

static void start_trigger(int which)
{
    struct conf_sonar conf = {.name = "front", .trigger_edge = which};
    begin(0);
    trigger_init(&trigger, &conf, 1500);
    trigger_start(&trigger, &(struct pin_chip){loop, &fake, ""}, "trigger", record, NULL);
}

/* A ping heard for 20 ms (15 m), whose last byte came in at t_in. */
static uint64_t time_of(uint64_t t_in_ns)
{
    struct ping ping = {.t_ns = t_in_ns - 77 * MS, .t_in_ns = t_in_ns, .n_bins = 1000, .dr_m = 0.015f};
    return trigger_time(&trigger, &ping);
}

static void stop_trigger(void)
{
    trigger_stop(&trigger);
    loop_free(loop);
}

TEST(a_ping_takes_the_time_of_its_edge)
{
    start_trigger(CONF_RISING);
    uint64_t t = loop_now(loop);
    edge(1);
    CHECK_INT(recorded, t);
    pass(1 * MS);
    edge(0); /* the other edge is nothing */
    CHECK_INT(time_of(t + 60 * MS), t);
    CHECK_INT(time_of(t + 120 * MS), t + 43 * MS); /* an edge serves one ping */
    CHECK_INT(trigger.used, 1);
    CHECK_INT(trigger.not_used, 1);
    stop_trigger();
}

TEST(the_edge_of_the_next_ping_is_not_taken)
{
    start_trigger(CONF_RISING);
    uint64_t t = loop_now(loop);
    trigger_edge(&trigger, t);
    trigger_edge(&trigger, t + 50 * MS); /* transmitted before the data of the first had come in */
    CHECK_INT(time_of(t + 60 * MS), t);
    CHECK_INT(time_of(t + 110 * MS), t + 50 * MS);
    stop_trigger();
}

TEST(an_edge_since_the_turn_began_counts_and_one_of_the_future_does_not)
{
    start_trigger(CONF_RISING);
    struct gpio_edge e = {loop_now(loop) + 3 * MS, true};
    CHECK(write(chip.pipe[1], &e, sizeof e) == sizeof e);
    loop_turn(loop, 0);
    CHECK_INT(recorded, e.t_ns);
    e.t_ns = loop_clock() + 1000 * S;
    CHECK(write(chip.pipe[1], &e, sizeof e) == sizeof e);
    loop_turn(loop, 0);
    CHECK_INT(trigger.edges, 1);
    stop_trigger();
}

TEST(an_edge_that_is_too_old_is_not_taken)
{
    start_trigger(CONF_RISING);
    uint64_t t = loop_now(loop);
    trigger_edge(&trigger, t);
    CHECK_INT(time_of(t + 2 * S), t + 2 * S - 77 * MS);
    stop_trigger();
}

TEST(a_falling_edge_can_be_the_trigger)
{
    start_trigger(CONF_FALLING);
    edge(1);
    CHECK_INT(trigger.edges, 0);
    edge(0);
    CHECK_INT(trigger.edges, 1);
    stop_trigger();
}

TEST(edges_without_pings_do_not_pile_up)
{
    start_trigger(CONF_RISING);
    uint64_t t = loop_now(loop);
    for (uint64_t i = 0; i < 1000; i++)
        trigger_edge(&trigger, t + i * 100 * MS);
    CHECK_INT(trigger.n, TRIGGER_EDGES);
    CHECK_INT(time_of(t + 99940 * MS), t + 99900 * MS);
    stop_trigger();
}

int main(void)
{
    RUN(a_leak_that_holds_is_told_once);
    RUN(a_leak_before_the_start_is_seen);
    RUN(bouncing_is_no_leak);
    RUN(an_edge_that_got_lost_is_found_by_asking);
    RUN(a_chip_that_vanishes_is_noticed_and_taken_back);
    RUN(a_busy_line_is_tried_again);
    RUN(power_is_on_from_the_start_and_as_configured_at_the_end);
    RUN(a_silent_sonar_is_switched_off_and_on);
    RUN(a_chip_that_is_back_gets_the_level_again);
    RUN(a_ping_takes_the_time_of_its_edge);
    RUN(the_edge_of_the_next_ping_is_not_taken);
    RUN(an_edge_since_the_turn_began_counts_and_one_of_the_future_does_not);
    RUN(an_edge_that_is_too_old_is_not_taken);
    RUN(a_falling_edge_can_be_the_trigger);
    RUN(edges_without_pings_do_not_pile_up);
    return test_end();
}
