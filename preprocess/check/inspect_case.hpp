// SPDX-License-Identifier: Apache-2.0
// What is wrong with a case, told before anybody waits for its preparation. Changes nothing.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
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

/// How far a bone or a tissue sticks out of the skin.
struct Outside {
  std::int64_t count = 0;  ///< of its vertices
  double share = 0;
  double largest_mm = 0;                               ///< distance of the farthest one from the skin
  Eigen::Vector3d farthest = Eigen::Vector3d::Zero();  ///< LPS mm
};

struct SurfaceLine {
  std::string name;
  Group group = Group::other;
  SurfaceFigures figures;
  std::int64_t specks = 0, inner = 0;      ///< parts: tiny ones, and closed ones inside another
  std::optional<Offenders> intersections;  ///< of the surface with itself; empty where nobody looked
  bool drawn = false;                      ///< round voxels, by ourselves
  std::optional<Outside> outside;          ///< of bones and tissues
};

struct Report {
  std::vector<SurfaceLine> surfaces;  ///< skin, bones, tissues
  std::vector<Finding> findings;      ///< in the order of the surfaces; then segments, volumes
  bool possible() const;              ///< no error among them
};

/// Vertices less than this outside of the skin are taken to touch it: 0.01 mm of a man.
inline constexpr double touching_share = 6e-6;  ///< of the skin's largest extent
/// Tissues that leave the skin by more than this are told, 10 mm of a man, ...
inline constexpr double tissue_outside_share = 6e-3;
/// ... and by more than this no model is made of them, whatever the size (bounds.hpp: max_outside_mm).
inline constexpr double tissue_lost_share = 0.1;

struct Options {
  /// Surfaces that were drawn round voxels here (label_surfaces): closed and manifold as they are, so that
  /// nobody looks for pairs of their triangles that meet.
  std::set<std::string> drawn;
};

/// Looks at every surface alone, at bones and tissues against the skin, at frames and units that would agree
/// better, at segments without a bone, at the ids of the labels, and at bounds that cannot belong to one
/// body. Throws Error{interrupted} only.
Report inspect(const Case& patient, const Context& context, const Options& options = {});

}  // namespace ecorche::check
