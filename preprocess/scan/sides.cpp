// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/sides.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/values/text.hpp"

namespace ecorche::scan {
namespace {

constexpr double kClearly = 0.6;   // the nearer one's distance over the other's
constexpr double kNear = 60;       // mm; neighbours in a limb lie nearer
constexpr double kOneSide = 0.85;  // share of a piece's points on its side of the plane
constexpr double kLike = 0.4;      // pieces of a pair differ by less in size

Eigen::Vector3d vector(const std::array<double, 3>& p) {
  return {p[0], p[1], p[2]};
}

struct Plane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), to_left = Eigen::Vector3d::UnitX();
  std::string from;
};

class Finder {
 public:
  Finder(const std::vector<SidedPiece>& pieces, const Neighbours& neighbours, Side only)
      : pieces_(pieces), neighbours_(neighbours), only_(only), found_(pieces.size()) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (pieces[i].side != Side::both) found_[i] = {pieces[i].side, 1, "its label says so"};
    }
  }

  std::vector<SideFound> run() {
    const std::optional<Plane> plane = middle();
    while (true) {
      if (by_neighbours(plane)) continue;
      if (plane ? by_plane(*plane) : alone()) continue;
      break;
    }
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (asked(i) && found_[i].why.empty())
        found_[i].why = plane ? "it lies on both sides of the middle" : "nothing tells left from right here";
    }
    return found_;
  }

 private:
  bool asked(std::size_t i) const { return !pieces_[i].segment.empty() && found_[i].side == Side::both; }

  bool neighbours(const std::string& a, const std::string& b) const {
    return a == b || std::any_of(neighbours_.begin(), neighbours_.end(), [&](const auto& pair) {
             return (pair[0] == a && pair[1] == b) || (pair[0] == b && pair[1] == a);
           });
  }

  double distance(std::size_t a, std::size_t b) const {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& p : pieces_[a].points) {
      for (const auto& q : pieces_[b].points) least = std::min(least, (vector(p) - vector(q)).squaredNorm());
    }
    return std::sqrt(least);
  }

  // Gives one piece its side: the one nearest to a bone that has one. False where there is none to give.
  bool by_neighbours(const std::optional<Plane>& plane) {
    std::size_t best = pieces_.size(), best_bone = 0;
    double best_distance = std::numeric_limits<double>::infinity(), best_confidence = 0;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (!asked(i)) continue;
      std::array<double, 2> nearest{1e30, 1e30};
      std::array<std::size_t, 2> bone{0, 0};
      for (std::size_t b = 0; b < pieces_.size(); ++b) {
        if (found_[b].side == Side::both || !neighbours(pieces_[i].segment, pieces_[b].segment)) continue;
        const std::size_t side = found_[b].side == Side::left ? 0 : 1;
        const double d = cached_distance(i, b);
        if (d < nearest[side]) nearest[side] = d, bone[side] = b;
      }
      const std::size_t side = nearest[0] <= nearest[1] ? 0 : 1;
      const double near = nearest[side], far = nearest[1 - side];
      if (near > kNear || near > kClearly * far) continue;
      // With bones of one side alone to compare with, the plane must not contradict.
      if (far > 1e29 && plane && (share_left(*plane, i) > 0.5) != (side == 0)) continue;
      if (near >= best_distance) continue;
      best = i;
      best_bone = bone[side];
      best_distance = near;
      best_confidence = far > 1e29 ? 0.8 : 0.97 - 0.2 * near / far;
    }
    if (best == pieces_.size()) return false;
    found_[best] = {found_[best_bone].side, std::min(best_confidence, found_[best_bone].confidence),
                    "nearest to the " + pieces_[best_bone].structure + " of that side, " +
                        text::number(best_distance, 2) + " mm away"};
    return true;
  }

  double share_left(const Plane& plane, std::size_t i) const {
    std::size_t left = 0;
    for (const auto& p : pieces_[i].points) left += (vector(p) - plane.point).dot(plane.to_left) >= 0 ? 1 : 0;
    return static_cast<double>(left) /
           static_cast<double>(std::max<std::size_t>(1, pieces_[i].points.size()));
  }

  // The largest of those that lie on one side; its neighbours may then follow it.
  bool by_plane(const Plane& plane) {
    std::size_t best = pieces_.size();
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const double share = asked(i) ? share_left(plane, i) : 0.5;
      if (std::max(share, 1 - share) < kOneSide) continue;
      if (best == pieces_.size() || pieces_[i].voxels > pieces_[best].voxels) best = i;
    }
    if (best == pieces_.size()) return false;
    found_[best] = {share_left(plane, best) > 0.5 ? Side::left : Side::right, 0.8,
                    "by the middle of " + plane.from};
    return true;
  }

  // One limb alone.
  bool alone() {
    if (only_ != Side::both) return all_become(only_, 0.95, "as --side says");
    for (const auto& [outer, inner] : {std::pair("fibula", "tibia")}) {
      const std::size_t a = largest(outer), b = largest(inner);
      if (a == pieces_.size() || b == pieces_.size()) continue;
      const double x = pieces_[a].centre[0] - pieces_[b].centre[0];
      if (std::abs(x) < 5) continue;
      return all_become(x > 0 ? Side::left : Side::right, 0.7,
                        std::string("one limb alone: the ") + outer + " lies outside of the " + inner);
    }
    return false;
  }
  bool all_become(Side side, double confidence, const std::string& why) {
    bool any = false;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (!asked(i)) continue;
      found_[i] = {side, confidence, why};
      any = true;
    }
    return any;
  }
  std::size_t largest(const std::string& structure) const {
    std::size_t best = pieces_.size();
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      if (pieces_[i].structure == structure &&
          (best == pieces_.size() || pieces_[i].voxels > pieces_[best].voxels))
        best = i;
    }
    return best;
  }

  std::optional<Plane> middle() const {
    Plane plane;
    // Bones of both sides.
    Eigen::Vector3d left = Eigen::Vector3d::Zero(), right = left;
    int pairs = 0;
    for (std::size_t a = 0; a < pieces_.size(); ++a) {
      for (std::size_t b = 0; b < pieces_.size(); ++b) {
        if (pieces_[a].side != Side::left || pieces_[b].side != Side::right ||
            pieces_[a].structure != pieces_[b].structure)
          continue;
        left += vector(pieces_[a].centre);
        right += vector(pieces_[b].centre);
        ++pairs;
      }
    }
    if (pairs > 0 && (left - right).norm() > 1e-6 * pairs) {
      plane.point = 0.5 * (left + right) / pairs;
      plane.to_left = (left - right).normalized();
      plane.from = "bones that have a side";
      return plane;
    }
    // Bones in the middle.
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0;
    for (const SidedPiece& piece : pieces_) {
      if (!piece.segment.empty()) continue;
      sum += static_cast<double>(piece.voxels) * vector(piece.centre);
      weight += static_cast<double>(piece.voxels);
    }
    if (weight > 0) {
      plane.point = sum / weight;
      plane.from = "the trunk's bones";
      return plane;
    }
    // Two pieces of one structure that are alike in size.
    for (const SidedPiece& a : pieces_) {
      for (const SidedPiece& b : pieces_) {
        const double ratio = static_cast<double>(b.voxels) / static_cast<double>(a.voxels);
        if (&a == &b || a.structure != b.structure || ratio < kLike || ratio > 1 / kLike) continue;
        if (std::abs(a.centre[0] - b.centre[0]) < kNear) continue;
        plane.point = 0.5 * (vector(a.centre) + vector(b.centre));
        plane.from = "two like pieces of " + a.structure;
        return plane;
      }
    }
    return std::nullopt;
  }

  double cached_distance(std::size_t a, std::size_t b) {
    if (distances_.empty()) distances_.assign(pieces_.size() * pieces_.size(), -1);
    double& d = distances_[a * pieces_.size() + b];
    if (d < 0) d = distance(a, b);
    return d;
  }

  const std::vector<SidedPiece>& pieces_;
  const Neighbours& neighbours_;
  Side only_;
  std::vector<SideFound> found_;
  std::vector<double> distances_;
};

}  // namespace

std::vector<SideFound> find_sides(const std::vector<SidedPiece>& pieces, const Neighbours& neighbours,
                                  Side only) {
  return Finder(pieces, neighbours, only).run();
}

}  // namespace ecorche::scan
