// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "preprocess/scan/distance_lattice.hpp"
#include "preprocess/scan/fit_segments.hpp"
#include "preprocess/scan/nameless.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::scan {
namespace {

constexpr double kCell = 8;        // mm: of the lattices
constexpr double kStride = 16;     // mm, along the body
constexpr double kSpread = 28;     // mm: farther from the template a point counts as nothing
constexpr double kLikely = 0.52;   // mean nearness of what may be bone
constexpr double kLeastSeen = 60;  // mm of the template
constexpr int kAsked = 40;         // points of a label
constexpr double kLeastSize = 0.78, kSizeStep = 1.03;
constexpr int kSizesTried = 14;
constexpr double kClimb[] = {8, 4};  // mm, of the last steps
constexpr double kClimbSize[] = {0.015, 0.008};
constexpr double kBeside[] = {-36, -18, 0, 18,
                              36};  // mm, to the back: flesh lies more before bone than behind
constexpr double kUsualSize = 0.95, kOdd = 1.5;

// Which labels lie in each cell of the scan or in one beside it.
class LabelCells {
 public:
  explicit LabelCells(const std::vector<Points>& labels) {
    Eigen::Vector3d high = Eigen::Vector3d::Constant(-1e30);
    low_ = -high;
    for (const Points& points : labels) {
      low_ = low_.cwiseMin(points.colwise().minCoeff().transpose().eval());
      high = high.cwiseMax(points.colwise().maxCoeff().transpose().eval());
    }
    low_.array() -= 2 * kCell;
    for (int a = 0; a < 3; ++a) size_[a] = static_cast<int>((high[a] + 2 * kCell - low_[a]) / kCell) + 1;
    cells_.resize(static_cast<std::size_t>(size_.cast<std::int64_t>().prod()));
    for (std::size_t l = 0; l < labels.size(); ++l) {
      for (Eigen::Index p = 0; p < labels[l].rows(); ++p) put(labels[l].row(p).transpose(), l);
    }
  }

  /// Whether any label there has `likely`.
  bool any(const Eigen::Vector3d& p, const std::vector<std::uint8_t>& likely) const {
    const Eigen::Vector3i c = ((p - low_) / kCell).array().floor().cast<int>();
    if ((c.array() < 0).any() || (c.array() >= size_.array()).any()) return false;
    const auto& here = cells_[at(c)];
    return std::any_of(here.begin(), here.end(), [&](std::uint16_t l) { return likely[l] != 0; });
  }

 private:
  std::size_t at(const Eigen::Vector3i& c) const {
    return static_cast<std::size_t>(c[0]) +
           static_cast<std::size_t>(size_[0]) *
               (static_cast<std::size_t>(c[1]) +
                static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(c[2]));
  }
  void put(const Eigen::Vector3d& p, std::size_t label) {
    const Eigen::Vector3i c = ((p - low_) / kCell).array().floor().cast<int>();
    for (int k = -1; k <= 1; ++k) {
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          auto& here = cells_[at(c + Eigen::Vector3i(i, j, k))];
          if (here.empty() || here.back() != label) here.push_back(static_cast<std::uint16_t>(label));
        }
      }
    }
  }

  Eigen::Vector3d low_;
  Eigen::Vector3i size_;
  std::vector<std::vector<std::uint16_t>> cells_;
};

constexpr double kSame = 60;  // mm: places nearer than this are one

// The best of those that are told, none near another.
class Best {
 public:
  double least() const { return places_.size() < kPlaces ? 0 : places_.back().score; }
  void add(RoughPlace place) {
    const auto near = [&](const RoughPlace& other) {
      const Eigen::Vector3d away = other.place.shift - place.place.shift;
      return other.view == place.view && away.norm() < kSame &&
             other.place.rotation.isApprox(place.place.rotation, 0.3);
    };
    if (std::any_of(places_.begin(), places_.end(),
                    [&](const RoughPlace& o) { return near(o) && o.score >= place.score; }))
      return;
    std::erase_if(places_, near);
    const auto at = std::find_if(places_.begin(), places_.end(),
                                 [&](const RoughPlace& o) { return o.score < place.score; });
    places_.insert(at, std::move(place));
    if (places_.size() > kPlaces) places_.pop_back();
  }
  std::vector<RoughPlace> take() { return std::exchange(places_, {}); }

 private:
  std::vector<RoughPlace> places_;
};

class Look {
 public:
  Look(const BodyTemplate& body, View view, const std::vector<Points>& labels, const Points& all,
       const LabelCells& cells, const ImageGrid& grid, const Context& context)
      : view_(view), labels_(labels), all_(all), cells_(cells), grid_(grid), context_(context) {
    std::vector<std::uint8_t> in_play;
    for (const TemplateSegment& segment : body.segments)
      in_play.push_back(view_has(view, segment.name) && (one_limb(view) || !of_arm(segment.name)) ? 1 : 0);
    const std::vector<SegmentCloud> clouds = segment_clouds(body, in_play);
    const std::vector<Similarity> held = held_by(body, view);
    std::vector<Eigen::Vector3d> own;
    for (std::size_t s = 0; s < clouds.size(); ++s) {
      for (Eigen::Index p = 0; p < clouds[s].points.rows(); ++p)
        own.push_back(held[s](clouds[s].points.row(p).transpose()));
    }
    own_.resize(static_cast<Eigen::Index>(own.size()), 3);
    for (std::size_t p = 0; p < own.size(); ++p) own_.row(static_cast<Eigen::Index>(p)) = own[p].transpose();
  }

  void run(Best& best) const {
    if (own_.rows() == 0) return;
    const DistanceLattice lattice(own_, kCell, kSpread / kLeastSize, context_);
    for (const auto& [turn, along] : turns_of(view_, own_, all_)) {
      for (int size = 0; size < kSizesTried; ++size)
        slide(turn, along, kLeastSize * std::pow(kSizeStep, size), lattice, best);
    }
    for (RoughPlace place : best.take()) {
      if (place.view == view_) climb(place, lattice);
      best.add(std::move(place));
    }
  }

 private:
  void slide(const Eigen::Matrix3d& turn, const Eigen::Vector3d& along, double size,
             const DistanceLattice& lattice, Best& best) const {
    Similarity place{size, turn, Eigen::Vector3d::Zero()};
    std::vector<std::uint8_t> likely;
    const Points turned = (size * (own_ * turn.transpose())).eval();
    const Eigen::VectorXd ways = turned * along, theirs = all_ * along;
    const double low = ways.minCoeff(), high = ways.maxCoeff();
    const double least = theirs.minCoeff(), most = theirs.maxCoeff();
    const Eigen::Vector3d to_back =
        one_limb(view_) ? Eigen::Vector3d::Zero().eval() : Eigen::Vector3d::UnitY().eval();
    const double first = least - high + kLeastSeen, last = most - low - kLeastSeen;
    for (int step = 0; first + step * kStride <= last; ++step) {
      context_.check_stop();
      const double way = first + step * kStride;
      const auto middle = [&](const Points& points, const Eigen::VectorXd& at, double from, double to) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        int count = 0;
        for (Eigen::Index p = 0; p < points.rows(); ++p) {
          if (at[p] < from || at[p] > to) continue;
          sum += points.row(p).transpose();
          ++count;
        }
        return std::pair(count, Eigen::Vector3d(sum / std::max(1, count)));
      };
      const auto [count, own] = middle(turned, ways, least - way, most - way);
      const auto [others, scan] = middle(all_, theirs, low + way, high + way);
      if (count < 10 || others < 10) continue;
      const Eigen::Vector3d beside = scan - own;
      // What lies beyond the template's ends is no part of a body.
      const double spanned = static_cast<double>(others) / static_cast<double>(all_.rows());
      for (const double back : kBeside) {
        if (one_limb(view_) && back != 0) continue;
        place.shift = beside - beside.dot(along) * along + way * along + back * to_back;
        const double score = score_of(place, turned, lattice, spanned, likely);
        keep(place, score, likely, best);
      }
    }
  }

  // The score of a place; `likely` becomes what may be bone there.
  double score_of(const Similarity& place, const Points& turned, const DistanceLattice& lattice,
                  double spanned, std::vector<std::uint8_t>& likely) const {
    likely.assign(labels_.size(), 0);
    double near_sum = 0, near_count = 0;
    for (std::size_t l = 0; l < labels_.size(); ++l) {
      const Points& points = labels_[l];
      const Eigen::Index step = std::max<Eigen::Index>(1, points.rows() / kAsked);
      double near = 0;
      int asked = 0;
      for (Eigen::Index p = 0; p < points.rows(); p += step, ++asked)
        near += 1 - std::min(1.0, place.scale * lattice.at(place.back(points.row(p).transpose())) / kSpread);
      near /= asked;
      if (near < kLikely) continue;
      likely[l] = 1;
      const double weight = std::cbrt(static_cast<double>(points.rows()));
      near_sum += weight * near;
      near_count += weight;
    }
    if (near_count == 0) return 0;
    const Eigen::Index step = std::max<Eigen::Index>(1, turned.rows() / 800);
    int seen = 0, covered = 0;
    for (Eigen::Index p = 0; p < turned.rows(); p += step) {
      const Eigen::Vector3d at = turned.row(p).transpose() + place.shift;
      if (!in_view(grid_, at)) continue;
      ++seen;
      covered += cells_.any(at, likely) ? 1 : 0;
    }
    if (seen < 10) return 0;
    const double odd = std::log(place.scale / kUsualSize);
    return spanned * static_cast<double>(covered) / seen * near_sum / near_count / (1 + kOdd * odd * odd);
  }

  void keep(const Similarity& place, double score, const std::vector<std::uint8_t>& likely,
            Best& best) const {
    if (score <= best.least()) return;
    RoughPlace found{view_, place, score, {}};
    for (std::size_t l = 0; l < likely.size(); ++l) {
      if (likely[l] != 0) found.likely.push_back(l);
    }
    best.add(std::move(found));
  }

  double spanned(const Points& turned, const Similarity& place) const {
    const double low = turned.col(2).minCoeff() + place.shift[2],
                 high = turned.col(2).maxCoeff() + place.shift[2];
    const auto z = all_.col(2).array();
    return static_cast<double>((z >= low && z <= high).count()) / static_cast<double>(all_.rows());
  }

  // By small steps of place and size to where no step is better.
  void climb(RoughPlace& best, const DistanceLattice& lattice) const {
    std::vector<std::uint8_t> likely;
    const Eigen::Vector3d middle = all_.colwise().mean().transpose();
    for (std::size_t fine = 0; fine < std::size(kClimb); ++fine) {
      for (bool better = true; better;) {
        context_.check_stop();
        better = false;
        for (int way = 0; way < 8; ++way) {
          Similarity next = best.place;
          const double sign = way % 2 == 0 ? 1 : -1;
          if (way < 6) {
            next.shift[way / 2] += sign * kClimb[fine];
          } else {  // about the middle of what is seen
            const Eigen::Vector3d own = next.back(middle);
            next.scale *= 1 + sign * kClimbSize[fine];
            next.shift += middle - next(own);
          }
          const Points turned = (next.scale * (own_ * next.rotation.transpose())).eval();
          const double score =
              score_of(next, turned, lattice, one_limb(view_) ? 1 : spanned(turned, next), likely);
          if (score <= best.score) continue;
          best.place = next;
          best.score = score;
          best.likely.clear();
          for (std::size_t l = 0; l < likely.size(); ++l) {
            if (likely[l] != 0) best.likely.push_back(l);
          }
          better = true;
        }
      }
    }
  }

  View view_;
  const std::vector<Points>& labels_;
  const Points& all_;
  const LabelCells& cells_;
  const ImageGrid& grid_;
  const Context& context_;
  Points own_;  // as the view holds them
};

}  // namespace

std::vector<RoughPlace> rough_places(const BodyTemplate& body, const std::vector<NamelessLabel>& labels,
                                     const ImageGrid& grid, Side side, const Context& context) {
  std::vector<Points> points;
  Eigen::Index count = 0;
  for (const NamelessLabel& label : labels) {
    points.push_back(label.points);
    count += label.points.rows();
  }
  if (count == 0) return {};
  // All of them, thinned: where the middle of the body is.
  const Eigen::Index step = std::max<Eigen::Index>(1, count / 6000);
  Points all(count / step + static_cast<Eigen::Index>(labels.size()), 3);
  Eigen::Index rows = 0;
  for (const Points& own : points) {
    for (Eigen::Index p = 0; p < own.rows(); p += step) all.row(rows++) = own.row(p);
  }
  all.conservativeResize(rows, 3);
  const LabelCells cells(points);
  Best best;
  for (const View view : views_of(side)) {
    if (side == Side::both && view != View::body) continue;
    Look(body, view, points, all, cells, grid, context).run(best);
  }
  return best.take();
}

}  // namespace ecorche::scan
