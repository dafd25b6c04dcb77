/* SPDX-License-Identifier: MIT */
/*
 * canvas - a picture of character cells for a terminal: text, and dots of which a cell has 2 by 4 (braille). Knows no
 * terminal. Everything beyond the edges is left out.
 */
#ifndef SONARD_CANVAS_H
#define SONARD_CANVAS_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#define CANVAS_COLUMNS_MAX 240
#define CANVAS_ROWS_MAX    80
#define CANVAS_DOTS_X      2 /* of a cell */
#define CANVAS_DOTS_Y      4

enum canvas_colour { CANVAS_PLAIN, CANVAS_DIM, CANVAS_GREEN, CANVAS_YELLOW, CANVAS_RED }; /* by weight */

struct canvas_cell {
    uint32_t glyph; /* Unicode; 0: nothing or dots */
    uint8_t dots;   /* bits of a braille cell */
    uint8_t colour;
};

struct canvas {
    int columns, rows;
    struct canvas_cell cell[CANVAS_ROWS_MAX][CANVAS_COLUMNS_MAX];
};

/** canvas_clear - an empty one; sizes beyond the greatest are cut. */
void canvas_clear(struct canvas *canvas, int columns, int rows);

/**
 * canvas_text - UTF-8 text from (column, row) rightward, at most `width` cells; what could move a cursor is shown as a
 * question mark. Returns the column behind it.
 */
int canvas_text(struct canvas *canvas, int column, int row, int width, enum canvas_colour colour,
                const char *text);

/** canvas_dot - a dot, counted from the upper left; a cell has the colour of its heaviest dot. */
void canvas_dot(struct canvas *canvas, int x, int y, enum canvas_colour colour);

/** canvas_row_equal - is a row the same in both? */
bool canvas_row_equal(const struct canvas *a, const struct canvas *b, int row);

/** canvas_print_row - without a line's end. colour false: no escape sequence; unicode false: ASCII, dots as # and . */
void canvas_print_row(FILE *out, const struct canvas *canvas, int row, bool colour, bool unicode);

#endif
