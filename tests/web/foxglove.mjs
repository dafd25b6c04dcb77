// SPDX-License-Identifier: MIT
// Subscribes to every topic of a server with @foxglove/ws-protocol, and decodes with protobufjs: readers that share no code
// with ours. Prints as JSON what the server said of itself, its channels, and one message of each topic. foxglove.mjs URL
import { createRequire } from "node:module";

const require = createRequire(process.env.FOXGLOVE_MODULES + "/");
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { WebSocket } = require("ws");
const protobuf = require("protobufjs");
const { FileDescriptorSet } = require("protobufjs/ext/descriptor");

const client = new FoxgloveClient({ ws: new WebSocket(process.argv[2], [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
const out = { server: null, channels: [], messages: {}, errors: [] }, topics = new Map(), types = new Map();
// As Foxglove has it: fields that are not there have their defaults, names of words, numbers beyond 2^53 as text.
function decoded(topic, data) {
  const type = types.get(topic);
  const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  return type.toObject(type.decode(bytes), { defaults: true, longs: String, enums: String, bytes: String });
}
function end() {
  client.close();
  process.stdout.write(JSON.stringify(out), () => process.exit(0));
}
client.on("error", (e) => out.errors.push(String(e.message || e)));
client.on("serverInfo", (info) => (out.server = info));
client.on("status", (s) => out.errors.push(s.message));
client.on("advertise", (channels) => {
  for (const c of channels) {
    out.channels.push(c);
    const root = protobuf.Root.fromDescriptor(FileDescriptorSet.decode(Buffer.from(c.schema, "base64")));
    types.set(c.topic, root.lookupType(c.schemaName));
    topics.set(client.subscribe(c.id), c.topic);
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const topic = topics.get(subscriptionId);
  if (topic in out.messages) return;
  out.messages[topic] = { timestamp: Number(timestamp) / 1e9, data: decoded(topic, data) };
  client.unsubscribe(subscriptionId);
  if (Object.keys(out.messages).length === topics.size) end();
});
setTimeout(end, 20000);
