/* SPDX-License-Identifier: MIT */
#include "counters.h"

#include <string.h>

#define FILL(out, ...)                                                                                            \
    const struct counter list[] = {__VA_ARGS__};                                                                  \
    _Static_assert(sizeof list / sizeof list[0] <= COUNTERS_MAX, "COUNTERS_MAX is too small");                    \
    memcpy(out, list, sizeof list);                                                                               \
    return sizeof list / sizeof list[0]

unsigned counters_sensor(const struct source_stats *s, uint64_t dropped, struct counter *out)
{
    FILL(out, {"frames", "valid messages", s->device.frames},
         {"garbage_bytes", "bytes outside any message", s->device.garbage_bytes},
         {"cut_bytes", "bytes of messages cut off by the loss of the port", s->device.cut_bytes},
         {"bad_checksum", "messages with a wrong checksum", s->device.bad_checksum},
         {"bad_frame", "malformed messages", s->device.bad_frame},
         {"lost_frames", "messages missing by their sequence number", s->device.lost_frames},
         {"nacks", "requests that the sonar refused", s->device.nacks},
         {"timeouts", "requests that the sonar left unanswered", s->device.timeouts},
         {"restarts", "times the sonar was set up again", s->device.restarts},
         {"taken_over", "times the sonar had settings that were not sent", s->device.taken_over},
         {"reconnects", "times the port was reopened", s->reconnects},
         {"undated_pings", "pings received while sonard was stalled (arrival time unknown)", s->undated_pings},
         {"tap_lost_bytes", "bytes not read from the tap", s->tap.dropped},
         {"tap_refused_bytes", "bytes written to the tap and discarded", s->tap.refused},
         {"port_lost", "bytes or frames lost in the port", s->port_lost},
         {"port_refused", "bytes or frames that the port did not take", s->port_refused},
         {"port_strangers", "datagrams or messages of others than who is believed: dropped", s->port_strangers},
         {"bytes_in", "bytes received", s->bytes_in}, {"bytes_out", "bytes sent", s->bytes_out},
         {"dropped", "pings dropped because newer ones came", dropped});
}

unsigned counters_pipeline(const struct pipeline_stats *s, struct counter *out)
{
    FILL(out, {"pings", "pings handed to the pipeline", s->submitted},
         {"pings_finished", "pings entered into the picture, or dropped", s->finished},
         {"grid_cells_lost", "cells of the grid dropped, grid full", s->grid.cells_lost},
         {"grid_out_of_range", "echoes beyond the grid", s->grid.out_of_range},
         {"grid_no_attitude", "pings not entered, no attitude", s->grid.no_attitude},
         {"grid_recentred", "times the grid followed the vehicle", s->grid.recentred},
         {"grid_turned", "times the grid's axes followed the course", s->grid.turned});
}

unsigned counters_server(const struct server_stats *s, struct counter *out)
{
    FILL(out, {"clients", "clients connected in total", s->clients_total},
         {"clients_refused", "clients refused, too many connected", s->clients_refused},
         {"clients_cut", "clients cut off", s->clients_cut}, {"requests", "requests handled", s->requests},
         {"request_errors", "requests answered with an error", s->errors},
         {"notifications_sent", "notifications sent to watching clients", s->notifications_sent},
         {"notifications_skipped", "notifications skipped because the client was slow", s->notifications_skipped});
}
