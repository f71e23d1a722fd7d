// SPDX-License-Identifier: Apache-2.0
// The surfaces that a case names, read side by side before they are asked for one by one.
#pragma once

#include <filesystem>
#include <map>
#include <utility>

#include <ecorche/files/budget.hpp>
#include "io/case/yaml_reader.hpp"
#include "io/surface/surface_file.hpp"

namespace ecorche::io {

class SurfacesAhead {
 public:
  SurfacesAhead(const files::ReadLimits& limits, const Context& context)
      : limits_(limits), context_(context) {}

  /// Reads what skin, bones and tissues of a case name. `folder`: the case's; `data`: that of `root: data`,
  /// or empty. What cannot be read, or is named in a way that will be refused, is left to take(). Throws
  /// Error{interrupted}.
  void read(const yaml::Value& root, const std::filesystem::path& folder, const std::filesystem::path& data);

  /// As read_tagged_surface, its errors included.
  TaggedSurface take(const std::filesystem::path& path);

 private:
  const files::ReadLimits& limits_;
  const Context& context_;
  std::map<std::filesystem::path, TaggedSurface> read_;
};

}  // namespace ecorche::io
