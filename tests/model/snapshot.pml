/* SPDX-License-Identifier: MIT */
/*
 * snapshot - a record of two parts that one thread publishes and another reads, every step of core/snapshot.h one step
 * of the model. PARTS: as grid/picture/ does, some parts change at a time and the side behind follows;
 * otherwise every record replaces all of the one before. Loads and stores are sequentially consistent here: the model
 * judges the algorithm, not the memory orders (the thread sanitizer and the stress test look at those).
 *
 * Checked over all interleavings:
 *   - what a reader accepts is one publication, whole: the newest when it began, or a later one, never an older one
 *   - the writer has no step at which it waits, the reader at most TRIES tries, and then the record it had: no deadlock
 *   - a reader that nobody interrupts, as one above the writer on its processor, needs one try wherever the writer is
 *
 * Deliberately broken, to be refuted: -DBROKEN_SIDE writes the side in front, -DBROKEN_ORDER turns before the words are
 * there, -DBROKEN_STILL accepts every copy, -DBROKEN_FOLLOW leaves what is behind as it was, -DBROKEN_HAD keeps a copy that
 * was overtaken. -DODD_NUMBER is a sequence lock, odd while the writer writes: its reader waits for the writer.
 */
#ifndef PUBLICATIONS
#define PUBLICATIONS 4
#endif
#ifndef READS
#define READS 2
#endif
#define TRIES 2

typedef side {
    byte part[2]
};

byte number;      /* of publications; a sequence lock: twice that, and 1 more while the writer writes */
side sides[2];
side history[PUBLICATIONS + 1]; /* ghost: what publication n was */

#ifdef ODD_NUMBER
#define PUBLISHED (number / 2)
#define FRONT(n)  0
#define BEHIND    0
#define GOOD(n)   (number == n && n % 2 == 0)
#else
#define PUBLISHED number
#define FRONT(n)  ((n) & 1)
#define GOOD(n)   (number == n)
#ifdef BROKEN_SIDE
#define BEHIND    (number & 1)
#else
#define BEHIND    ((number + 1) & 1)
#endif
#endif

/* Publication n: `first` and `second` say which parts change. */
proctype writer()
{
    byte n;
    bit b;
    bool first, second;

    for (n : 1 .. PUBLICATIONS) {
        atomic {
#ifdef PARTS
            if
            :: first = true; second = false
            :: first = false; second = true
            :: first = true; second = true
            fi;
#else
            first = true;
            second = true;
#endif
            history[n].part[0] = (first -> n : history[n - 1].part[0]);
            history[n].part[1] = (second -> n : history[n - 1].part[1]);
            b = BEHIND
        };
#ifdef ODD_NUMBER
        number++;
#endif
#ifdef BROKEN_ORDER
        number++;
#endif
        if
        :: first -> sides[b].part[0] = n
        :: else
        fi;
        if
        :: second -> sides[b].part[1] = n
        :: else
        fi;
#ifndef BROKEN_ORDER
        number++;
#endif
#if defined(PARTS) && !defined(BROKEN_FOLLOW) && !defined(ODD_NUMBER)
        if
        :: first -> sides[1 - b].part[0] = sides[b].part[0]
        :: else
        fi;
        if
        :: second -> sides[1 - b].part[1] = sides[b].part[1]
        :: else
        fi
#endif
    }
}

/* One try; got says whether its copy is accepted. */
inline try()
{
    n = number;
    copy.part[0] = sides[FRONT(n)].part[0];
    copy.part[1] = sides[FRONT(n)].part[1];
#ifdef BROKEN_STILL
    got = true
#else
    got = GOOD(n)
#endif
}

/* Is the copy publication k for some k from `from` on? Ghost. */
inline assert_published(from)
{
    whole = false;
    for (k : from .. PUBLICATIONS) {
        if
        :: k <= PUBLISHED && history[k].part[0] == copy.part[0] && history[k].part[1] == copy.part[1] -> whole = true
        :: else
        fi
    }
    assert(whole)
}

proctype reader()
{
    byte n, k, r, tries, since;
    bool got, whole;
    side copy, had;

    for (r : 1 .. READS) {
        since = PUBLISHED;
        tries = 0;
        got = false;
        do
        :: got || tries == TRIES -> break
        :: else -> try(); tries++
        od;
        skip; /* no jump may lead into what follows */
        d_step {
            if
            :: got -> assert_published(since); had.part[0] = copy.part[0]; had.part[1] = copy.part[1]
            :: else ->
#ifdef BROKEN_HAD
                had.part[0] = copy.part[0]; had.part[1] = copy.part[1];
#endif
                copy.part[0] = had.part[0]; copy.part[1] = had.part[1];
                assert_published(0)
            fi
        }
    }
}

/* Above the writer on its processor: all of it in one step, at any time. */
proctype preempting_reader()
{
    byte n, k;
    bool got, whole;
    side copy;

    d_step {
        try();
        assert(got);
        assert_published(PUBLISHED)
    }
}

init
{
    atomic {
        run writer();
        run reader();
        run preempting_reader()
    }
}
