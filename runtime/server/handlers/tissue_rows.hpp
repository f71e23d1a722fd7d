// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include <ecorche/values/error.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::server {

/// Rows of the tissues that a request names, ascending, each once; none named: all. `what`: how refusals
/// begin.
template <class Names>
Status tissue_rows(const char* what, const Names& names, const Model& model,
                   std::vector<std::uint32_t>& out) {
  out.clear();
  for (const std::string& name : names) {
    const auto found = std::find_if(model.tissues.begin(), model.tissues.end(),
                                    [&](const Tissue& tissue) { return tissue.name == name; });
    if (found == model.tissues.end())
      return {StatusCode::not_found,
              std::string(what) + ": no tissue '" + name + "' (ModelOpened.tissues has the names)"};
    out.push_back(static_cast<std::uint32_t>(found - model.tissues.begin()));
  }
  if (names.empty()) {
    out.resize(model.tissues.size());
    std::iota(out.begin(), out.end(), 0U);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return {};
}

}  // namespace ecorche::server
