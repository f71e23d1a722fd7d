// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/label_shape.hpp"

#include <algorithm>
#include <limits>

#include "core/linear/decompositions.hpp"

namespace ecorche::scan {
namespace {

constexpr double kOutside = 0.5;   // share of all that is outside: the body's
constexpr double kThin = 2.5;      // voxels a face of its outside: a shell
constexpr double kSlender = 3.5;   // times as long as wide: a long bone
constexpr double kLongBone = 150;  // mm: no bone of a hand
constexpr double kBorder = 1;      // cubes of label points

bool at_border(const Points& points, const ImageGrid& grid) {
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const auto index = grid.index({points(p, 0), points(p, 1), points(p, 2)});
    for (std::size_t a = 0; a < 3; ++a) {
      const double near = kBorder * kLabelCubes / grid.spacing[a];
      if (index[a] < near || index[a] > grid.size[a] - 1 - near) return true;
    }
  }
  return false;
}

}  // namespace

Extents extents_of(const Points& points) {
  if (points.rows() < 2) return {};
  const Points centred = points.rowwise() - points.colwise().mean();
  const Eigen::Matrix3d axes = linear::symmetric_eigen(centred.transpose() * centred).vectors;
  const auto along = [&](int axis) {
    const Eigen::VectorXd at = centred * axes.col(axis);
    return at.maxCoeff() - at.minCoeff();
  };
  return {along(2), along(1)};
}

TooShort::TooShort(const BodyTemplate& body, const std::vector<NamelessLabel>& labels,
                   const ImageGrid& whole) {
  for (const NamelessLabel& label : labels)
    label_.push_back(at_border(label.points, whole) ? std::numeric_limits<double>::infinity()
                                                    : extents_of(label.points).length + kLabelCubes);
  for (const TemplateBone& bone : body.bones) {
    const Extents e = extents_of(bone.points);
    bone_.push_back(e.length > kLongBone && e.length > kSlender * e.width ? e.length : 0);
  }
}

void find_bodies(const std::vector<NamelessLabel>& labels, std::vector<LabelMeaning>& out) {
  std::size_t all = 0;
  for (const NamelessLabel& label : labels) all += label.outside;
  for (std::size_t l = 0; l < labels.size(); ++l) {
    const double share =
        static_cast<double>(labels[l].outside) / static_cast<double>(std::max<std::size_t>(1, all));
    if (share < kOutside || labels.size() < 2) continue;
    const bool thin = static_cast<double>(labels[l].voxels) < kThin * static_cast<double>(labels[l].outside);
    out[l].kind = thin ? LabelMeaning::Kind::shell : LabelMeaning::Kind::body;
    out[l].confidence = share;
  }
}

Points points_of(const std::vector<NamelessLabel>& labels, const std::vector<std::size_t>& which,
                 Eigen::Index most) {
  Eigen::Index count = 0, at = 0;
  for (const std::size_t l : which) count += labels[l].points.rows();
  const Eigen::Index step = std::max<Eigen::Index>(1, count / most);
  Points out(count / step + static_cast<Eigen::Index>(which.size()), 3);
  for (const std::size_t l : which) {
    for (Eigen::Index p = 0; p < labels[l].points.rows(); p += step) out.row(at++) = labels[l].points.row(p);
  }
  out.conservativeResize(at, 3);
  return out;
}

}  // namespace ecorche::scan
