/* SPDX-License-Identifier: MIT */
/* mcap_channel - see the header. */
#include "mcap_channel.h"

#include <stdlib.h>

#define METADATA_BYTES_MAX 65536u

void mcap_copy_text(char *dst, size_t dst_size, struct mcap_cursor text)
{
    size_t n = (size_t)(text.end - text.p);
    if (n > dst_size - 1)
        n = dst_size - 1;
    if (n)
        memcpy(dst, text.p, n);
    dst[n] = '\0';
}

static const char *store_text(char **room, struct mcap_cursor text)
{
    char *s = *room;
    size_t n = (size_t)(text.end - text.p);
    mcap_copy_text(s, n + 1, text);
    *room += n + 1;
    return s;
}

/* How many pairs of strings the map holds; -1 when it is malformed. */
static int count_pairs(struct mcap_cursor map)
{
    int n = 0;
    for (; !map.bad && map.p < map.end; n++) {
        mcap_take_sized(&map);
        mcap_take_sized(&map);
    }
    return map.bad ? -1 : n;
}

struct mcap_channel *mcap_parse_channel(struct mcap_cursor c)
{
    uint16_t id = (uint16_t)mcap_take_int(&c, 2), schema_id = (uint16_t)mcap_take_int(&c, 2);
    struct mcap_cursor topic = mcap_take_sized(&c), encoding = mcap_take_sized(&c), map = mcap_take_sized(&c);
    if (c.bad || topic.end - topic.p > MCAP_STRING_MAX || encoding.end - encoding.p > MCAP_STRING_MAX ||
        (size_t)(map.end - map.p) > METADATA_BYTES_MAX)
        return NULL;
    int pairs = count_pairs(map);
    if (pairs < 0)
        return NULL;

    struct mcap_channel *channel;
    struct mcap_pair *metadata;
    size_t texts = (size_t)(topic.end - topic.p) + (size_t)(encoding.end - encoding.p) + 2 +
                   (size_t)(map.end - map.p); /* each string gives up 4 bytes of length for its NUL */
    channel = calloc(1, sizeof *channel + (size_t)pairs * sizeof *metadata + texts);
    if (!channel)
        return NULL;
    metadata = (struct mcap_pair *)(channel + 1);
    char *room = (char *)(metadata + pairs);
    channel->id = id;
    channel->schema_id = schema_id;
    channel->topic = store_text(&room, topic);
    channel->encoding = store_text(&room, encoding);
    channel->metadata = metadata;
    channel->n_metadata = (size_t)pairs;
    for (int i = 0; i < pairs; i++) {
        metadata[i].key = store_text(&room, mcap_take_sized(&map));
        metadata[i].value = store_text(&room, mcap_take_sized(&map));
    }
    return channel;
}
