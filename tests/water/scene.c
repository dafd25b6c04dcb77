/* SPDX-License-Identifier: MIT */
/* scene - see scene.h. */
#include "scene.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/geometry.h"

#define TEXT_MAX    8192
#define NUMBERS_MAX 6

/* Each makes a shape of the numbers of a line. False: they are none. */

static bool box_of(const double *p, struct place_shape *s)
{
    s->kind = PLACE_BOX;
    memcpy(s->p, p, sizeof s->p);
    return p[0] < p[1] && p[2] < p[3] && p[4] < p[5];
}

static bool pile_of(const double *p, struct place_shape *s)
{
    *s = (struct place_shape){
        .kind = PLACE_TUBE, .p = {p[0], p[1], p[2], -INFINITY, INFINITY}, .v = {p[3], p[4], 0}};
    return p[2] > 0.0;
}

static bool slope_of(const double *p, struct place_shape *s)
{
    double normal[3];
    geo_direction(geo_rad(p[1]), geo_rad(p[2]), normal);
    *s = (struct place_shape){.kind = PLACE_HALF, .cut = {-normal[0], -normal[1], -normal[2], -p[0]}};
    return p[0] > 0.0 && fabs(p[2]) <= 90.0;
}

static const struct kind {
    const char *name;
    int n_numbers;
    const char *numbers; /* for messages */
    bool (*shape_of)(const double *p, struct place_shape *s);
} kinds[] = {
    {"box", 6, "XMIN XMAX YMIN YMAX ZMIN ZMAX, each MIN below its MAX", box_of},
    {"cylinder", 3, "X Y RADIUS, RADIUS > 0", pile_of},
    {"slope", 3, "DISTANCE AZIMUTH ELEVATION, DISTANCE > 0, ELEVATION -90..90", slope_of},
    {"pile", 5, "X Y RADIUS VX VY, RADIUS > 0", pile_of},
};

static const struct {
    const char *name, *what, *text;
} builtin[] = {
    {"open", "open water, nothing in range", ""},
    {"box", "basin 15 x 9 m, vehicle off its middle", "box -6 9 -5 4 -20 20\n"},
    {"channel", "blind end of a channel 0.555 m wide", "box -4 1.46 -0.294 0.261 -3 3\n"},
    {"pile", "one pile of 0.8 m ahead to the right", "cylinder 6 2 0.4\n"},
    {"slope", "seabed that rises ahead", "slope 6 0 -60\n"},
    {"moving", "a pile of 1 m crosses from the left", "pile 6 -6 0.5 0 0.2\n"},
    {"harbour", "quay wall, three piles, rising bed, a boat passing",
     "box -100 100 -100 8 -100 100\ncylinder 5 -2 0.3\ncylinder 5 2 0.3\ncylinder -4 -3 0.3\nslope 10 180 -70\n"
     "pile 12 -8 1.5 -0.1 0.1\n"},
};

#define COUNT(a) (sizeof a / sizeof(a)[0])

/* One shape from the words of one line. */
static bool shape_parse(struct place_shape *shape, char *line, struct fault *fault)
{
    double p[NUMBERS_MAX] = {0};
    char *save = NULL, *word = strtok_r(line, " \t\r", &save);
    const struct kind *kind = kinds;
    memset(shape, 0, sizeof *shape);
    while (strcmp(kind->name, word) != 0)
        if (++kind == kinds + COUNT(kinds))
            return fault_set(fault, "'%.20s' is no shape; there are box, cylinder, slope, pile", word);
    int n = 0;
    for (; (word = strtok_r(NULL, " \t\r", &save)) != NULL; n++) {
        char *end;
        double value = strtod(word, &end);
        if (n == kind->n_numbers || end == word || *end != '\0' || !isfinite(value))
            break;
        p[n] = value;
    }
    if (word != NULL || n != kind->n_numbers || !kind->shape_of(p, shape))
        return fault_set(fault, "%s needs %s", kind->name, kind->numbers);
    return true;
}

bool scene_parse(struct place *place, const char *name, const char *text, struct fault *fault)
{
    char copy[TEXT_MAX];
    struct fault what;
    int line_no = 0;
    memset(place, 0, sizeof *place);
    if (strlen(text) >= sizeof copy)
        return fault_set(fault, "%s: longer than %d bytes", name, TEXT_MAX - 1);
    strcpy(copy, text);
    for (char *next = copy, *line; (line = strsep(&next, "\n")) != NULL;) {
        struct place_shape shape;
        line_no++;
        line[strcspn(line, "#")] = '\0';
        if (line[strspn(line, " \t\r")] == '\0')
            continue;
        if (!shape_parse(&shape, line, &what))
            return fault_set(fault, "%s:%d: %s", name, line_no, what.text);
        if (!place_add(place, &shape))
            return fault_set(fault, "%s:%d: more than %d shapes", name, line_no, PLACE_MAX_SHAPES);
    }
    return true;
}

bool scene_load(struct place *place, const char *name_or_file, struct fault *fault)
{
    char text[TEXT_MAX + 1];
    for (size_t i = 0; i < COUNT(builtin); i++) {
        if (strcmp(builtin[i].name, name_or_file) == 0)
            return scene_parse(place, name_or_file, builtin[i].text, fault);
    }
    FILE *file = fopen(name_or_file, "r");
    if (file == NULL)
        return fault_set(fault, "%s: no built-in scene and no file: %s", name_or_file, strerror(errno));
    text[fread(text, 1, TEXT_MAX, file)] = '\0';
    fclose(file);
    return scene_parse(place, name_or_file, text, fault);
}

void scene_print_builtin(FILE *out)
{
    for (size_t i = 0; i < COUNT(builtin); i++)
        fprintf(out, "  %-9s %s\n", builtin[i].name, builtin[i].what);
}
