// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/fit_points.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/geometry/dihedral.hpp"
#include "core/geometry/face_tree.hpp"
#include "preprocess/tet/lattice/incidence.hpp"

namespace ecorche::tet {
namespace {

using Eigen::Vector3d;

constexpr int kPasses = 4;
constexpr std::array kSteps{1.0, 0.6, 0.3};  // of the way that is left
constexpr double kNegligible = 0.1;          // of `reach`: no move is worth less
const double kSharpest = std::cos(10 * std::numbers::pi / 180),
             kBluntest = std::cos(165 * std::numbers::pi / 180);  // as SliverBounds
constexpr int kOutside = -1, kSoft = 0;                           // else the bone's label

/// The materials of either side; low < high.
struct Border {
  int low, high;
};

/// Where the border of two materials should be.
class Surfaces {
 public:
  Surfaces(const Case& patient, double reach)
      : skin_(geometry::FaceTree::corners_of(patient.skin)), reach_(reach) {
    trees_.reserve(1 + patient.bones.size());
    trees_.emplace_back(patient.skin);
    for (const CaseBone& bone : patient.bones) trees_.emplace_back(bone.surface);
    area_.push_back(0);  // the skin is never asked for its
    for (const CaseBone& bone : patient.bones) area_.push_back(area(bone.surface));
  }

  Vector3d nearest(const Border& b, const Vector3d& p) const {
    if (b.high == kSoft) return nearest(0, p);
    if (b.low == kSoft) return nearest(b.high, p);
    const bool low_first =
        b.low > kSoft && area_[static_cast<std::size_t>(b.low)] < area_[static_cast<std::size_t>(b.high)];
    Vector3d first = nearest(low_first ? b.low : b.high, p);
    if (b.low == kOutside && out_of_skin(first)) return first;
    const int other = low_first ? b.high : std::max(b.low, 0);
    const Vector3d way = 0.5 * (nearest(other, p) - first);
    return first + way * std::min(1.0, reach_ / std::max(way.norm(), 1e-300));
  }

 private:
  Vector3d nearest(int surface, const Vector3d& p) const {
    const auto hit = trees_[static_cast<std::size_t>(surface)].nearest(p);
    return hit.face < 0 ? p : hit.point;
  }
  static double area(const SurfaceMesh& s) {
    double twice = 0;
    for (const auto& [a, b, c] : geometry::FaceTree::corners_of(s)) twice += (b - a).cross(c - a).norm();
    return twice / 2;
  }
  /// Judged by the nearest triangle.
  bool out_of_skin(const Vector3d& p) const {
    const auto hit = trees_[0].nearest(p);
    if (hit.face < 0) return false;
    const auto& t = skin_[static_cast<std::size_t>(hit.face)];
    return (t[1] - t[0]).cross(t[2] - t[0]).dot(p - hit.point) > 0;
  }

  std::vector<geometry::FaceTree> trees_;  // skin, bones
  std::vector<geometry::FaceTree::Corners> skin_;
  std::vector<double> area_;  // mm^2
  double reach_;
};

class Fitter {
 public:
  Fitter(TetMesh& mesh, const Case& patient, double reach, const Context& context)
      : mesh_(mesh),
        context_(context),
        negligible_(kNegligible * reach),
        surfaces_(patient, reach),
        tets_at_(static_cast<std::size_t>(mesh.T.rows()), static_cast<std::size_t>(mesh.V.rows()),
                 [&](std::size_t t, std::size_t c) {
                   return mesh.T(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(c));
                 }) {
    find_faces();
    find_points();
  }

  FitReport run() {
    FitReport report;
    report.points = static_cast<std::int64_t>(points_.size());
    std::vector<std::uint8_t> moved(points_.size(), 0);
    for (int pass = 0; pass < kPasses; ++pass) {
      const std::vector<Vector3d> ways = ways_to_go();
      for (std::size_t n = 0; n < points_.size(); ++n) {
        if ((n & 0xfff) == 0) context_.check_stop();
        if (ways[n].norm() > negligible_ && approach(points_[n].node, ways[n])) moved[n] = 1;
      }
    }
    report.moved = std::count(moved.begin(), moved.end(), 1);
    return report;
  }

 private:
  enum Rank : std::uint8_t { kInner, kSkin, kBony };
  struct Face {
    std::array<std::int32_t, 3> corner;
    Border border;
  };
  struct Point {
    std::int32_t node;
    Border border;  // low == high where more than two meet: its faces alone decide
    std::size_t first_face, end_face;
  };

  Vector3d at(std::int32_t node) const { return mesh_.V.row(node).transpose(); }
  int label(std::int32_t tet) const { return mesh_.label[static_cast<std::size_t>(tet)]; }

  /// The label beyond a face of a tet.
  int beyond(std::int32_t tet, const std::array<std::int32_t, 3>& face) const {
    const auto a = static_cast<std::size_t>(face[0]);
    for (std::size_t e = tets_at_.first[a]; e < tets_at_.first[a + 1]; ++e) {
      const std::int32_t other = tets_at_.tets[e];
      if (other == tet) continue;
      bool b = false, c = false;
      for (Eigen::Index k = 0; k < 4; ++k) {
        b = b || mesh_.T(other, k) == face[1];
        c = c || mesh_.T(other, k) == face[2];
      }
      if (b && c) return label(other);
    }
    return kOutside;
  }

  void find_faces() {
    constexpr std::int32_t kRun = 1 << 12;
    const auto count = static_cast<std::int32_t>(mesh_.T.rows());
    std::vector<std::vector<Face>> found(static_cast<std::size_t>(count / kRun + 1));
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t run) {
      context_.check_stop();
      const auto begin = static_cast<std::int32_t>(run) * kRun;
      for (std::int32_t t = begin; t < std::min(count, begin + kRun); ++t)
        for (Eigen::Index skipped = 0; skipped < 4; ++skipped) {
          std::array<std::int32_t, 3> face{};
          for (Eigen::Index c = 0, k = 0; c < 4; ++c)
            if (c != skipped) face[static_cast<std::size_t>(k++)] = mesh_.T(t, c);
          const int other = beyond(t, face);
          if (other < label(t)) found[run].push_back({face, {other, label(t)}});
        }
    });
    for (const std::vector<Face>& some : found) faces_.insert(faces_.end(), some.begin(), some.end());
  }

  void find_points() {
    rank_.assign(static_cast<std::size_t>(mesh_.V.rows()), 0);
    std::vector<std::pair<std::int32_t, std::size_t>> corners;
    corners.reserve(3 * faces_.size());
    for (std::size_t f = 0; f < faces_.size(); ++f)
      for (const std::int32_t node : faces_[f].corner) corners.emplace_back(node, f);
    std::sort(corners.begin(), corners.end());
    std::vector<int> seen;
    for (std::size_t n = 0; n < corners.size();) {
      Point point{corners[n].first, {0, 0}, n, n};
      seen.clear();
      for (; n < corners.size() && corners[n].first == point.node; ++n) {
        const Border& b = faces_[corners[n].second].border;
        seen.insert(seen.end(), {b.low, b.high});
        faces_at_.push_back(corners[n].second);
      }
      point.end_face = n;
      rank_[static_cast<std::size_t>(point.node)] =
          *std::max_element(seen.begin(), seen.end()) > kSoft ? kBony : kSkin;
      std::sort(seen.begin(), seen.end());
      seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
      if (seen.size() == 3) std::erase(seen, kSoft);
      if (seen.size() == 2) point.border = {seen[0], seen[1]};
      points_.push_back(point);
    }
  }

  template <class Visit>
  void each(std::size_t count, const Visit& visit) const {
    constexpr std::size_t kRun = 256;
    tbb::parallel_for(std::size_t{0}, (count + kRun - 1) / kRun, [&](std::size_t run) {
      context_.check_stop();
      for (std::size_t n = run * kRun; n < std::min(count, (run + 1) * kRun); ++n) visit(n);
    });
  }

  /// One step of Jacobi's method on the least squares, scaled by row sums: a face's middle moves by a third
  /// of each corner's step.
  std::vector<Vector3d> ways_to_go() const {
    std::vector<Vector3d> of_face(faces_.size()), way(points_.size());
    each(faces_.size(), [&](std::size_t f) {
      const auto& c = faces_[f].corner;
      const Vector3d middle = (at(c[0]) + at(c[1]) + at(c[2])) / 3;
      of_face[f] = surfaces_.nearest(faces_[f].border, middle) - middle;
    });
    each(points_.size(), [&](std::size_t n) {
      const Point& point = points_[n];
      Vector3d sum = Vector3d::Zero();
      double weight = 0;
      for (std::size_t f = point.first_face; f < point.end_face; ++f) {
        if (rank_[static_cast<std::size_t>(point.node)] == kBony && faces_[faces_at_[f]].border.high == kSoft)
          continue;  // the skin gives way
        sum += of_face[faces_at_[f]] / 3;
        weight += 1.0 / 3;
      }
      if (point.border.low != point.border.high) {
        sum += surfaces_.nearest(point.border, at(point.node)) - at(point.node);
        weight += 1;
      }
      way[n] = sum / weight;
    });
    return way;
  }

  bool approach(std::int32_t node, const Vector3d& way) {
    for (const double step : kSteps) {
      movers_.assign(1, node);
      if (shift(step * way)) return true;
      add_lower_neighbours(node);
      if (movers_.size() > 1 && shift(step * way)) return true;
    }
    return false;
  }

  void add_lower_neighbours(std::int32_t node) {
    const auto n = static_cast<std::size_t>(node);
    for (std::size_t e = tets_at_.first[n]; e < tets_at_.first[n + 1]; ++e)
      for (Eigen::Index c = 0; c < 4; ++c)
        if (const std::int32_t other = mesh_.T(tets_at_.tets[e], c);
            rank_[static_cast<std::size_t>(other)] < rank_[n])
          movers_.push_back(other);
    std::sort(movers_.begin() + 1, movers_.end());
    movers_.erase(std::unique(movers_.begin() + 1, movers_.end()), movers_.end());
  }

  geometry::TetShape shape(std::int32_t t) const {
    return geometry::tet_shape({at(mesh_.T(t, 0)), at(mesh_.T(t, 1)), at(mesh_.T(t, 2)), at(mesh_.T(t, 3))});
  }

  /// Moves the first of the movers by `way`, the others by half of it; or none, where a tet would not bear
  /// it.
  bool shift(const Vector3d& way) {
    touched_.clear();
    for (const std::int32_t mover : movers_) {
      const auto m = static_cast<std::size_t>(mover);
      touched_.insert(touched_.end(), tets_at_.tets.begin() + static_cast<std::ptrdiff_t>(tets_at_.first[m]),
                      tets_at_.tets.begin() + static_cast<std::ptrdiff_t>(tets_at_.first[m + 1]));
    }
    std::sort(touched_.begin(), touched_.end());
    touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
    kept_.clear();
    for (const std::int32_t mover : movers_) kept_.push_back(at(mover));
    for (std::size_t m = 0; m < movers_.size(); ++m)
      mesh_.V.row(movers_[m]) += (m == 0 ? 1.0 : 0.5) * way.transpose();
    beyond_.clear();
    bool sound = true;
    for (std::size_t n = 0; n < touched_.size() && sound; ++n) {
      const geometry::TetShape after = shape(touched_[n]);
      sound = after.sound();
      if (after.greatest_cosine > kSharpest || after.least_cosine < kBluntest)
        beyond_.push_back({touched_[n], after});
    }
    if (sound && beyond_.empty()) return true;
    swap_back();
    for (std::size_t n = 0; n < beyond_.size() && sound; ++n) {
      const geometry::TetShape before = shape(beyond_[n].first), &after = beyond_[n].second;
      sound = after.greatest_cosine <= std::max(kSharpest, before.greatest_cosine) &&
              after.least_cosine >= std::min(kBluntest, before.least_cosine);
    }
    if (!sound) return false;
    swap_back();
    return true;
  }

  /// Where the movers are against where they were.
  void swap_back() {
    for (std::size_t m = 0; m < movers_.size(); ++m) {
      const Vector3d there = at(movers_[m]);
      mesh_.V.row(movers_[m]) = kept_[m].transpose();
      kept_[m] = there;
    }
  }

  TetMesh& mesh_;
  const Context& context_;
  double negligible_;  // mm
  Surfaces surfaces_;
  Incidence tets_at_;
  std::vector<Face> faces_;
  std::vector<Point> points_;
  std::vector<std::size_t> faces_at_;                                // of points_
  std::vector<std::uint8_t> rank_;                                   // per node: lower ones give way
  std::vector<std::int32_t> movers_, touched_;                       // of the move at hand
  std::vector<std::pair<std::int32_t, geometry::TetShape>> beyond_;  // tets, and what they would be
  std::vector<Vector3d> kept_;
};

}  // namespace

FitReport fit_points(TetMesh& mesh, const Case& patient, double reach, const Context& context) {
  return Fitter(mesh, patient, reach, context).run();
}

}  // namespace ecorche::tet
