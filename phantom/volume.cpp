// SPDX-License-Identifier: Apache-2.0
#include "phantom/volume.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "phantom/random.hpp"

namespace ecorche::phantom {

namespace {

constexpr double kAir = -1024, kSkin = 40, kSpongy = 250, kNoise = 15;
constexpr double kSkinThickness = 2, kCortex = 3.5, kFade = 3;  // mm
constexpr int kTile = 8;  // voxels along an edge of the tiles that are skipped together

/// HU of a part at depth `d` (negative inside).
double hounsfield(const Part& part, double d) {
  if (part.group == Group::skin) return d > -kSkinThickness ? kSkin : part.hounsfield;
  if (part.group != Group::bone) return part.hounsfield;
  // A dense shell that fades into spongy bone.
  const double t = std::clamp((-d - kCortex) / kFade, 0.0, 1.0);
  return part.hounsfield + (kSpongy - part.hounsfield) * t;
}

ImageGrid grid_over(const Box& box, double voxel) {
  ImageGrid grid;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double first = std::floor(box.lo[a] / voxel) - 1;
    grid.size[i] = static_cast<std::int32_t>(std::ceil(box.hi[a] / voxel) - first) + 1;
    grid.origin[i] = (first + 0.5) * voxel;
    grid.spacing[i] = voxel;
  }
  return grid;
}

/// Writes one part over what is there, tile by tile within its box.
class Painter {
 public:
  Painter(const Part& part, std::uint8_t label, const ImageGrid& grid, std::vector<float>& hu,
          std::span<std::uint8_t> labels)
      : part_(part), label_(label), grid_(grid), hu_(hu), labels_(labels), voxel_(grid.spacing[0]) {
    const Box box = part.shape.box().grown(voxel_);
    for (std::size_t a = 0; a < 3; ++a) {
      lo_[a] =
          std::max(0, static_cast<int>(std::floor((box.lo[static_cast<int>(a)] - grid.origin[a]) / voxel_)));
      hi_[a] =
          std::min(grid.size[a],
                   static_cast<int>(std::ceil((box.hi[static_cast<int>(a)] - grid.origin[a]) / voxel_)) + 1);
      tiles_[a] = std::max(0, (hi_[a] - lo_[a] + kTile - 1) / kTile);
    }
  }

  void run(const Context& context) {
    tbb::parallel_for(0, tiles_[0] * tiles_[1] * tiles_[2], [&](int tile) {
      if (context.stop.stop_requested()) return;
      paint({lo_[0] + tile % tiles_[0] * kTile, lo_[1] + tile / tiles_[0] % tiles_[1] * kTile,
             lo_[2] + tile / (tiles_[0] * tiles_[1]) * kTile},
            kTile);
    });
    context.check_stop();
  }

 private:
  Vec centre(double i, double j, double k) const {
    const auto p = grid_.point(i, j, k);
    return {p[0], p[1], p[2]};
  }

  void paint(const std::array<int, 3>& at, int edge) {
    const double middle = (edge - 1) / 2.0,
                 reach = Shape::lipschitz * (std::sqrt(3.0) * middle + 0.5) * voxel_;
    const double d = part_.shape.distance(centre(at[0] + middle, at[1] + middle, at[2] + middle));
    if (d > reach) return;
    // Deep inside only the part's own value is left; bones and skin have their shells to pass first.
    const bool deep = d < -reach - kCortex - kFade;
    if (!deep && edge > 2) {
      const int half = edge / 2;
      for (int q = 0; q < 8; ++q) {
        const std::array<int, 3> child{at[0] + (q & 1) * half, at[1] + (q >> 1 & 1) * half,
                                       at[2] + (q >> 2) * half};
        if (child[0] < hi_[0] && child[1] < hi_[1] && child[2] < hi_[2]) paint(child, half);
      }
      return;
    }
    for (int k = at[2]; k < std::min(at[2] + edge, hi_[2]); ++k) {
      for (int j = at[1]; j < std::min(at[1] + edge, hi_[1]); ++j) {
        for (int i = at[0]; i < std::min(at[0] + edge, hi_[0]); ++i) {
          set(grid_.offset(i, j, k), deep ? d : part_.shape.distance(centre(i, j, k)));
        }
      }
    }
  }

  void set(std::size_t n, double depth) {
    const double share = std::clamp(0.5 - depth / voxel_, 0.0, 1.0);
    hu_[n] = static_cast<float>(hu_[n] + share * (hounsfield(part_, depth) - hu_[n]));
    if (depth < 0) labels_[n] = label_;
  }

  const Part& part_;
  std::uint8_t label_;
  const ImageGrid& grid_;
  std::vector<float>& hu_;
  std::span<std::uint8_t> labels_;
  double voxel_;
  std::array<int, 3> lo_{}, hi_{}, tiles_{};
};

}  // namespace

Scan make_scan(const Part& skin, const std::vector<Part>& parts, const Box& bounds, double voxel,
               std::uint64_t seed, const Context& context) {
  if (parts.size() > 253)
    throw Error(ErrorKind::internal, "phantom", "too many parts for 8-bit labels", "report it");
  const ImageGrid grid = grid_over(bounds, voxel);
  Scan scan;
  scan.labels.image = Image(grid, ScalarType::u8);
  std::vector<float> hu(grid.voxels(), static_cast<float>(kAir));
  Painter(skin, 1, grid, hu, scan.labels.image.scalars<std::uint8_t>()).run(context);
  scan.labels.table[1] = "soft";
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto label = static_cast<std::uint8_t>(i + 2);
    Painter(parts[i], label, grid, hu, scan.labels.image.scalars<std::uint8_t>()).run(context);
    scan.labels.table[label] = parts[i].name;
    context.report(static_cast<double>(i + 1) / static_cast<double>(parts.size()));
  }

  scan.ct = {"ct", Image(grid, ScalarType::i16), kAir};
  scan.ct_noisy = {"ct_noisy", Image(grid, ScalarType::i16), kAir};
  const auto smooth = scan.ct.image.scalars<std::int16_t>(),
             noisy = scan.ct_noisy.image.scalars<std::int16_t>();
  const std::size_t layer = static_cast<std::size_t>(grid.size[0]) * static_cast<std::size_t>(grid.size[1]);
  tbb::parallel_for(0, grid.size[2], [&](int k) {
    const std::size_t first = layer * static_cast<std::size_t>(k);
    for (std::size_t n = first; n < first + layer; ++n) {
      smooth[n] = static_cast<std::int16_t>(std::lround(hu[n]));
      noisy[n] = static_cast<std::int16_t>(std::max(kAir, std::round(hu[n] + kNoise * gaussian(seed, n))));
    }
  });
  return scan;
}

}  // namespace ecorche::phantom
