/* SPDX-License-Identifier: MIT */
/*
 * Framing of the Ping protocol: worked frames byte for byte, any split, garbage, lost and damaged bytes.
 */
#include "drivers/devices/ping_frame.h"
#include "tests/lib/test.h"

/* Published or worked out by hand; the sums were computed by another program. */
static const struct worked {
    const char *name, *hex;
    uint16_t id;
    uint8_t src;
} worked[] = {
    {"ask protocol version", "42520200060000000500A100", 6, 0},
    {"protocol version 1.2.3",
     "4252040005000000"
     "01020300"
     "A300",
     5, 0},
    {"ask device information", "42520200060000000400A000", 6, 0},
    {"Ping360 fw 3.3.8 id 2",
     "4252060004000200"
     "020003030800"
     "B000",
     4, 2},
    {"ask 1211", "4252020006000000BB045B01", 6, 0},
    {"legacy request 1211", "42520000BB0400005301", 1211, 0},
    {"set_range ack", "4252020001000100E9038401", 1, 1},
    {"nack with text",
     "4252200002000100"
     "E903"
     "52616E6765207363616E206C656E677468206F7574206F662072616E6765"
     "910C",
     2, 1},
    {"transducer",
     "42520E00290A0000"
     "0101C8006B007803EE02B0040100"
     "2A04",
     2601, 0},
    {"device data",
     "42521200FC080200"
     "0101C8006B007803EE02B0040400FF780300"
     "7E06",
     2300, 2},
    {"auto transmit",
     "425210002A0A0000"
     "01016B007803EE02B00400008F010100"
     "F503",
     2602, 0},
    {"auto device data",
     "42521800FD080200"
     "010100006B007803EE0200008F010100B0040400FF780300"
     "4E06",
     2301, 2},
    {"motor off", "42520000570B0000F600", 2903, 0},
};
#define N_WORKED (sizeof worked / sizeof worked[0])

static size_t unhex(const char *hex, uint8_t *out)
{
    size_t n = 0;
    unsigned v;
    for (; sscanf(hex + 2 * n, "%2x", &v) == 1; n++)
        out[n] = (uint8_t)v;
    return n;
}

static size_t bytes_of(const char *name, uint8_t *out)
{
    for (size_t i = 0; i < N_WORKED; i++)
        if (strcmp(worked[i].name, name) == 0)
            return unhex(worked[i].hex, out);
    abort();
}

/* Everything a stream holds when fed in pieces of at most `split` bytes, a millisecond apart. */
struct heard {
    struct ping_parser parser;
    size_t n;
    uint16_t id[4096];
    struct ping_frame last;
};

static struct heard *hear(const uint8_t *bytes, size_t n, size_t split)
{
    static struct heard h;
    ping_parser_init(&h.parser, PING_PAYLOAD_MAX);
    h.n = 0;
    uint64_t now_ns = 0;
    for (size_t at = 0; at < n;) {
        const uint8_t *piece = bytes + at;
        size_t left = n - at < split ? n - at : split;
        at += left;
        now_ns += 1000000;
        while (ping_parser_next(&h.parser, &piece, &left, now_ns, &h.last))
            h.id[h.n++ % 4096] = h.last.id;
    }
    return &h;
}

TEST(worked_frames_are_found)
{
    for (size_t i = 0; i < N_WORKED; i++) {
        uint8_t b[64];
        size_t n = unhex(worked[i].hex, b);
        struct heard *h = hear(b, n, n);
        if (h->n != 1 || h->id[0] != worked[i].id || h->last.src != worked[i].src || h->last.length != n - 10) {
            printf("%s: %zu frames\n", worked[i].name, h->n);
            CHECK(false);
        }
        CHECK_INT(h->parser.garbage_bytes, 0);
        CHECK_INT(h->parser.bad_checksum, 0);
    }
}

TEST(any_split_finds_the_same)
{
    uint8_t all[1024];
    size_t n = 0;
    for (size_t i = 0; i < N_WORKED; i++)
        n += unhex(worked[i].hex, all + n);
    for (size_t split = 1; split <= n; split++) {
        struct heard *h = hear(all, n, split);
        CHECK_INT(h->n, N_WORKED);
        for (size_t i = 0; i < N_WORKED && i < h->n; i++)
            CHECK_INT(h->id[i], worked[i].id);
        CHECK_INT(h->parser.garbage_bytes, 0);
    }
}

TEST(arrival_of_first_and_last_byte)
{
    uint8_t b[64] = "xyz";
    size_t n = 3 + bytes_of("motor off", b + 3);
    struct heard *h = hear(b, n, 1);
    CHECK_INT(h->n, 1);
    CHECK_INT(h->last.t_first_ns, 4000000);
    CHECK_INT(h->last.t_last_ns, 13000000);
}

TEST(arrival_is_known_after_a_false_start)
{
    uint8_t b[64] = {'B', 'R', 4, 0}; /* a 14 byte frame, it says; the real one begins inside */
    size_t n = 4 + bytes_of("motor off", b + 4);
    struct heard *h = hear(b, n, 2);
    CHECK_INT(h->n, 1);
    CHECK_INT(h->last.t_first_ns, 3000000);
    CHECK_INT(h->last.t_last_ns, 7000000);
    CHECK_INT(h->parser.garbage_bytes, 4);
    CHECK_INT(h->parser.bad_checksum, 1);
}

TEST(garbage_is_skipped_and_counted)
{
    static const struct {
        const char *name;
        uint8_t before[16];
        size_t n;
        unsigned bad_checksum;
    } row[] = {
        {"B B R", {'B'}, 1, 0},
        {"many B", {'B', 'B', 'B', 'B'}, 4, 0},
        {"text", {'p', 'o', 'w', 'e', 'r', '\r', '\n'}, 7, 0},
        {"B and another", {'B', 'X'}, 2, 0},
        {"length over the cap", {'B', 'R', 0x15, 0x05, 'z', 'z'}, 6, 0}, /* 1301 */
        {"length 65535", {'B', 'R', 0xff, 0xff}, 4, 0},
        {"header then nothing", {'B', 'R', 0, 0, 'B', 'R', 1, 0}, 8, 2},
        {"zeros", {0, 0, 0}, 3, 0},
        {"B X and a length", {'B', 'X', 4, 0}, 4, 0},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        for (size_t split = 1; split < 64; split++) {
            uint8_t b[128];
            memcpy(b, row[i].before, row[i].n);
            size_t n = row[i].n;
            n += bytes_of("Ping360 fw 3.3.8 id 2", b + n);
            n += bytes_of("motor off", b + n);
            struct heard *h = hear(b, n, split);
            if (h->n != 2 || h->id[0] != 4 || h->parser.garbage_bytes != row[i].n ||
                h->parser.bad_checksum != row[i].bad_checksum) {
                printf("%s, split %zu: %zu frames, %llu garbage\n", row[i].name, split, h->n,
                       (unsigned long long)h->parser.garbage_bytes);
                CHECK(false);
            }
        }
    }
}

TEST(longest_payload_passes_one_more_does_not)
{
    static uint8_t payload[PING_PAYLOAD_MAX + 1], out[PING_FRAME_MAX + 1];
    size_t n = ping_frame_build(out, sizeof out, 2300, 2, payload, PING_PAYLOAD_MAX);
    CHECK_INT(n, PING_FRAME_MAX);
    CHECK_INT(hear(out, n, 7)->n, 1);
    n = ping_frame_build(out, sizeof out, 2300, 2, payload, PING_PAYLOAD_MAX + 1);
    CHECK_INT(n, PING_FRAME_MAX + 1);
    struct heard *h = hear(out, n, 7);
    CHECK_INT(h->n, 0);
    CHECK_INT(h->parser.garbage_bytes, n);
}

TEST(payload_may_contain_a_frame)
{
    uint8_t inner[64], out[128];
    size_t n = bytes_of("device data", inner);
    n = ping_frame_build(out, sizeof out, 3, 2, inner, n);
    CHECK_INT(hear(out, n, 1)->n, 1);
    CHECK_INT(hear(out, n, 1)->id[0], 3);
}

TEST(a_damaged_byte_costs_one_frame)
{
    uint8_t b[256];
    size_t first = bytes_of("device data", b), n = first;
    n += bytes_of("auto device data", b + n);
    n += bytes_of("transducer", b + n);
    for (size_t at = 0; at < first; at++) {
        for (int bit = 0; bit < 8; bit++) {
            b[at] ^= (uint8_t)(1 << bit);
            /* a longer length may swallow what follows; then nothing must be lost once enough bytes have come */
            uint8_t stream[256 + PING_FRAME_MAX] = {0};
            memcpy(stream, b, n);
            struct heard *h = hear(stream, sizeof stream, 11);
            CHECK_INT(h->n, 2);
            CHECK_INT(h->id[0], 2301);
            CHECK_INT(h->id[1], 2601);
            b[at] ^= (uint8_t)(1 << bit);
        }
    }
}

TEST(a_lost_byte_costs_one_frame)
{
    uint8_t b[256];
    size_t first = bytes_of("device data", b), n = first;
    n += bytes_of("auto device data", b + n);
    n += bytes_of("transducer", b + n);
    for (size_t at = 0; at < first; at++) {
        uint8_t cut[256];
        memcpy(cut, b, at);
        memcpy(cut + at, b + at + 1, n - at - 1);
        struct heard *h = hear(cut, n - 1, 5);
        CHECK_INT(h->n, 2);
        CHECK_INT(h->parser.garbage_bytes, first - 1);
    }
}

TEST(every_seventh_byte_lost_yields_nothing_wrong)
{
    uint8_t data[1200], frame[PING_FRAME_MAX], stream[8 * PING_FRAME_MAX];
    size_t n = 0, seen = 0;
    for (size_t i = 0; i < sizeof data; i++)
        data[i] = (uint8_t)(i * 7);
    struct ping360_data d = {
        .set = {1, 1, 200, 107, 888, 750, 1200}, .data_length = 1200, .n_data = 1200, .data = data};
    size_t frame_n = ping360_encode_data(frame, sizeof frame, 2, &d);
    CHECK_INT(frame_n, 1224);
    for (int k = 0; k < 6; k++)
        for (size_t i = 0; i < frame_n; i++)
            if (++seen % 7 != 0)
                stream[n++] = frame[i];
    memcpy(stream + n, frame, frame_n);
    n += frame_n;
    struct heard *h = hear(stream, n, 100);
    CHECK_INT(h->n, 1); /* the whole one at the end */
    CHECK_INT(h->parser.garbage_bytes, n - frame_n);
}

TEST(given_up_frame_uncovers_the_one_behind)
{
    uint8_t b[64] = {'B', 'R', 0x00, 0x05};
    size_t n = 4 + bytes_of("motor off", b + 4);
    struct heard *h = hear(b, n, n); /* all arrives at 1 ms, and waits for 1290 bytes */
    struct ping_frame f;
    const uint8_t *none = NULL;
    size_t zero = 0;
    CHECK_INT(h->n, 0);
    ping_parser_give_up(&h->parser, 999999);
    CHECK(!ping_parser_next(&h->parser, &none, &zero, 2000000, &f));
    ping_parser_give_up(&h->parser, 1000000);
    CHECK(ping_parser_next(&h->parser, &none, &zero, 2000000, &f));
    CHECK_INT(f.id, 2903);
    CHECK_INT(f.t_last_ns, 1000000);
    CHECK(!ping_parser_next(&h->parser, &none, &zero, 2000000, &f));
    CHECK_INT(h->parser.garbage_bytes, 4);
}

TEST(reset_forgets_half_a_frame)
{
    uint8_t b[64];
    size_t n = bytes_of("device data", b);
    struct heard *h = hear(b, n - 5, 3);
    ping_parser_reset(&h->parser);
    CHECK_INT(h->parser.cut_bytes, n - 5); /* it may have been good: no garbage */
    CHECK_INT(h->parser.garbage_bytes, 0);
    const uint8_t *p = b + n - 5;
    size_t left = 5;
    struct ping_frame f;
    CHECK(!ping_parser_next(&h->parser, &p, &left, 1, &f));
}

TEST(noise_never_loses_a_byte_of_the_account)
{
    uint64_t rng = test_seed();
    static uint8_t stream[20000];
    for (int round = 0; round < 40; round++) {
        size_t n = 0, good_bytes = 0;
        while (n < sizeof stream - 2000) {
            if (test_random(&rng) % 3 == 0) {
                n += unhex(worked[test_random(&rng) % N_WORKED].hex, stream + n);
            } else {
                for (uint64_t k = test_random(&rng) % 40; k > 0; k--)
                    stream[n++] = (uint8_t) "BR\0\1"[test_random(&rng) % 4]; /* much like a frame */
            }
        }
        struct ping_parser p;
        ping_parser_init(&p, PING_PAYLOAD_MAX);
        for (size_t at = 0; at < n;) {
            const uint8_t *piece = stream + at;
            size_t left = 1 + test_random(&rng) % 300;
            left = left < n - at ? left : n - at;
            at += left;
            struct ping_frame f;
            while (ping_parser_next(&p, &piece, &left, at, &f))
                good_bytes += (size_t)f.length + PING_OVERHEAD;
        }
        ping_parser_reset(&p);
        CHECK_INT(p.garbage_bytes + p.cut_bytes + good_bytes, n);
    }
}

/* Every fourth byte may begin a frame of the largest size, and none does but a few in between. */
TEST(starts_of_frames_without_end_cost_none)
{
    static struct ping_parser p;
    static uint8_t stream[1 << 22];
    const uint8_t *bytes = stream;
    size_t left = sizeof stream, n_good = 0;
    struct ping_frame f;
    for (size_t i = 0; i < sizeof stream; i += 4)
        memcpy(stream + i, "BR\0\x40", 4);
    for (size_t at = 0; at < sizeof stream - 20000; at += 19999) {
        const size_t n = unhex(worked[n_good++ % N_WORKED].hex, stream + at);
        memset(stream + at + n, 'x', 3);
    }
    ping_parser_init(&p, PING_PAYLOAD_LIMIT);
    for (size_t i = 0; ping_parser_next(&p, &bytes, &left, 1, &f); i++)
        CHECK_INT(f.id, worked[i % N_WORKED].id);
    CHECK_INT(p.frames, n_good);
    CHECK(p.bad_checksum > sizeof stream / 5);
}

static void check_hex(const uint8_t *got, size_t n, const char *name)
{
    uint8_t want[64];
    size_t want_n = bytes_of(name, want);
    CHECK_INT(n, want_n);
    CHECK(n == want_n && memcmp(got, want, n) == 0);
}

TEST(encoders_give_the_worked_frames)
{
    const uint8_t samples[4] = {0xff, 0x78, 0x03, 0x00};
    struct ping360_settings set = {1, 1, 200, 107, 888, 750, 1200};
    struct ping360_sweep sweep = {0, 399, 1, 0};
    uint8_t b[64];
    check_hex(b, ping_encode_request(b, sizeof b, PING_PROTOCOL_VERSION), "ask protocol version");
    check_hex(b, ping_encode_request(b, sizeof b, PING_DEVICE_INFORMATION), "ask device information");
    check_hex(b, ping360_encode_transducer(b, sizeof b, &set, true), "transducer");
    check_hex(b, ping360_encode_auto_transmit(b, sizeof b, &set, &sweep), "auto transmit");
    check_hex(b, ping360_encode_motor_off(b, sizeof b), "motor off");
    /* 4 samples are sent, 1200 announced */
    struct ping360_data d = {.set = set, .data_length = 4, .n_data = 4, .data = samples};
    check_hex(b, ping360_encode_data(b, sizeof b, 2, &d), "device data");
    d.automatic = true;
    d.set.angle = 0;
    d.sweep = sweep;
    check_hex(b, ping360_encode_data(b, sizeof b, 2, &d), "auto device data");
}

TEST(encoders_refuse_a_short_buffer)
{
    struct ping360_settings set = {1, 1, 200, 107, 888, 750, 1200};
    struct ping360_sweep sweep = {0, 399, 1, 0};
    uint8_t b[64];
    CHECK_INT(ping_encode_request(b, 11, 5), 0);
    CHECK_INT(ping360_encode_transducer(b, 23, &set, true), 0);
    CHECK_INT(ping360_encode_auto_transmit(b, 25, &set, &sweep), 0);
    CHECK_INT(ping360_encode_motor_off(b, 9), 0);
    static const uint8_t samples[1300];
    static uint8_t big[2000];
    struct ping360_data d = {.set = set, .data_length = 1287, .n_data = 1287, .data = samples};
    CHECK_INT(ping360_encode_data(big, sizeof big, 2, &d), 0);
    d.n_data = 1286;
    CHECK_INT(ping360_encode_data(big, sizeof big, 2, &d), 1310);
}

static struct ping_frame frame_of(const char *name)
{
    static uint8_t b[64];
    size_t n = bytes_of(name, b);
    return (struct ping_frame){.id = (uint16_t)(b[4] | b[5] << 8), .length = (uint16_t)(n - 10), .payload = b + 8};
}

TEST(texts_of_the_line_can_be_logged)
{
    static const struct {
        const char *text;
        size_t n;
        const char *want;
    } row[] = {
        {"not supported\0", 14, "not supported"}, /* as C programs send them */
        {"two lines\r\n\0\0", 13, "two lines"},
        {"a\0b\x1b[31m\\", 9, "a\\x00b\\x1b[31m\\x5c"},
        {"\0\0", 2, ""},
        {"", 0, ""},
    };
    char shown[64];
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        CHECK_STR(ping_text(shown, sizeof shown, row[i].text, row[i].n), row[i].want);
    CHECK_STR(ping_text(shown, 9, "abcdefgh", 8), "abcde");
}

TEST(decoders_read_the_worked_frames)
{
    struct ping_frame f = frame_of("set_range ack");
    uint16_t id = 0;
    CHECK(ping_decode_ack(&f, &id));
    CHECK_INT(id, 1001);

    f = frame_of("nack with text");
    const char *text = "";
    size_t n = 0;
    CHECK(!ping_decode_ack(&f, &id));
    CHECK(ping_decode_nack(&f, &id, &text, &n));
    CHECK_INT(id, 1001);
    CHECK(n == 30 && memcmp(text, "Range scan length out of range", n) == 0);

    f = frame_of("Ping360 fw 3.3.8 id 2");
    struct ping_device_information info = {0};
    CHECK(ping_decode_device_information(&f, &info));
    CHECK(info.type == 2 && info.firmware[0] == 3 && info.firmware[1] == 3 && info.firmware[2] == 8);

    f = frame_of("protocol version 1.2.3");
    uint8_t v[3] = {0};
    CHECK(ping_decode_protocol_version(&f, v));
    CHECK(v[0] == 1 && v[1] == 2 && v[2] == 3);
}

TEST(decoders_read_device_data)
{
    struct ping360_data d;
    struct ping_frame f = frame_of("device data");
    CHECK(ping360_decode_data(&f, &d));
    CHECK(!d.automatic);
    CHECK_INT(d.set.gain, 1);
    CHECK_INT(d.set.angle, 200);
    CHECK_INT(d.set.transmit_us, 107);
    CHECK_INT(d.set.sample_period, 888);
    CHECK_INT(d.set.frequency_khz, 750);
    CHECK_INT(d.set.n_samples, 1200);
    CHECK_INT(d.n_data, 4);
    CHECK(d.data[0] == 0xff && d.data[2] == 3);

    f = frame_of("auto device data");
    CHECK(ping360_decode_data(&f, &d));
    CHECK(d.automatic);
    CHECK_INT(d.set.angle, 0);
    CHECK_INT(d.sweep.stop, 399);
    CHECK_INT(d.sweep.step, 1);
    CHECK_INT(d.set.n_samples, 1200);
    CHECK(d.n_data == 4 && d.data[1] == 0x78);
}

TEST(lengths_that_disagree_trust_the_least)
{
    static const struct {
        const char *name;
        unsigned n_samples, data_length, bytes, want;
    } row[] = {
        {"all agree", 5, 5, 5, 5},       {"fewer bytes", 5, 5, 3, 3}, {"fewer announced", 5, 2, 5, 2},
        {"fewer samples", 1, 5, 5, 1},   {"no data", 1200, 0, 0, 0},  {"length claims more", 1200, 65535, 4, 4},
        {"appended bytes", 4, 4, 20, 4},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint8_t payload[64] = {1, 1, 200};
        payload[10] = (uint8_t)row[i].n_samples;
        payload[11] = (uint8_t)(row[i].n_samples >> 8);
        payload[12] = (uint8_t)row[i].data_length;
        payload[13] = (uint8_t)(row[i].data_length >> 8);
        struct ping_frame f = {.id = 2300, .length = (uint16_t)(14 + row[i].bytes), .payload = payload};
        struct ping360_data d;
        CHECK(ping360_decode_data(&f, &d));
        if (d.n_data != row[i].want) {
            printf("%s: %u\n", row[i].name, d.n_data);
            CHECK(false);
        }
    }
}

TEST(short_messages_are_refused)
{
    uint8_t payload[32] = {0}, v[3];
    struct ping_frame f = {.payload = payload};
    struct ping360_data d;
    struct ping_device_information info;
    uint16_t id;
    const char *text;
    size_t n;
    f.id = 2300, f.length = 13;
    CHECK(!ping360_decode_data(&f, &d));
    f.id = 2301, f.length = 19;
    CHECK(!ping360_decode_data(&f, &d));
    f.id = 4, f.length = 4;
    CHECK(!ping_decode_device_information(&f, &info));
    f.id = 5, f.length = 2;
    CHECK(!ping_decode_protocol_version(&f, v));
    f.id = 1, f.length = 1;
    CHECK(!ping_decode_ack(&f, &id));
    f.id = 2, f.length = 1;
    CHECK(!ping_decode_nack(&f, &id, &text, &n));
}

int main(void)
{
    RUN(worked_frames_are_found);
    RUN(any_split_finds_the_same);
    RUN(arrival_of_first_and_last_byte);
    RUN(arrival_is_known_after_a_false_start);
    RUN(garbage_is_skipped_and_counted);
    RUN(longest_payload_passes_one_more_does_not);
    RUN(payload_may_contain_a_frame);
    RUN(a_damaged_byte_costs_one_frame);
    RUN(a_lost_byte_costs_one_frame);
    RUN(every_seventh_byte_lost_yields_nothing_wrong);
    RUN(given_up_frame_uncovers_the_one_behind);
    RUN(reset_forgets_half_a_frame);
    RUN(noise_never_loses_a_byte_of_the_account);
    RUN(starts_of_frames_without_end_cost_none);
    RUN(encoders_give_the_worked_frames);
    RUN(encoders_refuse_a_short_buffer);
    RUN(texts_of_the_line_can_be_logged);
    RUN(decoders_read_the_worked_frames);
    RUN(decoders_read_device_data);
    RUN(lengths_that_disagree_trust_the_least);
    RUN(short_messages_are_refused);
    return test_end();
}
