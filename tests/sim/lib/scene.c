/* SPDX-License-Identifier: MIT */
/* scene - shapes and rays; see scene.h. */
#include "scene.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/geometry.h"

#define TEXT_MAX          8192
#define SURFACE_EPSILON_M 1e-6 /* a ray that starts on a surface does not hit it */

struct scene_kind {
    const char *name;
    int n_numbers;
    const char *numbers; /* for messages */
    bool (*prepare)(double *p);
    bool (*cast)(const double *p, const double o[3], const double d[3], double t_s, struct scene_hit *hit);
};

static bool box_prepare(double *p)
{
    return p[0] < p[1] && p[2] < p[3] && p[4] < p[5];
}

/* From inside, the way out; from outside, the way in. A room rings between opposite walls, so its ghost lies one
 * room further. */
static bool box_cast(const double *p, const double o[3], const double d[3], double t_s, struct scene_hit *hit)
{
    double enter = -INFINITY, leave = INFINITY;
    int enter_axis = 0, leave_axis = 0;
    (void)t_s;
    for (int axis = 0; axis < 3; axis++) {
        double lo = p[2 * axis], hi = p[2 * axis + 1];
        if (d[axis] == 0.0) {
            if (o[axis] < lo || o[axis] > hi)
                return false;
            continue;
        }
        double a = (lo - o[axis]) / d[axis], b = (hi - o[axis]) / d[axis];
        double near = fmin(a, b), far = fmax(a, b);
        if (near > enter) {
            enter = near;
            enter_axis = axis;
        }
        if (far < leave) {
            leave = far;
            leave_axis = axis;
        }
    }
    if (enter > leave || leave <= SURFACE_EPSILON_M)
        return false;
    if (enter > SURFACE_EPSILON_M) {
        *hit = (struct scene_hit){enter, fabs(d[enter_axis]), 2.0 * enter};
    } else {
        double length = p[2 * leave_axis + 1] - p[2 * leave_axis];
        *hit = (struct scene_hit){leave, fabs(d[leave_axis]), leave + length};
    }
    return true;
}

static bool cylinder_prepare(double *p)
{
    return p[2] > 0.0;
}

static bool pile_cast(const double *p, const double o[3], const double d[3], double t_s, struct scene_hit *hit)
{
    const double x = o[0] - (p[0] + p[3] * t_s), y = o[1] - (p[1] + p[4] * t_s), radius = p[2];
    const double a = d[0] * d[0] + d[1] * d[1];
    const double b = x * d[0] + y * d[1];
    const double c = x * x + y * y - radius * radius;
    const double disc = b * b - a * c;
    if (a == 0.0 || disc < 0.0)
        return false;
    double range = (-b - sqrt(disc)) / a;
    if (range <= SURFACE_EPSILON_M)
        range = (-b + sqrt(disc)) / a;
    if (range <= SURFACE_EPSILON_M)
        return false;
    double normal_x = (x + range * d[0]) / radius, normal_y = (y + range * d[1]) / radius;
    *hit = (struct scene_hit){range, fmin(1.0, fabs(normal_x * d[0] + normal_y * d[1])), 2.0 * range};
    return true;
}

static bool cylinder_cast(const double *p, const double o[3], const double d[3], double t_s, struct scene_hit *hit)
{
    (void)t_s;
    return pile_cast(p, o, d, 0.0, hit);
}

static bool slope_prepare(double *p)
{
    double normal[3];
    if (!(p[0] > 0.0) || fabs(p[2]) > 90.0)
        return false;
    geo_direction(geo_rad(p[1]), geo_rad(p[2]), normal);
    memcpy(p + 1, normal, sizeof normal);
    return true;
}

static bool slope_cast(const double *p, const double o[3], const double d[3], double t_s, struct scene_hit *hit)
{
    const double *normal = p + 1;
    const double towards = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2];
    const double height = p[0] - (o[0] * normal[0] + o[1] * normal[1] + o[2] * normal[2]);
    (void)t_s;
    if (towards == 0.0 || height / towards <= SURFACE_EPSILON_M)
        return false;
    double range = height / towards;
    *hit = (struct scene_hit){range, fabs(towards), 2.0 * range};
    return true;
}

static const struct scene_kind kinds[] = {
    {"box", 6, "XMIN XMAX YMIN YMAX ZMIN ZMAX, each MIN below its MAX", box_prepare, box_cast},
    {"cylinder", 3, "X Y RADIUS, RADIUS > 0", cylinder_prepare, cylinder_cast},
    {"slope", 3, "DISTANCE AZIMUTH ELEVATION, DISTANCE > 0, ELEVATION -90..90", slope_prepare, slope_cast},
    {"pile", 5, "X Y RADIUS VX VY, RADIUS > 0", cylinder_prepare, pile_cast},
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

static const struct scene_kind *kind_find(const char *name)
{
    for (size_t i = 0; i < COUNT(kinds); i++) {
        if (strcmp(kinds[i].name, name) == 0)
            return &kinds[i];
    }
    return NULL;
}

/* One shape from the words of one line. */
static bool shape_parse(struct scene_shape *shape, char *line, struct fault *fault)
{
    char *save = NULL, *word = strtok_r(line, " \t\r", &save);
    memset(shape, 0, sizeof *shape);
    shape->kind = kind_find(word);
    if (shape->kind == NULL)
        return fault_set(fault, "'%.20s' is no shape; there are box, cylinder, slope, pile", word);
    int n = 0;
    for (; (word = strtok_r(NULL, " \t\r", &save)) != NULL; n++) {
        char *end;
        double value = strtod(word, &end);
        if (n == shape->kind->n_numbers || end == word || *end != '\0' || !isfinite(value))
            break;
        shape->p[n] = value;
    }
    if (word != NULL || n != shape->kind->n_numbers || !shape->kind->prepare(shape->p))
        return fault_set(fault, "%s needs %s", shape->kind->name, shape->kind->numbers);
    return true;
}

bool scene_parse(struct scene *scene, const char *name, const char *text, struct fault *fault)
{
    char copy[TEXT_MAX];
    struct fault what;
    int line_no = 0;
    scene->n = 0;
    if (strlen(text) >= sizeof copy)
        return fault_set(fault, "%s: longer than %d bytes", name, TEXT_MAX - 1);
    strcpy(copy, text);
    for (char *next = copy, *line; (line = strsep(&next, "\n")) != NULL;) {
        line_no++;
        line[strcspn(line, "#")] = '\0';
        if (line[strspn(line, " \t\r")] == '\0')
            continue;
        if (scene->n == SCENE_MAX_SHAPES)
            return fault_set(fault, "%s:%d: more than %d shapes", name, line_no, SCENE_MAX_SHAPES);
        if (!shape_parse(&scene->shape[scene->n], line, &what))
            return fault_set(fault, "%s:%d: %s", name, line_no, what.text);
        scene->n++;
    }
    return true;
}

bool scene_load(struct scene *scene, const char *name_or_file, struct fault *fault)
{
    char text[TEXT_MAX + 1];
    for (size_t i = 0; i < COUNT(builtin); i++) {
        if (strcmp(builtin[i].name, name_or_file) == 0)
            return scene_parse(scene, name_or_file, builtin[i].text, fault);
    }
    FILE *file = fopen(name_or_file, "r");
    if (file == NULL)
        return fault_set(fault, "%s: no built-in scene and no file: %s", name_or_file, strerror(errno));
    text[fread(text, 1, TEXT_MAX, file)] = '\0';
    fclose(file);
    return scene_parse(scene, name_or_file, text, fault);
}

void scene_print_builtin(FILE *out)
{
    for (size_t i = 0; i < COUNT(builtin); i++)
        fprintf(out, "  %-9s %s\n", builtin[i].name, builtin[i].what);
}

bool scene_cast(const struct scene *scene, const double origin[3], const double direction[3], double t_s,
                struct scene_hit *hit)
{
    bool found = false;
    for (size_t i = 0; i < scene->n; i++) {
        const struct scene_shape *shape = &scene->shape[i];
        struct scene_hit h;
        if (shape->kind->cast(shape->p, origin, direction, t_s, &h) && (!found || h.range_m < hit->range_m)) {
            *hit = h;
            found = true;
        }
    }
    return found;
}
