// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/thinning.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

#include "preprocess/thin/isotropic.hpp"

namespace ecorche::thin {
namespace {

constexpr std::size_t kSlab = 32;  // slices that a thread takes at once; two more are read for them

void check_thinness(double thinness, double least) {
  if (thinness >= least && thinness <= most_thinness) return;
  std::ostringstream what;
  what << thinness << " is not within " << least << " to " << most_thinness;
  throw Error(ErrorKind::usage, "--tp", what.str(),
              least > least_thinness ? "a skeleton can only become thinner" : "0.3 to 1 is usual");
}

void check_grid(const ImageGrid& grid) {
  if (!is_isotropic(grid)) {
    std::ostringstream what;
    what << "voxels of " << grid.spacing[0] << " x " << grid.spacing[1] << " x " << grid.spacing[2]
         << " mm are not isotropic";
    throw Error(ErrorKind::data, "grid", what.str(), "resample them first");
  }
  if (*std::max_element(grid.size.begin(), grid.size.end()) > 65535)
    throw Error(ErrorKind::data, "grid", "has more than 65535 voxels along an axis", "use coarser voxels");
}

// The largest float that is not above `x`: a float is above `x` exactly when it is above this.
float floor_float(double x) {
  const auto near = static_cast<float>(x);
  return static_cast<double>(near) > x ? std::nextafter(near, -std::numeric_limits<float>::infinity()) : near;
}

// What thinning keeps of one slab.
struct Kept {
  std::vector<std::array<std::uint16_t, 3>> voxel;
  std::vector<std::uint32_t> distance;
  std::vector<float> deficit;
};

// Sums of lengths (roots of squares; <3,4,5> as it is, whose sums are exact) over 3 by 3 voxels of slices.
template <class T>
class Planes {
 public:
  Planes(const T* values, const std::array<std::int32_t, 3>& size, bool squares)
      : values_(values),
        nx_(static_cast<std::size_t>(size[0])),
        ny_(static_cast<std::size_t>(size[1])),
        nz_(static_cast<std::size_t>(size[2])),
        squares_(squares),
        row_(nx_ + 2, 0.0F),
        rows_(3 * nx_) {}

  const T* row(std::size_t j, std::size_t k) const { return values_ + (k * ny_ + j) * nx_; }
  void lengths(const T* from, float* to) const {
    if (squares_) {
      for (std::size_t i = 0; i < nx_; ++i) to[i] = std::sqrt(static_cast<float>(from[i]));
    } else {
      for (std::size_t i = 0; i < nx_; ++i) to[i] = static_cast<float>(from[i]);
    }
  }
  // The sums over slice k (all 0 beyond the image), nx by ny.
  void sums(std::ptrdiff_t k, std::vector<float>& out) {
    out.resize(nx_ * ny_);
    if (k < 0 || k >= static_cast<std::ptrdiff_t>(nz_)) {
      std::fill(out.begin(), out.end(), 0.0F);
      return;
    }
    row_sums(0, k, ny_);
    for (std::size_t j = 0; j < ny_; ++j) {
      const float* const before = j == 0 ? nullptr : &rows_[(j - 1) % 3 * nx_];
      row_sums(j + 1, k, ny_);
      const float *const here = &rows_[j % 3 * nx_], *const after = &rows_[(j + 1) % 3 * nx_];
      float* const to = &out[j * nx_];
      if (before == nullptr) {
        for (std::size_t i = 0; i < nx_; ++i) to[i] = 0.0F + here[i] + after[i];
      } else {
        for (std::size_t i = 0; i < nx_; ++i) to[i] = before[i] + here[i] + after[i];
      }
    }
  }

 private:
  void row_sums(std::size_t j, std::ptrdiff_t k, std::size_t rows) {
    float* const to = &rows_[j % 3 * nx_];
    if (j >= rows) {
      std::fill_n(to, nx_, 0.0F);
      return;
    }
    lengths(row(j, static_cast<std::size_t>(k)), &row_[1]);
    for (std::size_t i = 0; i < nx_; ++i) to[i] = row_[i] + row_[i + 1] + row_[i + 2];
  }

  const T* values_;
  std::size_t nx_, ny_, nz_;
  bool squares_;
  std::vector<float> row_;   // one row, 0 beyond both ends
  std::vector<float> rows_;  // sums along i of three rows, by j modulo 3
};

template <class T>
void thin_slab(const T* values, const std::array<std::int32_t, 3>& size, bool squares, double thinness,
               std::size_t begin, std::size_t end, const Context& context, Kept& kept) {
  const auto nx = static_cast<std::size_t>(size[0]), ny = static_cast<std::size_t>(size[1]);
  Planes<T> planes(values, size, squares);
  std::vector<float> before, here, after, own(nx), deficit(nx);
  planes.sums(static_cast<std::ptrdiff_t>(begin) - 1, before);
  planes.sums(static_cast<std::ptrdiff_t>(begin), here);
  const float above = floor_float(thinness), unit = squares ? 1.0F : 3.0F;
  for (std::size_t k = begin; k < end && !context.stop.stop_requested(); ++k) {
    planes.sums(static_cast<std::ptrdiff_t>(k) + 1, after);
    for (std::size_t j = 0; j < ny; ++j) {
      const T* const row = planes.row(j, k);
      planes.lengths(row, own.data());
      const float *const a = &before[j * nx], *const b = &here[j * nx], *const c = &after[j * nx];
      // No product here, which a compiler could fuse into a sum on some processors.
      for (std::size_t i = 0; i < nx; ++i) {
        const float all = a[i] + b[i] + c[i];
        deficit[i] = (own[i] - (all - own[i]) / 26.0F) / unit;
      }
      for (std::size_t i = 0; i < nx; ++i) {
        if (!(deficit[i] > above) || row[i] == 0) continue;
        kept.voxel.push_back(
            {static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j), static_cast<std::uint16_t>(k)});
        kept.distance.push_back(row[i]);
        kept.deficit.push_back(deficit[i]);
      }
    }
    before.swap(here);
    here.swap(after);
  }
}

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

VolumetricSkeleton thin(const DistanceMap& map, const ImageGrid& grid, double thinness,
                        const Context& context) {
  check_thinness(thinness, least_thinness);
  check_grid(grid);
  const auto nz = static_cast<std::size_t>(map.size[2]);
  std::vector<Kept> slabs((nz + kSlab - 1) / kSlab);
  const bool squares = map.metric == DistanceMetric::euclidean;
  std::visit(
      [&](const auto& values) {
        tbb::parallel_for(std::size_t{0}, slabs.size(), [&](std::size_t s) {
          thin_slab(values.data(), map.size, squares, thinness, s * kSlab, std::min(nz, (s + 1) * kSlab),
                    context, slabs[s]);
        });
      },
      map.values);
  context.check_stop();
  VolumetricSkeleton skeleton;
  skeleton.grid = grid;
  skeleton.metric = map.metric;
  skeleton.thinness = thinness;
  std::size_t rows = 0;
  for (const Kept& kept : slabs) rows += kept.voxel.size();
  skeleton.voxel.reserve(rows);
  skeleton.distance.reserve(rows);
  skeleton.deficit.reserve(rows);
  for (const Kept& kept : slabs) {
    append(skeleton.voxel, kept.voxel);
    append(skeleton.distance, kept.distance);
    append(skeleton.deficit, kept.deficit);
  }
  context.report(1);
  return skeleton;
}

VolumetricSkeleton thinner(const VolumetricSkeleton& skeleton, double thinness) {
  check_thinness(thinness, skeleton.thinness);
  VolumetricSkeleton out;
  out.name = skeleton.name;
  out.grid = skeleton.grid;
  out.metric = skeleton.metric;
  out.thinness = thinness;
  const float above = floor_float(thinness);
  const std::size_t rows = skeleton.size();
  const auto count = static_cast<std::size_t>(
      std::count_if(skeleton.deficit.begin(), skeleton.deficit.end(), [&](float d) { return d > above; }));
  out.voxel.reserve(count);
  out.distance.reserve(count);
  out.deficit.reserve(count);
  if (!skeleton.segment.empty()) out.segment.reserve(count);
  for (std::size_t r = 0; r < rows; ++r) {
    if (!(skeleton.deficit[r] > above)) continue;
    out.voxel.push_back(skeleton.voxel[r]);
    out.distance.push_back(skeleton.distance[r]);
    out.deficit.push_back(skeleton.deficit[r]);
    if (!skeleton.segment.empty()) out.segment.push_back(skeleton.segment[r]);
  }
  return out;
}

}  // namespace ecorche::thin
