// SPDX-License-Identifier: MIT
// Subscribes to every topic of a server with @foxglove/ws-protocol, a client that shares no code with ours, and prints as
// JSON what the server said of itself, its channels, and one message of each topic. foxglove.mjs URL
import { createRequire } from "node:module";

const require = createRequire(process.env.FOXGLOVE_MODULES + "/");
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { WebSocket } = require("ws");

const client = new FoxgloveClient({ ws: new WebSocket(process.argv[2], [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
const out = { server: null, channels: [], messages: {}, errors: [] }, topics = new Map();
const end = () => process.stdout.write(JSON.stringify(out), () => process.exit(0));
client.on("error", (e) => out.errors.push(String(e.message || e)));
client.on("serverInfo", (info) => (out.server = info));
client.on("status", (s) => out.errors.push(s.message));
client.on("advertise", (channels) => {
  for (const c of channels) {
    out.channels.push({ ...c, schema: JSON.parse(c.schema) });
    topics.set(client.subscribe(c.id), c.topic);
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const topic = topics.get(subscriptionId);
  out.messages[topic] = { timestamp: Number(timestamp) / 1e9, data: JSON.parse(new TextDecoder().decode(data)) };
  client.unsubscribe(subscriptionId);
  if (Object.keys(out.messages).length === topics.size) end();
});
setTimeout(end, 20000);
