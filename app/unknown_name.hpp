// SPDX-License-Identifier: Apache-2.0
// A name that a model does not hold: the nearest that it holds, not all ninety of them.
#pragma once

#include <iterator>
#include <string>
#include <vector>

#include <ecorche/values/error.hpp>
#include "io/case/yaml_reader.hpp"

namespace ecorche::app {

/// Error{usage} for `name`, given by `option`, which is none of the `items` (each has a `name`).
template <class Items>
Error unknown_name(const std::string& option, const std::string& name, const Items& items) {
  std::vector<std::string> known;
  known.reserve(std::size(items));
  for (const auto& item : items) known.push_back(item.name);
  const std::string near = io::yaml::nearest(name, known);
  std::string mend = near.empty() ? "use names that ecorche info lists" : "did you mean '" + near + "'?";
  constexpr std::size_t few = 8;
  if (near.empty() && known.size() <= few) {
    mend = "it has";
    for (const std::string& one : known) mend += (&one == &known.front() ? " " : ", ") + one;
  }
  return {ErrorKind::usage, option, "the model has no '" + name + "'", known.empty() ? "it has none" : mend};
}

}  // namespace ecorche::app
