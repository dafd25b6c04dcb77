/* SPDX-License-Identifier: MIT */
#include "canvas.h"

#include <string.h>

#define BRAILLE 0x2800u

void canvas_clear(struct canvas *canvas, int columns, int rows)
{
    memset(canvas, 0, sizeof *canvas);
    canvas->columns = columns < CANVAS_COLUMNS_MAX ? columns : CANVAS_COLUMNS_MAX;
    canvas->rows = rows < CANVAS_ROWS_MAX ? rows : CANVAS_ROWS_MAX;
}

/* The next character of valid UTF-8; a byte that is none counts as '?'. */
static uint32_t next_character(const unsigned char **at)
{
    const unsigned char *s = *at;
    const int n = s[0] < 0x80             ? 1
                  : (s[0] & 0xe0) == 0xc0 ? 2
                  : (s[0] & 0xf0) == 0xe0 ? 3
                  : (s[0] & 0xf8) == 0xf0 ? 4
                                          : 0;
    uint32_t c = n == 1 ? s[0] : n ? s[0] & (0x7fu >> n) : '?';
    for (int i = 1; i < n; i++) {
        if ((s[i] & 0xc0) != 0x80) {
            *at = s + i;
            return '?';
        }
        c = c << 6 | (s[i] & 0x3f);
    }
    *at = s + (n ? n : 1);
    return c < 0x20 || (c >= 0x7f && c < 0xa0) ? '?' : c;
}

int canvas_text(struct canvas *canvas, int column, int row, int width, enum canvas_colour colour, const char *text)
{
    const unsigned char *at = (const unsigned char *)text;
    for (; *at && width > 0; width--, column++) {
        const uint32_t c = next_character(&at);
        if (row >= 0 && row < canvas->rows && column >= 0 && column < canvas->columns)
            canvas->cell[row][column] = (struct canvas_cell){.glyph = c, .colour = (uint8_t)colour};
    }
    return column;
}

void canvas_dot(struct canvas *canvas, int x, int y, enum canvas_colour colour)
{
    static const uint8_t bit[CANVAS_DOTS_Y][CANVAS_DOTS_X] = {
        {0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
    if (x < 0 || y < 0 || x >= canvas->columns * CANVAS_DOTS_X || y >= canvas->rows * CANVAS_DOTS_Y)
        return;

    struct canvas_cell *cell = &canvas->cell[y / CANVAS_DOTS_Y][x / CANVAS_DOTS_X];

    cell->dots |= bit[y % CANVAS_DOTS_Y][x % CANVAS_DOTS_X];
    if (colour > cell->colour)
        cell->colour = (uint8_t)colour;
}

bool canvas_row_equal(const struct canvas *a, const struct canvas *b, int row)
{
    return memcmp(a->cell[row], b->cell[row], sizeof a->cell[row]) == 0;
}

static void print_character(FILE *out, uint32_t c)
{
    if (c < 0x80) {
        fputc((int)c, out);
    } else if (c < 0x800) {
        fprintf(out, "%c%c", (int)(0xc0 | c >> 6), (int)(0x80 | (c & 0x3f)));
    } else if (c < 0x10000) {
        fprintf(out, "%c%c%c", (int)(0xe0 | c >> 12), (int)(0x80 | (c >> 6 & 0x3f)), (int)(0x80 | (c & 0x3f)));
    } else {
        fprintf(out, "%c%c%c%c", (int)(0xf0 | c >> 18), (int)(0x80 | (c >> 12 & 0x3f)),
                (int)(0x80 | (c >> 6 & 0x3f)), (int)(0x80 | (c & 0x3f)));
    }
}

static uint32_t shown(const struct canvas_cell *cell, bool unicode)
{
    if (cell->glyph)
        return unicode || cell->glyph < 0x80 ? cell->glyph : '?';
    if (!cell->dots)
        return ' ';
    return unicode ? BRAILLE | cell->dots : cell->colour == CANVAS_RED ? '#' : '.';
}

void canvas_print_row(FILE *out, const struct canvas *canvas, int row, bool colour, bool unicode)
{
    static const char *const codes[] = {[CANVAS_PLAIN] = "0",
                                        [CANVAS_DIM] = "0;2",
                                        [CANVAS_GREEN] = "0;32",
                                        [CANVAS_YELLOW] = "0;33",
                                        [CANVAS_RED] = "0;1;31"};
    enum canvas_colour now = CANVAS_PLAIN;
    int end = canvas->columns;
    while (end > 0 && shown(&canvas->cell[row][end - 1], unicode) == ' ')
        end--;
    for (int column = 0; column < end; column++) {
        const struct canvas_cell *cell = &canvas->cell[row][column];
        if (colour && cell->colour != now) {
            now = (enum canvas_colour)cell->colour;
            fprintf(out, "\033[%sm", codes[now]);
        }
        print_character(out, shown(cell, unicode));
    }
    if (now != CANVAS_PLAIN)
        fputs("\033[0m", out);
}
