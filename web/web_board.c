/* SPDX-License-Identifier: MIT */
#include "web_board.h"

#include <stdlib.h>
#include <string.h>

#include "web_query.h"

#define TURN_US    20000 /* between looks for what is due */
#define CPU_SHARE  60    /* reading the answers of one method takes at most this part of a processor */
#define USUAL_US   2000000
#define REFUSED_US 2000000
#define SPARE_S    0.5

/* How often what changes faster than usual is asked. */
static const struct {
    const char *method;
    uint64_t period_us;
} periods[] = {{"image", 80000},       {"sectors", 200000},           {"status", 500000},
               {"limit", 200000},      {"time_to_collision", 500000}, {"nearest", 500000},
               {"map_slice", 1000000}, {"clusters", 1000000},         {"plan", 10000000}};

static uint64_t period_us(const char *method)
{
    for (size_t i = 0; i < sizeof periods / sizeof *periods; i++)
        if (strcmp(periods[i].method, method) == 0)
            return periods[i].period_us;
    return USUAL_US;
}

static void set_text(struct web_channel *channel, json_t *message)
{
    char *text = message ? json_dumps(message, JSON_COMPACT | JSON_REAL_PRECISION(15)) : NULL;
    const size_t size = text ? strlen(text) : 0;
    char *padded = text ? malloc(LWS_PRE + size) : NULL;
    if (padded) {
        memcpy(padded + LWS_PRE, text, size);
        free(channel->text);
        channel->text = padded;
        channel->size = size;
        channel->version++;
    }
    free(text);
    json_decref(message);
}

static void set_result(struct web_channel *channel, json_t *result)
{
    json_incref(result);
    json_decref(channel->result);
    channel->result = result;
}

static void refuse(struct web_channel *channel, int code, const char *message)
{
    set_result(channel, NULL);
    set_text(channel, json_pack("{s:s, s:O, s:{s:i, s:s}}", "method", channel->method, "params", channel->params,
                                "error", "code", code, "message", message));
}

/* The rows since the last answer, with some to spare; all of them when some may have been missed. */
static json_t *image_params(struct web_channel *channel, uint64_t now_us)
{
    json_t *params = json_copy(channel->params);
    channel->newer_s = channel->whole ? 0 : SPARE_S + (double)(now_us - channel->asked_us) * 1e-6;
    if (channel->newer_s > 0)
        json_object_set_new(params, "newer_s", json_real(channel->newer_s));
    channel->asked_us = now_us;
    return params;
}

/* A replay's clock may run ahead of ours. */
static void take_rows(struct web_channel *channel, const json_t *image)
{
    const double before = channel->rows->t_unix;
    view_rows_take(channel->rows, image);
    channel->whole = channel->newer_s > 0 && !(channel->rows->t_unix - before < channel->newer_s);
    channel->version++;
}

static void take_answer(void *ctx, const struct web_answer *answer)
{
    struct web_channel *channel = ctx;
    const uint64_t now_us = (uint64_t)lws_now_usecs();
    uint64_t wait_us = period_us(channel->method);
    channel->asked = false;
    if (!answer->result && answer->rpc_code == 0)
        return; /* lost: web_board_reset follows */
    if (!answer->result) {
        refuse(channel, answer->rpc_code, answer->message);
        wait_us = wait_us > REFUSED_US ? wait_us : REFUSED_US;
    } else if (channel->rows) {
        take_rows(channel, answer->result);
    } else {
        set_result(channel, answer->result);
        set_text(channel, json_pack("{s:s, s:O, s:O}", "method", channel->method, "params", channel->params,
                                    "result", answer->result));
    }
    /* the answer was long in coming? then its turn began when it was asked; but reading it must not take over */
    channel->due_us += wait_us;
    if (channel->due_us < now_us + CPU_SHARE * answer->cpu_us)
        channel->due_us = now_us + CPU_SHARE * answer->cpu_us;
    channel->board->news(channel->board->ctx, channel);
}

static void on_turn(lws_sorted_usec_list_t *timer)
{
    struct web_board *board = lws_container_of(timer, struct web_board, timer);
    const uint64_t now_us = (uint64_t)lws_now_usecs();
    bool used = false;
    for (size_t i = 0; i < WEB_BOARD_CHANNELS; i++) {
        struct web_channel *channel = &board->channel[i];
        used = used || channel->method;
        if (!channel->method || channel->asked || channel->due_us > now_us)
            continue;
        channel->due_us = now_us;

        json_t *params = channel->rows ? image_params(channel, now_us) : json_incref(channel->params);

        channel->asked = web_link_ask(board->link, channel->method, params, take_answer, channel);
        json_decref(params);
    }
    if (used)
        lws_sul_schedule(board->link->context, 0, timer, on_turn, TURN_US);
}

struct web_channel *web_board_open(struct web_board *board, const char *method, json_t *params)
{
    const struct protocol_method *row = web_query_method(method);
    struct web_channel *free_one = NULL;
    for (size_t i = 0; i < WEB_BOARD_CHANNELS; i++) {
        struct web_channel *channel = &board->channel[i];
        if (!channel->method) {
            free_one = free_one ? free_one : channel;
        } else if (strcmp(channel->method, method) == 0 && json_equal(channel->params, params)) {
            channel->users++;
            return channel;
        }
    }
    if (!row || !free_one)
        return NULL;
    *free_one = (struct web_channel){.params = json_incref(params), .users = 1, .whole = true, .board = board};
    if (strcmp(method, "image") == 0 && !(free_one->rows = calloc(1, sizeof *free_one->rows))) {
        json_decref(free_one->params);
        return NULL;
    }
    free_one->method = row->name;
    lws_sul_schedule(board->link->context, 0, &board->timer, on_turn, 1);
    return free_one;
}

void web_board_close(struct web_channel *channel)
{
    if (--channel->users > 0)
        return;
    web_link_cancel(channel->board->link, channel);
    json_decref(channel->params);
    json_decref(channel->result);
    free(channel->text);
    free(channel->rows);
    *channel = (struct web_channel){0};
}

void web_board_reset(struct web_board *board)
{
    for (size_t i = 0; i < WEB_BOARD_CHANNELS; i++) {
        struct web_channel *channel = &board->channel[i];
        if (!channel->method)
            continue;
        channel->asked = false;
        channel->due_us = 0;
        channel->version = 0;
        set_result(channel, NULL);
        free(channel->text);
        channel->text = NULL;
        channel->whole = true;
        if (channel->rows)
            view_rows_forget(channel->rows);
    }
}

void web_board_stop(struct web_board *board)
{
    lws_sul_cancel(&board->timer);
}
