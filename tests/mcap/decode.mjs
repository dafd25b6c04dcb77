// SPDX-License-Identifier: MIT
// Decodes messages by the schemas of their file with protobufjs and @foxglove/rosmsg2-serialization, which share no code with
// ours, and holds these schemas against those that Foxglove and ROS 2 publish: the same fields of the same types.
import { createRequire } from "node:module";

const require = createRequire(process.env.MCAP_MODULES + "/");
const protobuf = require("protobufjs");
const { FileDescriptorSet } = require("protobufjs/ext/descriptor");
const { foxgloveMessageSchemas, foxgloveEnumSchemas, generateProto } = require("@foxglove/schemas/internal");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");

function must(condition, why) {
  if (!condition) throw new Error(why);
}

function publishedFields(name) {
  const schema = foxgloveMessageSchemas[name];
  must(schema, `Foxglove has no ${name}`);
  const enums = Object.values(foxgloveEnumSchemas).filter((e) => e.parentSchemaName === name);
  return protobuf.parse(generateProto(schema, enums), { keepCase: true }).root.lookupType(`foxglove.${name}`);
}

const last = (type) => type.split(".").pop();

function holdType(type) {
  const published = publishedFields(type.name);
  for (const f of type.fieldsArray) {
    const of = published.fields[f.name];
    must(of, `${type.name} has no ${f.name}`);
    must(of.id === f.id && last(of.type) === last(f.type) && of.repeated === f.repeated, `${type.name}.${f.name} is ${of.id}, a ${of.type}`);
  }
  for (const e of type.nestedArray.filter((n) => n instanceof protobuf.Enum))
    must(JSON.stringify(published.get(e.name).values) === JSON.stringify(e.values), `${type.name}.${e.name} has other values`);
}

function protobufReader(schema) {
  const root = protobuf.Root.fromDescriptor(FileDescriptorSet.decode(schema.data));
  root.resolveAll();
  for (const type of root.lookup("foxglove")?.nestedArray ?? []) holdType(type);
  const type = root.lookupType(schema.name);
  return (data) => type.toObject(type.decode(data), { defaults: true, longs: Number });
}

const field = (f) => `${f.name}: ${f.type}${f.isArray ? "[]" : ""}`;

function cdrReader(schema) {
  const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
  definitions.forEach((d, i) => {
    const name = d.name ?? schema.name.replace("/msg/", "/");
    const of = ros2humble[name] ?? (name === "builtin_interfaces/Time" ? undefined : must(false, `ROS has no ${name}`));
    if (!of) return;
    const published = of.definitions.filter((f) => !f.isConstant).map(field);
    must(published.join() === d.definitions.map(field).join(), `${name} is ${published.join()}`);
  });
  const reader = new MessageReader(definitions);
  return (data) => reader.readMessage(data);
}

// How many messages of the file could be decoded, of those that have a binary schema.
export function decodeAll(reader, messages) {
  const readers = new Map();
  let count = 0;
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    if (schema?.encoding === "protobuf") readers.set(channel.id, protobufReader(schema));
    else if (schema?.encoding === "ros2msg") readers.set(channel.id, cdrReader(schema));
  }
  for (const message of messages) {
    const read = readers.get(message.channelId);
    if (!read) continue;
    const decoded = read(message.data);
    const stamp = decoded.timestamp ?? decoded.header?.stamp ?? decoded.stamp;
    const t = stamp && BigInt(stamp.seconds ?? stamp.sec) * 1000000000n + BigInt(stamp.nanos ?? stamp.nanosec ?? stamp.nsec);
    must(!stamp || t === message.logTime, `a message of ${message.logTime} says ${t}`);
    count++;
  }
  return count;
}
