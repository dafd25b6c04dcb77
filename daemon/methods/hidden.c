/* SPDX-License-Identifier: MIT */
#include "hidden.h"

#include <math.h>
#include <stdio.h>

#include "grid/answer/witness.h"

#define NEAR_M 0.5 /* the grid's layers and the pose blur where water ends */

/* The nearest place where something hides water. */
struct hiding {
    double at_m; /* from the vehicle; INFINITY: there is none */
    uint32_t hides;
};

/* A direction asked about: in NED where poses have an attitude, else the body's. */
struct asked {
    double axis[3], half_rad;
    bool ned;
};

/* Did the beam, of a sonar mounted so, look there? */
static bool looked_at(const struct image_end *end, const struct mount *mount, const struct asked *asked)
{
    const double attitude[4] = {(double)end->attitude[0], (double)end->attitude[1], (double)end->attitude[2],
                                (double)end->attitude[3]};
    struct witness beam = {.half_az_rad = end->half_az_rad, .half_el_rad = end->half_el_rad};
    double turn[4] = {mount->attitude[0], mount->attitude[1], mount->attitude[2], mount->attitude[3]}, v[3], up[3];
    if (end->ned != asked->ned)
        return false;
    if (end->ned)
        quat_multiply(attitude, mount->attitude, turn);
    geo_direction((double)end->az_rad, (double)end->el_rad, v);
    geo_direction((double)end->az_rad, (double)end->el_rad + GEO_PI / 2, up);
    quat_rotate(turn, v, v);
    quat_rotate(turn, up, up);
    for (int i = 0; i < 3; i++) {
        beam.axis[i] = (float)v[i];
        beam.up[i] = (float)up[i];
    }
    return witness_sees(&beam, asked->axis, asked->half_rad);
}

/* How far from the vehicle's reference point that is. */
static double distance_m(const struct image_end *end, const struct mount *mount)
{
    double v[3];
    geo_direction((double)end->az_rad, (double)end->el_rad, v);
    quat_rotate(mount->attitude, v, v);
    for (int i = 0; i < 3; i++)
        v[i] = mount->position_m[i] + (double)end->at_m * v[i];
    return geo_length(v);
}

/* Does the answer's water end, or begin, where that hides it? Where nothing is free, any of it may be the cause. */
static bool may_hide(const struct image_end *end, double at_m, const struct answer_query *query,
                     const struct answer *a)
{
    const bool any = a->free_to_m > 0;
    switch ((enum image_hides)end->hides) {
    case IMAGE_HIDES_NOTHING:
        return false;
    case IMAGE_HIDES_RING:
    case IMAGE_HIDES_DEAF:
        return !any;
    case IMAGE_HIDES_BEFORE:
        return (a->reason == ANSWER_BLIND || !any) && fabs(at_m - a->blind_to_m) <= NEAR_M;
    case IMAGE_HIDES_OWN:
    case IMAGE_HIDES_MASK:
        break;
    }
    return a->reason == ANSWER_BEYOND && at_m <= query->distance_m &&
           (!any || fabs(at_m - a->free_to_m) <= NEAR_M);
}

static struct hiding nearest_hiding(const struct methods_env *d, const struct asked *asked,
                                    const struct answer_query *query, const struct answer *a)
{
    struct hiding found = {.at_m = INFINITY};
    for (int i = 0; i < d->conf.n_sonars; i++) {
        struct image *image = pipeline_image(d->pipeline, i);
        for (uint32_t k = 0; image && k < IMAGE_ROWS; k++) {
            struct image_end end;
            image_end(image, k, &end);
            if (end.hides == IMAGE_HIDES_NOTHING)
                continue;
            const double at_m = distance_m(&end, &d->mount[i]);
            if (at_m < found.at_m && may_hide(&end, at_m, query, a) && looked_at(&end, &d->mount[i], asked))
                found = (struct hiding){at_m, end.hides};
        }
    }
    return found;
}

const char *hidden_cause(const struct methods_env *d, const struct answer_now *now,
                         const struct answer_query *query, const struct answer *a, char text[HIDDEN_SIZE])
{
    static const char *const words[] = {[IMAGE_HIDES_NOTHING] = NULL,
                                        [IMAGE_HIDES_OWN] = "the vehicle's own echo",
                                        [IMAGE_HIDES_MASK] = "the background template",
                                        [IMAGE_HIDES_BEFORE] = "the background template",
                                        [IMAGE_HIDES_RING] = "a ring-down that is longer or louder than usual",
                                        [IMAGE_HIDES_DEAF] = "a receiver that may hear nothing (see status)"};
    const bool attitude = (now->pose.has & POSE_ATTITUDE) != 0;
    struct asked asked = {.half_rad = query->corridor ? 0 : query->half_angle_rad, .ned = attitude || query->ned};
    text[0] = '\0';
    if (a->reason != ANSWER_BEYOND && a->reason != ANSWER_BLIND)
        return text;
    geo_direction(query->az_rad, query->el_rad, asked.axis);
    if (attitude && !query->ned)
        quat_rotate(now->pose.attitude, asked.axis, asked.axis);
    const char *by = words[nearest_hiding(d, &asked, query, a).hides];
    if (by)
        snprintf(text, HIDDEN_SIZE, "hidden by %s", by);
    return text;
}
