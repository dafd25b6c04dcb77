/* SPDX-License-Identifier: MIT */
#include "can_frame.h"

#include <string.h>

bool can_frame_read(const uint8_t *record, size_t n, struct canfd_frame *out)
{
    memset(out, 0, sizeof *out);
    if (n != CAN_MTU && n != CANFD_MTU)
        return false;
    memcpy(out, record, n);
    size_t room = n == CAN_MTU ? CAN_MAX_DLEN : CANFD_MAX_DLEN;
    if (out->len > room)
        return false;
    memset(out->data + out->len, 0, sizeof out->data - out->len);
    return true;
}

bool can_frame_is_data(const struct canfd_frame *frame)
{
    return !(frame->can_id & (CAN_ERR_FLAG | CAN_RTR_FLAG));
}

bool can_frame_matches(const struct canfd_frame *frame, struct can_match match)
{
    return (frame->can_id & match.mask) == (match.id & match.mask);
}
