// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/image_places.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "core/values/text.hpp"

namespace ecorche::check {
namespace {

using Eigen::Vector3d;

constexpr double kShare = 0.01;     // of the skin's vertices, and of its length
constexpr double kVoxels = 2;       // skin drawn round voxels leaves them by half of one
constexpr double kSameGrid = 1e-3;  // of a spacing

Vector3d point(const ImageGrid& grid, double i, double j, double k) {
  const auto p = grid.point(i, j, k);
  return {p[0], p[1], p[2]};
}

Vector3d middle(const ImageGrid& grid) {
  return point(grid, 0.5 * (grid.size[0] - 1), 0.5 * (grid.size[1] - 1), 0.5 * (grid.size[2] - 1));
}

// How far, mm, the point lies outside of the image's box.
double outside(const ImageGrid& grid, const Vector3d& p) {
  const auto index = grid.index({p.x(), p.y(), p.z()});
  double squared = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double beyond = std::max({-0.5 - index[a], index[a] - (grid.size[a] - 0.5), 0.0}) * grid.spacing[a];
    squared += beyond * beyond;
  }
  return std::sqrt(squared);
}

std::optional<Misplaced> against_skin(const std::string& name, const ImageGrid& grid, const Points& skin,
                                      double length) {
  Misplaced out{name, {}, middle(grid), {}};
  Eigen::Index count = 0;
  double most = 0, least = 1e300;
  const double voxel = *std::max_element(grid.spacing.begin(), grid.spacing.end());
  const double far = std::max(kVoxels * voxel, kShare * length);
  for (Eigen::Index v = 0; v < skin.rows(); ++v) {
    const Vector3d p = skin.row(v).transpose();
    const double mm = outside(grid, p);
    least = std::min(least, mm);
    if (mm > far) ++count;
    if (mm <= most) continue;
    most = mm;
    out.at = p;
  }
  const double share = static_cast<double>(count) / static_cast<double>(skin.rows());
  if (least > 0) {
    out.what = "does not meet the skin: they lie " + text::number(least) + " mm apart";
    out.mend = "mend the skin's frame or unit, or the image's header";
    return out;
  }
  if (share < kShare) return std::nullopt;
  out.what = text::number(100 * share) + " % of the skin lies outside of this image, by up to " +
             text::number(most) + " mm";
  out.mend = "there it has nothing to pose; mend the skin's frame or the image's header if that is not meant";
  return out;
}

// The same voxels in another place.
std::optional<Misplaced> against_labels(const std::string& name, const ImageGrid& grid,
                                        const ImageGrid& labels) {
  if (grid.size != labels.size) return std::nullopt;
  for (std::size_t a = 0; a < 3; ++a) {
    if (std::abs(grid.spacing[a] - labels.spacing[a]) > kSameGrid * labels.spacing[a]) return std::nullopt;
  }
  double most = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](const ImageGrid& g) {
      return point(g, (corner & 1) != 0 ? g.size[0] - 1 : 0, (corner & 2) != 0 ? g.size[1] - 1 : 0,
                   (corner & 4) != 0 ? g.size[2] - 1 : 0);
    };
    most = std::max(most, (at(grid) - at(labels)).norm());
  }
  if (most <= 0.5 * *std::min_element(grid.spacing.begin(), grid.spacing.end())) return std::nullopt;
  return Misplaced{name, "has the label map's voxels, but lies up to " + text::number(most) + " mm from it",
                   middle(grid),
                   "mend the header of one of them (origin, direction; of a NIfTI its qform and sform)"};
}

}  // namespace

std::vector<Misplaced> misplaced_images(const Case& patient) {
  std::vector<Misplaced> out;
  const Points& skin = patient.skin.V;
  if (skin.rows() == 0) return out;
  const double length = (skin.colwise().maxCoeff() - skin.colwise().minCoeff()).maxCoeff();
  const auto look = [&](const std::string& name, const ImageGrid& grid, bool is_labels) {
    std::optional<Misplaced> found;
    if (!is_labels && patient.labels) found = against_labels(name, grid, patient.labels->image.grid);
    if (!found) found = against_skin(name, grid, skin, length);
    if (found) out.push_back(std::move(*found));
  };
  for (const CaseVolume& volume : patient.volumes) look(volume.name, volume.image.grid, false);
  if (patient.labels) look("labels", patient.labels->image.grid, true);
  return out;
}

}  // namespace ecorche::check
