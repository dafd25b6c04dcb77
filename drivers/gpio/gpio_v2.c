/* SPDX-License-Identifier: MIT */
/* gpio_v2 - GPIO lines through libgpiod 2.x (Debian 13). */
#include "gpio.h"

#if SONARD_GPIOD == 2

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <gpiod.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"

static bool v2_available(struct fault *fault)
{
    (void)fault;
    return true;
}

static bool is_wanted(struct gpiod_chip *chip, const char *wanted)
{
    struct gpiod_chip_info *info = gpiod_chip_get_info(chip);
    bool is = info && (!wanted[0] || strcmp(gpiod_chip_info_get_label(info), wanted) == 0 ||
                       strcmp(gpiod_chip_info_get_name(info), wanted) == 0);
    if (info)
        gpiod_chip_info_free(info);
    return is;
}

/* The first wanted chip that has the line, or NULL with the reason. */
static struct gpiod_chip *find_line(const struct gpio_want *want, unsigned *offset, const char **why)
{
    struct gpiod_chip *chip = NULL;
    DIR *dev = opendir("/dev");
    *why = want->chip[0] ? "no such chip" : "no line of that name; gpioinfo lists the lines";
    for (struct dirent *e = NULL; dev && !chip && (e = readdir(dev));) {
        char path[300];
        if (strncmp(e->d_name, "gpiochip", 8) != 0)
            continue;
        snprintf(path, sizeof path, "/dev/%s", e->d_name);
        chip = gpiod_chip_open(path);
        int at = -1;
        if (chip && is_wanted(chip, want->chip)) {
            *why = "no line of that name; gpioinfo lists the lines";
            at = gpiod_chip_get_line_offset_from_name(chip, want->line);
        }
        if (chip && at < 0) {
            gpiod_chip_close(chip);
            chip = NULL;
        }
        *offset = (unsigned)at;
    }
    if (dev)
        closedir(dev);
    return chip;
}

static struct gpiod_line_settings *settings(const struct gpio_want *want)
{
    static const enum gpiod_line_bias bias[] = {[GPIO_AS_IS] = GPIOD_LINE_BIAS_AS_IS,
                                                [GPIO_PULL_UP] = GPIOD_LINE_BIAS_PULL_UP,
                                                [GPIO_PULL_DOWN] = GPIOD_LINE_BIAS_PULL_DOWN};
    struct gpiod_line_settings *s = gpiod_line_settings_new();
    if (!s)
        return NULL;
    gpiod_line_settings_set_active_low(s, want->active_low);
    if (want->output) {
        gpiod_line_settings_set_direction(s, GPIOD_LINE_DIRECTION_OUTPUT);
        gpiod_line_settings_set_output_value(s, want->value ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
    } else {
        gpiod_line_settings_set_direction(s, GPIOD_LINE_DIRECTION_INPUT);
        gpiod_line_settings_set_edge_detection(s, GPIOD_LINE_EDGE_BOTH);
        gpiod_line_settings_set_bias(s, bias[want->bias]);
        gpiod_line_settings_set_event_clock(s, GPIOD_LINE_CLOCK_MONOTONIC);
    }
    return s;
}

static struct gpiod_line_request *request(struct gpiod_chip *chip, unsigned offset, const struct gpio_want *want)
{
    struct gpiod_line_settings *s = settings(want);
    struct gpiod_line_config *lines = gpiod_line_config_new();
    struct gpiod_request_config *conf = gpiod_request_config_new();
    struct gpiod_line_request *r = NULL;
    if (s && lines && conf && gpiod_line_config_add_line_settings(lines, &offset, 1, s) == 0) {
        gpiod_request_config_set_consumer(conf, "sonard");
        r = gpiod_chip_request_lines(chip, conf, lines);
    }
    int cause = errno;
    gpiod_line_settings_free(s);
    gpiod_line_config_free(lines);
    gpiod_request_config_free(conf);
    errno = cause;
    return r;
}

static void describe_line(struct gpiod_chip *chip, unsigned offset, int cause, char *text, size_t size)
{
    struct gpiod_line_info *info = cause == EBUSY ? gpiod_chip_get_line_info(chip, offset) : NULL;
    const char *who = info ? gpiod_line_info_get_consumer(info) : NULL;
    if (who)
        snprintf(text, size, "in use by '%.40s'", who);
    else
        snprintf(text, size, "%s", cause == EBUSY ? "in use by another program" : strerror(cause));
    if (info)
        gpiod_line_info_free(info);
}

static void v2_close(struct gpio_line *line)
{
    if (line->events)
        gpiod_edge_event_buffer_free(line->events);
    if (line->request)
        gpiod_line_request_release(line->request);
    *line = (struct gpio_line){.fd = -1};
}

static bool v2_open(struct gpio_line *line, const struct gpio_want *want, struct fault *fault)
{
    char text[96];
    const char *why = text;
    *line = (struct gpio_line){.fd = -1};
    struct gpiod_chip *chip = find_line(want, &line->offset, &why);
    if (chip) {
        line->request = request(chip, line->offset, want);
        describe_line(chip, line->offset, errno, text, sizeof text);
        why = text;
        gpiod_chip_close(chip); /* the request lives on */
    }
    if (line->request && !want->output) {
        line->events = gpiod_edge_event_buffer_new(GPIO_EDGES_MAX);
        line->fd = gpiod_line_request_get_fd(line->request);
        fcntl(line->fd, F_SETFL, fcntl(line->fd, F_GETFL) | O_NONBLOCK);
    }
    if (line->request && (want->output || line->events))
        return true;
    v2_close(line);
    return fault_set(fault, "line '%s' of %s%s: %s", want->line, want->chip[0] ? "chip " : "any chip", want->chip,
                     why);
}

static int v2_get(const struct gpio_line *line)
{
    return (int)gpiod_line_request_get_value(line->request, line->offset);
}

static bool v2_set(const struct gpio_line *line, bool on)
{
    return gpiod_line_request_set_value(line->request, line->offset,
                                        on ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE) == 0;
}

static int v2_edges(const struct gpio_line *line, struct gpio_edge edges[GPIO_EDGES_MAX])
{
    int n = gpiod_line_request_read_edge_events(line->request, line->events, GPIO_EDGES_MAX);
    for (int i = 0; i < n; i++) {
        struct gpiod_edge_event *e = gpiod_edge_event_buffer_get_event(line->events, (unsigned long)i);
        edges[i] = (struct gpio_edge){gpiod_edge_event_get_timestamp_ns(e),
                                      gpiod_edge_event_get_event_type(e) == GPIOD_EDGE_EVENT_RISING_EDGE};
    }
    return n > 0 ? n : 0;
}

const struct gpio_ops gpio_library = {.library = "libgpiod 2",
                                      .available = v2_available,
                                      .open = v2_open,
                                      .get = v2_get,
                                      .set = v2_set,
                                      .edges = v2_edges,
                                      .close = v2_close};

#endif
