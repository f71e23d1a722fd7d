// SPDX-License-Identifier: Apache-2.0
// One animated property of a glTF node.
#pragma once

#include <tiny_gltf.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <ecorche/files/budget.hpp>

namespace ecorche::io {

enum class Interpolation : std::uint8_t { step, linear, cubic };

/// Keys of a translation (width 3) or a rotation (width 4; x, y, z, w).
struct GltfTrack {
  std::vector<double> time;    ///< seconds, ascending
  std::vector<double> values;  ///< `width` a key; of a cubic spline three times that: tangent in, value, out
  std::size_t width = 3;
  Interpolation interpolation = Interpolation::linear;

  /// The value at `seconds`; before the first and after the last key, that key's. Rotations are unit.
  std::array<double, 4> at(double seconds) const;
};

/// Reads a sampler. Throws Error{data} for keys that are damaged, not finite or out of order.
GltfTrack read_track(const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                     std::size_t width, files::Budget& budget);

}  // namespace ecorche::io
