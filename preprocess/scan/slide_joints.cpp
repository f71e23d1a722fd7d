// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/slide_joints.hpp"

#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "preprocess/scan/fit_segments.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::scan {
namespace {

constexpr double kFarthestSlide = 45, kSlideStep = 5;  // mm, of a slide
constexpr double kSlideGain = 0.997;                   // times the misfit
constexpr int kSlideRounds = 4;
constexpr double kSettleReach = 20;  // mm

// Turns, stretches and moves a placed segment so that two of its points come where they shall.
Similarity carried(const Similarity& place, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                   const Eigen::Vector3d& to_a, const Eigen::Vector3d& to_b) {
  const Eigen::Vector3d from = place(b) - place(a), to = to_b - to_a;
  const double length = from.norm();
  if (length < 1 || to.norm() < 1) return place;
  Similarity more;
  more.scale = to.norm() / length;
  more.rotation = Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
  more.shift = to_a - more.scale * (more.rotation * place(a));
  return more.after(place);
}

class Slider {
 public:
  Slider(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds, const Points& bone,
         const ImageGrid& grid, double size, std::vector<Similarity>& placed, const Context& context)
      : body_(body),
        clouds_(clouds),
        bone_(bone),
        grid_(grid),
        size_(size),
        placed_(placed),
        context_(context) {
    std::vector<std::int32_t> rows(static_cast<std::size_t>(bone.rows()));
    std::iota(rows.begin(), rows.end(), 0);
    nearest_ = std::make_unique<geometry::NearestPoint>(bone, rows);
  }

  void run() {
    for (const TemplateSegment& segment : body_.segments)
      held_.push_back(without_side(segment.name) == segment.name ? 1 : 0);
    double best = misfit_of(clouds_, placed_, bone_, *nearest_, grid_);
    for (int round = 0; round < kSlideRounds; ++round) {
      const std::vector<Similarity> before = placed_;
      bool any = false;
      for (std::size_t s = 0; s < clouds_.size(); ++s) any = slide(s) || any;
      if (!any) return;
      fit_segments(body_, clouds_, bone_, grid_, {size_, kSettleReach, held_}, placed_, context_);
      const double now = misfit_of(clouds_, placed_, bone_, *nearest_, grid_);
      if (now >= best) {
        placed_ = before;
        return;
      }
      best = now;
    }
  }

 private:
  // The end of a segment across from its joint, in the template's own place.
  Eigen::Vector3d other_end(std::size_t s) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (std::size_t c = s + 1; c < clouds_.size(); ++c) {
      if (body_.segments[c].parent != static_cast<int>(s) || !clouds_[c].nearest) continue;
      sum += body_.segments[c].joint;
      ++count;
    }
    if (count > 0) return sum / count;
    return 2 * clouds_[s].centre - body_.segments[s].joint;
  }

  bool slide(std::size_t s) {
    const int parent = body_.segments[s].parent;
    if (held_[s] != 0 || !clouds_[s].nearest || parent < 0 ||
        !clouds_[static_cast<std::size_t>(parent)].nearest)
      return false;
    const auto p = static_cast<std::size_t>(parent);
    const Eigen::Vector3d joint = body_.segments[s].joint;
    const bool hangs = body_.segments[p].parent >= 0 &&
                       clouds_[static_cast<std::size_t>(body_.segments[p].parent)].nearest != nullptr;
    const Eigen::Vector3d root = hangs ? body_.segments[p].joint : 2 * clouds_[p].centre - joint;
    const Eigen::Vector3d end = other_end(s);
    const Similarity up = placed_[p], down = placed_[s];
    const Eigen::Vector3d from = up(root), to = down(end), at = (up(joint) + down(joint)) / 2;
    const Eigen::Vector3d along = (to - from).normalized();
    // What of the scan either may explain, and how near the others are.
    std::vector<Eigen::Index> near;
    std::vector<double> others;
    for (Eigen::Index b = 0; b < bone_.rows(); ++b) {
      const Eigen::Vector3d q = bone_.row(b).transpose();
      if (!reaches(p, q) && !reaches(s, q)) continue;
      double least = kReach;
      for (std::size_t o = 0; o < clouds_.size(); ++o) {
        if (o != p && o != s && clouds_[o].nearest)
          least = std::min(least, distance(o, placed_[o], q, least));
      }
      near.push_back(b);
      others.push_back(least);
    }
    const auto misfit = [&](double way) {
      const Eigen::Vector3d now = at + way * along;
      const Similarity a = held_[p] != 0 ? up : carried(up, root, joint, from, now);
      const Similarity b = carried(down, joint, end, now, to);
      const double least = size_ / kOddSegment, most = size_ * kOddSegment;
      if (way != 0 && (a.scale < least || a.scale > most || b.scale < least || b.scale > most)) return 1e30;
      double sum = 0;
      for (std::size_t n = 0; n < near.size(); ++n) {
        const Eigen::Vector3d q = bone_.row(near[n]).transpose();
        double d = distance(p, a, q, others[n]);
        d = distance(s, b, q, d);
        sum += d;
      }
      double back = 0;
      std::size_t seen = 0;
      for (const auto& [segment, place] : {std::pair{p, &a}, std::pair{s, &b}}) {
        for (Eigen::Index r = 0; r < clouds_[segment].points.rows(); ++r) {
          const Eigen::Vector3d q = (*place)(clouds_[segment].points.row(r).transpose());
          if (!in_view(grid_, q)) continue;
          double square = 0;
          nearest_->find(q, square);
          back += std::min(std::sqrt(square), kReach);
          ++seen;
        }
      }
      if (seen == 0 || near.empty()) return 1e30;
      return sum / static_cast<double>(near.size()) + back / static_cast<double>(seen);
    };
    double best = misfit(0), way = 0;
    const double first = best;
    const int steps = static_cast<int>(kFarthestSlide / kSlideStep);
    for (int n = -steps; n <= steps; ++n) {
      context_.check_stop();
      const double w = n * kSlideStep, m = n == 0 ? first : misfit(w);
      if (m < kSlideGain * first && m < best) best = m, way = w;
    }
    if (way == 0) return false;
    const Eigen::Vector3d now = at + way * along;
    if (held_[p] == 0) placed_[p] = carried(up, root, joint, from, now);
    placed_[s] = carried(down, joint, end, now, to);
    return true;
  }

  bool reaches(std::size_t s, const Eigen::Vector3d& q) const {
    return (q - placed_[s](clouds_[s].centre)).norm() < placed_[s].scale * clouds_[s].radius + kReach;
  }
  double distance(std::size_t s, const Similarity& place, const Eigen::Vector3d& q, double most) const {
    if ((q - place(clouds_[s].centre)).norm() - place.scale * clouds_[s].radius >= most) return most;
    double square = 0;
    clouds_[s].nearest->find(place.back(q), square);
    return std::min(most, place.scale * std::sqrt(square));
  }

  const BodyTemplate& body_;
  const std::vector<SegmentCloud>& clouds_;
  const Points& bone_;
  const ImageGrid& grid_;
  std::vector<std::uint8_t> held_;
  double size_;  // of the body over the template's
  std::vector<Similarity>& placed_;
  const Context& context_;
  std::unique_ptr<geometry::NearestPoint> nearest_;
};

}  // namespace

void slide_joints(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds, const Points& bone,
                  const ImageGrid& grid, double size, std::vector<Similarity>& placed,
                  const Context& context) {
  Slider(body, clouds, bone, grid, size, placed, context).run();
}

}  // namespace ecorche::scan
