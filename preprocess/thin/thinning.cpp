// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/thinning.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
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

// Where a row is not 0: from the first such voxel to behind the last; empty where begin is not below end.
struct Extent {
  std::size_t begin = 0, end = 0;
};

template <class T>
Extent extent_of(const T* row, std::size_t n) {
  constexpr std::size_t lanes = sizeof(std::uint64_t) / sizeof(T);
  const auto is_empty = [&](std::size_t at) {
    std::uint64_t word = 0;
    std::memcpy(&word, row + at, sizeof word);
    return word == 0;
  };
  Extent e{0, n};
  while (e.begin + lanes <= n && is_empty(e.begin)) e.begin += lanes;
  while (e.begin < n && row[e.begin] == 0) ++e.begin;
  while (e.end >= e.begin + lanes && is_empty(e.end - lanes)) e.end -= lanes;
  while (e.end > e.begin && row[e.end - 1] == 0) --e.end;
  return e;
}

// The lengths over one slice (roots of squares; <3,4,5> as it is, whose sums are exact), with a border of
// zeros. Most of a scan is background: only what a row holds is looked at.
class Slice {
 public:
  Slice(std::size_t nx, std::size_t ny)
      : stride_(nx + 2), lengths_((nx + 2) * (ny + 2), 0.0F), extents_(ny) {}

  template <class T>
  void read(const T* values, bool squares) {
    const std::size_t nx = stride_ - 2;
    for (std::size_t j = 0; j < extents_.size(); ++j) {
      float* const to = row(j);
      std::fill(to + extents_[j].begin, to + std::max(extents_[j].begin, extents_[j].end), 0.0F);
      const T* const from = values + j * nx;
      const Extent e = extents_[j] = extent_of(from, nx);
      if (squares) {
        for (std::size_t i = e.begin; i < e.end; ++i) to[i] = std::sqrt(static_cast<float>(from[i]));
      } else {
        for (std::size_t i = e.begin; i < e.end; ++i) to[i] = static_cast<float>(from[i]);
      }
    }
  }
  void clear() {
    std::fill(lengths_.begin(), lengths_.end(), 0.0F);
    std::fill(extents_.begin(), extents_.end(), Extent());
  }
  // Voxel 0 of row j, which may be -1 or one past the last: index -1 is valid too.
  float* row(std::size_t j) { return &lengths_[(j + 1) * stride_ + 1]; }
  const float* row(std::size_t j) const { return &lengths_[(j + 1) * stride_ + 1]; }
  const float* row_before(std::size_t j) const { return &lengths_[j * stride_ + 1]; }
  Extent extent(std::size_t j) const { return extents_[j]; }

 private:
  std::size_t stride_;
  std::vector<float> lengths_;
  std::vector<Extent> extents_;
};

template <class T>
void thin_slab(const T* values, const std::array<std::int32_t, 3>& size, bool squares, double thinness,
               std::size_t begin, std::size_t end, const Context& context, Kept& kept) {
  const auto nx = static_cast<std::size_t>(size[0]), ny = static_cast<std::size_t>(size[1]),
             nz = static_cast<std::size_t>(size[2]);
  Slice before(nx, ny), here(nx, ny), after(nx, ny);
  if (begin > 0) before.read(values + (begin - 1) * nx * ny, squares);
  here.read(values + begin * nx * ny, squares);
  std::vector<float> columns(nx + 2), deficit(nx);  // of nine rows at voxel i - 1; of voxel i
  const float above = floor_float(thinness), unit = squares ? 1.0F : 3.0F;
  for (std::size_t k = begin; k < end && !context.stop.stop_requested(); ++k) {
    if (k + 1 < nz) {
      after.read(values + (k + 1) * nx * ny, squares);
    } else {
      after.clear();
    }
    for (std::size_t j = 0; j < ny; ++j) {
      const Extent e = here.extent(j);
      if (e.begin >= e.end) continue;
      const float *const a0 = before.row_before(j) - 1, *const a1 = before.row(j) - 1,
                         *const a2 = before.row(j + 1) - 1, *const b0 = here.row_before(j) - 1,
                         *const b1 = here.row(j) - 1, *const b2 = here.row(j + 1) - 1,
                         *const c0 = after.row_before(j) - 1, *const c1 = after.row(j) - 1,
                         *const c2 = after.row(j + 1) - 1;
      // No product here or below, which a compiler could fuse into a sum on some processors.
      for (std::size_t i = e.begin; i < e.end + 2; ++i)
        columns[i] = (a0[i] + a1[i] + a2[i]) + (b0[i] + b1[i] + b2[i]) + (c0[i] + c1[i] + c2[i]);
      for (std::size_t i = e.begin; i < e.end; ++i) {
        const float all = columns[i] + columns[i + 1] + columns[i + 2], own = b1[i + 1];
        deficit[i] = (own - (all - own) / 26.0F) / unit;
      }
      const T* const row = values + (k * ny + j) * nx;
      for (std::size_t i = e.begin; i < e.end; ++i) {
        if (!(deficit[i] > above) || row[i] == 0) continue;
        kept.voxel.push_back(
            {static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j), static_cast<std::uint16_t>(k)});
        kept.distance.push_back(row[i]);
        kept.deficit.push_back(deficit[i]);
      }
    }
    std::swap(before, here);
    std::swap(here, after);
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
