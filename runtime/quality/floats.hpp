// SPDX-License-Identifier: Apache-2.0
// Points as the kernels read them.
#pragma once

#include <span>

#include <ecorche/values/mesh.hpp>

namespace ecorche::runtime {

/// The same numbers, three per point; `points` must outlive it.
inline std::span<const float> floats(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

}  // namespace ecorche::runtime
