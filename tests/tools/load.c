/* SPDX-License-Identifier: MIT */
/*
 * load - two hundred clients on a sonard whose picture stands still (a replay that has ended):
 *
 *   load SOCKET SECONDS    questions from standard input, one line each
 *
 * A single plain client asks every question twice first. What it was told is what everybody must be told, byte for
 * byte. Then ask at once: polite clients, one question at a time; floods of sixteen; readers of a few bytes at a time;
 * those that never read; those that send half a line and go. Prints one line of KEY=VALUE;
 * exit status 1: an answer was wrong.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define CLIENTS       200
#define QUESTIONS_MAX 64
#define FLOOD         16
#define SIPS_PER_S    200 /* of a slow reader */
#define SIP_BYTES     64
#define AWAY_NS       50000000u /* how long a rude client keeps a connection */

struct text {
    char *bytes;
    size_t size;
};

struct question {
    struct text line, answer;
};

enum kind { POLITE, FLOODS, SLOW, DEAF, HALF, KINDS };
static const int share[KINDS] = {[POLITE] = 150, [FLOODS] = 20, [SLOW] = 10, [DEAF] = 10, [HALF] = 10};

struct client {
    enum kind kind;
    int fd;
    unsigned asked[FLOOD], n_asked, n_answered; /* questions on their way */
    size_t matched;                             /* bytes of the answer due that have come */
    uint64_t since_ns;
};

static struct question question[QUESTIONS_MAX];
static unsigned n_questions;
static uint64_t answers, wrong, comes;
static uint32_t waited_us[1 << 22];
static size_t n_waited;
static uint64_t seed = 1;

static uint64_t clock_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static unsigned any(unsigned n)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (unsigned)(seed >> 33) % n;
}

__attribute__((noreturn)) static void die(const char *what)
{
    fprintf(stderr, "load: %s: %s\n", what, strerror(errno));
    exit(2);
}

static int come(const char *path)
{
    struct sockaddr_un to = {.sun_family = AF_UNIX};
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    snprintf(to.sun_path, sizeof to.sun_path, "%s", path);
    if (fd < 0 || connect(fd, (const struct sockaddr *)&to, sizeof to) != 0)
        die(path);
    comes++;
    return fd;
}

/* ---- the plain client ---- */

static struct text ask(FILE *to, FILE *from, const struct text *line)
{
    struct text answer = {NULL, 0};
    size_t room = 0;
    fwrite(line->bytes, 1, line->size, to);
    fflush(to);
    const ssize_t n = getline(&answer.bytes, &room, from);
    if (n <= 0)
        die("the plain client is not answered");
    answer.size = (size_t)n;
    return answer;
}

static void ask_all(const char *path)
{
    const int fd = come(path);
    FILE *to = fdopen(fd, "w"), *from = fdopen(dup(fd), "r");
    size_t room;
    ssize_t n;
    for (; n_questions < QUESTIONS_MAX; n_questions++) {
        struct question *q = &question[n_questions];
        room = 0;
        if ((n = getline(&q->line.bytes, &room, stdin)) <= 0)
            break;
        q->line.size = (size_t)n;
        q->answer = ask(to, from, &q->line);
    }
    for (unsigned i = 0; i < n_questions; i++) {
        struct text again = ask(to, from, &question[i].line);
        if (again.size != question[i].answer.size ||
            memcmp(again.bytes, question[i].answer.bytes, again.size) != 0) {
            fprintf(stderr, "load: the picture moves: %sfirst %sthen  %s", question[i].line.bytes,
                    question[i].answer.bytes, again.bytes);
            exit(2);
        }
        free(again.bytes);
    }
    fclose(to);
    fclose(from);
}

/* ---- the crowd ---- */

/* As many questions at once as its kind asks. What a deaf one cannot send stays unsent. */
static void send_questions(struct client *c)
{
    const unsigned n = c->kind == POLITE ? 1 : FLOOD;
    c->n_asked = c->n_answered = 0;
    c->since_ns = clock_ns();
    for (unsigned i = 0; i < n; i++) {
        const unsigned which = any(n_questions);
        const struct text *line = &question[which].line;
        if (send(c->fd, line->bytes, line->size, MSG_NOSIGNAL | (c->kind == DEAF ? MSG_DONTWAIT : 0)) !=
            (ssize_t)line->size)
            break;
        c->asked[c->n_asked++] = which;
    }
}

static void begin(struct client *c, const char *path, int epoll)
{
    struct epoll_event wanted = {.events = EPOLLIN, .data.ptr = c};
    c->fd = come(path);
    c->matched = 0;
    if (c->kind == HALF) {
        const struct text *line = &question[any(n_questions)].line;
        (void)!send(c->fd, line->bytes, line->size / 2, MSG_NOSIGNAL);
        c->since_ns = clock_ns();
    } else {
        send_questions(c);
    }
    if (c->kind == POLITE || c->kind == FLOODS)
        epoll_ctl(epoll, EPOLL_CTL_ADD, c->fd, &wanted);
}

/* These bytes must be the next of the answers that are due. */
static void hold(struct client *c, const char *bytes, size_t n)
{
    while (n > 0 && c->n_answered < c->n_asked) {
        const struct text *due = &question[c->asked[c->n_answered]].answer;
        const size_t left = due->size - c->matched, some = n < left ? n : left;
        wrong += memcmp(due->bytes + c->matched, bytes, some) != 0;
        c->matched += some;
        bytes += some;
        n -= some;
        if (c->matched < due->size)
            continue;
        c->matched = 0;
        c->n_answered++;
        answers++;
        if (c->kind == POLITE && n_waited < sizeof waited_us / sizeof *waited_us)
            waited_us[n_waited++] = (uint32_t)((clock_ns() - c->since_ns) / 1000);
    }
    wrong += n > 0; /* more than was asked for */
}

static void listen_to(struct client *c, size_t most)
{
    static char bytes[65536];
    const ssize_t n = recv(c->fd, bytes, most, MSG_DONTWAIT);
    if (n > 0)
        hold(c, bytes, (size_t)n);
    else if (n == 0 || errno != EAGAIN)
        wrong++; /* who reads is not cut off */
    if (n > 0 && c->n_answered == c->n_asked)
        send_questions(c);
}

/* Those that no event tells of. */
static void rude_turn(struct client *client, const char *path, int epoll, uint64_t now_ns)
{
    for (int i = 0; i < CLIENTS; i++) {
        struct client *c = &client[i];
        if (c->kind == SLOW) {
            listen_to(c, SIP_BYTES);
        } else if ((c->kind == DEAF || c->kind == HALF) && now_ns - c->since_ns > AWAY_NS) {
            close(c->fd);
            begin(c, path, epoll);
        }
    }
}

static int by_size(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

int main(int argc, char **argv)
{
    static struct client client[CLIENTS];
    struct epoll_event event[CLIENTS];
    if (argc != 3) {
        fprintf(stderr, "usage: load SOCKET SECONDS < QUESTIONS\n");
        return 2;
    }
    ask_all(argv[1]);
    const int epoll = epoll_create1(EPOLL_CLOEXEC);
    int n = 0;
    for (enum kind kind = 0; kind < KINDS; kind++)
        for (int i = 0; i < share[kind]; i++, n++) {
            client[n].kind = kind;
            begin(&client[n], argv[1], epoll);
        }
    const uint64_t start_ns = clock_ns(), span_ns = (uint64_t)(strtod(argv[2], NULL) * 1e9);
    uint64_t now_ns = start_ns, sip_ns = start_ns;
    for (; now_ns - start_ns < span_ns; now_ns = clock_ns()) {
        const int ready = epoll_wait(epoll, event, CLIENTS, 1000 / SIPS_PER_S);
        for (int i = 0; i < ready; i++)
            listen_to(event[i].data.ptr, 65536);
        if (now_ns - sip_ns < 1000000000u / SIPS_PER_S)
            continue;
        sip_ns = now_ns;
        rude_turn(client, argv[1], epoll, now_ns);
    }
    qsort(waited_us, n_waited, sizeof *waited_us, by_size);
    printf("clients=%d questions=%u answers=%llu wrong=%llu per_s=%.0f connections=%llu p50_ms=%.1f p99_ms=%.1f\n",
           CLIENTS, n_questions, (unsigned long long)answers, (unsigned long long)wrong,
           (double)answers * 1e9 / (double)(now_ns - start_ns), (unsigned long long)comes,
           n_waited ? waited_us[n_waited / 2] * 1e-3 : 0, n_waited ? waited_us[n_waited * 99 / 100] * 1e-3 : 0);
    return wrong ? 1 : 0;
}
