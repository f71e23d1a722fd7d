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

/// Of `count` vectors the axes, `stride` bytes from one to the next. `make(first, count, batch)`: where the
/// floats of so many of them are, perhaps made in `batch`.
template <class Make>
void place_all(std::size_t count, const Make& make, const Axes& axes, float* out, std::size_t stride) {
  auto* to = reinterpret_cast<char*>(out);
  Batch batch;
  const auto [x, y, z] = axes.from;
  const auto [by_x, by_y, by_z] = axes.by;
  for (std::size_t first = 0; first < count; first += batch_vertices) {
    const std::size_t some = std::min(batch_vertices, count - first);
    const float* from = make(first, some, batch);
    for (std::size_t i = 0; i < some; ++i, from += 3, to += stride) {
      const std::array<float, 3> q{by_x * from[x], by_y * from[y], by_z * from[z]};
      std::memcpy(to, q.data(), vector_bytes);
    }
  }
}

/// As ecorche_body_copy, of vertices that place_all() is told of. The vectors that `normals` makes have the
/// length 1 / `unit`.
template <class Positions, class Normals>
ecorche_code copy_vertices(std::size_t vertices, const Positions& positions, const Normals& normals,
                           double unit, ecorche_space space, VerticesOut out) {
  if (const ecorche_code wrong = check_out(vertices, space, out); wrong != ECORCHE_OK) return wrong;
  const Space& to = *find_space(space);
  if (out.positions != nullptr)
    place_all(vertices, positions, to.axes(to.scale), out.positions, out.position_stride);
  if (out.normals != nullptr) place_all(vertices, normals, to.axes(unit), out.normals, out.normal_stride);
  return ECORCHE_OK;
}

}  // namespace ecorche::c
