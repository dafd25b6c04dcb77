/* SPDX-License-Identifier: MIT */
#include "page.h"

#include <math.h>
#include <string.h>
#include <time.h>

double page_number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

long long page_count(const json_t *object, const char *key)
{
    return (long long)json_integer_value(json_object_get(object, key));
}

/* Control characters (C0, DEL and the C1 of UTF-8) would be commands to a terminal. */
const char *page_text(char cell[PAGE_CELL], const json_t *object, const char *key)
{
    const char *s = json_string_value(json_object_get(object, key));
    size_t n = 0;
    for (; s && s[n] && n < PAGE_CELL - 1; n++) {
        const unsigned char c = (unsigned char)s[n], before = n ? (unsigned char)s[n - 1] : 0;
        cell[n] = c < 0x20 || c == 0x7f || (before == 0xc2 && c < 0xa0) ? '?' : s[n];
    }
    cell[n] = '\0';
    return n > 0 ? cell : "-";
}

const char *page_metres(char cell[PAGE_CELL], double m)
{
    if (isnan(m))
        return "-";
    snprintf(cell, PAGE_CELL, "%.2f m", m);
    return cell;
}

const char *page_duration(char cell[PAGE_CELL], double s)
{
    if (isnan(s))
        return "-";
    if (s < 9.95)
        snprintf(cell, PAGE_CELL, "%.1f s", s);
    else if (s < 120)
        snprintf(cell, PAGE_CELL, "%.0f s", s);
    else if (s < 7200)
        snprintf(cell, PAGE_CELL, "%.0f min", s / 60);
    else if (s < 172800)
        snprintf(cell, PAGE_CELL, "%.0f h", s / 3600);
    else
        snprintf(cell, PAGE_CELL, "%.0f days", s / 86400);
    return cell;
}

const char *page_utc(char cell[PAGE_CELL], double t_unix)
{
    const time_t t = t_unix > 0 && t_unix < 1e11 ? (time_t)t_unix : -1;
    struct tm tm;
    if (t < 0 || !gmtime_r(&t, &tm))
        return "-";
    strftime(cell, PAGE_CELL, "%Y-%m-%d %H:%M:%S UTC", &tm);
    return cell;
}

const char *page_plural(long long n)
{
    return n == 1 ? "" : "s";
}

void page_target(const struct page *page, const json_t *result)
{
    char target[PAGE_CELL];
    if (!json_is_string(json_object_get(result, "target")))
        return;
    fprintf(page->out, "  free of  %s; ", page_text(target, result, "target"));
    if (json_is_number(json_object_get(result, "bottom_db")))
        fprintf(page->out, "bottoms down to %.4g dB below a wall, not softer ones\n",
                page_number(result, "bottom_db"));
    else
        fputs("soft bottoms may be there\n", page->out);
}

void page_word(const struct page *page, enum page_colour colour, int width, const char *word)
{
    static const char *const codes[] = {
        [PAGE_PLAIN] = "", [PAGE_RED] = "\033[31m", [PAGE_GREEN] = "\033[32m", [PAGE_YELLOW] = "\033[33m"};
    const bool coloured = page->colour && colour != PAGE_PLAIN;
    fprintf(page->out, "%s%-*s%s", coloured ? codes[colour] : "", width, word, coloured ? "\033[0m" : "");
}

enum page_colour page_state_colour(const char *state)
{
    return strcmp(state, "blocked") == 0 ? PAGE_RED : strcmp(state, "clear") == 0 ? PAGE_GREEN : PAGE_YELLOW;
}
