/* SPDX-License-Identifier: MIT */
/*
 * fuzz_client - any bytes as what a daemon says: libsonard hands out JSON or a refusal and ends with the connection, a
 * typed answer is of a state that exists, and `sonarctl top` draws whatever it was.
 */
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "client/lib/sonard.h"
#include "client/ctl/top_view.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static char path[64];

static void must(bool fact)
{
    if (!fact)
        abort();
}

static void leave(void)
{
    unlink(path);
}

static int listen_here(void)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
    snprintf(path, sizeof path, "/tmp/sonard-fuzz-%d.sock", (int)getpid());
    strcpy(address.sun_path, path);
    unlink(path);
    must(bind(listener, (struct sockaddr *)&address, sizeof address) == 0 && listen(listener, 8) == 0);
    atexit(leave);
    return listener;
}

static void read_all(const char *json)
{
    static struct sonard_sectors sectors;
    struct sonard_blocked blocked;
    struct sonard_limit limit;
    struct sonard_collision collision;
    must(sonard_read_blocked(json, &blocked) || blocked.state == SONARD_UNKNOWN);
    must(blocked.state <= SONARD_CLEAR && memchr(blocked.reason, '\0', sizeof blocked.reason));
    must(sonard_read_limit(json, &limit) || limit.speed_mps == 0);
    must(sonard_read_collision(json, &collision) || collision.state == SONARD_UNKNOWN);
    must(sonard_read_sectors(json, &sectors) == (sectors.count > 0) && sectors.count <= SONARD_SECTORS_MAX);
}

static void draw(const json_t *answer)
{
    static struct canvas canvas;
    static struct top_rates rates;
    const struct top_frame frame = {.sectors = answer, .status = answer, .stats = answer, .rates = &rates};
    top_rates_take(&rates, answer);
    canvas_clear(&canvas, 80, 24);
    top_view_draw(&canvas, &frame);
}

static void take(const struct sonard_message *message)
{
    json_t *answer = message->json ? json_loads(message->json, JSON_DECODE_ANY, NULL) : NULL;
    must((message->refusal.status == SONARD_REFUSED) == !message->json &&
         (message->id == 0 || message->watch == 0));
    if (message->json) {
        must(answer && !strchr(message->json, '\n'));
        read_all(message->json);
        draw(answer);
    }
    json_decref(answer);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static int listener = -1;
    struct sonard_error error;
    struct sonard_message message;
    listener = listener < 0 ? listen_here() : listener;
    struct sonard_client *client = sonard_connect(path, 10, &error);
    must(client != NULL);
    const int fd = accept(listener, NULL, NULL);
    must(size == 0 || send(fd, data, size, MSG_DONTWAIT) == (ssize_t)size);
    shutdown(fd, SHUT_WR);
    if (size > 0 && data[0] == ' ') /* what is kept while a call waits */
        sonard_call(client, "m", NULL, &error);
    while (sonard_take(client, 10, &message, &error))
        take(&message);
    must(error.status == SONARD_LOST);
    sonard_disconnect(client);
    close(fd);
    return 0;
}
