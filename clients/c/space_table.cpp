// SPDX-License-Identifier: Apache-2.0
#include "clients/c/space.hpp"

#include <string>

namespace ecorche::c {
namespace {

// Rows say which of left, back and up each axis of the space is.
const std::array<Space, 6> spaces{{
    {{1, 0, 0, 0, 1, 0, 0, 0, 1}, 1, false},
    {{-1, 0, 0, 0, 0, 1, 0, -1, 0}, 1e-3, true},
    {{0, -1, 0, -1, 0, 0, 0, 0, 1}, 0.1, true},
    {{1, 0, 0, 0, 0, 1, 0, -1, 0}, 1e-3, false},
    {{0, -1, 0, 1, 0, 0, 0, 0, 1}, 1e-3, false},
    {{-1, 0, 0, 0, -1, 0, 0, 0, 1}, 1, false},
}};

}  // namespace

const Space* find_space(ecorche_space space) {
  const auto row = static_cast<std::size_t>(space);
  return row < spaces.size() ? &spaces[row] : nullptr;
}

ecorche_code check_out(std::size_t vertices, ecorche_space space, VerticesOut& out) {
  if (find_space(space) == nullptr)
    return fail(ECORCHE_INVALID_ARGUMENT, "space: there is no such space (see ecorche_space)");
  if (vertices > out.capacity)
    return fail(ECORCHE_INVALID_ARGUMENT,
                "capacity: the tissue has " + std::to_string(vertices) + " vertices");
  if (out.position_stride == 0) out.position_stride = vector_bytes;
  if (out.normal_stride == 0) out.normal_stride = vector_bytes;
  if (out.position_stride < vector_bytes || out.normal_stride < vector_bytes)
    return fail(ECORCHE_INVALID_ARGUMENT, "stride: is less than three floats (12 bytes, or 0 for that)");
  return ECORCHE_OK;
}

}  // namespace ecorche::c
