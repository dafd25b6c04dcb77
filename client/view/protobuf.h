/* SPDX-License-Identifier: MIT */
/*
 * protobuf - messages as Protocol Buffers (proto3) and the description that readers decode them by. Source: the
 * encoding of protobuf.dev, descriptor.proto.
 */
#ifndef SONARD_PROTOBUF_H
#define SONARD_PROTOBUF_H

#include <jansson.h>

#include "bytes.h"
#include "message.h"

/** protobuf_schema - a FileDescriptorSet of the type and of all that it is made of, one file each, in this order. */
void protobuf_schema(const struct message_type *type, struct bytes *out);

/** protobuf_message - a message of the type; members that are no fields, or of another kind, are left out. */
void protobuf_message(const struct message_type *type, const json_t *message, struct bytes *out);

#endif
