// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/fit_segments.hpp"

#include <numeric>

namespace ecorche::scan {
namespace {

constexpr int kWholeRounds = 20, kRounds = 40;
constexpr double kWideReach = 90;  // mm: the same at first, for the whole
constexpr double kLastReach = 14;  // mm: pairs farther apart are none
constexpr double kGrowth = 1.05;   // of the whole over its first size: pairs far off shrink it
constexpr double kJoint = 0.25;    // weight of a joint over that of its segment's pairs
constexpr double kTurn = 0.04;     // the same for each of the points that keep it as its parent lies
constexpr double kFewPairs = 12;   // what a segment weighs at least there
constexpr double kArm = 60;        // mm: how far those points lie from the joint

std::vector<std::int32_t> all_rows(const Points& points) {
  std::vector<std::int32_t> rows(static_cast<std::size_t>(points.rows()));
  std::iota(rows.begin(), rows.end(), 0);
  return rows;
}

}  // namespace

bool in_view(const ImageGrid& grid, const Eigen::Vector3d& p) {
  const auto index = grid.index({p[0], p[1], p[2]});
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(index[a] >= -0.5 && index[a] <= grid.size[a] - 0.5)) return false;
  }
  return true;
}

double misfit_of(const std::vector<SegmentCloud>& clouds, const std::vector<Similarity>& placed,
                 const Points& bone, const geometry::NearestPoint& nearest, const ImageGrid& grid) {
  double there = 0, back = 0;
  for (Eigen::Index p = 0; p < bone.rows(); ++p)
    there += nearest_bone(clouds, placed, bone.row(p).transpose(), kReach).distance;
  std::size_t seen = 0;
  for (std::size_t s = 0; s < clouds.size(); ++s) {
    for (Eigen::Index p = 0; p < clouds[s].points.rows(); ++p) {
      const Eigen::Vector3d at = placed[s](clouds[s].points.row(p).transpose());
      if (!in_view(grid, at)) continue;
      double square = 0;
      nearest.find(at, square);
      back += std::min(std::sqrt(square), kReach);
      ++seen;
    }
  }
  if (seen == 0) return 1;
  return 0.5 * (there / static_cast<double>(bone.rows()) + back / static_cast<double>(seen)) / kReach;
}

Similarity fit_whole(const Points& own, const Points& bone, const ImageGrid& grid, Similarity place,
                     const Context& context) {
  const geometry::NearestPoint of_bone(bone, all_rows(bone)), of_own(own, all_rows(own));
  const double least = std::max(kSmallest, place.scale / kGrowth);
  const double most = std::min(kLargest, place.scale * kGrowth);
  for (int round = 0; round < kWholeRounds; ++round) {
    context.check_stop();
    const double reach = kWideReach + (kFirstReach - kWideReach) * round / (kWholeRounds - 1);
    SimilarityFit fit;
    for (Eigen::Index p = 0; p < bone.rows(); p += 2) {
      const Eigen::Vector3d at = bone.row(p).transpose();
      double square = 0;
      const std::int32_t row = of_own.find(place.back(at), square);
      const double distance = place.scale * std::sqrt(square);
      if (distance < reach) fit.add(own.row(row).transpose(), at, 1);
    }
    for (Eigen::Index p = 0; p < own.rows(); p += 4) {
      const Eigen::Vector3d from = own.row(p).transpose(), at = place(from);
      if (!in_view(grid, at)) continue;
      double square = 0;
      const std::int32_t row = of_bone.find(at, square);
      if (square < reach * reach) fit.add(from, bone.row(row).transpose(), 1);
    }
    if (fit.weight() < kFewPairs) return place;
    place = fit.solve(least, most);
  }
  return place;
}

double size_of_last(const std::vector<SegmentCloud>& clouds, const std::vector<Similarity>& placed) {
  double size = 1;
  for (std::size_t s = 0; s < clouds.size(); ++s) {
    if (clouds[s].nearest) size = placed[s].scale;
  }
  return size;
}

void fit_segments(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds, const Points& bone,
                  const ImageGrid& grid, const SegmentsFit& how, std::vector<Similarity>& placed,
                  const Context& context) {
  const geometry::NearestPoint nearest(bone, all_rows(bone));
  const std::vector<Similarity> first = placed;
  const std::size_t count = clouds.size();
  for (int round = 0; round < kRounds; ++round) {
    context.check_stop();
    const double share = static_cast<double>(round) / (kRounds - 1);
    const double reach = how.first_reach + (kLastReach - how.first_reach) * std::min(1.0, 1.25 * share);
    std::vector<SimilarityFit> fits(count);
    for (Eigen::Index p = 0; p < bone.rows(); ++p) {
      const Eigen::Vector3d at = bone.row(p).transpose();
      const NearestBone near = nearest_bone(clouds, placed, at, reach);
      if (near.segment < 0) continue;
      const auto s = static_cast<std::size_t>(near.segment);
      fits[s].add(clouds[s].points.row(near.point).transpose(), at, 1);
    }
    for (std::size_t s = 0; s < count; ++s) {
      for (Eigen::Index p = 0; p < clouds[s].points.rows(); p += 2) {
        const Eigen::Vector3d from = clouds[s].points.row(p).transpose(), at = placed[s](from);
        if (!in_view(grid, at)) continue;
        double square = 0;
        const std::int32_t row = nearest.find(at, square);
        const double distance = std::sqrt(square);
        if (distance < reach) fits[s].add(from, bone.row(row).transpose(), 1);
      }
    }
    std::vector<Similarity> next = placed;
    for (std::size_t s = 0; s < count; ++s) {
      if (!clouds[s].nearest || (!how.held.empty() && how.held[s] != 0)) continue;
      const double weight = std::max(kFewPairs, fits[s].weight());
      const auto hold = [&](const Eigen::Vector3d& joint, const Similarity& other) {
        fits[s].add(joint, other(joint), kJoint * weight);
      };
      const int parent = body.segments[s].parent;
      const bool hangs = parent >= 0 && clouds[static_cast<std::size_t>(parent)].nearest != nullptr;
      if (hangs) {
        const auto p = static_cast<std::size_t>(parent);
        hold(body.segments[s].joint, next[p]);
        // As its parent would carry it from the first place.
        const Similarity from_parent = next[p].after(inverse(first[p])).after(first[s]);
        for (int a = 0; a < 3; ++a) {
          for (const double sign : {-kArm, kArm}) {
            const Eigen::Vector3d q = body.segments[s].joint + sign * Eigen::Vector3d::Unit(a);
            fits[s].add(q, from_parent(q), kTurn * weight);
          }
        }
      }
      for (std::size_t c = s + 1; c < count; ++c) {
        if (body.segments[c].parent == static_cast<int>(s) && clouds[c].nearest)
          hold(body.segments[c].joint, placed[c]);
      }
      next[s] = fits[s].solve(how.size / kOddSegment, how.size * kOddSegment);
    }
    placed = std::move(next);
  }
}

}  // namespace ecorche::scan
