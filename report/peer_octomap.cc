/* SPDX-License-Identifier: MIT */
/* peer_octomap - OctoMap's own way to enter a scan, a cloud of points from one place; see peer.h. */
#include <octomap/octomap.h>

extern "C" {
#include "peer.h"
}

struct peer {
    octomap::OcTree tree;
};

struct peer *peer_make(double voxel_m)
{
    return new peer{octomap::OcTree(voxel_m)};
}

void peer_free(struct peer *p)
{
    delete p;
}

void peer_enter(struct peer *p, const double from[3], const float (*to)[3], size_t n, double most_m)
{
    octomap::Pointcloud ends;
    for (size_t i = 0; i < n; i++)
        ends.push_back(to[i][0], to[i][1], to[i][2]);
    p->tree.insertPointCloud(ends, octomap::point3d(float(from[0]), float(from[1]), float(from[2])), most_m, true,
                             false);
}

size_t peer_bytes(const struct peer *p)
{
    return p->tree.memoryUsage();
}

enum peer_state peer_at(const struct peer *p, const double at[3])
{
    const octomap::OcTreeNode *node = p->tree.search(at[0], at[1], at[2]);
    return !node ? PEER_UNKNOWN : p->tree.isNodeOccupied(node) ? PEER_OCCUPIED : PEER_FREE;
}
