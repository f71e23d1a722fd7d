// SPDX-License-Identifier: Apache-2.0
#include "clients/c/space.hpp"

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

}  // namespace ecorche::c
