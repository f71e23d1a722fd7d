// SPDX-License-Identifier: Apache-2.0
// The vertices that a rule is about: of named regions, bones and segments.
#pragma once

#include <array>
#include <map>
#include <string>
#include <tuple>

#include <ecorche/values/case.hpp>
#include "preprocess/rig/surface_points.hpp"

namespace ecorche::rig {

class BonePoints {
 public:
  /// `patient` must outlive this.
  explicit BonePoints(const Case& patient) : patient_(patient) {}

  /// No rows where the place has no bone in this case. A region's boxes take the vertices
  /// within them; each of its points takes the vertex nearest to it, once: so a region that was marked on
  /// another surface of the same bone still finds its own.
  const SurfacePoints& of(const RegionUse& use);

  /// All bones of a segment as one surface, its vertices by_place; empty where it has none.
  const SurfaceMesh& segment(const std::string& name);

  /// The segment that the vertices of `use` belong to; empty where it is unknown.
  std::string owner(const RegionUse& use) const;

  /// Whose bones a region is on; empty where it is on a single bone, or unknown.
  std::string segment_of(const std::string& region) const;

 private:
  const CaseBone* case_bone(const std::string& name) const;
  const SurfaceMesh* bone(const std::string& name);
  SurfacePoints region(const std::string& name);
  SurfacePoints find(const RegionUse& use);

  const Case& patient_;
  std::map<std::string, SurfaceMesh> segments_, single_;
  using Key = std::tuple<std::array<std::string, 5>, std::array<double, 6>>;
  std::map<Key, SurfacePoints> found_;  // facing is slow, and centre and axes ask alike
};

}  // namespace ecorche::rig
