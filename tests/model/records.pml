/* SPDX-License-Identifier: MIT */
/*
 * records - records that one thread writes and another reads where they lie (daemon/pipeline/records.c, grid/water/pool.c),
 * every access to what both share one step of the model. The owner writes each record into the slot that is idle for the
 * longest time, and publishes the list of the newest KEPT. The loop tells how far it has come, opens up to two lists, reads
 * their records in any order, with anything between, and closes them in any order, or never: a list that is more than HELD
 * lists old is taken away when the loop tells, and its question reads no more until it has opened another. Copying a list
 * is one step here: that it is whole is what snapshot.pml is about; that it may fail, and then leaves nothing to read, is
 * part of this model.
 * Loads and stores are sequentially consistent: the thread sanitizer and the stress test look at the memory orders.
 *
 * Checked over all interleavings:
 *   - what is read of a list is what its records were when it was published, whole
 *   - the owner has no step at which it waits, and leaves a record out only when the loop has been silent for SPARE - HELD
 *     lists, whatever is open
 *   - what the loop tells only grows
 *
 * Deliberately broken, to be refuted: -DBROKEN_TAKE takes a slot without looking how far the loop is, -DBROKEN_SINCE holds a
 * slot for idle one list too early, -DBROKEN_TELL tells the newest list while an older one is open, -DBROKEN_CLOSE does so
 * when the newer one of two is closed, -DBROKEN_HAD reads an older list when the newest could not be copied, -DBROKEN_TURN
 * publishes the list before its record is written, -DBROKEN_PLACE writes each time over the newest record of the list as
 * well, -DBROKEN_HOLD takes nothing away, -DBROKEN_KEEPS reads on in a list that was taken, -DBROKEN_AMID tells while a
 * record is being read, as if another thread read it, -DBROKEN_BEFORE tells first and takes away then.
 */
#ifndef PINGS
#define PINGS 5
#endif
#ifndef OPENS
#define OPENS 3
#endif
#define KEPT  2
#define SPARE 2
#define SLOTS 4
#define HELD  1
#define NONE  255

typedef record {
    byte part[2]
};
typedef list {
    byte id[KEPT] /* slots, the newest first */
};

record slot[SLOTS];
byte number;           /* of the newest list */
list lists[PINGS + 1]; /* [n]: list n; the newest is the one that can be copied */
byte read_from;        /* the loop's word */
byte told_at;          /* ghost: the newest list when it was told */
list was[PINGS + 1];   /* ghost: the records' contents */

proctype owner()
{
    byte n, take, i, made, seen, seen_at;
    byte idle[SLOTS]; /* the longest first */
    byte since[SLOTS];
    byte idles = SLOTS;
    byte id[KEPT], content[KEPT];

    d_step {
        for (i : 0 .. SLOTS - 1) {
            idle[i] = i
        }
        id[0] = NONE;
        id[1] = NONE
    };
    for (n : 1 .. PINGS) {
        made = number + 1;
        d_step {
            seen = read_from;
            seen_at = told_at
        };
        if
#ifdef BROKEN_TAKE
        :: true ->
#else
        :: since[0] <= seen ->
#endif
            d_step {
                take = idle[0];
                idles--;
                for (i : 0 .. SLOTS - 2) {
                    idle[i] = idle[i + 1];
                    since[i] = since[i + 1]
                }
            };
#ifndef BROKEN_TURN
            slot[take].part[0] = n;
            slot[take].part[1] = n;
#endif
            d_step {
                if
                :: id[KEPT - 1] != NONE ->
                    idle[idles] = id[KEPT - 1];
#ifdef BROKEN_SINCE
                    since[idles] = made - 1;
#else
                    since[idles] = made;
#endif
                    idles++
                :: else
                fi;
                id[1] = id[0];
                content[1] = content[0];
                id[0] = take;
                content[0] = n
            }
        :: else ->
            assert(number - seen >= SPARE); /* left out */
            assert(number - seen_at >= SPARE - HELD)
        fi;
#ifdef BROKEN_PLACE
        slot[id[0]].part[0] = n;
        content[0] = n;
        slot[id[0]].part[1] = n;
#endif
        d_step {
            for (i : 0 .. KEPT - 1) {
                lists[made].id[i] = id[i];
                was[made].id[i] = content[i]
            }
            number = made
        };
#ifdef BROKEN_TURN
        if
        :: content[0] == n ->
            slot[take].part[0] = n;
            slot[take].part[1] = n
        :: else
        fi
#endif
    }
}

/* open[0] is the older one; NONE: it is not open. */
inline take()
{
    d_step {
        do
        :: open[0] != NONE && now - open[0] > HELD ->
#ifdef BROKEN_KEEPS
            taken = open[0];
#endif
            open[0] = open[1];
            open[1] = NONE
        :: else -> break
        od
    }
}

inline tell()
{
    now = number;
#ifndef BROKEN_HOLD
#ifndef BROKEN_BEFORE
    take();
#endif
#endif
    if
#ifdef BROKEN_TELL
    :: true -> told = now
#else
    :: open[0] != NONE -> told = open[0]
    :: open[0] == NONE -> told = now
#endif
    fi;
    assert(told >= read_from);
    d_step {
        read_from = told;
        told_at = now
    };
#ifdef BROKEN_BEFORE
    take();
#endif
    now = 0;
    told = 0
}

/* A record of list l. */
inline read(l)
{
    if
    :: i = 0
    :: i = 1
    fi;
    s = lists[l].id[i];
    if
    :: l > 0 && s != NONE ->
        first = slot[s].part[0];
        assert(first == was[l].id[i]);
#ifdef BROKEN_AMID
        tell();
#endif
        assert(slot[s].part[1] == was[l].id[i])
    :: else
    fi;
    i = 0;
    s = 0;
    first = 0
}

proctype loop()
{
    byte open[2], now, told, opened, had, k, l, i, s, first;
    byte taken = NONE; /* a list that its question has no more */

    open[0] = NONE;
    open[1] = NONE;
    do
    :: opened < OPENS && open[1] == NONE ->
        opened++;
        if
        :: open[1] = number; had = open[1]
        :: true -> /* overtaken: nothing is open */
#ifdef BROKEN_HAD
            open[1] = had;
#endif
            skip
        fi;
        d_step {
            if
            :: open[0] == NONE -> open[0] = open[1]; open[1] = NONE
            :: else
            fi
        }
    :: open[0] != NONE -> /* a record is read */
        if
        :: k = 0
        :: open[1] != NONE -> k = 1
        fi;
        l = open[k];
        read(l);
        if
        :: true -> skip
        :: d_step { open[k] = NONE; /* and it is closed */
                if
                :: k == 0 -> open[0] = open[1]; open[1] = NONE
                :: else
                fi
            };
#ifdef BROKEN_CLOSE
            told = number;
            read_from = told
#else
            tell()
#endif
        fi;
        k = 0;
        l = 0
#ifdef BROKEN_KEEPS
    :: taken != NONE -> read(taken)
#endif
    :: tell()
    :: opened == OPENS && open[0] == NONE -> break
    od
}

init
{
    atomic {
        run owner();
        run loop()
    }
}
