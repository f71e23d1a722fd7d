// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/solid_faces.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "core/values/text.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::parting {
namespace {

using Eigen::Vector3d;

bool has_word_skin(std::string_view name) {
  const std::string low = text::lower(name);
  for (std::size_t at = low.find("skin"); at != std::string::npos; at = low.find("skin", at + 1)) {
    const auto letter = [&](std::size_t i) { return i < low.size() && low[i] >= 'a' && low[i] <= 'z'; };
    if ((at == 0 || !letter(at - 1)) && !letter(at + 4)) return true;
  }
  return false;
}

// The offset of the voxel that holds the point; nothing beyond the image.
std::optional<std::size_t> voxel_at(const ImageGrid& grid, const Vector3d& point) {
  const std::array<double, 3> index = grid.index({point.x(), point.y(), point.z()});
  std::array<int, 3> at{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double rounded = std::floor(index[a] + 0.5);
    if (!(rounded >= 0 && rounded < grid.size[a])) return std::nullopt;
    at[a] = static_cast<int>(rounded);
  }
  return grid.offset(at[0], at[1], at[2]);
}

std::int64_t value_at(const Image& image, std::size_t voxel) {
  return with_scalar_type(image.type, [&](auto zero) {
    return static_cast<std::int64_t>(image.scalars<decltype(zero)>()[voxel]);
  });
}

// Over the middle, the middles of the edges, and half way from there to the corners.
template <class Value>
double mean_over(const std::array<Vector3d, 3>& corners, const Value& value) {
  const Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3;
  double sum = value(middle);
  for (std::size_t c = 0; c < 3; ++c) {
    sum += value(0.5 * (corners[c] + corners[(c + 1) % 3]));
    sum += value(0.5 * (corners[c] + middle));
  }
  return sum / 7;
}

}  // namespace

SolidFaces::SolidFaces(const Image& voxels, const std::optional<CaseLabels>& labels) : voxels_(voxels) {
  if (!labels) return;
  for (const auto& [id, name] : labels->table) {
    if (has_word_skin(name)) skin_.push_back(id);
  }
  if (!skin_.empty()) labels_ = &labels->image;
}

bool SolidFaces::solid_at(const Vector3d& point) const {
  const std::optional<std::size_t> voxel = voxel_at(voxels_.grid, point);
  return voxel && voxels_.scalars<std::uint16_t>()[*voxel] != voxel::outside;
}

bool SolidFaces::skin_at(const Vector3d& point) const {
  if (labels_ == nullptr) return false;
  const std::optional<std::size_t> voxel = voxel_at(labels_->grid, point);
  return voxel && std::binary_search(skin_.begin(), skin_.end(), value_at(*labels_, *voxel));
}

double SolidFaces::share(const std::array<Vector3d, 3>& corners) const {
  return mean_over(corners, [&](const Vector3d& p) { return solid_at(p) ? 1 : 0; });
}

double SolidFaces::price(const std::array<Vector3d, 3>& corners) const {
  return mean_over(corners, [&](const Vector3d& p) { return !solid_at(p) ? 0 : skin_at(p) ? kSkin : 1; });
}

}  // namespace ecorche::parting
