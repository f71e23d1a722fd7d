// SPDX-License-Identifier: Apache-2.0
// What is wrong with a case, told before anybody waits for its preparation. Changes nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/values/case.hpp"
#include "core/values/context.hpp"
#include "preprocess/check/surface_figures.hpp"

namespace ecorche::check {

enum class Severity : std::uint8_t {
  note,     ///< worth knowing
  warning,  ///< preparing works, but perhaps not as meant
  error,    ///< preparing is impossible
};
/// `note`, `warning`, `error`.
std::string_view severity_name(Severity severity);

struct Finding {
  Severity severity = Severity::note;
  std::string where;                  ///< the name of a surface, segment or volume
  std::string what;                   ///< with its number
  std::optional<Eigen::Vector3d> at;  ///< the first offender, LPS mm
  std::string mend;
};

/// How far a bone sticks out of the skin.
struct BoneOutside {
  double share = 0;       ///< of its vertices
  double largest_mm = 0;  ///< distance of the farthest one from the skin
};

struct SurfaceLine {
  std::string name;
  Group group = Group::other;
  SurfaceFigures figures;
  std::optional<BoneOutside> outside;  ///< of bones
};

struct Report {
  std::vector<SurfaceLine> surfaces;  ///< skin, bones, tissues
  std::vector<Finding> findings;      ///< in the order of the surfaces; then segments, volumes
  bool possible() const;              ///< no error among them
};

/// Vertices of bones less than this outside of the skin are taken to touch it.
inline constexpr double touching_mm = 0.01;

/// Looks at every surface alone, at bones against the skin, at segments without a bone, and at bounds that
/// cannot belong to one body. Throws Error{interrupted} only.
Report inspect(const Case& patient, const Context& context);

}  // namespace ecorche::check
