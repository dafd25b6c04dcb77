/* SPDX-License-Identifier: MIT */
#include "steer.h"

void steer_begin(struct steer *s, uint64_t now_ns)
{
    if (s->pings)
        s->pace_ns = (double)(now_ns - s->started_ns) / s->pings;
    s->started_ns = now_ns;
    s->pings = 0;
}

void steer_ping(struct steer *s)
{
    s->pings++;
}

bool steer_has_time(const struct steer *s, unsigned plain, unsigned pass, unsigned turn, uint64_t now_ns)
{
    if (!s->circle_ns)
        return plain >= pass;
    if (!(s->pace_ns > 0) && !s->pings)
        return false;
    const double pace_ns = s->pace_ns > 0 ? s->pace_ns : (double)(now_ns - s->started_ns) / s->pings;
    /* a turn that begins with a pass has one more in it than fit in between */
    const double room = (double)s->circle_ns / pace_ns - turn - pass;
    return plain >= pass && plain * room >= (double)turn * pass;
}

bool steer_seen_add(struct steer_seen *seen, unsigned angle, unsigned step, unsigned turn)
{
    const unsigned arcs = turn / step, at = angle / step, arc = at < arcs ? at : arcs - 1;
    const bool new_turn = seen->n >= arcs;
    if (new_turn)
        *seen = (struct steer_seen){0};
    seen->n = (uint16_t)(seen->n + !(seen->arcs[arc / 64] >> (arc % 64) & 1));
    seen->arcs[arc / 64] |= 1ull << (arc % 64);
    return new_turn;
}
