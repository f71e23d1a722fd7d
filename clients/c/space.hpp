// SPDX-License-Identifier: Apache-2.0
// The axes of engines, from LPS mm.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>

#include <ecorche/ecorche.h>
#include "clients/c/guard.hpp"

namespace ecorche::c {

// How each axis of a space is made from a point of LPS: it is one axis of it, times a number.
struct Axes {
  std::array<std::size_t, 3> from;
  std::array<float, 3> by;
};

struct Space {
  std::array<double, 9> turn;  ///< row by row: in every row and column one number is 1 or -1
  double scale;                ///< units a millimetre
  bool mirrors;                ///< it is left-handed

  /// Both, as points are multiplied.
  std::array<float, 9> scaled() const {
    std::array<float, 9> out{};
    for (std::size_t i = 0; i < 9; ++i) out[i] = static_cast<float>(scale * turn[i]);
    return out;
  }
  /// `turn` times `unit`.
  Axes axes(double unit) const {
    Axes out{};
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        if (turn[3 * r + c] == 0) continue;
        out.from[r] = c;
        out.by[r] = static_cast<float>(unit * turn[3 * r + c]);
      }
    }
    return out;
  }
};

inline constexpr std::size_t vector_bytes = 3 * sizeof(float);

/// Null where there is none.
const Space* find_space(ecorche_space space);

/// The caller's vertices.
struct VerticesOut {
  float* positions;
  std::size_t position_stride;
  float* normals;
  std::size_t normal_stride, capacity;
};

/// What is wrong with them for `vertices` vertices, or OK; then strides of 0 are what they stand for.
ecorche_code check_out(std::size_t vertices, ecorche_space space, VerticesOut& out);

/// Room for the floats of some vertices, in the first cache: they are made there and leave it as the
/// caller's.
inline constexpr std::size_t batch_vertices = 256;
using Batch = std::array<float, 3 * batch_vertices>;

/// Vectors into the axes of a space, `stride` bytes from one to the next.
inline void place(const float* from, std::size_t count, const Axes& axes, char* to, std::size_t stride) {
  const auto [x, y, z] = axes.from;
  const auto [by_x, by_y, by_z] = axes.by;
  for (std::size_t i = 0; i < count; ++i, from += 3, to += stride) {
    // Each by itself: twelve bytes at once would be put together in memory first, and waited for.
    const float a = by_x * from[x], b = by_y * from[y], c = by_z * from[z];
    std::memcpy(to, &a, sizeof a);
    std::memcpy(to + sizeof a, &b, sizeof b);
    std::memcpy(to + 2 * sizeof a, &c, sizeof c);
  }
}

/// As ecorche_body_copy. `positions(first, count, batch)`, and `normals` likewise: where the floats of so
/// many vertices are, perhaps made in `batch`; normals have the length 1 / `unit`.
template <class Positions, class Normals>
ecorche_code copy_vertices(std::size_t vertices, const Positions& positions, const Normals& normals,
                           double unit, ecorche_space space, VerticesOut out) {
  if (const ecorche_code wrong = check_out(vertices, space, out); wrong != ECORCHE_OK) return wrong;
  const Space& to = *find_space(space);
  const Axes points = to.axes(to.scale), directions = to.axes(unit);
  auto* const at = reinterpret_cast<char*>(out.positions);
  auto* const along = reinterpret_cast<char*>(out.normals);
  Batch batch;
  // Both of a vertex in turn, which mostly lie in one line of the cache: else all of them came and went
  // twice.
  for (std::size_t first = 0; first < vertices; first += batch_vertices) {
    const std::size_t some = std::min(batch_vertices, vertices - first);
    if (at != nullptr)
      place(positions(first, some, batch), some, points, at + first * out.position_stride,
            out.position_stride);
    if (along != nullptr)
      place(normals(first, some, batch), some, directions, along + first * out.normal_stride,
            out.normal_stride);
  }
  return ECORCHE_OK;
}

}  // namespace ecorche::c
