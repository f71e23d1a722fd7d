// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/skin_nodes.hpp"

namespace ecorche::runtime {

std::string_view SkinNodesInput::check(std::span<const float> posed) const {
  if (rest.size() % 3 != 0) return "rest is not three coordinates a node";
  if (posed.size() != rest.size()) return "posed has not the size of rest";
  if (offsets.size() != nodes() + 1) return "offsets has not one entry more than nodes";
  if (segment.size() != weight.size()) return "segment and weight differ in size";
  if (offsets.back() != weight.size()) return "offsets does not end at the last weight";
  if (motions.empty()) return "no segment moves";
  return {};
}

}  // namespace ecorche::runtime
