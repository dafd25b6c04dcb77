/* SPDX-License-Identifier: MIT */
/*
 * pager - keeps the map of places within its memory: the oldest submaps go to files in the map's folder. One comes back
 * when somebody asks for a place where it has a tile, or the vehicle is at such a place near its base. One at a time, by
 * a thread of its own that may wait for the disk; pings wait for nothing but the copying of a submap, and the loop for
 * nothing. In a replay it waits for that thread and for the owner, so that the same capture gives the same map.
 *
 * A submap is given up in memory only when its file is safe. Where the disk refuses or is too slow, the map itself
 * forgets the oldest (voxmap_low): counted, and unknown. Pages belong to one run; they are removed at its end, or at the
 * start of the next. A folder belongs to one daemon: it holds a lock on the file .lock there.
 */
#ifndef SONARD_PAGER_H
#define SONARD_PAGER_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

#include "../config/conf.h"
#include "loop.h"
#include "map_file.h"
#include "pipeline.h"

struct daemon;

/* The map's owner looks and packs, the thread writes; or the thread reads. Then the owner takes it out, or in. */
enum pager_state { PAGER_IDLE, PAGER_LOOKING, PAGER_PACKING, PAGER_WRITING, PAGER_READING, PAGER_TAKING };

/* What the map's owner does for it: while it is out, all this is its. */
struct pager_errand {
    struct errand errand;
    struct daemon *d;
    bool wanted, placed; /* a look: the places that somebody asked for, and where the vehicle is */
    double wanted_m[3], vehicle_m[3];
    uint64_t out, in; /* to put away, to bring back; 0: none */
    size_t size;      /* of what is to be put away; 0: there is nothing any more */
    bool due;         /* one that is away should be here */
    uint64_t id;      /* a page: of this submap, ... */
    uint8_t *room;    /* ... packed to here, `size` bytes, or ... */
    const struct map_bytes *bytes; /* ... what a file has of it */
    bool done;
    char err[200];
};

struct pager {
    enum pager_state state;
    struct pager_errand errand;
    uint64_t id;        /* of the submap under way */
    bool wanted;        /* somebody asked for ... */
    double wanted_m[3]; /* ... what is there */
    uint64_t out, in;   /* submaps written, brought back */
    uint64_t errors;    /* writes and reads that failed */
    uint64_t newest;    /* the largest id that ever had a file */
    int lock;           /* descriptor of the folder's lock; below 0: none */
    struct loop_timer timer;
    struct loop_fd ended; /* an eventfd */
    pthread_t thread;     /* while it writes or reads */
    /* of the thread while one is under way */
    struct voxmap_setting setting;
    struct map_bytes bytes;
    char path[CONF_TEXT_MAX + 40], message[400];
    bool good;
};

/** pager_start - from here on submaps go and come. Nothing without a map or a folder.
 * The folder is made if only its last component is missing. False with a sentence in err, also when another daemon uses
 * the folder. */
bool pager_start(struct daemon *d, char *err, size_t err_size);

/** pager_want - a place that answers unknown because its submap is away. */
void pager_want(struct daemon *d, const double place_m[3]);

/** pager_path - the file of a submap that is away. */
void pager_path(const char *folder, uint64_t id, char *path, size_t size);

/** pager_end - waits for what is under way and removes the pages. */
void pager_end(struct daemon *d);

#endif
