// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

inline std::vector<float> rest_nodes(const Model& model) {
  return {model.nodes.data(), model.nodes.data() + model.nodes.size()};
}

}  // namespace ecorche::runtime
