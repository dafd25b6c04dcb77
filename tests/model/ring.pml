/* SPDX-License-Identifier: MIT */
/*
 * ring - the buffers between two threads of the pipeline, every step of core/ring.h one step of the model: the
 * producer takes an idle buffer or steals the oldest waiting one, fills it, lets it wait; the consumer takes the
 * oldest, works, gives it back. Loads and stores are sequentially consistent here: the model judges the algorithm,
 * not the memory orders (the thread sanitizer and the stress test look at those).
 *
 * Checked over all interleavings:
 *   - a buffer is at any time in exactly one place: idle, producer, waiting, consumer
 *   - nobody writes a buffer that another reads
 *   - whoever takes gets the oldest that waits: order is kept, and only the oldest are dropped
 *   - a ring with room for all buffers is never full
 *   - the consumer ends only when every ping was consumed or dropped, none lost, none twice; no deadlock
 *
 * Deliberately broken, to be refuted: -DBROKEN_PUBLISH advances tail before the slot is written, -DBROKEN_HEAD
 * moves head by a load and a store, -DBROKEN_WAKE does not post for the stop, -DBROKEN_STOP stops while pings wait.
 */
#ifndef BUFFERS
#define BUFFERS 3
#endif
#ifndef PINGS
#define PINGS 5
#endif
#define SIZE    4   /* of a ring: the power of two that holds all buffers */
#define START   254 /* the indices, bytes here, wrap on the way */

#define SLOT(i) ((i) & (SIZE - 1))

typedef ring {
    byte head, tail;
    byte slot[SIZE]
};

mtype = { idle, producing, waiting, consuming };

ring ping_ring, idle_ring;
mtype place[BUFFERS];    /* ghost: where each buffer is */
byte number[BUFFERS];    /* of the ping in it */
byte busy[BUFFERS];      /* ghost: how many threads touch its content */
byte news;               /* the semaphore */
bool stop;
byte consumed, dropped, last;

/* The oldest of all that wait? */
inline assert_oldest(b)
{
    for (k : 0 .. BUFFERS - 1) {
        assert(k == b || place[k] != waiting || number[k] > number[b])
    }
}

/* ring_put: the buffer b of `from` goes to `to`. */
inline put(r, b, from, to)
{
    t = r.tail;
    assert(((t - r.head) & 255) < SIZE);
#ifdef BROKEN_PUBLISH
    atomic { r.tail = (t + 1) & 255; assert(place[b] == from); place[b] = to };
    r.slot[SLOT(t)] = b;
#else
    r.slot[SLOT(t)] = b;
    atomic { r.tail = (t + 1) & 255; assert(place[b] == from); place[b] = to };
#endif
}

/* The compare-and-swap at the end of ring_take; `got` says whether it won. */
inline swap_head(r, h, b, from, to)
{
#ifdef BROKEN_HEAD
    got = (r.head == h);
    if
    :: got -> atomic { r.head = (h + 1) & 255; assert(place[b] == from); place[b] = to }
    :: else
    fi
#else
    atomic {
        got = (r.head == h);
        if
        :: got -> r.head = (h + 1) & 255; assert(place[b] == from);
            if
            :: from == waiting -> assert_oldest(b)
            :: else
            fi;
            place[b] = to
        :: else
        fi
    }
#endif
}

/* ring_take: got says whether b is an entry of r. */
inline take(r, b, from, to)
{
    h = r.head;
    do
    :: got = false;
        if
        :: h == r.tail -> break
        :: else
        fi;
        b = r.slot[SLOT(h)];
        swap_head(r, h, b, from, to);
        if
        :: got -> break
        :: else -> h = r.head
        fi
    od
}

inline touch(b)
{
    busy[b]++;
    assert(busy[b] == 1);
    busy[b]--
}

proctype producer()
{
    byte b, h, t, k, n;
    bool got;

    for (n : 1 .. PINGS) {
        do
        :: take(idle_ring, b, idle, producing);
            if
            :: got -> break
            :: else
            fi;
            take(ping_ring, b, waiting, producing);
            if
            :: got -> dropped++; break
            :: else
            fi
        od;
        touch(b);
        number[b] = n;
        put(ping_ring, b, producing, waiting);
        news++
    }
#ifndef BROKEN_STOP
    (consumed + dropped == PINGS);
#endif
    stop = true;
#ifndef BROKEN_WAKE
    news++
#endif
}

proctype consumer()
{
    byte b, h, t, k;
    bool got;

    do
    :: take(ping_ring, b, waiting, consuming);
        if
        :: got ->
            touch(b);
            assert(number[b] > last);
            last = number[b];
            consumed++;
            put(idle_ring, b, consuming, idle)
        :: else ->
            if
            :: stop -> break
            :: else -> atomic { news > 0 -> news-- }
            fi
        fi
    od;
    assert(consumed + dropped == PINGS)
}

init
{
    byte k;

    atomic {
        ping_ring.head = START;
        ping_ring.tail = START;
        idle_ring.head = START;
        idle_ring.tail = (START + BUFFERS) & 255;
        for (k : 0 .. BUFFERS - 1) {
            place[k] = idle;
            idle_ring.slot[SLOT(START + k)] = k
        }
        run producer();
        run consumer()
    }
}
