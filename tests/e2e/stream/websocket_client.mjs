// SPDX-License-Identifier: Apache-2.0
// A client in plain JavaScript, as a browser's would be, without a line of ours or a package: a WebSocket by hand (older nodes
// have none), Protobuf by hand, and all three encodings of positions.
//
//     node websocket_client.mjs PORT ENCODING POSES.json OUT      ENCODING: 1 f32, 2 u16, 3 u16 deltas
//
// Sends each pose (flat [w, x, y, z, ...]) and writes the frame's positions, float32 of one tissue after another, to OUT.<i>.
import crypto from "node:crypto";
import fs from "node:fs";
import http from "node:http";

// ---- Protobuf: a message is a Map from field number to its values, in the order they came.
function read(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const fields = new Map();
  let at = 0;
  const varint = () => {
    let value = 0n, shift = 0n, byte;
    do {
      byte = bytes[at++];
      value |= BigInt(byte & 127) << shift;
      shift += 7n;
    } while (byte & 128);
    return value;
  };
  while (at < bytes.length) {
    const tag = Number(varint()), wire = tag & 7, field = tag >>> 3;
    let value;
    if (wire === 0) value = varint();
    else if (wire === 1) { value = bytes.subarray(at, at + 8); at += 8; }
    else if (wire === 5) { value = view.getFloat32(at, true); at += 4; }
    else if (wire === 2) { const size = Number(varint()); value = bytes.subarray(at, at + size); at += size; }
    else throw new Error(`wire type ${wire}`);
    if (!fields.has(field)) fields.set(field, []);
    fields.get(field).push(value);
  }
  return {
    all: (field) => fields.get(field) ?? [],
    number: (field) => Number(fields.get(field)?.at(-1) ?? 0),
    has: (field) => fields.has(field),
    bytes: (field) => fields.get(field)?.at(-1),
    message: (field) => read(fields.get(field)?.at(-1) ?? new Uint8Array()),
  };
}

function varint(value) {
  const out = [];
  for (value = BigInt(value); value > 127n; value >>= 7n) out.push(Number(value & 127n) | 128);
  out.push(Number(value));
  return Buffer.from(out);
}
const whole = (field, value) => Buffer.concat([varint(field << 3), varint(value)]);
const part = (field, bytes) => Buffer.concat([varint(field << 3 | 2), varint(bytes.length), bytes]);
const fixed64 = (field, bytes) => Buffer.concat([varint(field << 3 | 1), bytes]);

// ---- Frames.
const aligned = (size) => Math.ceil(size / 16) * 16;
function frame(...fields) {
  const envelope = Buffer.concat(fields), out = Buffer.alloc(aligned(8 + envelope.length));
  out.writeUInt32LE(envelope.length, 0);
  envelope.copy(out, 8);
  return out;
}
function array(message, payload, Type, width) {
  const size = message.number(2) * message.number(3), offset = message.number(4);
  if (offset % 16 !== 0 || offset + size * width > payload.length) throw new Error("an array beyond its payload");
  return new Type(payload.buffer.slice(payload.byteOffset + offset, payload.byteOffset + offset + size * width));
}

// ---- docs/reference/protocol.md, "Deltas".
const wrap = (x) => (x << 16) >> 16;
function decodeDelta(data, key) {
  const out = new Uint16Array(key.length), count = key.length / 3;
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  let at = 0;
  for (let first = 0; first < count; first += 512) {
    const vertices = Math.min(512, count - first), rows = Math.ceil(vertices / 32);
    const digits = data[at], widths = [1, 2, 3].map((i) => data[at + i]), head = at;
    at += 34;
    const planes = widths.map((width) => {
      const start = at;
      at += 64 * Math.ceil(rows * width / 16);
      return (v) => {  // a lane's bits stand in its words lowest first, row after row
        let left = 0;
        for (let bit = 0; bit < width; ++bit) {
          const place = (v >> 5) * width + bit, word = view.getUint16(start + 64 * (place >> 4) + 2 * (v & 31), true);
          left |= (word >> (place & 15) & 1) << bit;
        }
        return left;
      };
    });
    for (let v = 0; v < vertices; ++v) {
      let x = [0, 1, 2].map((c) => wrap(key[3 * (first + v) + c] - view.getUint16(head + 22 + 2 * c, true)));
      if (digits !== 255) {
        x = x.map((value) => wrap(value << digits + 2));
        x = [0, 1, 2].map((i) => {
          let sum = digits > 0 ? 1 << digits - 1 : 0;
          for (let j = 0; j < 3; ++j) sum += wrap(view.getInt16(head + 4 + 2 * (3 * i + j), true) * x[j] + (1 << 14) >> 15);
          return wrap(sum) >> digits;
        });
      }
      for (let c = 0; c < 3; ++c) out[3 * (first + v) + c] = x[c] + view.getUint16(head + 28 + 2 * c, true) + planes[c](v);
    }
  }
  if (at !== data.length) throw new Error("deltas of another length");
  return out;
}

const keyframes = new Map();
function positionsOf(mesh, payload) {
  const encoding = mesh.number(5), number = mesh.number(2), keyframe = mesh.number(10), box = mesh.message(11);
  const numbers = [], positions = [];
  for (const entry of mesh.all(6).map(read)) {
    const rows = entry.message(3);
    if (encoding === 1) {
      positions.push(array(rows, payload, Float32Array, 4));
      continue;
    }
    const delta = encoding === 3 && keyframe !== number;
    if (delta && !keyframes.has(keyframe)) throw new Error("the keyframe did not come");
    const found = delta ? decodeDelta(array(rows, payload, Uint8Array, 1), keyframes.get(keyframe)[numbers.length])
                        : array(rows, payload, Uint16Array, 2);
    numbers.push(found);
    const low = [1, 2, 3].map((axis) => box.number(axis)), step = box.number(4);
    positions.push(Float32Array.from(found, (n, i) => low[i % 3] + step * n));
  }
  if (encoding === 3 && keyframe === number) { keyframes.clear(); keyframes.set(number, numbers); }
  return positions;
}

// ---- The conversation.
const [port, encoding, posesFile, out] = process.argv.slice(2);
const poses = JSON.parse(fs.readFileSync(posesFile, "utf8"));
const accept = (key) => crypto.createHash("sha1").update(key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").digest("base64");
const key = crypto.randomBytes(16).toString("base64");
const request = http.request({
  host: "127.0.0.1", port, path: "/v1",
  headers: {Connection: "Upgrade", Upgrade: "websocket", "Sec-WebSocket-Version": 13, "Sec-WebSocket-Key": key,
            "Sec-WebSocket-Protocol": "ecorche.v1"},
});
request.on("response", (response) => { throw new Error(`HTTP ${response.statusCode}`); });
request.on("upgrade", (response, socket, early) => {
  if (response.headers["sec-websocket-accept"] !== accept(key)) throw new Error("no WebSocket");
  const say = (bytes) => {  // one binary message, masked as clients must
    const mask = crypto.randomBytes(4), head = Buffer.alloc(bytes.length < 126 ? 2 : bytes.length < 65536 ? 4 : 10);
    head[0] = 0x82;
    head[1] = 0x80 | (head.length === 2 ? bytes.length : head.length === 4 ? 126 : 127);
    if (head.length === 4) head.writeUInt16BE(bytes.length, 2);
    if (head.length === 10) head.writeBigUInt64BE(BigInt(bytes.length), 2);
    socket.write(Buffer.concat([head, mask, bytes.map((byte, i) => byte ^ mask[i & 3])]));
  };
  let digest, sent = 0;
  const pose = () => {
    const turns = Buffer.alloc(8 * poses[sent].length);
    poses[sent].forEach((value, i) => turns.writeDoubleLE(value, 8 * i));
    ++sent;
    say(frame(part(15, Buffer.concat([whole(1, sent), fixed64(2, digest), part(4, turns)]))));
  };
  const hear = (bytes) => {
    const size = bytes.readUInt32LE(0), start = aligned(8 + size);
    const envelope = read(bytes.subarray(8, 8 + size)), payload = bytes.subarray(start, start + bytes.readUInt32LE(4));
    if (envelope.has(42) && envelope.message(42).number(1) !== 0) throw new Error(`status ${envelope.message(42).number(1)}`);
    if (envelope.has(60)) say(frame(whole(1, 2), part(12, whole(3, 1))));            // ServerHello: OpenModel
    if (envelope.has(62)) {                                                          // ModelOpened: Subscribe
      digest = Buffer.from(envelope.message(62).bytes(3));
      say(frame(whole(1, 3), part(13, part(1, whole(2, encoding)))));
    }
    if (!envelope.has(65)) return;
    const mesh = envelope.message(65);
    say(frame(part(16, Buffer.concat([whole(1, mesh.number(1)), whole(2, mesh.number(2))]))));
    const positions = positionsOf(mesh, payload), sequence = mesh.number(3);
    if (!mesh.has(8)) throw new Error("no quality");
    if (sequence > 0) fs.writeFileSync(`${out}.${sequence - 1}`, Buffer.concat(positions.map((p) => Buffer.from(p.buffer))));
    if (sequence === sent && sent < poses.length) return pose();
    if (sequence !== poses.length) return;
    socket.end(Buffer.from([0x88, 0x80, 0, 0, 0, 0]));
    console.log(`${poses.length} frames, encoding ${mesh.number(5)}, keyframe ${mesh.number(10)} of ${mesh.number(2)}`);
  };
  let buffer = early;
  const take = () => {
    for (;;) {
      if (buffer.length < 2) return;
      const short = buffer[1] & 127, head = short < 126 ? 2 : short === 126 ? 4 : 10;
      if (buffer.length < head) return;
      const size = short < 126 ? short : short === 126 ? buffer.readUInt16BE(2) : Number(buffer.readBigUInt64BE(2));
      if (buffer.length < head + size) return;
      const opcode = buffer[0] & 15, message = buffer.subarray(head, head + size);
      if (opcode === 2) hear(Buffer.from(message));
      else if (opcode !== 8) throw new Error(`opcode ${opcode}`);
      buffer = buffer.subarray(head + size);
    }
  };
  socket.on("data", (bytes) => { buffer = Buffer.concat([buffer, bytes]); take(); });
  socket.on("error", () => process.exit(1));
  say(frame(whole(1, 1), part(10, Buffer.concat([whole(1, 1), whole(2, 1), part(5, Buffer.from([1, 2, 3]))]))));
});
request.end();
setTimeout(() => { console.error("no frame came"); process.exit(1); }, 60_000).unref();
