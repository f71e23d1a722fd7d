// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/body_scale.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "core/linear/decompositions.hpp"
#include "preprocess/rig/parted_bones.hpp"

namespace ecorche::rig {
namespace {

using Eigen::RowVector3d;

// Of BodyParts3D's man and ICRP's woman: the mean of their lengths, mm, and from the least to the greatest of
// their lengths in widths, with 15 % for other bodies.
struct LongBone {
  std::string_view segment;
  double length, least, most;
};
constexpr std::array<LongBone, 4> kLongBones{{{"thigh_left", 415, 3.8, 5.8},
                                              {"thigh_right", 415, 3.8, 5.8},
                                              {"upper_arm_left", 310, 4.1, 6.3},
                                              {"upper_arm_right", 310, 4.1, 6.3}}};
constexpr double kPelvis = 254;                           // mm, its largest extent
constexpr double kPelvisMid = 0.69, kPelvisLeast = 0.53;  // of that, the others at least,
constexpr double kPelvisMostLeast = 0.70;                 // and the least one at most
constexpr double kFlare = 1.5, kSlice = 0.12;             // an end's width in widths of the middle
constexpr double kLeastScale = 0.35, kMostScale = 1.3;    // clamped
constexpr double kAdultFrom = 0.8, kAdultTo = 1.2;        // as adults differ

// The vertices along their principal axes, the longest first, from 0 on.
Points along_axes(const Case& patient, std::string_view segment) {
  Points all(0, 3);
  for (const CaseBone& bone : patient.bones) {
    if (bone.segment != segment) continue;
    all.conservativeResize(all.rows() + bone.surface.V.rows(), 3);
    all.bottomRows(bone.surface.V.rows()) = bone.surface.V;
  }
  if (all.rows() < 12) return Points(0, 3);
  const Points from = all.rowwise() - all.colwise().mean();
  const Eigen::Matrix3d axes = linear::symmetric_eigen(from.transpose() * from).vectors;
  const Points out = from * axes.rowwise().reverse();
  return out.rowwise() - out.colwise().minCoeff();
}

// The largest extent across the long axis between two shares of the length.
double width(const Points& p, double length, double from, double to) {
  RowVector3d least = RowVector3d::Constant(1e30), most = RowVector3d::Constant(-1e30);
  for (Eigen::Index v = 0; v < p.rows(); ++v) {
    if (p(v, 0) < from * length || p(v, 0) > to * length) continue;
    least = least.cwiseMin(p.row(v));
    most = most.cwiseMax(p.row(v));
  }
  return std::max({0.0, most[1] - least[1], most[2] - least[2]});
}

// Over an adult's; nothing where it is not whole.
std::optional<double> scale_of(const Case& patient, const LongBone& bone) {
  const Points p = along_axes(patient, bone.segment);
  if (p.rows() == 0) return std::nullopt;
  const double length = p.col(0).maxCoeff(), slender = length / width(p, length, 0, 1);
  if (!(slender >= bone.least && slender <= bone.most)) return std::nullopt;
  const double amid = width(p, length, 0.5 - kSlice, 0.5 + kSlice);
  const double ends = std::min(width(p, length, 0, kSlice), width(p, length, 1 - kSlice, 1));
  if (!(ends > kFlare * amid)) return std::nullopt;
  return length / bone.length;
}

std::optional<double> scale_of_pelvis(const Case& patient) {
  const Points p = along_axes(patient, "pelvis");
  if (p.rows() == 0) return std::nullopt;
  RowVector3d size = p.colwise().maxCoeff();
  std::sort(size.data(), size.data() + 3);
  const bool whole = size[1] >= kPelvisMid * size[2] && size[0] >= kPelvisLeast * size[2] &&
                     size[0] <= kPelvisMostLeast * size[2];
  return whole ? std::optional(size[2] / kPelvis) : std::nullopt;
}

}  // namespace

double body_scale(const Case& patient) {
  if (patient.generic || (patient.skeleton.name != "human" && !is_parted(patient.skeleton))) return 1;
  std::optional<double> largest = scale_of_pelvis(patient);
  for (const LongBone& bone : kLongBones) largest = std::max(largest, scale_of(patient, bone));
  if (!largest || (*largest >= kAdultFrom && *largest <= kAdultTo)) return 1;
  return std::clamp(*largest, kLeastScale, kMostScale);
}

}  // namespace ecorche::rig
