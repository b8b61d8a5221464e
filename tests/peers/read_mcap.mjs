// Reads an MCAP file with @mcap/core, through its index and then from its beginning to its end; prints what it found.
import { execFileSync } from 'node:child_process';
import { readFile } from 'node:fs/promises';
import mcap from '@mcap/core';

const { McapIndexedReader, McapStreamReader } = mcap;

const bytes = new Uint8Array(await readFile(process.argv[2]));
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};

// Chunks are compressed; Node.js 20 has no Zstandard, Debian's program has.
const decompressHandlers = {
  zstd: (packed) => new Uint8Array(execFileSync('zstd', ['-dc'], { input: packed, maxBuffer: 1 << 26 })),
};
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const indexed = {};
let last = -1n;
const samples = {};
for await (const message of reader.readMessages()) {
  if (message.logTime < last) throw new Error('time goes back');
  last = message.logTime;
  const channel = reader.channelsById.get(message.channelId);
  indexed[channel.topic] = (indexed[channel.topic] ?? 0) + 1;
  samples[channel.topic] = JSON.parse(new TextDecoder().decode(message.data));
}

const stream = new McapStreamReader({ decompressHandlers });
stream.append(bytes);
const streamed = {}, topics = {};
for (let record = stream.nextRecord(); record; record = stream.nextRecord()) {
  if (record.type === 'Channel') topics[record.id] = record.topic;
  if (record.type === 'Message') streamed[topics[record.channelId]] = (streamed[topics[record.channelId]] ?? 0) + 1;
}
if (!stream.done()) throw new Error('the stream has no end');

const schemas = {};
for (const schema of reader.schemasById.values()) {
  schemas[schema.name] = [schema.encoding, JSON.parse(new TextDecoder().decode(schema.data)).title];
}
console.log(JSON.stringify({
  indexed, streamed, schemas, samples,
  statistics: Object.fromEntries([...reader.statistics.channelMessageCounts].map(
    ([id, count]) => [reader.channelsById.get(id).topic, Number(count)])),
}));
