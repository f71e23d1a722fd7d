// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/lost_segments.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <optional>
#include <string>

#include "core/geometry/face_tree.hpp"
#include "core/geometry/hole_size.hpp"

namespace ecorche::check {
namespace {

constexpr Eigen::Index kSamples = 200;  // vertices of each bone
constexpr double kOnSkin = 0.02;        // of the skin's length: bones may be drawn a little larger than it

Eigen::AlignedBox3d bounds_of(const SurfaceMesh& mesh) {
  return {mesh.V.colwise().minCoeff().transpose(), mesh.V.colwise().maxCoeff().transpose()};
}

// Whether some of the body is about the bone: a vertex of it in the skin, or right at it, or all of the skin
// in its bounds.
class Body {
 public:
  Body(const SurfaceMesh& skin, const Inside& inside)
      : skin_(skin), box_(bounds_of(skin)), inside_(inside), near_(kOnSkin * box_.sizes().maxCoeff()) {}

  bool holds(const SurfaceMesh& bone) {
    if (bounds_of(bone).contains(box_)) return true;
    const Eigen::Index step = std::max<Eigen::Index>(1, bone.V.rows() / kSamples);
    for (Eigen::Index v = 0; v < bone.V.rows(); v += step) {
      const Eigen::Vector3d p = bone.V.row(v).transpose();
      if (inside_(p) || mm2_from_skin(p) <= near_ * near_) return true;
    }
    return false;
  }

 private:
  double mm2_from_skin(const Eigen::Vector3d& p) {
    if (!tree_) tree_.emplace(skin_);
    return tree_->nearest(p).squared;
  }

  const SurfaceMesh& skin_;
  Eigen::AlignedBox3d box_;
  const Inside& inside_;
  std::optional<geometry::FaceTree> tree_;  // where all bones lie inside nobody asks for it
  double near_;
};

}  // namespace

std::vector<Finding> lost_segments(const Case& patient, const Inside& in_skin) {
  if (patient.skin.F.rows() == 0) return {};
  Body body(patient.skin, in_skin);
  std::map<std::string, const CaseBone*> lost;
  std::map<std::string, bool> held;
  for (const CaseBone& bone : patient.bones) {
    if (bone.surface.V.rows() == 0 || held[bone.segment]) continue;
    if (body.holds(bone.surface)) {
      held[bone.segment] = true;
      lost.erase(bone.segment);
    } else {
      lost.emplace(bone.segment, &bone);
    }
  }
  // What an open skin encloses is not sure.
  if (lost.empty() || geometry::largest_hole(patient.skin).holes > 0) return {};
  std::vector<Finding> out;
  out.reserve(lost.size());
  for (const auto& [segment, bone] : lost)
    out.push_back({Severity::error, segment,
                   "its bones lie outside the skin: nothing of the body would follow them",
                   bone->surface.V.colwise().mean().transpose(),
                   "mend their frame or unit, or the skin; or leave them out"});
  return out;
}

}  // namespace ecorche::check
