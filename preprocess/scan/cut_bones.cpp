// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/cut_bones.hpp"

#include <algorithm>
#include <cmath>

#include "preprocess/label_surfaces/nearest.hpp"
#include "preprocess/scan/part_joints.hpp"
#include "preprocess/scan/pieces.hpp"
#include "preprocess/scan/template_cloud.hpp"

namespace ecorche::scan {
namespace {

constexpr double kBlock = 4;      // mm: the template is asked once in a block of so much
constexpr double kSeedNear = 14;  // mm: a seed lies nearer to its bone
constexpr double kMargin = 10;    // mm: ... and the bones of other segments so much farther
constexpr double kAgrees = 12;    // mm

// The part of an image that holds all of a mask, as an image of its own.
struct Part {
  std::array<std::int32_t, 3> low{0, 0, 0}, size{0, 0, 0};
  ImageGrid grid;
  std::vector<std::uint8_t> mask;

  Part(const std::vector<std::uint8_t>& whole, const ImageGrid& all) {
    std::array<std::int32_t, 3> high{-1, -1, -1};
    low = all.size;
    const auto each_row = [&](auto&& f) {
      for (int k = 0; k < all.size[2]; ++k) {
        for (int j = 0; j < all.size[1]; ++j) f(j, k, all.offset(0, j, k));
      }
    };
    each_row([&](int j, int k, std::size_t at) {
      for (int i = 0; i < all.size[0]; ++i) {
        if (whole[at + static_cast<std::size_t>(i)] == 0) continue;
        const std::array<std::int32_t, 3> v{i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          low[a] = std::min(low[a], v[a]);
          high[a] = std::max(high[a], v[a]);
        }
      }
    });
    grid = all;
    for (std::size_t a = 0; a < 3; ++a) grid.size[a] = size[a] = std::max(0, high[a] - low[a] + 1);
    grid.origin = all.point(low[0], low[1], low[2]);
    mask.reserve(grid.voxels());
    each(
        [&](std::size_t, std::size_t from, std::size_t count) {
          mask.insert(mask.end(), whole.begin() + static_cast<std::ptrdiff_t>(from),
                      whole.begin() + static_cast<std::ptrdiff_t>(from + count));
        },
        all);
  }

  /// f(first voxel of a row here, the same in the whole, voxels of the row)
  template <class F>
  void each(F&& f, const ImageGrid& all) const {
    std::size_t at = 0;
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j, at += static_cast<std::size_t>(size[0]))
        f(at, all.offset(low[0], low[1] + j, low[2] + k), static_cast<std::size_t>(size[0]));
    }
  }
};

class Cutter {
 public:
  Cutter(const std::vector<std::uint8_t>& mask, const ImageGrid& grid, const BodyTemplate& body,
         const Placed& placed, const Context& context)
      : grid_(grid),
        body_(body),
        placed_(placed),
        context_(context),
        part_(mask, grid),
        clouds_(segment_clouds(body, placed.in_play)) {}

  CutBones run() {
    CutBones out;
    out.of.assign(grid_.voxels(), 0);
    out.bones.resize(body_.bones.size());
    if (part_.mask.empty()) return out;
    of_.assign(part_.mask.size(), 0);
    seed();
    context_.report(0.4);
    std::vector<float> depth(part_.mask.size());
    std::transform(part_.mask.begin(), part_.mask.end(), depth.begin(),
                   [](std::uint8_t m) { return m == 0 ? 0.0F : label_surfaces::kFar; });
    std::vector<std::int32_t> none;
    label_surfaces::spread_nearest(depth, none, part_.size, grid_.spacing, context_.quiet());
    // Beyond the part's own border nothing is known: a mask that fills it is deep everywhere.
    for (float& d : depth) d = std::min(std::sqrt(d), 200.0F);
    const double finest = *std::min_element(grid_.spacing.begin(), grid_.spacing.end());
    watershed(part_.mask, depth, part_.size, finest / 4, of_, context_);
    context_.report(0.8);
    out.left_out = islands();
    part_joints(body_, clouds_, placed_, part_.grid, of_, context_);
    agreement(out.bones);
    std::vector<double> hollows;
    for (const TemplateBone& bone : body_.bones) hollows.push_back(bone.hollow_mm2);
    fill_hollows(of_, part_.grid, hollows);
    part_.each(
        [&](std::size_t at, std::size_t to, std::size_t count) {
          std::copy_n(of_.begin() + static_cast<std::ptrdiff_t>(at), count,
                      out.of.begin() + static_cast<std::ptrdiff_t>(to));
        },
        grid_);
    context_.report(1);
    return out;
  }

 private:
  // f(middle of the block, LPS mm; its voxels) for each block that holds any of the mask.
  template <class F>
  void each_block(F&& f) {
    std::array<int, 3> edge{};
    for (std::size_t a = 0; a < 3; ++a)
      edge[a] = std::max(1, static_cast<int>(std::lround(kBlock / grid_.spacing[a])));
    std::vector<std::size_t> voxels;
    for (int k = 0; k < part_.size[2]; k += edge[2]) {
      context_.check_stop();
      for (int j = 0; j < part_.size[1]; j += edge[1]) {
        for (int i = 0; i < part_.size[0]; i += edge[0]) {
          voxels.clear();
          Eigen::Vector3d sum = Eigen::Vector3d::Zero();
          for (int z = k; z < std::min(k + edge[2], part_.size[2]); ++z) {
            for (int y = j; y < std::min(j + edge[1], part_.size[1]); ++y) {
              for (int x = i; x < std::min(i + edge[0], part_.size[0]); ++x) {
                const std::size_t v = part_.grid.offset(x, y, z);
                if (part_.mask[v] == 0) continue;
                voxels.push_back(v);
                sum += Eigen::Vector3d(x, y, z);
              }
            }
          }
          if (voxels.empty()) continue;
          sum /= static_cast<double>(voxels.size());
          const auto p = part_.grid.point(sum[0], sum[1], sum[2]);
          f(Eigen::Vector3d(p[0], p[1], p[2]), voxels);
        }
      }
    }
  }

  int bone_of(const NearestBone& near) const {
    return clouds_[static_cast<std::size_t>(near.segment)].bone[static_cast<std::size_t>(near.point)];
  }

  void seed() {
    each_block([&](const Eigen::Vector3d& p, const std::vector<std::size_t>& voxels) {
      const NearestBone near = nearest_bone(clouds_, placed_.segments, p, kSeedNear);
      if (near.segment < 0) return;
      const double reach = near.distance + kMargin;
      if (nearest_bone(clouds_, placed_.segments, p, reach, near.segment).segment >= 0) return;
      for (const std::size_t v : voxels) of_[v] = static_cast<std::uint16_t>(bone_of(near) + 1);
    });
  }

  // Pieces that no seed reached; voxels that are left out.
  std::size_t islands() {
    Image rest(part_.grid, ScalarType::u16);
    const auto voxels = rest.scalars<std::uint16_t>();
    for (std::size_t v = 0; v < voxels.size(); ++v) voxels[v] = part_.mask[v] != 0 && of_[v] == 0 ? 1 : 0;
    const Pieces found = find_pieces(rest, {0, 1}, context_.quiet());
    std::vector<std::uint16_t> bone(found.pieces.size(), 0);
    std::size_t out = 0;
    for (std::size_t p = 0; p < bone.size(); ++p) {
      const auto& c = found.pieces[p].centre;
      const NearestBone near = nearest_bone(clouds_, placed_.segments, {c[0], c[1], c[2]}, kReach);
      if (near.segment >= 0) {
        bone[p] = static_cast<std::uint16_t>(bone_of(near) + 1);
      } else {
        out += found.pieces[p].voxels;
      }
    }
    for (const Run& run : found.runs) {
      const std::size_t at = part_.grid.offset(run.begin, run.j, run.k);
      std::fill_n(of_.begin() + static_cast<std::ptrdiff_t>(at), run.end - run.begin, bone[run.piece]);
    }
    return out;
  }

  void agreement(std::vector<FoundBone>& bones) {
    std::vector<double> near(bones.size(), 0), all(bones.size(), 0);
    std::vector<std::vector<Eigen::Vector3d>> points(bones.size());
    each_block([&](const Eigen::Vector3d& p, const std::vector<std::size_t>& voxels) {
      for (const std::size_t v : voxels) {
        if (of_[v] != 0) ++bones[of_[v] - 1U].voxels;
      }
      const std::uint16_t id = of_[voxels[voxels.size() / 2]];
      if (id == 0) return;
      const std::size_t b = id - 1U;
      const auto s = static_cast<std::size_t>(body_.bones[b].segment);
      double square = 0;
      clouds_[s].nearest->find(placed_.segments[s].back(p), square);
      all[b] += 1;
      near[b] += std::sqrt(square) * placed_.segments[s].scale < kAgrees ? 1 : 0;
      points[b].push_back(p);
    });
    for (std::size_t b = 0; b < bones.size(); ++b) {
      if (points[b].empty()) continue;
      Points own(static_cast<Eigen::Index>(points[b].size()), 3);
      std::vector<std::int32_t> rows;
      for (std::size_t p = 0; p < points[b].size(); ++p) {
        own.row(static_cast<Eigen::Index>(p)) = points[b][p].transpose();
        rows.push_back(static_cast<std::int32_t>(p));
      }
      const geometry::NearestPoint nearest(own, rows);
      const auto s = static_cast<std::size_t>(body_.bones[b].segment);
      double back = 0, seen = 0;
      for (Eigen::Index p = 0; p < body_.bones[b].points.rows(); ++p) {
        const Eigen::Vector3d at = placed_.segments[s](body_.bones[b].points.row(p).transpose());
        const auto index = grid_.index({at[0], at[1], at[2]});
        bool in = true;
        for (std::size_t a = 0; a < 3; ++a) in = in && index[a] >= 0 && index[a] <= grid_.size[a] - 1;
        if (!in) continue;
        double square = 0;
        nearest.find(at, square);
        seen += 1;
        back += square < kAgrees * kAgrees ? 1 : 0;
      }
      bones[b].agreement = 0.5 * (near[b] / all[b] + (seen > 0 ? back / seen : 0));
    }
  }

  const ImageGrid& grid_;
  const BodyTemplate& body_;
  const Placed& placed_;
  const Context& context_;
  Part part_;
  std::vector<SegmentCloud> clouds_;
  std::vector<std::uint16_t> of_;  // of the part's voxels
};

}  // namespace

CutBones cut_bones(const std::vector<std::uint8_t>& mask, const ImageGrid& grid, const BodyTemplate& body,
                   const Placed& placed, const Context& context) {
  return Cutter(mask, grid, body, placed, context).run();
}

}  // namespace ecorche::scan
