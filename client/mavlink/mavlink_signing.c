/* SPDX-License-Identifier: MIT */
#include "mavlink_signing.h"

#include <string.h>

#include "sha256.h"

#define EPOCH_2015_US  1420070400000000u
#define UNIT_US        10
#define NEW_STREAM_AGE 6000000u /* a minute */
#define HASH_BYTES     6
#define STAMP_BYTES    6

static int digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

bool mavlink_signing_key(struct mavlink_signing *signing, const char *text)
{
    static const char space[] = " \t\r\n";
    text += strspn(text, space);
    for (size_t i = 0; i < 2 * MAVLINK_KEY_BYTES; i++, text++) {
        const int d = digit(*text);
        if (d < 0)
            return false;
        signing->key[i / 2] = (uint8_t)(signing->key[i / 2] << 4 | d);
    }
    return text[strspn(text, space)] == '\0';
}

void mavlink_signing_clock(struct mavlink_signing *signing, uint64_t unix_us)
{
    const uint64_t now = unix_us > EPOCH_2015_US ? (unix_us - EPOCH_2015_US) / UNIT_US : 0;
    signing->newest = now > signing->newest ? now : signing->newest;
}

/* Of the frame's n bytes, the link id and the time stamp behind them. */
static void hash_frame(const struct mavlink_signing *signing, const uint8_t *frame, size_t n,
                       uint8_t hash[HASH_BYTES])
{
    struct sha256 sha;
    uint8_t digest[SHA256_BYTES];
    sha256_begin(&sha);
    sha256_add(&sha, signing->key, sizeof signing->key);
    sha256_add(&sha, frame, n + 1 + STAMP_BYTES);
    sha256_end(&sha, digest);
    memcpy(hash, digest, HASH_BYTES);
}

void mavlink_sign(struct mavlink_signing *signing, uint8_t *frame, size_t n)
{
    const uint64_t stamp = ++signing->newest;
    frame[n] = signing->link_id;
    for (unsigned i = 0; i < STAMP_BYTES; i++)
        frame[n + 1 + i] = (uint8_t)(stamp >> (8 * i));
    hash_frame(signing, frame, n, frame + n + 1 + STAMP_BYTES);
}

/* The sender's entry; made anew (newest 0) when there is none, NULL without room. */
static struct mavlink_stream *find_stream(struct mavlink_signing *signing, uint8_t system_id, uint8_t component_id,
                                          uint8_t link_id)
{
    struct mavlink_stream *stream = signing->stream;
    for (size_t i = 0; i < signing->n_streams; i++, stream++)
        if (stream->system_id == system_id && stream->component_id == component_id && stream->link_id == link_id)
            return stream;
    if (signing->n_streams == MAVLINK_STREAMS_MAX)
        return NULL;
    *stream = (struct mavlink_stream){system_id, component_id, link_id, 0};
    return stream;
}

bool mavlink_signature_holds(struct mavlink_signing *signing, const uint8_t *frame, size_t n)
{
    struct mavlink_stream *stream = find_stream(signing, frame[5], frame[6], frame[n]);
    uint8_t hash[HASH_BYTES];
    uint64_t stamp = 0;
    for (unsigned i = 0; i < STAMP_BYTES; i++)
        stamp |= (uint64_t)frame[n + 1 + i] << (8 * i);
    hash_frame(signing, frame, n, hash);
    if (!stream || memcmp(hash, frame + n + 1 + STAMP_BYTES, HASH_BYTES) != 0 || stamp <= stream->newest)
        return false;
    if (stream == signing->stream + signing->n_streams) {
        if (stamp + NEW_STREAM_AGE < signing->newest)
            return false;
        signing->n_streams++;
    }
    stream->newest = stamp;
    signing->newest = stamp > signing->newest ? stamp : signing->newest;
    return true;
}
