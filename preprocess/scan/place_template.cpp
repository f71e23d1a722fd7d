// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/place_template.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>

#include "preprocess/scan/distance_lattice.hpp"
#include "preprocess/scan/fit_segments.hpp"
#include "preprocess/scan/slide_joints.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::scan {
namespace {

constexpr double kLattice = 8;       // mm
constexpr double kStep = 20;         // mm, along the body
constexpr double kLeastInView = 40;  // mm of the template
constexpr std::size_t kKept = 6;     // of a view, to be fitted by segments
constexpr double kApart = 45;        // mm between those that are kept
constexpr double kHopeless = 1.2;    // times the best misfit
constexpr Eigen::Index kMostPoints = 2500;
constexpr double kSizes[] = {0.78, 0.84, 0.9, 0.96, 1.02, 1.08, 1.15};
constexpr double kUsual = 0.95,
                 kOddSize = 2;        // few are much larger or smaller: so much more misfit they need
constexpr double kTheirs = 14;        // mm: bone of an arm so near to others' may be theirs
constexpr double kMostShared = 0.35;  // ... and where so much of it is, the arm is not there

struct Start {
  Similarity place;
  double misfit = 1;
};

// About `most` of them, evenly.
Points thinned(const Points& points, Eigen::Index most) {
  if (points.rows() <= most) return points;
  Points out(most, 3);
  for (Eigen::Index p = 0; p < most; ++p) out.row(p) = points.row(p * points.rows() / most);
  return out;
}

// Looks for places of one view.
class Search {
 public:
  Search(const BodyTemplate& body, View view, const Points& bone, const DistanceLattice& scan,
         const ImageGrid& grid, const Context& context)
      : body_(body),
        view_(view),
        bone_(bone),
        scan_(scan),
        grid_(grid),
        context_(context),
        held_(held_by(body, view)) {
    std::vector<std::uint8_t> in_play;
    for (const TemplateSegment& segment : body.segments)
      in_play.push_back(view_has(view, segment.name) ? 1 : 0);
    clouds_ = segment_clouds(body, in_play);
    Eigen::Index count = 0;
    for (const SegmentCloud& cloud : clouds_) count += cloud.points.rows();
    own_.resize(count, 3);
    Eigen::Index row = 0;
    for (std::size_t s = 0; s < clouds_.size(); ++s) {
      for (Eigen::Index p = 0; p < clouds_[s].points.rows(); ++p)
        own_.row(row++) = held_[s](clouds_[s].points.row(p).transpose()).transpose();
    }
  }

  /// Tries everywhere; the least misfit, 1 where the template has nothing of this view.
  double look() {
    if (own_.rows() == 0) return 1;
    const DistanceLattice lattice(own_, kLattice, kReach / kSizes[0], context_);
    std::vector<Start> starts;
    for (const auto& [turn, along] : turns_of(view_, own_, bone_)) {
      for (const double size : kSizes) sweep(turn, along, size, lattice, starts);
    }
    std::stable_sort(starts.begin(), starts.end(),
                     [](const Start& a, const Start& b) { return a.misfit < b.misfit; });
    for (const Start& start : starts) {
      if (kept_.size() == kKept) break;
      const bool near = std::any_of(kept_.begin(), kept_.end(), [&](const Start& k) {
        return (middle(k) - middle(start)).norm() < kApart &&
               k.place.rotation.isApprox(start.place.rotation, 0.3);
      });
      if (!near) kept_.push_back(start);
    }
    return kept_.empty() ? 1 : kept_.front().misfit;
  }

  /// Segment by segment, from the best of those places.
  Placed fit() const {
    Placed out;
    out.view = view_;
    out.segments.resize(clouds_.size());
    out.in_play = all_in_play();
    std::vector<std::int32_t> rows(static_cast<std::size_t>(bone_.rows()));
    std::iota(rows.begin(), rows.end(), 0);
    const geometry::NearestPoint nearest(bone_, rows);
    for (const Start& start : kept_) {
      if (start.misfit > kHopeless * kept_.front().misfit) break;
      std::vector<Similarity> placed;
      const Similarity whole = fit_whole(own_, bone_, grid_, start.place, context_);
      for (const Similarity& h : held_) placed.push_back(whole.after(h));
      const std::vector<Similarity> first = placed;
      fit_segments(body_, clouds_, bone_, grid_, {whole.scale}, placed, context_);
      std::vector<std::uint8_t> in_play = all_in_play();
      const std::vector<SegmentCloud>* clouds = &clouds_;
      std::vector<SegmentCloud> fewer;
      if (take_arms_out(placed, in_play)) {
        fewer = segment_clouds(body_, in_play);
        clouds = &fewer;
        placed = first;
        fit_segments(body_, fewer, bone_, grid_, {whole.scale}, placed, context_);
      }
      const double misfit = misfit_of(*clouds, placed, bone_, nearest, grid_);
      if (misfit >= out.misfit) continue;
      out.misfit = misfit;
      out.segments = placed;
      out.in_play = in_play;
      out.scale = whole.scale;
    }
    if (out.misfit < 1) {
      const std::vector<SegmentCloud> clouds = segment_clouds(body_, out.in_play);
      slide_joints(body_, clouds, bone_, grid_, out.scale, out.segments, context_);
      out.misfit = misfit_of(clouds, out.segments, bone_, nearest, grid_);
    }
    return out;
  }

 private:
  std::vector<std::uint8_t> all_in_play() const {
    std::vector<std::uint8_t> out;
    for (const SegmentCloud& cloud : clouds_) out.push_back(cloud.nearest ? 1 : 0);
    return out;
  }

  // Arms that are not in the scan come to lie on bones of the trunk and legs, which others explain as well.
  bool take_arms_out(const std::vector<Similarity>& placed, std::vector<std::uint8_t>& in_play) const {
    std::vector<std::uint8_t> trunk;
    bool arms = false, others = false;
    for (std::size_t s = 0; s < clouds_.size(); ++s) {
      const bool arm = of_arm(body_.segments[s].name);
      trunk.push_back(in_play[s] != 0 && !arm ? 1 : 0);
      arms = arms || (in_play[s] != 0 && arm);
      others = others || trunk.back() != 0;
    }
    if (!arms || !others) return false;
    const std::vector<SegmentCloud> without = segment_clouds(body_, trunk);
    std::vector<int> all(clouds_.size(), 0), shared(clouds_.size(), 0);
    for (Eigen::Index p = 0; p < bone_.rows(); ++p) {
      const Eigen::Vector3d at = bone_.row(p).transpose();
      const NearestBone near = nearest_bone(clouds_, placed, at, kReach);
      if (near.segment < 0) continue;
      const auto s = static_cast<std::size_t>(near.segment);
      ++all[s];
      shared[s] += nearest_bone(without, placed, at, kTheirs).segment >= 0 ? 1 : 0;
    }
    bool any = false;
    for (std::size_t s = 0; s < all.size(); ++s) {
      if (in_play[s] == 0 || trunk[s] != 0 || all[s] == 0 || shared[s] < kMostShared * all[s]) continue;
      in_play[s] = 0;
      any = true;
    }
    return any;
  }

  Eigen::Vector3d middle(const Start& start) const {
    return start.place.back(bone_.colwise().mean().transpose());
  }

  void sweep(const Eigen::Matrix3d& turn, const Eigen::Vector3d& along, double size,
             const DistanceLattice& lattice, std::vector<Start>& starts) const {
    Similarity place{size, turn, Eigen::Vector3d::Zero()};
    Points turned(own_.rows(), 3);
    double low = 1e30, high = -1e30, least = 1e30, most = -1e30;
    for (Eigen::Index p = 0; p < own_.rows(); ++p) {
      const Eigen::Vector3d at = place(own_.row(p).transpose());
      turned.row(p) = at.transpose();
      low = std::min(low, at.dot(along));
      high = std::max(high, at.dot(along));
    }
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (Eigen::Index p = 0; p < bone_.rows(); ++p) {
      const double d = bone_.row(p).dot(along);
      least = std::min(least, d);
      most = std::max(most, d);
      centre += bone_.row(p).transpose();
    }
    centre /= static_cast<double>(bone_.rows());
    const double first = least - high + kLeastInView, last = most - low - kLeastInView;
    const int steps = first <= last ? static_cast<int>((last - first) / kStep) : -1;
    for (int step = 0; step <= steps; ++step) {
      const double way = first + step * kStep;
      context_.check_stop();
      // Beside, by the middles of what both have here.
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int count = 0;
      for (Eigen::Index p = 0; p < turned.rows(); ++p) {
        const double d = turned.row(p).dot(along) + way;
        if (d < least - kLattice || d > most + kLattice) continue;
        sum += turned.row(p).transpose();
        ++count;
      }
      if (count < 10) continue;
      const Eigen::Vector3d beside = centre - sum / count;
      place.shift = beside - beside.dot(along) * along + way * along;
      starts.push_back({place, rough_misfit(place, turned, lattice)});
    }
  }

  double rough_misfit(const Similarity& place, const Points& turned, const DistanceLattice& lattice) const {
    double there = 0, back = 0;
    int seen = 0, asked = 0;
    const Eigen::Index step = std::max<Eigen::Index>(1, bone_.rows() / 500);
    for (Eigen::Index p = 0; p < bone_.rows(); p += step, ++asked)
      there += std::min(kReach, place.scale * lattice.at(place.back(bone_.row(p).transpose())));
    const Eigen::Index own_step = std::max<Eigen::Index>(1, own_.rows() / 1500);
    for (Eigen::Index p = 0; p < turned.rows(); p += own_step) {
      const Eigen::Vector3d at = turned.row(p).transpose() + place.shift;
      if (!in_view(grid_, at)) continue;
      back += scan_.at(at);
      ++seen;
    }
    if (seen == 0) return 1;
    const double odd = std::log(place.scale / kUsual);
    return 0.5 * (there / asked + back / seen) / kReach * (1 + kOddSize * odd * odd);
  }

  const BodyTemplate& body_;
  View view_;
  const Points& bone_;
  const DistanceLattice& scan_;
  const ImageGrid& grid_;
  const Context& context_;
  std::vector<Similarity> held_;
  std::vector<SegmentCloud> clouds_;
  Points own_;  // as the view holds them
  std::vector<Start> kept_;
};

}  // namespace

std::vector<Placed> place_template(const BodyTemplate& body, const Points& bone, const ImageGrid& grid,
                                   Side side, const Context& context) {
  const std::vector<View> views = views_of(side);
  const Points fewer = thinned(bone, kMostPoints);
  const DistanceLattice scan(fewer, kLattice, kReach, context);
  std::vector<std::unique_ptr<Search>> searches;
  std::vector<double> misfits;
  for (const View view : views) {
    searches.push_back(std::make_unique<Search>(body, view, fewer, scan, grid, context));
    misfits.push_back(searches.back()->look());
    context.report(0.4 * static_cast<double>(searches.size()) / static_cast<double>(views.size()));
  }
  const double best = *std::min_element(misfits.begin(), misfits.end());
  std::vector<Placed> out;
  for (std::size_t s = 0; s < searches.size(); ++s) {
    if (misfits[s] < 1 && misfits[s] <= kHopeless * best) out.push_back(searches[s]->fit());
    context.report(0.4 + 0.6 * static_cast<double>(s + 1) / static_cast<double>(searches.size()));
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Placed& a, const Placed& b) { return a.misfit < b.misfit; });
  return out;
}

Points spread_points(const std::vector<std::uint8_t>& mask, const ImageGrid& grid, double mm) {
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0;
  };
  std::map<std::array<std::int64_t, 3>, Cell> cells;
  std::size_t at = 0;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i, ++at) {
        if (mask[at] == 0) continue;
        const auto p = grid.point(i, j, k);
        const auto cell = [&](std::size_t a) { return static_cast<std::int64_t>(std::floor(p[a] / mm)); };
        Cell& c = cells[{cell(0), cell(1), cell(2)}];
        c.sum += Eigen::Vector3d(p[0], p[1], p[2]);
        c.count += 1;
      }
    }
  }
  std::vector<Eigen::Vector3d> means;
  means.reserve(cells.size());
  for (const auto& [key, cell] : cells) means.push_back(cell.sum / cell.count);
  Points out(static_cast<Eigen::Index>(means.size()), 3);
  for (std::size_t m = 0; m < means.size(); ++m) out.row(static_cast<Eigen::Index>(m)) = means[m].transpose();
  return out;
}

}  // namespace ecorche::scan
