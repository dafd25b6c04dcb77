/* SPDX-License-Identifier: MIT */
#include "nmea0183.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "grid/geometry.h"

#define FIELDS_MAX 24

enum verdict { VALUE, NOT_AVAILABLE, OTHER, BAD };

void nmea_parser_init(struct nmea_parser *p, bool checksum_required)
{
    memset(p, 0, sizeof *p);
    p->checksum_required = checksum_required;
}

void nmea_parser_reset(struct nmea_parser *p)
{
    p->inside = false;
    p->n = 0;
    p->head = 0;
}

/* ---- fields ---- */

/* A plain decimal number, all of the field; strtod would take exponents, names and the locale's comma. */
static bool number(const char *s, double *value)
{
    double v = 0, place = 1;
    bool minus = *s == '-', point = false, digit = false;
    for (s += *s == '-' || *s == '+'; *s; s++) {
        if (*s == '.' && !point) {
            point = true;
        } else if (*s >= '0' && *s <= '9') {
            digit = true;
            v = v * 10 + (*s - '0');
            place *= point ? 10 : 1;
        } else {
            return false;
        }
    }
    *value = (minus ? -v : v) / place;
    return digit && isfinite(*value);
}

static enum verdict no_depth(struct nmea_value *value)
{
    value->has = NMEA_NO_DEPTH;
    return NOT_AVAILABLE;
}

static enum verdict depth(const char *text, double unit_m, double offset_m, struct nmea_value *value)
{
    double d;
    if (!*text)
        return no_depth(value);
    if (!number(text, &d) || fabs(d * unit_m) > 12000)
        return BAD;
    value->has = NMEA_DEPTH;
    value->below_m = d * unit_m;
    value->offset_m = offset_m;
    value->depth_m = value->below_m + (offset_m > 0 ? offset_m : 0);
    return VALUE;
}

/* Some instruments send an offset that is no number, as "-1.-1": the depth beside it is good. */
static enum verdict dpt(const char *const f[], struct nmea_value *value)
{
    double offset_m = 0;
    if (*f[2] && (!number(f[2], &offset_m) || fabs(offset_m) > 1000)) {
        offset_m = 0;
        value->odd = true;
    }
    return depth(f[1], 1, offset_m, value);
}

/* The depth in feet, metres and fathoms, of which some instruments fill in one only. Metres go first. */
static enum verdict dbt(const char *const f[], struct nmea_value *value)
{
    static const struct {
        int field;
        const char *letter;
        double unit_m;
    } units[] = {{3, "M", 1}, {1, "f", 0.3048}, {5, "F", 1.8288}};
    for (size_t i = 0; i < sizeof units / sizeof *units; i++)
        if (*f[units[i].field])
            return strcmp(f[units[i].field + 1], units[i].letter) != 0
                       ? BAD
                       : depth(f[units[i].field], units[i].unit_m, 0, value);
    return no_depth(value);
}

static enum verdict heading(const char *deg, unsigned kind, double add_deg, struct nmea_value *value)
{
    double h;
    if (!*deg)
        return NOT_AVAILABLE;
    if (!number(deg, &h) || h < -180 || h > 360)
        return BAD;
    value->odd |= h < 0;
    value->has = kind;
    value->heading_rad = geo_wrap(geo_rad(h + add_deg));
    return VALUE;
}

/* "12.6,W": degrees, east positive. Empty: *given stays false. */
static bool east(const char *deg, const char *side, double *value, bool *given)
{
    if (!*deg)
        return true;
    if (!number(deg, value) || fabs(*value) > 180 || (strcmp(side, "E") != 0 && strcmp(side, "W") != 0))
        return false;
    if (*side == 'W')
        *value = -*value;
    *given = true;
    return true;
}

static enum verdict hdg(const char *const f[], struct nmea_value *value)
{
    double deviation = 0, variation = 0;
    bool deviated = false, varied = false;
    if (!east(f[2], f[3], &deviation, &deviated) || !east(f[4], f[5], &variation, &varied))
        return BAD;
    return heading(f[1], varied ? NMEA_TRUE : NMEA_MAGNETIC, deviation + variation, value);
}

/* With a mode: only Autonomous and Estimated are measured; Manual, Simulator and not Valid are not. */
static enum verdict ths(const char *const f[], struct nmea_value *value)
{
    if (*f[2] && (!strchr("AEMSV", *f[2]) || f[2][1]))
        return BAD;
    return *f[2] == 'A' || *f[2] == 'E' ? heading(f[1], NMEA_TRUE, 0, value) : NOT_AVAILABLE;
}

static enum verdict understand(const char *const f[], struct nmea_value *value)
{
    if (strlen(f[0]) != 5 || f[0][0] == 'P')
        return OTHER;
    const char *kind = f[0] + 2;
    if (strcmp(kind, "DPT") == 0)
        return dpt(f, value);
    if (strcmp(kind, "DBT") == 0)
        return dbt(f, value);
    if (strcmp(kind, "THS") == 0)
        return ths(f, value);
    if (strcmp(kind, "HDT") == 0)
        return *f[1] && strcmp(f[2], "T") != 0 ? BAD : heading(f[1], NMEA_TRUE, 0, value);
    if (strcmp(kind, "HDM") == 0)
        return *f[1] && strcmp(f[2], "M") != 0 ? BAD : heading(f[1], NMEA_MAGNETIC, 0, value);
    return strcmp(kind, "HDG") == 0 ? hdg(f, value) : OTHER;
}

/* ---- lines ---- */

static int hex(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                  : -1;
}

enum checksum { GOOD, WRONG, MISSING };

/* Takes the checksum off the line's end. */
static enum checksum take_checksum(char *line)
{
    unsigned sum = 0;
    char *c = line;
    for (; *c && *c != '*'; c++)
        sum ^= (unsigned char)*c;
    if (!*c)
        return MISSING;
    *c = '\0';
    for (size_t n = strlen(c + 1); n > 0 && c[n] == ' '; n--)
        c[n] = '\0'; /* some instruments put blanks there */
    const bool good =
        strlen(c + 1) == 2 && hex(c[1]) >= 0 && hex(c[2]) >= 0 && (unsigned)(hex(c[1]) * 16 + hex(c[2])) == sum;
    return good ? GOOD : WRONG;
}

static void split(char *line, const char *fields[FIELDS_MAX])
{
    int n = 0;
    for (int i = 0; i < FIELDS_MAX; i++)
        fields[i] = "";
    for (char *at = line; at && n < FIELDS_MAX; n++) {
        char *comma = strchr(at, ',');
        fields[n] = at;
        if (comma)
            *comma = '\0';
        at = comma ? comma + 1 : NULL;
    }
}

/* Of a line without a checksum its name alone shows that it is a sentence and no noise: "AIVDM", "PFEC". */
static bool is_name(const char *s)
{
    const size_t n = strspn(s, "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789");
    return n >= 3 && s[n] == '\0';
}

/* p->line holds what stood between the $ or ! and the end of the line. */
static bool take_line(struct nmea_parser *p, struct nmea_value *value)
{
    const char *fields[FIELDS_MAX];
    p->line[p->n] = '\0';
    const enum checksum sum = take_checksum(p->line);
    if (sum == WRONG) {
        p->counts.bad_checksum++;
        return false;
    }
    split(p->line, fields);
    /* "$*00" has no name, and its checksum is of nothing. */
    if (!*fields[0] || (sum == MISSING && !is_name(fields[0]))) {
        p->counts.garbage_bytes += p->n + 1;
        return false;
    }
    *value = (struct nmea_value){0};
    snprintf(value->name, sizeof value->name, "%.5s", fields[0]);
    const enum verdict verdict = p->start == '!' ? OTHER : understand(fields, value);
    if (sum == MISSING && p->checksum_required && verdict != OTHER) {
        p->counts.bad_checksum++;
        p->counts.no_checksum++;
        return false;
    }
    p->counts.sentences++;
    switch (verdict) {
    case VALUE:
        p->counts.values++;
        p->counts.odd += value->odd;
        return true;
    case NOT_AVAILABLE:
        p->counts.not_available++;
        return value->has == NMEA_NO_DEPTH;
    case OTHER:
        p->counts.other++;
        snprintf(p->other, sizeof p->other, "%.7s", fields[0]);
        return false;
    case BAD:
        p->counts.bad_sentence++;
    }
    return false;
}

/* Its source and time are not used, so a damaged one costs nothing: the sentence behind it has its own checksum. */
static void take_tag_block(struct nmea_parser *p)
{
    p->line[p->n] = '\0';
    p->counts.bad_checksum += take_checksum(p->line) == WRONG;
    p->inside = false;
}

/* ---- bytes ---- */

/* With its zero: before the first tag block or sentence of an IEC 61162-450 datagram. */
static const char datagram_head[] = "UdPbC";

/* What was taken for a start was none. */
static void drop_head(struct nmea_parser *p)
{
    p->counts.garbage_bytes += p->head;
    p->head = 0;
}

static void take_outside(struct nmea_parser *p, char c)
{
    if (c != datagram_head[p->head])
        drop_head(p);
    if (c == datagram_head[p->head])
        p->head = (p->head + 1) % sizeof datagram_head;
    else
        p->counts.garbage_bytes += c != '\r' && c != '\n';
}

static void start(struct nmea_parser *p, char c)
{
    drop_head(p);
    p->counts.garbage_bytes += p->inside ? p->n + 1 : 0; /* what came before was cut off */
    p->inside = true;
    p->start = c;
    p->n = 0;
}

/* Inside, and c is no $. True: the end of a sentence with a value. */
static bool take_inside(struct nmea_parser *p, char c, struct nmea_value *value)
{
    const bool tag_block = p->start == '\\', end = c == '\r' || c == '\n';
    if (tag_block && c == '\\') {
        take_tag_block(p);
    } else if (end && !tag_block) {
        p->inside = false;
        return take_line(p, value);
    } else if (c < ' ' || c > '~') { /* or a tag block without its end */
        p->counts.garbage_bytes += p->n + 1 + !end;
        p->inside = false;
    } else if (p->n == NMEA_LINE_MAX) { /* as no line of a talker is: it is told from noise by nothing */
        p->counts.overlong++;
        p->counts.garbage_bytes += p->n + 2;
        p->inside = false;
    } else {
        p->line[p->n++] = c;
    }
    return false;
}

/* A $ starts a sentence wherever it stands: nothing may cost the next depth. Within a sentence the other two are text:
 * a sentence that one of them cut off fails its checksum. */
bool nmea_parser_next(struct nmea_parser *p, const uint8_t **bytes, size_t *n, struct nmea_value *value)
{
    while (*n > 0) {
        const char c = (char)*(*bytes)++;
        --*n;
        if (c == '$' || (!p->inside && (c == '!' || c == '\\')))
            start(p, c);
        else if (!p->inside)
            take_outside(p, c);
        else if (take_inside(p, c, value))
            return true;
    }
    return false;
}
