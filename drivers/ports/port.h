/* SPDX-License-Identifier: MIT */
/*
 * port - moves bytes or CAN frames and knows no protocol. One ops table per kind of wire, listed in port_table.c;
 * a new wire is a new port_*.c and a line there.
 *
 * Addresses are written "kind:rest", for instance serial:/dev/ttyUSB0:115200. All descriptors are non-blocking and
 * close-on-exec.
 */
#ifndef SONARD_PORT_H
#define SONARD_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/types.h>

#include "can_frame.h"
#include "core/fault.h"

#define PORT_ADDRESS_MAX 256

#define PORT_FAR_MAX 4

struct port;

/* The far ends that a host's name stands for; they are tried in turn. */
struct port_far {
    unsigned n;
    struct sockaddr_storage at[PORT_FAR_MAX];
};

struct port_ops {
    const char *kind; /* what stands before the first colon of an address */

    /* Message encoding of a capture channel: "octet-stream", or "socketcan" for can_frame/canfd_frame records. */
    const char *encoding;

    /*
     * Is `rest` (behind the colon) well formed? Opens nothing. False with a sentence in fault that says what would be
     * right.
     */
    bool (*check)(const char *rest, struct fault *fault);

    /* Speed of the line in baud that a checked `rest` asks for; NULL: such wires have none. */
    unsigned (*baud)(const char *rest);

    /* Of wires without baud, a line that is no faster than they are at the least; 0: their time does not count. */
    unsigned least_baud;

    /* Must a checked `rest` be looked up before each open, into port->far? NULL: such wires have no names. */
    bool (*named)(const char *rest);

    /* Ask the name service, which may take many seconds: not in the loop. False with a sentence in fault. */
    bool (*look_up)(const char *rest, struct port_far *far, struct fault *fault);

    /*
     * Open; port->fd on success. False with a sentence in fault; errno of the cause is left in port->error. With
     * port->connecting the wire is on its way: once fd is writable, `connected` tells whether it is there.
     */
    bool (*open)(struct port *port, const char *rest, struct fault *fault);

    /* As open; NULL: such wires need not connect. False: close the port. */
    bool (*connected)(struct port *port, const char *rest, struct fault *fault);

    /* Bytes read; 0: nothing now; -1: the wire is gone (port->error says why) and the port must be closed. */
    ssize_t (*read)(struct port *port, void *buf, size_t size);

    /* Bytes taken (0 when the line is full); -1 as above. */
    ssize_t (*write)(struct port *port, const void *buf, size_t size);

    /* Begin or end to hold the line in break state (serial); elsewhere what the wire has for it, or nothing. */
    void (*hold_break)(struct port *port, bool on);

    void (*close)(struct port *port); /* closed ports may be closed again */
};

/* What a CAN controller tells of itself, as far as it does. */
enum bus_state {
    BUS_NONE, /* the wire is no CAN bus, or was never tried */
    BUS_DOWN, /* there is no such interface, or it is down */
    BUS_UP,
    BUS_WARNING, /* 96 errors or more */
    BUS_PASSIVE, /* 128 or more */
    BUS_OFF,     /* 256: takes no part any more until it is restarted */
};

struct port_bus {
    enum bus_state state;
    uint8_t tx_errors, rx_errors; /* the controller's own counters, when it last reported them */
    /* These only grow. */
    uint64_t error_frames, bus_offs, restarts;
    uint64_t controller_overflows; /* reports of them */
    uint64_t transfer_errors;      /* messages given up by ISO-TP */
    uint64_t not_sent;             /* frames dropped because the interface's queue was full */
};

struct port {
    const struct port_ops *ops;
    int fd;                     /* -1: closed. Readable means: call ops->read */
    int error;                  /* errno of the last failure */
    unsigned baud;              /* serial only */
    bool connecting;            /* open, but not connected yet: neither read nor write */
    struct port_far far;        /* of a name: set before open */
    unsigned connects;          /* tries so far */
    uint64_t lost;              /* datagrams or frames that came and found no room in the kernel; only grows */
    uint32_t lost_here;         /* of these, the kernel's own count for this descriptor */
    uint64_t refused;           /* datagrams sent that nobody was there to take, as far as the network said so */
    bool only_listens;          /* set before open: its user sends nothing, so nobody can answer it */
    bool listens;               /* UDP: only hears; what is written is refused */
    uint8_t hears[16];          /* then: the address whose datagrams are taken */
    size_t hears_bytes;         /* of it: 4, 16, or 0 for everybody's */
    uint64_t strangers;         /* datagrams of others, dropped; only grows */
    char stranger[48];          /* the first of these others; empty: none */
    int64_t unix_offset_ns;     /* time of day less monotonic, at the last frame that was stamped */
    int64_t clock_set_ns;       /* when it was last seen that the time of day was set, monotonic; 0: never */
    uint64_t t_ns;              /* when the last read's bytes came in, monotonic; 0: not known, it was just now */
    struct can_match can_match; /* CAN: set before open, which frames are to be heard */
    uint32_t can_send_id;       /* CAN streams only */
    struct port_bus bus;
};

extern const struct port_ops *const port_table[]; /* NULL at its end */
extern const struct port_ops port_serial;
extern const struct port_ops port_udp;
extern const struct port_ops port_tcp;
extern const struct port_ops port_can;
extern const struct port_ops port_canstream;
extern const struct port_ops port_isotp;

/**
 * port_find - the ops for "kind:rest", and where rest begins.
 * NULL with a sentence in fault when the kind is unknown or rest is malformed.
 */
const struct port_ops *port_find(const char *address, const char **rest, struct fault *fault);

#endif
