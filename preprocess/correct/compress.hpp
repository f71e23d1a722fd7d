// SPDX-License-Identifier: Apache-2.0
// Fields of samples as a model keeps them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/correction.hpp>

namespace ecorche::correct {

struct CompressOptions {
  double least_mm = 0.05;       ///< nodes that no sample moves farther are left out
  std::size_t most_modes = 10;  ///< of a joint that is not a hinge
  double rounding_mm = 0.05;    ///< most that a number of a sample may be off, a mode, to fit in a byte
};

/// `fields`: a sample each, 3 * #node, mm; `turn`: theirs. A hinge keeps its samples as they are, since a
/// pose takes two of them. Others keep principal modes (Kry02): as few as leave less than least_mm, root mean
/// square over nodes and samples, but no more than most_modes, of which a small sample misses no more of its
/// size than a large one. Each mode is rounded by `quantise`. Without a node that counts, `node` is empty.
/// Deterministic.
JointCorrection compress(std::int32_t joint, bool hinge, const JointCorrection::Turns& turn,
                         std::span<const std::vector<float>> fields, const std::vector<std::uint32_t>& node,
                         const CompressOptions& options);

/// Appends `mm` (3 * #node) in steps of its largest number / 32512, and returns the step, mm. Where that is
/// off by no more than rounding_mm, a block of nodes is made to fit in bytes (model_file::PackedField).
float quantise(std::span<const float> mm, double rounding_mm, std::vector<std::int16_t>& out);

/// What the joint is moved by at sample s: 3 * correction.node, mm.
std::vector<float> field_of(const JointCorrection& correction, std::size_t s);

}  // namespace ecorche::correct
