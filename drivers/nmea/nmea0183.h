/* SPDX-License-Identifier: MIT */
/*
 * nmea0183 - depth and heading out of NMEA 0183 sentences (IEC 61162-1): DPT, DBT, HDT, THS, HDG, HDM. Bytes in, values
 * out; knows no port, no clock and no pose. Any talker is listened to; proprietary ($P...) and encapsulated (!...)
 * sentences, as of AIS, and those not listed are counted and skipped. So are tag blocks (NMEA 4.0: \...\ before a
 * sentence) and the head of IEC 61162-450 datagrams: all of this is traffic of the line, and none of it is garbage.
 */
#ifndef SONARD_NMEA0183_H
#define SONARD_NMEA0183_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The standard has 82 with the end of the line. Instruments exceed it a little, and proprietary lists of satellites by
 * far: they are to be told from noise by their checksum. */
#define NMEA_LINE_MAX 1024

enum nmea_part {
    NMEA_DEPTH = 1,
    NMEA_TRUE = 2,
    NMEA_MAGNETIC = 4,
    NMEA_NO_DEPTH = 8, /* DPT or DBT without a number: the instrument is there and has no depth */
};

/* One sentence's worth. Fields that are empty in the sentence are not available. */
struct nmea_value {
    unsigned has;       /* one of enum nmea_part */
    bool odd;           /* something in it is malformed and was not needed, or a heading is negative */
    double depth_m;     /* of the transducer; DPT with a positive offset: of the water line */
    double below_m;     /* NMEA_DEPTH: the same as it was measured, without any offset */
    double offset_m;    /* DPT: of the transducer to the water line, positive, or to the keel, negative; else 0 */
    double heading_rad; /* [0, 2pi); magnetic: with deviation, without variation */
    char name[6];       /* talker and kind: "SDDPT" */
};

/* Counters only grow. */
struct nmea_counts {
    uint64_t sentences;     /* whole, of any kind, with a good checksum, or a name and none where none is needed */
    uint64_t values;        /* of them: with a value for us */
    uint64_t odd;           /* of these: malformed in a part that was not needed, or with a negative heading */
    uint64_t not_available; /* of the listed kinds, with empty fields, or whose mode says not valid */
    uint64_t other;         /* of other kinds */
    uint64_t bad_checksum;  /* wrong, also of a tag block, or missing where one is required */
    uint64_t no_checksum;   /* of them: missing; of the listed kinds only */
    uint64_t bad_sentence;  /* of the listed kinds, senseless content */
    uint64_t overlong;      /* lines of more than NMEA_LINE_MAX bytes */
    uint64_t garbage_bytes; /* outside sentences and tag blocks, and all of an overlong line */
};

struct nmea_parser {
    bool checksum_required;
    bool inside;   /* a sentence or a tag block has started, */
    char start;    /* with this: '$', '!' or '\\' */
    unsigned head; /* bytes of a datagram's head that came outside of both */
    size_t n;
    char line[NMEA_LINE_MAX + 1];
    char other[8]; /* name of the last sentence of another kind; empty: none */
    struct nmea_counts counts;
};

void nmea_parser_init(struct nmea_parser *p, bool checksum_required);

/** nmea_parser_reset - forget the half sentence: the port was closed. */
void nmea_parser_reset(struct nmea_parser *p);

/**
 * nmea_parser_next - go on through *n bytes at *bytes until a sentence gave a value, or one of depth has none: true,
 * *value set, *bytes and *n moved behind it. False: all bytes are used up. Any split of the input gives the same
 * values.
 */
bool nmea_parser_next(struct nmea_parser *p, const uint8_t **bytes, size_t *n, struct nmea_value *value);

#endif
