// SPDX-License-Identifier: Apache-2.0
// The axes of engines, from LPS mm.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

#include <ecorche/ecorche.h>
#include "clients/c/guard.hpp"

namespace ecorche::c {

struct Space {
  std::array<double, 9> turn;  ///< row by row, orthogonal
  double scale;                ///< units a millimetre
  bool mirrors;                ///< it is left-handed

  /// Both, as points are multiplied.
  std::array<float, 9> scaled() const {
    std::array<float, 9> out{};
    for (std::size_t i = 0; i < 9; ++i) out[i] = static_cast<float>(scale * turn[i]);
    return out;
  }
  /// As directions are multiplied, `unit` being the length 1.
  std::array<float, 9> turned(double unit) const {
    std::array<float, 9> out{};
    for (std::size_t i = 0; i < 9; ++i) out[i] = static_cast<float>(unit * turn[i]);
    return out;
  }
};

inline constexpr std::size_t vector_bytes = 3 * sizeof(float);

/// `matrix`, row by row, by every three numbers, into floats `stride` bytes from one to the next.
template <class T>
void multiply_all(const std::vector<T>& from, const std::array<float, 9>& matrix, float* out,
                  std::size_t stride) {
  auto* to = reinterpret_cast<char*>(out);
  for (std::size_t i = 0; i + 2 < from.size(); i += 3, to += stride) {
    const std::array<float, 3> p{static_cast<float>(from[i]), static_cast<float>(from[i + 1]),
                                 static_cast<float>(from[i + 2])};
    std::array<float, 3> q{};
    for (std::size_t r = 0; r < 3; ++r)
      q[r] = matrix[3 * r] * p[0] + matrix[3 * r + 1] * p[1] + matrix[3 * r + 2] * p[2];
    std::memcpy(to, q.data(), vector_bytes);
  }
}

/// Null where there is none.
const Space* find_space(ecorche_space space);

/// The caller's vertices.
struct VerticesOut {
  float* positions;
  std::size_t position_stride;
  float* normals;
  std::size_t normal_stride, capacity;
};

/// As ecorche_body_copy; `normals` times `unit` have the length 1, and may be empty where none are wanted.
template <class T>
ecorche_code copy_vertices(const std::vector<float>& positions, const std::vector<T>& normals, double unit,
                           ecorche_space space, VerticesOut out) {
  const Space* const to = find_space(space);
  if (to == nullptr)
    return fail(ECORCHE_INVALID_ARGUMENT, "space: there is no such space (see ecorche_space)");
  if (positions.size() / 3 > out.capacity) {
    return fail(ECORCHE_INVALID_ARGUMENT,
                "capacity: the tissue has " + std::to_string(positions.size() / 3) + " vertices");
  }
  if (out.position_stride == 0) out.position_stride = vector_bytes;
  if (out.normal_stride == 0) out.normal_stride = vector_bytes;
  if (out.position_stride < vector_bytes || out.normal_stride < vector_bytes)
    return fail(ECORCHE_INVALID_ARGUMENT, "stride: is less than three floats (12 bytes, or 0 for that)");
  if (out.positions != nullptr) multiply_all(positions, to->scaled(), out.positions, out.position_stride);
  if (out.normals != nullptr) multiply_all(normals, to->turned(unit), out.normals, out.normal_stride);
  return ECORCHE_OK;
}

}  // namespace ecorche::c
