/* SPDX-License-Identifier: MIT */
#include "mavlink_obstacles.h"

#include <math.h>
#include <string.h>

#define UNKNOWN_CM    65535
#define MIN_CM        1
#define MAX_CM        65533 /* so that "nothing seen", one more, is not "unknown" */
#define INCREMENT_DEG (360 / MAVLINK_SECTORS)
#define ROUNDING_CM   1e-6 /* 7.25 * 100 is 724.99... in binary */

static const double radians_per_degree = 3.14159265358979323846 / 180.0;

static void doubt(struct mavlink_sector *sector)
{
    sector->free_to_m = 0;
    if (sector->state == MAVLINK_SECTOR_CLEAR)
        sector->state = MAVLINK_SECTOR_UNKNOWN;
}

/* near_m: water nearer than this is the vehicle's own. */
static bool read_sector(const json_t *object, double near_m, struct mavlink_sector *sector, double *age_s)
{
    static const char *const states[] = {[MAVLINK_SECTOR_UNKNOWN] = "unknown",
                                         [MAVLINK_SECTOR_CLEAR] = "clear",
                                         [MAVLINK_SECTOR_BLOCKED] = "blocked"};
    const char *state = json_string_value(json_object_get(object, "state"));
    const json_t *range = json_object_get(object, "range_m"), *free_to = json_object_get(object, "free_to_m");
    const json_t *blind_to = json_object_get(object, "blind_to_m"), *age = json_object_get(object, "age_s");
    for (int i = 0; state && i < 3; i++) {
        if (strcmp(state, states[i]) != 0)
            continue;
        *sector = (struct mavlink_sector){.state = (enum mavlink_sector_state)i,
                                          .range_m = json_number_value(range),
                                          .free_to_m = json_number_value(free_to)};
        if (i == MAVLINK_SECTOR_UNKNOWN && json_is_number(range)) /* an echo beyond what was asked about */
            sector->state = MAVLINK_SECTOR_BLOCKED;
        if (!json_is_number(blind_to) || json_number_value(blind_to) > near_m)
            doubt(sector);
        *age_s = json_is_number(age) ? json_number_value(age) : -1;
        return i != MAVLINK_SECTOR_BLOCKED || json_is_number(range);
    }
    return false;
}

bool mavlink_ring_read(struct mavlink_ring *ring, const json_t *result)
{
    const json_t *sectors = json_object_get(result, "sectors");
    const double near_m = json_number_value(json_object_get(result, "near_m"));
    struct mavlink_ring read = {
        .youngest_s = -1, .near_m = near_m, .t_unix = json_number_value(json_object_get(result, "t_unix"))};
    if (json_array_size(sectors) != MAVLINK_SECTORS || read.t_unix <= 0)
        return false;
    for (size_t i = 0; i < MAVLINK_SECTORS; i++) {
        double age_s;
        if (!read_sector(json_array_get(sectors, i), near_m, &read.sector[i], &age_s))
            return false;
        if (age_s >= 0 && (read.youngest_s < 0 || age_s < read.youngest_s))
            read.youngest_s = age_s;
    }
    *ring = read;
    return true;
}

void mavlink_ring_forget(struct mavlink_ring *ring)
{
    *ring = (struct mavlink_ring){.youngest_s = -1};
}

void mavlink_ring_doubt(struct mavlink_ring *ring)
{
    for (int i = 0; i < MAVLINK_SECTORS; i++)
        doubt(&ring->sector[i]);
}

bool mavlink_ring_known(const struct mavlink_ring *ring)
{
    for (int i = 0; i < MAVLINK_SECTORS; i++)
        if (ring->sector[i].state != MAVLINK_SECTOR_UNKNOWN)
            return true;
    return false;
}

uint16_t mavlink_centimetres(double m, uint16_t most)
{
    const double cm = floor(m * 100 + ROUNDING_CM);
    if (!(cm > MIN_CM))
        return MIN_CM;
    if (cm > most)
        return most;
    return (uint16_t)cm;
}

/*
 * Receivers ignore what is nearer than min_distance. Water nearer than near_m is the vehicle's own and nothing is known
 * of it, but an obstacle that is reported there must not be ignored.
 */
static double least_m(const struct mavlink_ring *ring, double nearest_m)
{
    return fmax(fmin(ring->near_m, nearest_m), MIN_CM * 0.01);
}

/* Is there an obstacle nearer than *nearest_m? One beyond max_m does not count where all before max_m is free. */
static void find_nearer(const struct mavlink_sector *sector, double max_m, double *nearest_m)
{
    if (sector->state == MAVLINK_SECTOR_BLOCKED && (sector->range_m <= max_m || sector->free_to_m < max_m))
        *nearest_m = fmin(*nearest_m, sector->range_m);
}

static uint16_t element(const struct mavlink_ring *ring, const struct mavlink_obstacle_conf *conf, int k,
                        double max_m, uint16_t max_cm)
{
    double nearest_m = INFINITY;
    for (int i = k - 1; i <= k + 1; i++)
        find_nearer(&ring->sector[(i + MAVLINK_SECTORS) % MAVLINK_SECTORS], max_m, &nearest_m);
    if (nearest_m < INFINITY)
        return mavlink_centimetres(nearest_m, max_cm);
    if (ring->sector[k].state != MAVLINK_SECTOR_UNKNOWN || conf->unknown_as == MAVLINK_UNKNOWN_AS_FAR)
        return (uint16_t)(max_cm + 1);
    return conf->unknown_as == MAVLINK_UNKNOWN_AS_DISTANCE ? mavlink_centimetres(conf->unknown_m, max_cm)
                                                           : UNKNOWN_CM;
}

void mavlink_ring_distances(const struct mavlink_ring *ring, const struct mavlink_obstacle_conf *conf,
                            double max_m, uint64_t time_usec, struct mavlink_obstacle_distance *out)
{
    const uint16_t max_cm = mavlink_centimetres(max_m, MAX_CM);
    *out = (struct mavlink_obstacle_distance){
        .time_usec = time_usec,
        .max_distance = max_cm,
        .sensor_type = MAVLINK_SENSOR_ULTRASOUND,
        .increment = INCREMENT_DEG,
        .frame = conf->north ? MAVLINK_FRAME_GLOBAL : MAVLINK_FRAME_BODY_FRD,
    };
    uint16_t nearest_cm = max_cm;
    for (int k = 0; k < MAVLINK_SECTORS; k++) {
        out->distances[k] = element(ring, conf, k, max_m, max_cm);
        nearest_cm = out->distances[k] < nearest_cm ? out->distances[k] : nearest_cm;
    }
    out->min_distance = mavlink_centimetres(least_m(ring, nearest_cm * 0.01), max_cm);
}

int mavlink_ring_points(const struct mavlink_ring *ring, const struct mavlink_obstacle_conf *conf,
                        double elevation_rad, double max_m, uint32_t time_boot_ms,
                        struct mavlink_obstacle_distance_3d out[MAVLINK_FACES])
{
    const int per_face = MAVLINK_SECTORS / MAVLINK_FACES;
    int n = 0;
    for (int face = 0; face < MAVLINK_FACES; face++) {
        double nearest_m = INFINITY, azimuth_rad = 0;
        for (int i = -per_face / 2; i <= per_face / 2; i++) {
            const int k = (face * per_face + i + MAVLINK_SECTORS) % MAVLINK_SECTORS;
            const double before_m = nearest_m;
            find_nearer(&ring->sector[k], max_m, &nearest_m);
            if (nearest_m < before_m)
                azimuth_rad = k * INCREMENT_DEG * radians_per_degree;
        }
        if (nearest_m == INFINITY)
            continue;

        const double range_m = fmax(fmin(nearest_m, max_m), MIN_CM * 0.01), level_m = range_m * cos(elevation_rad);

        out[n++] = (struct mavlink_obstacle_distance_3d){
            .time_boot_ms = time_boot_ms,
            .x = (float)(level_m * cos(azimuth_rad)),
            .y = (float)(level_m * sin(azimuth_rad)),
            .z = (float)(-range_m * sin(elevation_rad)),
            .min_distance = (float)least_m(ring, range_m),
            .max_distance = (float)max_m,
            .obstacle_id = MAVLINK_OBSTACLE_ID_UNKNOWN,
            .sensor_type = MAVLINK_SENSOR_ULTRASOUND,
            .frame = conf->north ? MAVLINK_FRAME_GLOBAL : MAVLINK_FRAME_BODY_FRD,
        };
    }
    return n;
}
