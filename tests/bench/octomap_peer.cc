/* SPDX-License-Identifier: MIT */
/*
 * octomap_peer - the pings of voxel_scene.h into OctoMap and into a voxel submap: time (of this process) per ping,
 * memory, the share of the voxels in a beam that OctoMap has as free, free voxels outside the shaft, and in how many
 * directions a ray from the vehicle is stopped at the wall after all turns. OctoMap gets rays at most one voxel apart
 * where the beam ends, and every end that is an echo as an occupied place: its own way to enter a wide beam.
 * "octomap_peer csv [quick]" prints what the report shows.
 */
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include <octomap/octomap.h>

extern "C" {
#include "core/fault.h"
#include "grid/voxel/submap.h"
#include "voxel_scene.h"
}

static double now_ns()
{
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return double(t.tv_sec) * 1e9 + double(t.tv_nsec);
}

static void enter_octomap(octomap::OcTree &tree, const scene_ping &p, double voxel_m)
{
    int n_az = int(geo_rad(SCENE_AZ_DEG) * p.range_m / voxel_m) + 2;
    int n_el = int(geo_rad(SCENE_EL_DEG) * p.range_m / voxel_m) + 2;
    octomap::point3d origin(float(p.position_m[0]), float(p.position_m[1]), float(p.position_m[2]));
    octomap::Pointcloud ends;
    double far_m = p.echo ? p.range_m : 2 * p.range_m;
    for (int a = 0; a < n_az; a++)
        for (int e = 0; e < n_el; e++) {
            double ray[3];
            scene_ray(&p, geo_rad(SCENE_AZ_DEG) * (double(a) / (n_az - 1) - 0.5),
                      geo_rad(SCENE_EL_DEG) * (double(e) / (n_el - 1) - 0.5), ray);
            ends.push_back(float(p.position_m[0] + far_m * ray[0]), float(p.position_m[1] + far_m * ray[1]),
                           float(p.position_m[2] + far_m * ray[2]));
        }
    tree.insertPointCloud(ends, origin, p.echo ? -1 : p.range_m, true, false);
}

static bool in_shaft(const int64_t cell[3], double voxel_m)
{
    static const double half_m[3] = {4.5, 2.5, 13.5};
    for (int a = 0; a < 3; a++)
        if (fabs((double(cell[a]) + 0.5) * voxel_m) > half_m[a] + 1e-9)
            return false;
    return true;
}

/* Of 360 level directions, those in which a ray from the vehicle's last place does not get past the wall unhindered. */
static void walls_left(const octomap::OcTree &tree, const submap &map, const scene_ping &last, double voxel_m,
                       int *by_octomap, int *by_submap)
{
    const voxel_rule rule = {2, 1};
    *by_octomap = *by_submap = 0;
    for (int d = 0; d < 360; d++) {
        double ray[3] = {cos(geo_rad(d)), sin(geo_rad(d)), 0};
        octomap::point3d hit,
            from(float(last.position_m[0]), float(last.position_m[1]), float(last.position_m[2]));
        *by_octomap += tree.castRay(from, octomap::point3d(float(ray[0]), float(ray[1]), 0), hit, true,
                                    scene_wall(last.position_m, ray) + 1);
        for (double r = 0.5; r < scene_wall(last.position_m, ray) + 1; r += voxel_m / 2) {
            double at[3] = {last.position_m[0] + r * ray[0], last.position_m[1] + r * ray[1], last.position_m[2]};
            struct lattice_place place;
            if (lattice_place(at, voxel_m, &place) &&
                voxel_judge(&rule, submap_count(&map, SUBMAP_VACANCY, place.cell), 0) != VOXEL_FREE) {
                ++*by_submap;
                break;
            }
        }
    }
}

static bool csv; /* rows for the report, without times */

/* How many times as fast the submap is. */
static double compare(char which, double voxel_m, int turns, int pings)
{
    double reach_m = which == 'B' ? 51 : 9, height_m = which == 'B' ? 40 : 29;
    uint32_t side = uint32_t(2 * reach_m / voxel_m / TILE_SIDE) + 3, height = uint32_t(height_m / voxel_m);
    struct lattice_place base = {{0, 0, 0}, {0.5, 0.5, 0.5}}, at;
    tiles pool;
    submap map;
    cast_opening o;
    cast_beam beam;
    struct fault fault;
    octomap::OcTree tree(voxel_m);
    void *memory = calloc(1, tiles_bytes(side * side, height, 1)),
         *directory = calloc(1, submap_bytes(side, height));
    if (!memory || !directory ||
        !cast_opening_init(&o, CAST_WEDGE, geo_rad(SCENE_AZ_DEG) / 2, geo_rad(SCENE_EL_DEG) / 2, 0, &fault))
        exit(1);
    tiles_init(&pool, memory, side * side, height, 1);
    submap_init(&map, directory, side, &pool, &base);

    double theirs_ns = 0, ours_ns = 0, start;
    scene_ping p{};
    for (int pass = 0; pass < 2; pass++) /* the second is timed: both maps have grown by then */
        for (int turn = 0; turn < turns; turn++)
            for (int n = 0; n < pings; n++) {
                p = scene_at(which, turn, turns, n);
                start = now_ns();
                enter_octomap(tree, p, voxel_m);
                theirs_ns += pass * (now_ns() - start);
            }
    for (int pass = 0; pass < 2; pass++)
        for (int turn = 0; turn < turns; turn++) {
            static scene_ping ping[SCENE_PINGS];
            for (int n = 0; n < pings; n++)
                ping[n] = scene_at(which, turn, turns, n);
            start = now_ns();
            for (int n = 0; n < pings; n++) {
                const cast_look look = {&at, ping[n].attitude, 0, 0, 0, ping[n].range_m, voxel_m};
                if (lattice_place(ping[n].position_m, voxel_m, &at) && cast_aim(&beam, &o, &look))
                    submap_cast(&map, &beam, SUBMAP_VACANCY);
            }
            ours_ns += pass * (now_ns() - start);
        }

    uint64_t covered = 0, both = 0, theirs_outside = 0, ours_outside = 0;
    int64_t cell[3];
    for (cell[0] = map.box.first[0]; cell[0] < map.box.first[0] + map.box.size[0]; cell[0]++)
        for (cell[1] = map.box.first[1]; cell[1] < map.box.first[1] + map.box.size[1]; cell[1]++)
            for (cell[2] = map.box.first[2]; cell[2] < map.box.first[2] + map.box.size[2]; cell[2]++) {
                bool outside = which != 'B' && !in_shaft(cell, voxel_m);
                bool ours = submap_count(&map, SUBMAP_VACANCY, cell) > 0;
                if (!ours && !outside)
                    continue;
                const octomap::OcTreeNode *node =
                    tree.search((double(cell[0]) + 0.5) * voxel_m, (double(cell[1]) + 0.5) * voxel_m,
                                (double(cell[2]) + 0.5) * voxel_m);
                bool theirs = node && !tree.isNodeOccupied(node);
                covered += ours;
                both += ours && theirs;
                theirs_outside += outside && theirs;
                ours_outside += outside && ours;
            }
    int n = turns * pings, by_octomap = 0, by_submap = 0;
    if (which != 'B')
        walls_left(tree, map, p, voxel_m, &by_octomap, &by_submap);
    tree.updateInnerOccupancy();
    if (csv) {
        printf("%c,%g,%d,%.2f,%.2f,%.6g,%.6g,%d,%d\n", which, voxel_m, n, 100.0 * double(both) / double(covered),
               100.0, double(theirs_outside) * pow(voxel_m, 3), double(ours_outside) * pow(voxel_m, 3), by_octomap,
               by_submap);
        free(memory);
        free(directory);
        return theirs_ns / ours_ns;
    }
    printf("%c %5.2f m, %6d pings: OctoMap %10.1f us/ping %6.1f MB (%.1f bytes per free voxel), free of the "
           "beams' voxels %5.1f %%, "
           "outside %llu, wall in %d of 360\n%25s sonard %10.3f us/ping %6.1f MB (%.1f), outside %llu, wall in "
           "%d: %.0f "
           "times as fast\n",
           which, voxel_m, n, theirs_ns / n / 1e3, double(tree.memoryUsage()) / 1e6,
           double(tree.memoryUsage()) / double(covered), 100.0 * double(both) / double(covered),
           (unsigned long long)theirs_outside, by_octomap, "", ours_ns / n / 1e3,
           double(map.n_tiles * pool.tile_bytes) / 1e6, double(map.n_tiles * pool.tile_bytes) / double(covered),
           (unsigned long long)ours_outside, by_submap, theirs_ns / ours_ns);
    free(memory);
    free(directory);
    return theirs_ns / ours_ns;
}

struct aim {
    char scene;
    double voxel_m;
    int turns, pings, must, should;
};

/* What the report shows; speed is left to the benchmark. */
static void for_report(bool quick)
{
    csv = true;
    printf("scene,voxel_m,pings,octomap_found,sonard_found,octomap_outside_m3,sonard_outside_m3,octomap_wall,"
           "sonard_wall\n");
    for (char which : {'A', 'T'}) {
        compare(which, 0.5, quick ? 5 : 100, SCENE_PINGS);
        if (!quick)
            compare(which, 0.2, 100, SCENE_PINGS);
    }
    if (quick)
        return;
    compare('A', 0.1, 100, SCENE_PINGS);
    compare('B', 0.5, 2, SCENE_PINGS);
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "csv") == 0) {
        for_report(argc > 2);
        return 0;
    }
    if (argc == 5) {
        compare(argv[1][0], atof(argv[2]), atoi(argv[3]), atoi(argv[4]));
        return 0;
    }
    static const aim aims[] = {
        {'A', 0.5, 100, SCENE_PINGS, 50, 100},  {'A', 0.2, 100, SCENE_PINGS, 250, 400},
        {'A', 0.1, 20, SCENE_PINGS, 600, 1000}, {'A', 0.05, 1, SCENE_PINGS, 1500, 2800},
        {'B', 0.5, 2, SCENE_PINGS, 1500, 2600}, {'B', 0.2, 1, 20, 1000, 2200},
    };
    double ratio[sizeof aims / sizeof aims[0]];
    for (size_t a = 0; a < sizeof aims / sizeof aims[0]; a++)
        ratio[a] = compare(aims[a].scene, aims[a].voxel_m, aims[a].turns, aims[a].pings);
    printf("\ntimes as fast as OctoMap    reached   must  should\n");
    for (size_t a = 0; a < sizeof aims / sizeof aims[0]; a++)
        printf("%c %5.2f m %26.0f %6d %7d\n", aims[a].scene, aims[a].voxel_m, ratio[a], aims[a].must,
               aims[a].should);
    return 0;
}
