// SPDX-License-Identifier: MIT
// Reads captures with @mcap/core, a reader that shares no code with ours: as a stream with all checksums, and through
// the summary and its indexes. One line per file: ok NAME: ..., or FAIL NAME: why.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

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
  let messages = 0;
  let last = 0n;
  for await (const message of reader.readMessages()) {
    must(message.logTime >= last, "indexed messages are out of order");
    last = message.logTime;
    messages++;
  }
  for await (const attachment of reader.readAttachments()) must(attachment.name.length > 0, "attachment without name");
  return { messages, reader };
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
    must(seen.Message === messages, `${seen.Message} messages in the stream, ${messages} through the indexes`);
    must(seen.Chunk === seen.Statistics.chunkCount && seen.Chunk === reader.chunkIndexes.length, "chunk counts differ");
    must(seen.Attachment === reader.attachmentIndexes.length, "attachment counts differ");
    must(reader.channelsById.size === seen.Statistics.channelCount, "channel counts differ");
    console.log(`ok mcap_core ${name}: ${messages} messages, ${seen.Chunk} chunks, ${seen.Attachment} attachments`);
  } catch (error) {
    console.log(`FAIL mcap_core ${name}: ${error.message}`);
    failed = 1;
  }
}
process.exit(failed);
