// SPDX-License-Identifier: Apache-2.0
// One zstd frame (RFC 8878) of a size that is known before. Its blocks are looked at first: nothing is made room for that the bytes
// cannot hold, and nothing may follow.
import { Decompress } from "fzstd";
import { ProtocolError } from "../framing.js";

const MAGIC = 0xfd2fb528;
/** Of what came before that a block may repeat: as much as the format asks of every decoder. */
const MOST_WINDOW = 8 << 20;
const MOST_BLOCK = 128 << 10;
const CHECKSUM_BYTES = 4;

/** Throws ProtocolError for anything else than a whole frame of `size` bytes. */
export function inflate(packed: Uint8Array, size: number): Uint8Array<ArrayBuffer> {
  check(packed, size);
  const out = new Uint8Array(size);
  let filled = 0;
  try {
    const decoder = new Decompress((block) => {
      if (block.length > size - filled) throw new ProtocolError("a zstd frame holds more than it says");
      out.set(block, filled);
      filled += block.length;
    });
    decoder.push(packed, true);
  } catch (error) {
    throw error instanceof ProtocolError ? error : new ProtocolError(`a zstd frame is damaged: ${error instanceof Error ? error.message : error}`);
  }
  if (filled !== size) throw new ProtocolError(`a zstd frame holds ${filled} bytes, not ${size}`);
  return out;
}

/** The head and all blocks' heads. */
function check(packed: Uint8Array, size: number): void {
  const view = new DataView(packed.buffer, packed.byteOffset, packed.byteLength);
  const need = (at: number, bytes: number) => {
    if (at + bytes > packed.length) throw new ProtocolError("a zstd frame is cut short");
  };
  need(0, 6);
  if (view.getUint32(0, true) !== MAGIC) throw new ProtocolError("voxels are no zstd frame");
  const flags = packed[4], single = (flags >> 5) & 1;
  if ((flags & 0b1011) !== 0) throw new ProtocolError("a zstd frame with a dictionary, or of another version");
  let at = 5;
  let window = size;
  if (!single) {
    const base = 2 ** (10 + (packed[at] >> 3));
    window = base + (base / 8) * (packed[at] & 7);
    ++at;
  }
  const sizeBytes = [single, 2, 4, 8][flags >> 6];
  need(at, sizeBytes);
  const told = sizeBytes === 1 ? packed[at] : sizeBytes === 2 ? view.getUint16(at, true) + 256 : sizeBytes === 4 ? view.getUint32(at, true) : sizeBytes === 8 ? Number(view.getBigUint64(at, true)) : -1;
  if (told !== size) throw new ProtocolError(`a zstd frame that tells of ${told} bytes, not ${size}`);
  if (window > MOST_WINDOW) throw new ProtocolError(`a zstd frame with a window of ${window} bytes (${MOST_WINDOW} at most)`);
  at += sizeBytes;
  let most = 0;
  for (let last = false; !last;) {
    need(at, 3);
    const head = packed[at] | (packed[at + 1] << 8) | (packed[at + 2] << 16);
    const type = (head >> 1) & 3, bytes = head >> 3;
    if (type === 3 || bytes > MOST_BLOCK) throw new ProtocolError("a zstd frame with a block of no kind or size");
    last = (head & 1) !== 0;
    at += 3 + (type === 1 ? 1 : bytes);
    most += type === 2 ? MOST_BLOCK : bytes;
  }
  if (at + (flags & 4 ? CHECKSUM_BYTES : 0) !== packed.length) throw new ProtocolError("a zstd frame is cut short, or something follows it");
  // What the size is believed for.
  if (size > most) throw new ProtocolError(`a zstd frame of ${packed.length} bytes cannot hold ${size}`);
}
