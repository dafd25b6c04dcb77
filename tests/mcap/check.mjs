// SPDX-License-Identifier: MIT
// Reads captures with @mcap/core, a reader that shares no code with ours: as a stream with all checksums, and through
// the summary and its indexes. A point cloud (an exported map) is decoded by its own fields, and held against the .ply of
// the same name beside it, point by point; what has a schema for Protocol Buffers or ROS 2 by that (decode.mjs). One line per file: ok NAME: ..., or FAIL NAME: why.
import { createRequire } from "node:module";
import { existsSync, readFileSync } from "node:fs";
import { decodeAll } from "./decode.mjs";

const require = createRequire(process.env.MCAP_MODULES + "/");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const lz4 = require("lz4js");
const fzstd = require("fzstd");

const decompressHandlers = {
  lz4: (bytes) => new Uint8Array(lz4.decompress(bytes)),
  zstd: (bytes) => fzstd.decompress(bytes),
};

function must(condition, why) {
  if (!condition) throw new Error(why);
}

function readStream(bytes) {
  const count = { Message: 0, Channel: 0, Chunk: 0, Attachment: 0, Statistics: undefined };
  const reader = new McapStreamReader({ validateCrcs: true, includeChunks: true, decompressHandlers });
  reader.append(bytes);
  for (let record; (record = reader.nextRecord()) != undefined; ) {
    if (record.type === "Statistics") count.Statistics = record;
    else if (record.type in count) count[record.type]++;
  }
  must(reader.done(), "the stream reader has not come to the end");
  return count;
}

async function readIndexed(bytes) {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const messages = [];
  let last = 0n;
  for await (const message of reader.readMessages()) {
    must(message.logTime >= last, "indexed messages are out of order");
    last = message.logTime;
    messages.push(message);
  }
  for await (const attachment of reader.readAttachments()) must(attachment.name.length > 0, "attachment without name");
  return { messages, reader };
}

// foxglove.NumericType: bytes, and how they are read.
const NUMERIC = { 1: "getUint8", 3: "getUint16", 7: "getFloat32", 8: "getFloat64" };

function cloudPoints(message) {
  const cloud = JSON.parse(new TextDecoder().decode(message.data));
  const data = Buffer.from(cloud.data, "base64");
  must(data.length % cloud.point_stride === 0, "the points are no whole number of strides");
  const view = new DataView(data.buffer, data.byteOffset, data.length);
  const points = [];
  for (let at = 0; at < data.length; at += cloud.point_stride)
    points.push(cloud.fields.map((f) => view[NUMERIC[f.type]](at + f.offset, true)));
  return { points, names: cloud.fields.map((f) => f.name).join(" ") };
}

function plyPoints(path) {
  const bytes = readFileSync(path);
  const head = bytes.toString("latin1", 0, 1024).split("end_header\n")[0] + "end_header\n";
  const read = { double: ["getFloat64", 8], float: ["getFloat32", 4], uchar: ["getUint8", 1] };
  const properties = [...head.matchAll(/property (\w+) (\w+)/g)].map(([, type, name]) => [...read[type], name]);
  const view = new DataView(bytes.buffer, bytes.byteOffset + head.length, bytes.length - head.length);
  const points = [];
  for (let at = 0; at < view.byteLength; )
    points.push(
      properties.map(([method, size]) => {
        at += size;
        return view[method](at - size, true);
      }),
    );
  must(points.length === Number(head.match(/element vertex (\d+)/)[1]), "the .ply has other points than it says");
  return { points, names: properties.map((p) => p[2]).join(" ") };
}

// Points of the cloud in a capture; 0 where there is none.
function checkCloud(path, reader, messages) {
  const clouds = messages.filter((m) => {
    const schema = reader.schemasById.get(reader.channelsById.get(m.channelId).schemaId);
    return schema?.name === "foxglove.PointCloud" && schema.encoding === "jsonschema";
  });
  let count = 0;
  for (const message of clouds) {
    const cloud = cloudPoints(message);
    const ply = path.replace(/\.mcap$/, ".ply");
    count += cloud.points.length;
    if (!existsSync(ply)) continue;
    const other = plyPoints(ply);
    must(cloud.names + " red green blue" === other.names, `fields ${cloud.names}, and ${other.names} in the .ply`);
    must(cloud.points.length === other.points.length, `${cloud.points.length} points, ${other.points.length} in the .ply`);
    const wrong = cloud.points.findIndex((p, i) => p.some((value, f) => !Object.is(value, other.points[i][f])));
    must(wrong < 0, `point ${wrong} is another one in the .ply`);
  }
  return count;
}

let failed = 0;
for (const path of process.argv.slice(2)) {
  const name = path.split("/").pop();
  try {
    const bytes = new Uint8Array(readFileSync(path));
    const seen = readStream(bytes);
    const { messages, reader } = await readIndexed(bytes);
    must(seen.Statistics, "there are no statistics");
    must(BigInt(seen.Message) === seen.Statistics.messageCount, "the statistics count other messages");
    must(seen.Message === messages.length, `${seen.Message} messages in the stream, ${messages.length} through the indexes`);
    must(seen.Chunk === seen.Statistics.chunkCount && seen.Chunk === reader.chunkIndexes.length, "chunk counts differ");
    must(seen.Attachment === reader.attachmentIndexes.length, "attachment counts differ");
    must(reader.channelsById.size === seen.Statistics.channelCount, "channel counts differ");
    const points = checkCloud(path, reader, messages);
    const parts = [`${messages.length} messages`, `${seen.Chunk} chunks`, `${seen.Attachment} attachments`];
    if (points) parts.push(`${points} points`);
    const decoded = decodeAll(reader, messages);
    if (decoded) parts.push(`${decoded} decoded`);
    console.log(`ok mcap_core ${name}: ${parts.join(", ")}`);
  } catch (error) {
    console.log(`FAIL mcap_core ${name}: ${error.message}`);
    failed = 1;
  }
}
process.exit(failed);
