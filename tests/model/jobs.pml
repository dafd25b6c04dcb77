/* SPDX-License-Identifier: MIT */
/*
 * jobs - what the loop has the owner of the grids do (daemon/pipeline/owner_jobs.c, pipeline_maps.c), every access to
 * what both share one step of the model: jobs of one or two steps, sent one at a time, some of them dropped when their
 * client goes; synchronous calls, for which the loop waits; and pings, for which the same semaphore is posted. Loads and
 * stores are sequentially consistent here: the model judges the algorithm, not the memory orders.
 *
 * Checked over all interleavings:
 *   - no wake-up is lost: whatever was sent, the loop and the owner both come to their ends
 *   - at most one job is out; a job is done whole or, when it was dropped before it began, not at all, and comes back once
 *   - nobody touches a job that another works on
 *
 * Deliberately broken, to be refuted: -DBROKEN_POST does not wake the owner for a second step, -DBROKEN_TELL wakes the loop
 * before the job is there, -DBROKEN_DROP drops a job without looking whether it has begun, -DBROKEN_CALL wakes the owner
 * before the call is there.
 */
#ifndef JOBS
#define JOBS 3
#endif
#define CALLS 1
#define PINGS 1
#define NONE  255

mtype = { waits, out, done_, gone };

byte to_owner = NONE, done = NONE; /* of the pipeline: the one that is out, not begun yet; come back */
byte event;                        /* the eventfd */
byte news;                         /* the semaphore */
bool call, answered;               /* a synchronous call; its own semaphore */
byte pings;                        /* that wait */
bool stop;

mtype state[JOBS];
byte steps[JOBS];  /* that it has left */
byte begun[JOBS];  /* ghost: of its steps */
byte busy[JOBS];   /* ghost: how many threads touch it */
byte sent, back;   /* jobs */

inline touch(j)
{
    busy[j]++;
    assert(busy[j] == 1);
    busy[j]--
}

/* owner_jobs_do: an exchange, a step, and what comes of it. */
inline do_job()
{
    atomic { j = to_owner; to_owner = NONE };
    if
    :: j != NONE ->
        touch(j);
        begun[j]++;
        steps[j]--;
        if
        :: steps[j] > 0 ->
            to_owner = j;
#ifndef BROKEN_POST
            news++
#endif
        :: else ->
#ifdef BROKEN_TELL
            event = 1;
            done = j
#else
            done = j;
            event = 1
#endif
        fi
    :: else
    fi
}

proctype owner()
{
    byte j;
    bool called;
    do
    ::  atomic { called = call; call = false };
        if
        :: called -> do_job(); answered = true
        :: else
        fi;
        do_job();
        if
        :: atomic { pings > 0 -> pings-- }
        :: else ->
            if
            :: stop -> break
            :: else -> atomic { news > 0 -> news-- }
            fi
        fi
    od
}

/* give: the next job goes out, if none is. */
inline send_next()
{
    if
    :: now_out == NONE && sent < JOBS ->
        now_out = sent;
        sent++;
        touch(now_out);
        state[now_out] = out;
        to_owner = now_out;
        news++
    :: else
    fi
}

proctype loop()
{
    byte now_out = NONE, j, calls = CALLS, posts = PINGS;
    bool dropped;
    send_next();
    do
    :: back == JOBS && calls == 0 && posts == 0 -> break
    :: posts > 0 -> posts--; pings++; news++
    :: calls > 0 -> /* owner_run_now */
        calls--;
#ifdef BROKEN_CALL
        news++;
        call = true;
#else
        call = true;
        news++;
#endif
        atomic { answered -> answered = false }
    :: now_out != NONE && state[now_out] == out -> /* owner_job_drop: a compare-and-swap */
#ifdef BROKEN_DROP
        dropped = true;
        to_owner = NONE;
#else
        atomic {
            dropped = (to_owner == now_out);
            if
            :: dropped -> to_owner = NONE
            :: else
            fi
        };
#endif
        state[now_out] = gone; /* nobody waits for it any more */
        if
        :: dropped ->
            touch(now_out);
            back++;
            now_out = NONE;
            send_next()
        :: else
        fi
    :: event > 0 -> /* owner_jobs_take */
        event = 0;
        atomic { j = done; done = NONE };
        if
        :: j != NONE ->
            assert(j == now_out && steps[j] == 0);
            touch(j);
            if
            :: state[j] == out -> state[j] = done_
            :: else
            fi;
            back++;
            now_out = NONE;
            send_next()
        :: else
        fi
    od;
    assert(to_owner == NONE && done == NONE && !call);
    stop = true;
    news++
}

init
{
    byte i;
    atomic {
        for (i : 0 .. JOBS - 1) {
            state[i] = waits;
            steps[i] = 1 + i % 2
        }
        run owner();
        run loop()
    }
}
