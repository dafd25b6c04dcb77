// SPDX-License-Identifier: MIT
// Our frames read by node-mavlink and its frames read by ours, by way of mavlink_pipe, whose rule for the value of a
// field stands here a second time. Prints ok NAME, or FAIL NAME: why.
import { spawnSync } from "node:child_process";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { PassThrough } from "node:stream";

const require = createRequire(resolve(process.env.MAVLINK_MODULES) + "/");
const { createMavLinkStream, MavLinkProtocolV1, MavLinkProtocolV2, minimal, common, ardupilotmega } =
  require("node-mavlink");

const pipe = process.argv[2];
const classes = { ...minimal.REGISTRY, ...common.REGISTRY, ...ardupilotmega.REGISTRY };
const keyText = "00112233445566778899aabbccddeeff0123456789abcdeffedcba9876543210";
const key = Buffer.from(keyText, "hex");

function must(condition, why) {
  if (!condition) throw new Error(why);
}

function run(mode, args = [], input = undefined) {
  const done = spawnSync(pipe, [mode, ...args], { input, maxBuffer: 1 << 24 });
  must(done.status === 0, `mavlink_pipe ${mode}: ${done.stderr}`);
  return done.stdout;
}

// Our messages, with the fields that we send and take. What we leave out are extensions, which a sender may always do.
const ours = new Map(
  run("list").toString().trim().split("\n").map((line) => line.split(" ")).map(([id, ...fields]) => [Number(id), fields]),
);
const ids = [...ours.keys()];
// Version 1 has ids of one byte, and no extensions.
const plain = ids.filter((id) => id < 256 && !classes[id].FIELDS.some((field) => field.extension));
const left = (id, field) => field.extension && !ours.get(id).includes(field.source);

function value(field, k) {
  const sum = [...field.source].reduce((total, c) => total + c.charCodeAt(0), 0);
  const v = (sum % 100) + k;
  const type = field.type.replace("[]", "");
  if (type === "float") return v + 0.25;
  if (type === "uint64_t" || type === "int64_t") return (1n << 40n) + BigInt(v);
  if (type === "char") return String.fromCharCode(65 + (v % 26));
  return v;
}

function wanted(field) {
  if (!field.type.endsWith("[]")) return value(field, 0);
  const elements = Array.from({ length: field.length }, (_, k) => value(field, k));
  return field.type === "char[]" ? elements.join("") : elements;
}

function message(id) {
  const made = new classes[id]();
  for (const field of classes[id].FIELDS) made[field.name] = wanted(field);
  return made;
}

function show(v) {
  return JSON.stringify(v, (_, x) => (typeof x === "bigint" ? String(x) : x));
}

// What node-mavlink makes of bytes: packets, and how many failed their CRC.
async function read(bytes) {
  const packets = [];
  let bad = 0;
  const input = new PassThrough();
  const stream = createMavLinkStream(input, { onCrcError: () => bad++ });
  const ended = new Promise((done) => stream.on("end", done));
  stream.on("data", (packet) => packets.push(packet));
  input.end(bytes);
  await ended;
  return { packets, bad };
}

function checkPacket(packet, id) {
  must(packet.header.msgid === id, `message ${packet.header.msgid}, not ${id}`);
  must(packet.header.sysid === 1 && packet.header.compid === 196, `message ${id}: sender`);
  const data = packet.protocol.data(packet.payload, classes[id]);
  for (const field of classes[id].FIELDS.filter((f) => !left(id, f))) {
    const got = show(data[field.name]);
    must(got === show(wanted(field)), `${classes[id].MSG_NAME}.${field.source}: ${got}, want ${show(wanted(field))}`);
  }
}

function serialize(protocol, change = (frame) => frame, only = ids) {
  return Buffer.concat(only.map((id, i) => change(protocol.serialize(message(id), i), i)));
}

function checkRead(output, frames, version, counters) {
  const lines = output.toString().trim().split("\n");
  must(lines.length === frames + 1, `${lines.length - 1} frames, want ${frames}`);
  for (const line of lines.slice(0, -1)) must(/^good \w+ version (\d) from 9\/7$/.exec(line)?.[1] === version, line);
  for (const [name, count] of Object.entries(counters))
    must(new RegExp(`\\b${name} ${count}\\b`).test(lines.at(-1)), `${lines.at(-1)}, want ${name} ${count}`);
}

const cases = {
  async it_reads_ours() {
    const { packets, bad } = await read(run("write"));
    must(packets.length === ids.length && bad === 0, `${packets.length} packets, ${bad} bad`);
    packets.forEach((packet, i) => checkPacket(packet, ids[i]));
  },
  async it_reads_ours_signed() {
    const { packets } = await read(run("write", [keyText]));
    must(packets.length === ids.length, `${packets.length} packets`);
    const wrong = Buffer.alloc(32, 1);
    const now = (Date.now() - MavLinkProtocolV2.SIGNATURE_START_TIME) * 100; // units of 10 us
    for (const [i, packet] of packets.entries()) {
      checkPacket(packet, ids[i]);
      must(packet.signature.matches(key) && packet.signature.linkId === 5, `message ${ids[i]}: signature`);
      must(!packet.signature.matches(wrong), `message ${ids[i]}: signature of another key`);
      must(Math.abs(packet.signature.timestamp - now) < 6e6, `message ${ids[i]}: time stamp`);
    }
  },
  async it_refuses_ours_with_a_changed_byte() {
    const bytes = run("write");
    bytes[bytes.length - 3] ^= 1;
    const { packets } = await read(bytes);
    must(packets.length === ids.length - 1, `${packets.length} packets`);
  },
  async we_read_its() {
    checkRead(run("read", [], serialize(new MavLinkProtocolV2(9, 7))), ids.length, "2", { bad_crc: 0, garbage: 0 });
  },
  async we_read_its_version_1() {
    const bytes = serialize(new MavLinkProtocolV1(9, 7), undefined, plain);
    checkRead(run("read", [], bytes), plain.length, "1", { bad_crc: 0, garbage: 0 });
  },
  async we_refuse_its_with_a_changed_byte() {
    const bytes = serialize(new MavLinkProtocolV2(9, 7), (frame, i) => {
      if (i === 3) frame[12] ^= 0x40;
      return frame;
    });
    checkRead(run("read", [], bytes), ids.length - 1, "2", { frames: ids.length - 1 });
  },
  async we_read_its_signed() {
    const protocol = new MavLinkProtocolV2(9, 7, MavLinkProtocolV2.IFLAG_SIGNED);
    const bytes = serialize(protocol, (frame, i) => protocol.sign(frame, 3, key, Date.now() + i));
    checkRead(run("read", [keyText], bytes), ids.length, "2", { bad_signature: 0, garbage: 0 });
  },
  async we_refuse_its_signed_with_another_key() {
    const protocol = new MavLinkProtocolV2(9, 7, MavLinkProtocolV2.IFLAG_SIGNED);
    const bytes = serialize(protocol, (frame, i) => protocol.sign(frame, 3, Buffer.alloc(32, 1), Date.now() + i));
    checkRead(run("read", [keyText], bytes), 0, "2", { bad_signature: ids.length, garbage: 0 });
  },
  async we_refuse_its_signed_twice_and_unsigned() {
    const protocol = new MavLinkProtocolV2(9, 7, MavLinkProtocolV2.IFLAG_SIGNED);
    const signed = serialize(protocol, (frame, i) => protocol.sign(frame, 3, key, Date.now() + i));
    const bytes = Buffer.concat([signed, signed, serialize(new MavLinkProtocolV2(9, 7))]);
    checkRead(run("read", [keyText], bytes), ids.length, "2", { bad_signature: 2 * ids.length });
  },
};

let failed = 0;
for (const [name, check] of Object.entries(cases)) {
  try {
    await check();
    console.log(`ok node_mavlink ${name}`);
  } catch (error) {
    console.log(`FAIL node_mavlink ${name}: ${error.message}`);
    failed = 1;
  }
}
process.exit(failed);
