// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/neck_lattice.hpp"

#include <span>

namespace ecorche::scan {
namespace {

constexpr double kRoundNeck = 8;      // mm more than the bone
constexpr double kLargestNeck = 320;  // mm: no neck
constexpr double kBeyondImage = -1e30, kBrightest = 4;
using Eigen::Vector3d;

// Between the eight voxels about it; `none` beyond the image.
template <class T>
double sample(const ImageGrid& grid, std::span<const T> values, const Vector3d& p, double none) {
  const auto index = grid.index({p[0], p[1], p[2]});
  std::array<int, 3> first{};
  std::array<double, 3> part{};
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(index[a] > -0.5 && index[a] < grid.size[a] - 0.5)) return none;
    const double inner = std::clamp(index[a], 0.0, grid.size[a] - 1.0);
    first[a] = std::min(static_cast<int>(inner), std::max(0, grid.size[a] - 2));
    part[a] = inner - first[a];
  }
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    double weight = 1;
    std::array<int, 3> at{};
    for (std::size_t a = 0; a < 3; ++a) {
      const bool next = (c >> a & 1) != 0;
      weight *= next ? part[a] : 1 - part[a];
      at[a] = std::min(first[a] + (next ? 1 : 0), grid.size[a] - 1);
    }
    if (weight > 0) sum += weight * static_cast<double>(values[grid.offset(at[0], at[1], at[2])]);
  }
  return sum;
}

}  // namespace

NeckLattice neck_lattice(const Image& ct, const std::vector<std::uint8_t>& neck,
                         const std::vector<std::uint8_t>& other, const Eigen::Matrix3d& axes, double bone,
                         double skin) {
  const ImageGrid& grid = ct.grid;
  NeckLattice out;
  out.axes = axes;
  Vector3d low = Vector3d::Constant(1e30), high = Vector3d::Constant(-1e30);
  std::size_t at = 0;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i, ++at) {
        if (neck[at] == 0) continue;
        const auto p = grid.point(i, j, k);
        const Vector3d q = axes.transpose() * Vector3d(p[0], p[1], p[2]);
        low = low.cwiseMin(q);
        high = high.cwiseMax(q);
      }
    }
  }
  if ((high - low).minCoeff() < 0 || (high - low).maxCoeff() > kLargestNeck) return out;
  out.low = low.array() - kRoundNeck;
  for (int a = 0; a < 3; ++a)
    out.size[static_cast<std::size_t>(a)] =
        static_cast<int>(std::ceil(high[a] - low[a] + 2 * kRoundNeck)) + 1;
  const std::size_t count = static_cast<std::size_t>(out.size[0]) * static_cast<std::size_t>(out.size[1]) *
                            static_cast<std::size_t>(out.size[2]);
  out.bright.assign(count, -1);
  out.neck.assign(count, 0);
  out.other.assign(count, 0);
  std::vector<double> raw(count, kBeyondImage), flesh;
  with_scalar_type(ct.type, [&](auto zero) {
    const auto voxels = ct.scalars<decltype(zero)>();
    out.each([&](const Vector3d& p, std::size_t n) { raw[n] = sample(grid, voxels, p, kBeyondImage); });
  });
  out.each([&](const Vector3d& p, std::size_t n) {
    if (raw[n] <= kBeyondImage) return;
    if (raw[n] > skin && raw[n] < bone) flesh.push_back(raw[n]);
    const auto index = grid.index({p[0], p[1], p[2]});
    std::array<int, 3> v{};
    for (std::size_t a = 0; a < 3; ++a)
      v[a] = std::clamp(static_cast<int>(std::lround(index[a])), 0, grid.size[a] - 1);
    const std::size_t voxel = grid.offset(v[0], v[1], v[2]);
    out.neck[n] = neck[voxel];
    out.other[n] = other[voxel];
  });
  if (flesh.empty()) return {};
  const auto middle = flesh.begin() + static_cast<std::ptrdiff_t>(flesh.size() / 2);
  std::nth_element(flesh.begin(), middle, flesh.end());
  const double range = std::max(bone - *middle, 1e-9);
  for (std::size_t s = 0; s < count; ++s) {
    if (raw[s] > kBeyondImage)
      out.bright[s] = static_cast<float>(std::clamp((raw[s] - *middle) / range, 0.0, kBrightest));
  }
  return out;
}

}  // namespace ecorche::scan
