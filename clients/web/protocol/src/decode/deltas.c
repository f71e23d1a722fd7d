// SPDX-License-Identifier: Apache-2.0
// Positions of frames to what the GPU takes: u16 x, y, z and a normal for each vertex (packed.ts). WebAssembly SIMD, eight vertices at a
// time; deltas.ts and packed.ts are the twins in plain numbers, and say what is computed. Needs no library. Compiled by
// scripts/viewer, once for memory that threads share and once for memory that they do not.
//
// `out` has room for whole vertices only, since the next tissue's stand behind it; `x`, `y`, `z` (the keyframe) and what is read
// may be read up to 16 bytes beyond their ends: wasm_kernel.ts leaves that room.
#include <stdint.h>
#include <wasm_simd128.h>

#define EXPORT(name) __attribute__((export_name(name)))
#define INLINE static inline __attribute__((always_inline))

enum { BLOCK = 512, LANES = 32, GROUP = 8, HEADER = 34, MOVED_ONLY = 255 };
enum { OK = 0, TOO_SHORT = 1, BAD_HEADER = 2, TOO_LONG = 3 };

// By hand, because clang 14 to 16 make eight scalar shifts of the intrinsics where the count is no constant.
INLINE v128_t shift_left(v128_t v, int n) {
  v128_t out;
  __asm__("local.get %1\nlocal.get %2\ni16x8.shl\nlocal.set %0" : "=r"(out) : "r"(v), "r"(n));
  return out;
}
INLINE v128_t shift_right(v128_t v, int n) {
  v128_t out;
  __asm__("local.get %1\nlocal.get %2\ni16x8.shr_s\nlocal.set %0" : "=r"(out) : "r"(v), "r"(n));
  return out;
}
INLINE v128_t shift_right_unsigned(v128_t v, int n) {
  v128_t out;
  __asm__("local.get %1\nlocal.get %2\ni16x8.shr_u\nlocal.set %0" : "=r"(out) : "r"(v), "r"(n));
  return out;
}

// Eight vertices, or the first `count` of them, x y z n each.
INLINE void store(uint16_t* out, int count, v128_t x, v128_t y, v128_t z, v128_t n) {
  const v128_t xy_low = wasm_i16x8_shuffle(x, y, 0, 8, 1, 9, 2, 10, 3, 11), xy_high = wasm_i16x8_shuffle(x, y, 4, 12, 5, 13, 6, 14, 7, 15);
  const v128_t zn_low = wasm_i16x8_shuffle(z, n, 0, 8, 1, 9, 2, 10, 3, 11), zn_high = wasm_i16x8_shuffle(z, n, 4, 12, 5, 13, 6, 14, 7, 15);
  const v128_t rows[4] = {
      wasm_i32x4_shuffle(xy_low, zn_low, 0, 4, 1, 5), wasm_i32x4_shuffle(xy_low, zn_low, 2, 6, 3, 7),
      wasm_i32x4_shuffle(xy_high, zn_high, 0, 4, 1, 5), wasm_i32x4_shuffle(xy_high, zn_high, 2, 6, 3, 7)};
  if (count >= GROUP) {
    for (int i = 0; i < 4; ++i) wasm_v128_store(out + 8 * i, rows[i]);
    return;
  }
  const uint64_t* vertices = (const uint64_t*)rows;
  for (int i = 0; i < count; ++i) ((uint64_t*)out)[i] = vertices[i];
}

// Of eight vertices, from the protocol's two i8 each; without `normals` NO_NORMAL.
INLINE v128_t normals_at(const uint16_t* normals, int vertex) {
  return normals ? wasm_v128_xor(wasm_v128_load(normals + vertex), wasm_i16x8_splat((int16_t)0x8080)) : wasm_i16x8_splat(0);
}

// One axis' bits in a block.
typedef struct {
  const uint16_t* words;
  int width;
  v128_t mask, base;
} Plane;

INLINE v128_t left_over(const Plane* plane, int row, int lane) {
  if (plane->width == 0) return plane->base;
  const int bit = row * plane->width, under = bit & 15;
  const uint16_t* word = plane->words + LANES * (bit >> 4) + lane;
  v128_t bits = shift_right_unsigned(wasm_v128_load(word), under);
  if (under + plane->width > 16) bits = wasm_v128_or(bits, shift_left(wasm_v128_load(word + LANES), 16 - under));
  return wasm_i16x8_add(wasm_v128_and(bits, plane->mask), plane->base);
}

typedef struct {
  v128_t entries[3], minus_one[3];  // `minus_one`: all ones where the entry is -1, whose product saturates where it must wrap
} Row;

// The sum of a row's products, each to 16 bits. `careful`: some entry is -1.
INLINE v128_t product(const Row* row, const v128_t* x, int careful) {
  v128_t sum = wasm_i16x8_splat(0);
  for (int j = 0; j < 3; ++j) {
    v128_t one = wasm_i16x8_q15mulr_sat(row->entries[j], x[j]);
    if (careful) one = wasm_v128_bitselect(wasm_i16x8_neg(x[j]), one, row->minus_one[j]);
    sum = wasm_i16x8_add(sum, one);
  }
  return sum;
}

typedef struct {
  int digits;
  v128_t centre[3], half;
  Row rows[3];
  Plane planes[3];
} Block;

INLINE void decode_rows(const Block* block, int turned, int careful, const uint16_t* const* key, const uint16_t* normals, uint16_t* out,
                        int first, int vertices) {
  for (int v = 0; v < vertices; v += GROUP) {
    v128_t x[3], y[3];
    for (int c = 0; c < 3; ++c) {
      x[c] = wasm_i16x8_sub(wasm_v128_load(key[c] + first + v), block->centre[c]);
      if (turned) x[c] = shift_left(x[c], block->digits + 2);
    }
    for (int c = 0; c < 3; ++c) {
      y[c] = turned ? shift_right(wasm_i16x8_add(product(&block->rows[c], x, careful), block->half), block->digits) : x[c];
      y[c] = wasm_i16x8_add(y[c], left_over(&block->planes[c], v / LANES, v % LANES));
    }
    store(out + 4 * (first + v), vertices - v, y[0], y[1], y[2], normals_at(normals, first + v));
  }
}

// The deltas of one tissue. OK, or why not; `out` is then half written.
EXPORT("decode_deltas")
int decode_deltas(const uint8_t* data, uint32_t bytes, const uint16_t* x, const uint16_t* y, const uint16_t* z, const uint16_t* normals,
                  uint16_t* out, int vertices) {
  const uint16_t* const key[3] = {x, y, z};
  uint32_t at = 0;
  for (int first = 0; first < vertices; first += BLOCK) {
    const int count = vertices - first < BLOCK ? vertices - first : BLOCK, rows = (count + LANES - 1) / LANES;
    if (bytes - at < HEADER) return TOO_SHORT;
    const uint8_t* head = data + at;
    const int16_t* numbers = (const int16_t*)(head + 4);  // matrix, centre, base
    at += HEADER;
    Block block;
    block.digits = head[0];
    const int turned = block.digits != MOVED_ONLY;
    if (turned && block.digits > 9) return BAD_HEADER;
    int careful = 0;
    for (int c = 0; c < 3; ++c) {
      for (int j = 0; j < 3; ++j) {
        const int16_t entry = numbers[3 * c + j];
        block.rows[c].entries[j] = wasm_i16x8_splat(entry);
        block.rows[c].minus_one[j] = wasm_i16x8_splat(entry == INT16_MIN ? -1 : 0);
        careful |= entry == INT16_MIN;
      }
      block.centre[c] = wasm_i16x8_splat(numbers[9 + c]);
      Plane* plane = &block.planes[c];
      plane->width = head[1 + c];
      if (plane->width > 16) return BAD_HEADER;
      plane->base = wasm_i16x8_splat(numbers[12 + c]);
      plane->mask = wasm_i16x8_splat((int16_t)((1u << plane->width) - 1));
      plane->words = (const uint16_t*)(data + at);
      const uint32_t size = 2 * LANES * ((rows * plane->width + 15) / 16);
      if (bytes - at < size) return TOO_SHORT;
      at += size;
    }
    block.half = wasm_i16x8_splat((int16_t)(turned && block.digits > 0 ? 1 << (block.digits - 1) : 0));
    if (!turned) decode_rows(&block, 0, 0, key, normals, out, first, count);
    else if (careful) decode_rows(&block, 1, 1, key, normals, out, first, count);
    else decode_rows(&block, 1, 0, key, normals, out, first, count);
  }
  return at == bytes ? OK : TOO_LONG;
}

// u16 numbers, three each. `x`, `y`, `z`: where a keyframe is kept, by axis, or none; there eight whole vertices are written, the last
// of them perhaps of the next tissue, whose turn comes next.
EXPORT("pack_numbers")
void pack_numbers(const uint16_t* numbers, uint16_t* x, uint16_t* y, uint16_t* z, const uint16_t* normals, uint16_t* out, int vertices) {
  for (int v = 0; v < vertices; v += GROUP) {
    const v128_t a = wasm_v128_load(numbers + 3 * v), b = wasm_v128_load(numbers + 3 * v + 8), c = wasm_v128_load(numbers + 3 * v + 16);
    const v128_t xs = wasm_i16x8_shuffle(wasm_i16x8_shuffle(a, b, 0, 3, 6, 9, 12, 15, 0, 0), c, 0, 1, 2, 3, 4, 5, 10, 13);
    const v128_t ys = wasm_i16x8_shuffle(wasm_i16x8_shuffle(a, b, 1, 4, 7, 10, 13, 0, 0, 0), c, 0, 1, 2, 3, 4, 8, 11, 14);
    const v128_t zs = wasm_i16x8_shuffle(wasm_i16x8_shuffle(a, b, 2, 5, 8, 11, 14, 0, 0, 0), c, 0, 1, 2, 3, 4, 9, 12, 15);
    if (x) {
      wasm_v128_store(x + v, xs);
      wasm_v128_store(y + v, ys);
      wasm_v128_store(z + v, zs);
    }
    store(out + 4 * v, vertices - v, xs, ys, zs, normals_at(normals, v));
  }
}
