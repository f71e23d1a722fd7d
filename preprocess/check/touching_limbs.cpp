// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/touching_limbs.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "core/geometry/nearest_point.hpp"
#include "core/geometry/surface_edges.hpp"

namespace ecorche::check {
namespace {

using Eigen::Vector3d;

constexpr double kSwing = 100 * std::numbers::pi / 180;
// From the joint, in ways from there to the skin. What is free reaches less than sure_ways
// and sure_ways_of_two (armpits of the built-in patient 3.3, its legs less than 1.8); where
// there is one it is counted from kFar or kFarOfTwo on.
constexpr double kFar = 2.5, kFarOfTwo = 1.75;
constexpr double kPatch = 1e3 / (1700.0 * 1700.0);  // of the body's length squared
constexpr std::int64_t kGrain = 1 << 14;
constexpr int kSquares = 8;  // along the side of a face of a cube of directions
constexpr double kNearestShare = 0.05;

// A piece of the surface u = 1/2 within a tet.
struct Piece {
  double area = 0;
  Vector3d middle = Vector3d::Zero();
  int other_limb = -1;
  bool sure = false;
};

class Finder {
 public:
  explicit Finder(const TouchInput& model) : model_(model), limb_(limbs_of(model.skeleton)) {}

  const std::vector<int>& limbs() const { return limb_; }

  std::vector<Piece> pieces(int top) const {
    const auto nodes = static_cast<std::int64_t>(model_.nodes.rows());
    std::vector<float> share(static_cast<std::size_t>(nodes), 0);
    in_pieces(nodes, [&](std::int64_t first, std::int64_t last, std::size_t) {
      for (std::int64_t n = first; n < last; ++n) {
        for_weights(n, [&](int segment, float weight) {
          if (limb_[static_cast<std::size_t>(segment)] == top) share[static_cast<std::size_t>(n)] += weight;
        });
      }
    });
    const Vector3d joint = model_.skeleton.segments[static_cast<std::size_t>(top)].joint.center;
    const double way = way_to_skin(model_.skin, joint);
    const auto tets = static_cast<std::int64_t>(model_.tets.rows());
    std::vector<std::vector<Piece>> found(static_cast<std::size_t>((tets + kGrain - 1) / kGrain));
    in_pieces(tets, [&](std::int64_t first, std::int64_t last, std::size_t at) {
      for (std::int64_t t = first; t < last; ++t) {
        Piece piece = cut(t, share);
        const double from = (piece.middle - joint).norm();
        if (!(piece.area > 0) || from <= kFarOfTwo * way) continue;
        piece.other_limb = beside(t, top);
        if (piece.other_limb < 0 && from <= kFar * way) continue;
        piece.sure = from > (piece.other_limb < 0 ? sure_ways : sure_ways_of_two) * way;
        found[at].push_back(piece);
      }
    });
    std::vector<Piece> out;
    for (const std::vector<Piece>& some : found) out.insert(out.end(), some.begin(), some.end());
    return out;
  }

 private:
  template <class Body>
  static void in_pieces(std::int64_t count, const Body& body) {
    tbb::parallel_for(std::int64_t{0}, (count + kGrain - 1) / kGrain, [&](std::int64_t piece) {
      body(piece * kGrain, std::min(count, (piece + 1) * kGrain), static_cast<std::size_t>(piece));
    });
  }

  template <class Visit>
  void for_weights(std::int64_t node, const Visit& visit) const {
    const Weights& w = model_.weights;
    for (std::uint64_t i = w.offsets[static_cast<std::size_t>(node)];
         i < w.offsets[static_cast<std::size_t>(node) + 1]; ++i)
      visit(static_cast<int>(w.segment[i]), w.weight[i]);
  }

  // By marching tets.
  Piece cut(std::int64_t tet, const std::vector<float>& share) const {
    std::array<double, 4> u{};
    std::array<int, 4> order{};  // those of the limb first
    int inside = 0, outside = 0;
    for (int c = 0; c < 4; ++c) {
      const auto at = static_cast<std::size_t>(c);
      u[at] = static_cast<double>(share[static_cast<std::size_t>(model_.tets(tet, c))]) - 0.5;
      order[static_cast<std::size_t>(u[at] > 0 ? inside++ : 3 - outside++)] = c;
    }
    Piece out;
    if (inside == 0 || outside == 0) return out;
    const auto point = [&](std::size_t a, std::size_t b) -> Vector3d {  // on the edge of two corners
      const auto i = static_cast<std::size_t>(order[a]), j = static_cast<std::size_t>(order[b]);
      const Vector3d p = model_.nodes.row(model_.tets(tet, order[a])).transpose().cast<double>();
      const Vector3d q = model_.nodes.row(model_.tets(tet, order[b])).transpose().cast<double>();
      return p + u[i] / (u[i] - u[j]) * (q - p);
    };
    std::array<Vector3d, 4> p;
    int count = 3;
    if (inside == 1) {
      p = {point(0, 1), point(0, 2), point(0, 3), Vector3d::Zero()};
    } else if (inside == 3) {
      p = {point(0, 3), point(1, 3), point(2, 3), Vector3d::Zero()};
    } else {
      p = {point(0, 2), point(0, 3), point(1, 3), point(1, 2)};
      count = 4;
    }
    for (int c = 2; c < count; ++c) {
      const Vector3d &b = p[static_cast<std::size_t>(c) - 1], &d = p[static_cast<std::size_t>(c)];
      const double area = 0.5 * (b - p[0]).cross(d - p[0]).norm();
      out.area += area;
      out.middle += area * (p[0] + b + d) / 3;
    }
    if (out.area > 0) out.middle /= out.area;
    return out;
  }

  // What has the largest share of the tet after the limb itself.
  int beside(std::int64_t tet, int top) const {
    std::map<int, float> shares;
    for (int c = 0; c < 4; ++c) {
      for_weights(model_.tets(tet, c), [&](int segment, float weight) {
        const int limb = limb_[static_cast<std::size_t>(segment)];
        if (limb != top) shares[limb] += weight;
      });
    }
    const auto most = std::max_element(shares.begin(), shares.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == shares.end() ? -1 : most->first;
  }

  const TouchInput& model_;
  std::vector<int> limb_;
};

std::string number(const char* format, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

// The segments of bones, by the nodes of their tets.
class Bones {
 public:
  Bones(const TouchInput& model, const std::vector<int>& limb)
      : limb_(limb),
        nodes_(model.nodes.cast<double>()),
        segment_(static_cast<std::size_t>(nodes_.rows()), -1) {
    for (std::size_t t = 0; t < model.tet_label.size(); ++t) {
      if (model.tet_label[t] == TetMesh::soft) continue;
      for (int c = 0; c < 4; ++c)
        segment_[static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(t), c))] =
            model.bone_segment[static_cast<std::size_t>(model.tet_label[t]) - 1];
    }
  }

  // Of the bones of the limb (-1: of none), the segment that is nearest to most of the contact; -1: it has no
  // bones.
  int nearest_to(const std::vector<const Piece*>& pieces, int limb) const {
    std::vector<std::int32_t> own;
    for (std::size_t n = 0; n < segment_.size(); ++n) {
      if (segment_[n] >= 0 && limb_[static_cast<std::size_t>(segment_[n])] == limb)
        own.push_back(static_cast<std::int32_t>(n));
    }
    if (own.empty()) return -1;
    const geometry::NearestPoint nearest(nodes_, own);
    std::map<int, double> areas;
    for (const Piece* piece : pieces) {
      double distance2 = 0;
      areas[segment_[static_cast<std::size_t>(nearest.find(piece->middle, distance2))]] += piece->area;
    }
    return std::max_element(areas.begin(), areas.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  }

 private:
  const std::vector<int>& limb_;
  Points nodes_;
  std::vector<int> segment_;  // of each node; -1: of no bone
};

// One contact of all pieces between a limb and the same other.
Touch joined(int limb, int other_limb, const std::vector<const Piece*>& pieces) {
  Touch out;
  out.limb = limb;
  out.other_limb = other_limb;
  Vector3d middle = Vector3d::Zero();
  for (const Piece* piece : pieces) {
    out.area_mm2 += piece->area;
    middle += piece->area * piece->middle;
  }
  middle /= out.area_mm2;
  double least = std::numeric_limits<double>::infinity();
  for (const Piece* piece : pieces) {
    const double d = (piece->middle - middle).squaredNorm();
    if (d >= least) continue;
    least = d;
    out.at = piece->middle;
  }
  return out;
}

}  // namespace

PointsF outer_vertices(const PointsF& V, const Triangles& F) {
  const geometry::TriangleClasses parts = geometry::parts({V.cast<double>(), F});
  std::vector<double> volume(static_cast<std::size_t>(parts.count), 0);  // about a vertex of its own
  std::vector<std::int32_t> first(volume.size(), -1);
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const auto part = static_cast<std::size_t>(parts.of[static_cast<std::size_t>(f)]);
    if (first[part] < 0) first[part] = F(f, 0);
    volume[part] += tet_det(V.row(first[part]), V.row(F(f, 0)), V.row(F(f, 1)), V.row(F(f, 2)));
  }
  std::vector<std::uint8_t> outer(static_cast<std::size_t>(V.rows()), 0);
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    if (volume[static_cast<std::size_t>(parts.of[static_cast<std::size_t>(f)])] < 0) continue;
    for (int c = 0; c < 3; ++c) outer[static_cast<std::size_t>(F(f, c))] = 1;
  }
  PointsF out(std::count(outer.begin(), outer.end(), 1), 3);
  Eigen::Index row = 0;
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    if (outer[static_cast<std::size_t>(v)] != 0) out.row(row++) = V.row(v);
  }
  return out;
}

double least_contact_mm2(double body_length_mm) {
  return kPatch * body_length_mm * body_length_mm;
}

double way_to_skin(const PointsF& skin, const Vector3d& joint) {
  // Directions by the squares of a cube's six faces.
  std::array<double, 6 * kSquares * kSquares> nearest;
  nearest.fill(std::numeric_limits<double>::infinity());
  for (Eigen::Index v = 0; v < skin.rows(); ++v) {
    const Vector3d way = skin.row(v).cast<double>().transpose() - joint;
    Eigen::Index axis = 0;
    const double most = way.cwiseAbs().maxCoeff(&axis);
    if (!(most > 0)) return 0;
    const auto square = [&](Eigen::Index other) {
      return std::min(kSquares - 1, static_cast<int>((way[other] / most + 1) / 2 * kSquares));
    };
    const int face = 2 * static_cast<int>(axis) + (way[axis] > 0 ? 1 : 0);
    const int at = (face * kSquares + square((axis + 1) % 3)) * kSquares + square((axis + 2) % 3);
    double& least = nearest[static_cast<std::size_t>(at)];
    least = std::min(least, way.norm());
  }
  std::sort(nearest.begin(), nearest.end());
  const auto seen = std::count_if(nearest.begin(), nearest.end(), [](double d) { return std::isfinite(d); });
  return nearest[static_cast<std::size_t>(static_cast<double>(seen) * kNearestShare)];
}

std::vector<int> limbs_of(const Skeleton& skeleton) {
  std::vector<int> limb(skeleton.segments.size(), -1);
  for (std::size_t s = 0; s < limb.size(); ++s) {  // parents come first
    const Segment& segment = skeleton.segments[s];
    if (segment.parent < 0) continue;
    limb[s] = limb[static_cast<std::size_t>(segment.parent)];
    if (limb[s] >= 0 || segment.joint.kind == JointKind::fixed) continue;
    const std::size_t turns = segment.joint.kind == JointKind::hinge       ? 1
                              : segment.joint.kind == JointKind::universal ? 2
                                                                           : 3;
    for (std::size_t a = 0; a < std::min(turns, segment.joint.sequence.size()); ++a) {
      const AngleAxis& angle = segment.joint.sequence[a];
      if (angle.max - angle.min > kSwing) limb[s] = static_cast<int>(s);
    }
  }
  return limb;
}

std::vector<Touch> touching_limbs(const TouchInput& model) {
  std::vector<Touch> out;
  if (model.tets.rows() == 0) return out;
  const Finder finder(model);
  const double length =
      static_cast<double>((model.nodes.colwise().maxCoeff() - model.nodes.colwise().minCoeff()).maxCoeff());
  std::optional<Bones> bones;
  for (int top = 0; top < static_cast<int>(model.skeleton.segments.size()); ++top) {
    if (finder.limbs()[static_cast<std::size_t>(top)] != top) continue;
    const std::vector<Piece> pieces = finder.pieces(top);
    std::map<int, std::vector<const Piece*>> by_other;
    for (const Piece& piece : pieces) by_other[piece.other_limb].push_back(&piece);
    for (const auto& [beside, some] : by_other) {
      const int other = beside;  // clang 14 takes no structured binding into a lambda
      double sure = 0;
      for (const Piece* piece : some) sure += piece->sure ? piece->area : 0;
      if (sure < least_contact_mm2(length)) continue;
      if (!bones) bones.emplace(model, finder.limbs());
      Touch touch = joined(top, other, some);
      touch.own = bones->nearest_to(some, top);
      touch.other = bones->nearest_to(some, other);
      if (touch.own < 0 || touch.other < 0) continue;
      const auto seen = std::find_if(out.begin(), out.end(), [&](const Touch& before) {
        return before.limb == other && before.other_limb == top;
      });
      if (seen == out.end()) {
        out.push_back(touch);
      } else if (touch.area_mm2 > seen->area_mm2) {
        *seen = touch;
      }
    }
  }
  return out;
}

std::vector<Touch> touching_limbs(const Model& model) {
  PointsF skin(0, 3);
  for (const Tissue& tissue : model.tissues) {
    if (tissue.group != Group::skin) continue;
    const PointsF outer = outer_vertices(tissue.V, tissue.F);
    const Eigen::Index before = skin.rows();
    skin.conservativeResize(before + outer.rows(), 3);
    skin.bottomRows(outer.rows()) = outer;
  }
  return touching_limbs(TouchInput{model.rig.skeleton, model.bone_segment, model.nodes, model.tets,
                                   model.tet_label, model.weights, std::move(skin)});
}

std::string what(const Touch& touch, const Skeleton& skeleton) {
  const auto name = [&](int s) { return skeleton.segments[static_cast<std::size_t>(s)].name; };
  return "touches " + (touch.other_limb >= 0 ? name(touch.other_limb) : "the trunk") + ": " +
         number("%.3g", touch.area_mm2 / 100) + " cm2 joined, most of " + name(touch.own) + " and " +
         name(touch.other);
}

std::string describe(const Touch& touch, const Skeleton& skeleton) {
  return skeleton.segments[static_cast<std::size_t>(touch.limb)].name + " " + what(touch, skeleton) +
         ", at [" + number("%.1f", touch.at.x()) + ", " + number("%.1f", touch.at.y()) + ", " +
         number("%.1f", touch.at.z()) + "]";
}

double cube_mm(const PointsF& nodes, const Tets& tets) {
  double volume = 0;
  for (Eigen::Index t = 0; t < tets.rows(); ++t)
    volume +=
        tet_det(nodes.row(tets(t, 0)), nodes.row(tets(t, 1)), nodes.row(tets(t, 2)), nodes.row(tets(t, 3))) /
        6;
  return tets.rows() == 0 ? 0 : std::cbrt(12 * volume / static_cast<double>(tets.rows()));
}

std::string parting_advice(double cube_mm) {
  return "either drags the other along; where a gap is narrower than " + number("%.3g", 1.5 * cube_mm) +
         " mm tets of this size bridge it: more of them (--max-tets) or a smaller --voxel may part them; "
         "what "
         "touches in the scan is held apart under labels, apart, with a gap_mm of more than that";
}

}  // namespace ecorche::check
