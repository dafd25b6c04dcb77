/* SPDX-License-Identifier: MIT */
/*
 * Framing of the SeaNet protocol: good frames in any cut, damage of every kind in between, no frame that was not sent.
 */
#include "drivers/devices/seanet_frame.h"
#include "tests/lib/test.h"

/* Written out by hand, not built. */
static const uint8_t alive[22] = {'@',  '0', '0',  '1',  '0',  0x10, 0, 2,    255,  0x0b, 4,
                                  0x80, 2,   0x80, 0x40, 0xe2, 1,    0, 0x80, 0x0c, 0xca, 10};
static const uint8_t data8[53] = {'@', '0',  '0',  '2',  'F', 0x2f, 0,    2,    255,  0x2a, 2,    0x80, 2,    0x27,
                                  0,   0x11, 0x10, 0,    5,   0x23, 0xc8, 0,    0,    0,    0,    0,    0x54, 0x7d,
                                  0,   0x51, 8,    0,    0,   0x68, 0,    0,    0,    0xff, 0x18, 0x10, 0x80, 0x0c,
                                  8,   0,    0xc8, 0x28, 10,  5,    9,    0xb4, 0x5a, 0x0c, 10};

static struct seanet_parser parser;

/* Feed n bytes in pieces of `split`; frames found. The last one's id is left in *id. */
static unsigned feed(const uint8_t *bytes, size_t n, size_t split, uint8_t *id)
{
    unsigned found = 0;
    struct seanet_frame f;
    for (size_t at = 0; at < n;) {
        const uint8_t *piece = bytes + at;
        size_t left = n - at < split ? n - at : split;
        at += left;
        while (seanet_parser_next(&parser, &piece, &left, at, &f)) {
            *id = f.id;
            found++;
        }
    }
    return found;
}

TEST(worked_frames)
{
    const uint8_t *b = alive;
    size_t n = sizeof alive;
    struct seanet_frame f;
    seanet_parser_init(&parser);
    CHECK(seanet_parser_next(&parser, &b, &n, 7, &f));
    CHECK_INT(f.id, SEANET_ALIVE);
    CHECK_INT(f.sender, 2);
    CHECK_INT(f.receiver, SEANET_HOST);
    CHECK_INT(f.node, 2);
    CHECK_INT(f.packet, 0);
    CHECK(f.last);
    CHECK_INT(f.length, 8);
    CHECK_INT(seanet_u32(f.payload + 1), 123456);
    CHECK_INT(f.t_first_ns, 7);
    b = data8;
    n = sizeof data8;
    CHECK(seanet_parser_next(&parser, &b, &n, 9, &f));
    CHECK_INT(f.id, SEANET_HEAD_DATA);
    CHECK_INT(f.length, 39);
    CHECK_INT(f.t_last_ns, 9);
    CHECK_INT(parser.frames, 2);
    CHECK_INT(parser.garbage_bytes, 0);
}

TEST(built_as_written_by_hand)
{
    uint8_t out[64];
    const uint8_t reboot[14] = {'@', '0', '0', '0', '8', 8, 0, 255, 2, 3, 16, 0x80, 2, 10};
    CHECK_INT(seanet_build(out, sizeof out, (struct seanet_head){2, 255, 4, SEANET_LAST_PACKET}, alive + 13, 8),
              22);
    CHECK(memcmp(out, alive, 22) == 0);
    CHECK_INT(seanet_build(out, sizeof out, (struct seanet_head){2, 255, 2, SEANET_LAST_PACKET}, data8 + 13, 39),
              53);
    CHECK(memcmp(out, data8, 53) == 0);
    CHECK_INT(
        seanet_build(out, sizeof out, (struct seanet_head){255, 2, SEANET_REBOOT, SEANET_LAST_PACKET}, NULL, 0),
        14);
    CHECK(memcmp(out, reboot, 14) == 0);
    CHECK_INT(seanet_build(out, 52, (struct seanet_head){2, 255, 2, SEANET_LAST_PACKET}, data8 + 13, 39), 0);
    CHECK_INT(seanet_build(out, SIZE_MAX, (struct seanet_head){2, 255, 2, 0}, data8,
                           SEANET_FRAME_MAX - SEANET_OVERHEAD + 1),
              0);
}

TEST(any_cut)
{
    uint8_t both[75], id = 0;
    memcpy(both, data8, 53);
    memcpy(both + 53, alive, 22);
    for (size_t split = 1; split <= sizeof both; split++) {
        seanet_parser_init(&parser);
        CHECK_INT(feed(both, sizeof both, split, &id), 2);
        CHECK_INT(id, SEANET_ALIVE);
        CHECK_INT(parser.garbage_bytes, 0);
    }
}

/* One wrong byte in what the framing checks: the frame is gone, the next one is not. */
TEST(refused_and_resynchronised)
{
    static const struct {
        const char *name;
        size_t at;
        uint8_t value;
    } row[] = {
        {"start", 0, 'A'},
        {"ASCII digit", 2, 'g'},
        {"lower case digit", 4, 'f'},
        {"ASCII length", 4, 'E'},
        {"binary length", 5, 0x30},
        {"binary length, high", 6, 1},
        {"sender is receiver", 7, 255},
        {"sender is not node", 12, 3},
        {"echo length", 42, 9},
        {"echo length, high", 43, 1},
        {"end", 52, 11},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint8_t bytes[75], id = 0;
        memcpy(bytes, data8, 53);
        memcpy(bytes + 53, alive, 22);
        bytes[row[i].at] = row[i].value;
        seanet_parser_init(&parser);
        if (feed(bytes, sizeof(bytes), 5, &id) != 1 || id != SEANET_ALIVE || parser.garbage_bytes != 53) {
            printf("%s: %u frames, %u garbage\n", row[i].name, (unsigned)parser.frames,
                   (unsigned)parser.garbage_bytes);
            CHECK(false);
        }
    }
}

TEST(lengths_by_message)
{
    static const struct {
        uint8_t id;
        size_t length;
        unsigned good;
    } row[] = {
        {SEANET_ALIVE, 7, 0},
        {SEANET_ALIVE, 8, 1},
        {SEANET_ALIVE, 9, 0},
        {SEANET_VERSION_DATA, 11, 1},
        {SEANET_VERSION_DATA, 12, 0},
        {SEANET_USER_DATA, 160, 0},
        {SEANET_USER_DATA, 161, 1},
        {SEANET_USER_DATA, 250, 1},
        {SEANET_USER_DATA, 251, 0},
        {SEANET_HEAD_DATA, 30, 0},
        {SEANET_HEAD_DATA, 31, 1},
        {99, 0, 1},
        {99, 4082, 1},
    };
    static uint8_t out[SEANET_FRAME_MAX], zeros[SEANET_FRAME_MAX];
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint8_t id;
        size_t n = seanet_build(out, sizeof out, (struct seanet_head){2, 255, row[i].id, SEANET_LAST_PACKET},
                                zeros, row[i].length);
        seanet_parser_init(&parser);
        CHECK_INT(feed(out, n, n, &id), row[i].good);
    }
}

/* The first of several packets says more than it holds; the last one of them does not begin with parameters. */
TEST(packets)
{
    uint8_t payload[60] = {0}, out[100], id;
    seanet_put_u16(payload + 29, 50);
    seanet_parser_init(&parser);
    size_t n = seanet_build(out, sizeof out, (struct seanet_head){2, 255, SEANET_HEAD_DATA, 0}, payload, 60);
    CHECK_INT(feed(out, n, n, &id), 1);
    n = seanet_build(out, sizeof out, (struct seanet_head){2, 255, SEANET_HEAD_DATA, 1 | SEANET_LAST_PACKET},
                     payload, 21);
    CHECK_INT(feed(out, n, n, &id), 1);
    seanet_put_u16(payload + 29, 29);
    n = seanet_build(out, sizeof out, (struct seanet_head){2, 255, SEANET_HEAD_DATA, 0}, payload, 60);
    CHECK_INT(feed(out, n, n, &id), 0);
}

/* Bytes were lost so that the frame ends on a chance LF inside the next one: the next one is the good one. */
TEST(frame_that_swallowed_the_next)
{
    uint8_t bytes[106], id = 0;
    memcpy(bytes, data8, 49);
    memcpy(bytes + 49, data8, 53);
    for (size_t lost = 1; lost < 9; lost++) {
        size_t n = 53 - lost + 53;
        memcpy(bytes, data8, 53 - lost);
        memcpy(bytes + 53 - lost, data8, 53);
        seanet_parser_init(&parser);
        CHECK_INT(feed(bytes, n, n, &id), 1);
        CHECK_INT(parser.garbage_bytes, 53 - lost);
    }
    uint8_t payload[61] = {0}; /* a whole alive in the echo, and all else right */
    memcpy(payload + 31, alive, 22);
    seanet_put_u16(payload + 29, 30);
    size_t n = seanet_build(bytes, sizeof(bytes),
                            (struct seanet_head){2, 255, SEANET_HEAD_DATA, SEANET_LAST_PACKET}, payload, 61);
    seanet_parser_init(&parser);
    CHECK_INT(feed(bytes, n, n, &id), 1);
    CHECK_INT(id, SEANET_ALIVE);
    CHECK_INT(parser.broken, 1);
}

TEST(unfinished_frame_is_given_up)
{
    uint8_t cut[40], id = 0;
    struct seanet_frame f;
    size_t none = 0;
    const uint8_t *nothing = NULL;
    seanet_parser_init(&parser);
    memcpy(cut, data8, 18);
    memcpy(cut + 18, alive, 22);
    CHECK_INT(feed(cut, sizeof cut, sizeof cut, &id), 0);
    seanet_parser_give_up(&parser, 39);
    CHECK(!seanet_parser_next(&parser, &nothing, &none, 60, &f));
    seanet_parser_give_up(&parser, 40);
    CHECK(seanet_parser_next(&parser, &nothing, &none, 60, &f));
    CHECK_INT(f.id, SEANET_ALIVE);
    CHECK_INT(parser.garbage_bytes, 18);
    CHECK_INT(parser.broken, 1);
}

TEST(what_a_lost_port_cuts_off_is_no_garbage)
{
    uint8_t id;
    seanet_parser_init(&parser);
    CHECK_INT(feed(data8, 18, 18, &id), 0);
    seanet_parser_reset(&parser);
    CHECK_INT(parser.cut_bytes, 18);
    CHECK_INT(feed(alive, 22, 22, &id), 1);
    seanet_parser_reset(&parser);
    CHECK_INT(parser.cut_bytes, 18); /* what was handed out is whole */
    CHECK_INT(parser.garbage_bytes, 0);
}

/* Frames of random length and content between random garbage; some are damaged. Whatever was sent whole is found. */
TEST(random_streams)
{
    static uint8_t stream[1 << 17], payload[SEANET_FRAME_MAX];
    uint64_t rng = test_seed();
    for (int round = 0; round < 300; round++) {
        size_t n = 0;
        unsigned sent = 0;
        uint64_t bytes_sent = 0;
        for (int k = 0; k < 20; k++) {
            size_t garbage = test_random(&rng) % 40;
            for (size_t i = 0; i < garbage; i++)
                stream[n++] = (uint8_t)("@00A\n\2\377"[test_random(&rng) % 7]);
            size_t bins = test_random(&rng) % 900;
            for (size_t i = 0; i < 31 + bins; i++)
                payload[i] = (uint8_t)test_random(&rng);
            seanet_put_u16(payload + 29, (unsigned)bins);
            size_t length = seanet_build(stream + n, sizeof stream - n,
                                         (struct seanet_head){2, 255, SEANET_HEAD_DATA, SEANET_LAST_PACKET},
                                         payload, 31 + bins);
            unsigned fate = (unsigned)(test_random(&rng) % 4);
            if (fate == 0) { /* bytes lost from the middle */
                size_t lost = 1 + test_random(&rng) % (length - 20);
                memmove(stream + n + 13, stream + n + 13 + lost, length - 13 - lost);
                n += length - lost;
            } else {
                n += length;
                sent++;
                bytes_sent += length;
            }
        }
        /* Enough behind the last one for any false start to be judged. */
        memset(stream + n, 0, SEANET_FRAME_MAX);
        n += SEANET_FRAME_MAX;
        uint8_t id;
        seanet_parser_init(&parser);
        unsigned found = feed(stream, n, 1 + test_random(&rng) % 700, &id);
        seanet_parser_reset(&parser);
        if (found != sent || parser.garbage_bytes + parser.cut_bytes != n - bytes_sent) {
            printf("round %d: %u of %u frames\n", round, found, sent);
            CHECK(false);
            return;
        }
    }
}

int main(void)
{
    RUN(worked_frames);
    RUN(built_as_written_by_hand);
    RUN(any_cut);
    RUN(refused_and_resynchronised);
    RUN(lengths_by_message);
    RUN(packets);
    RUN(frame_that_swallowed_the_next);
    RUN(unfinished_frame_is_given_up);
    RUN(what_a_lost_port_cuts_off_is_no_garbage);
    RUN(random_streams);
    return test_end();
}
