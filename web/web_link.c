/* SPDX-License-Identifier: MIT */
#include "web_link.h"

#include <poll.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "client/lib/sonard_json.h"

#define CHECK_US   1000000 /* between attempts to connect, and looks for a daemon that is silent */
#define SILENCE_US 5000000 /* a request that waits for so long means that the daemon hangs */

static uint64_t cpu_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (uint64_t)t.tv_sec * 1000000 + (uint64_t)t.tv_nsec / 1000;
}

static void answer(struct web_request *request, const struct web_answer *given)
{
    web_answer_fn *done = request->done;
    void *ctx = request->ctx;
    *request = (struct web_request){0};
    if (done)
        done(ctx, given);
}

static void fail_all(struct web_link *link)
{
    const struct web_answer lost = {.message = link->error.message};
    for (size_t i = 0; i < WEB_LINK_WAITING_MAX; i++)
        if (link->waiting[i].id)
            answer(&link->waiting[i], &lost);
}

/* link->error says why. */
static void lose_daemon(struct web_link *link)
{
    sonard_disconnect(link->client);
    link->client = NULL;
    if (link->wsi) {
        lws_set_opaque_user_data(link->wsi, NULL);
        lws_set_timeout(link->wsi, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
        link->wsi = NULL;
    }
    fail_all(link);
    if (link->changed)
        link->changed(link->ctx);
}

static void connect_now(struct web_link *link)
{
    lws_sock_file_fd_type fd;
    link->client = sonard_connect(link->path, 0, &link->error);
    if (!link->client)
        return;
    fd.filefd = dup(sonard_fd(link->client)); /* the loop closes what it is given, and so does libsonard */
    if (fd.filefd >= 0)
        link->wsi =
            lws_adopt_descriptor_vhost(link->vhost, LWS_ADOPT_RAW_FILE_DESC, fd, web_link_protocol.name, NULL);
    if (!link->wsi) {
        snprintf(link->error.message, sizeof link->error.message, "no descriptor left for the daemon");
        lose_daemon(link);
        return;
    }
    lws_set_opaque_user_data(link->wsi, link);
    if (link->changed)
        link->changed(link->ctx);
}

static bool is_silent(const struct web_link *link)
{
    const uint64_t now_us = (uint64_t)lws_now_usecs();
    for (size_t i = 0; i < WEB_LINK_WAITING_MAX; i++)
        if (link->waiting[i].id && now_us - link->waiting[i].sent_us > SILENCE_US)
            return true;
    return false;
}

static void check(lws_sorted_usec_list_t *timer)
{
    struct web_link *link = lws_container_of(timer, struct web_link, timer);
    if (link->client && is_silent(link)) {
        snprintf(link->error.message, sizeof link->error.message, "the daemon has not answered for %d s",
                 SILENCE_US / 1000000);
        lose_daemon(link);
    } else if (!link->client) {
        connect_now(link);
    }
    lws_sul_schedule(link->context, 0, timer, check, CHECK_US);
}

static void take_all(struct web_link *link)
{
    struct sonard_message message;
    json_t *result;
    for (;;) {
        const uint64_t start_us = cpu_us();
        if (!link->client)
            return;
        if (!sonard_json_take(link->client, 0, &message, &result, &link->error))
            break;

        const struct web_answer given = {.result = result,
                                         .rpc_code = message.refusal.rpc_code,
                                         .message = message.refusal.message,
                                         .cpu_us = cpu_us() - start_us};
        for (size_t i = 0; i < WEB_LINK_WAITING_MAX; i++) {
            if (link->waiting[i].id && link->waiting[i].id == message.id) {
                answer(&link->waiting[i], &given);
                break;
            }
        }
        json_decref(result);
    }
    if (link->error.status != SONARD_SILENT)
        lose_daemon(link);
    else if (sonard_events(link->client) & POLLOUT)
        lws_callback_on_writable(link->wsi);
}

static int callback(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t n)
{
    struct web_link *link;
    (void)user, (void)in, (void)n;
    if (reason != LWS_CALLBACK_RAW_RX_FILE && reason != LWS_CALLBACK_RAW_WRITEABLE_FILE &&
        reason != LWS_CALLBACK_RAW_CLOSE_FILE)
        return 0;
    link = lws_get_opaque_user_data(wsi);
    if (!link)
        return reason == LWS_CALLBACK_RAW_CLOSE_FILE ? 0 : -1;
    if (reason == LWS_CALLBACK_RAW_CLOSE_FILE) {
        link->wsi = NULL;
        if (link->client) {
            snprintf(link->error.message, sizeof link->error.message, "the daemon ended the connection");
            lose_daemon(link);
        }
        return 0;
    }
    take_all(link);
    return link->wsi == wsi ? 0 : -1;
}

const struct lws_protocols web_link_protocol = {.name = "sonard-daemon", .callback = callback};

void web_link_start(struct web_link *link)
{
    snprintf(link->error.message, sizeof link->error.message, "not connected to the daemon yet");
    lws_sul_schedule(link->context, 0, &link->timer, check, 1);
}

void web_link_stop(struct web_link *link)
{
    lws_sul_cancel(&link->timer);
    link->changed = NULL;
    lose_daemon(link);
}

bool web_link_ask(struct web_link *link, const char *method, json_t *params, web_answer_fn *done, void *ctx)
{
    struct web_request *request = NULL;
    for (size_t i = 0; i < WEB_LINK_WAITING_MAX && !request; i++)
        request = link->waiting[i].id ? NULL : &link->waiting[i];
    if (!link->client || !request)
        return false;
    *request = (struct web_request){
        .id = sonard_json_send(link->client, method, params, &link->error),
        .sent_us = (uint64_t)lws_now_usecs(),
        .done = done,
        .ctx = ctx,
    };
    if (!request->id) {
        *request = (struct web_request){0};
        return false;
    }
    if (sonard_events(link->client) & POLLOUT)
        lws_callback_on_writable(link->wsi);
    return true;
}

void web_link_cancel(struct web_link *link, const void *ctx)
{
    for (size_t i = 0; i < WEB_LINK_WAITING_MAX; i++)
        if (link->waiting[i].ctx == ctx)
            link->waiting[i].done = NULL;
}

const char *web_link_state(const struct web_link *link)
{
    return link->client ? NULL : link->error.message;
}
