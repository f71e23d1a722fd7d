// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/surface_sides.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/geometry/surface_edges.hpp"
#include "preprocess/parting/minimum_cut.hpp"

namespace ecorche::parting {
namespace {

using Eigen::Vector3d;

constexpr double kCrease = 0.1;                     // of the cost of a border along a crease
constexpr double kSharp = 0.94;                     // cosine between the normals of a crease that goes in
constexpr double kNearEnd = 0.15;                   // of an edge
constexpr int kFewestPasses = 4, kMostPasses = 30;  // smoothings: as many as reach about a cube far

}  // namespace

SurfaceSides::SurfaceSides(const Tissue& tissue, const PartedTets& tets)
    : V_(tissue.V.cast<double>()),
      F_(tissue.F),
      tets_(tets),
      side_(tissue.tet.size()),
      level_(tissue.tet.size(), 1) {
  for (std::size_t v = 0; v < side_.size(); ++v) side_[v] = tets.part_of(tissue.tet[v]);
}

bool SurfaceSides::any_crosses() const {
  for (Eigen::Index f = 0; f < F_.rows(); ++f) {
    const int a = side(F_(f, 0));
    if (a != side(F_(f, 1)) || a != side(F_(f, 2))) return true;
  }
  return false;
}

void SurfaceSides::settle() {
  way_.assign(side_.size(), std::numeric_limits<double>::infinity());
  contact_.assign(side_.size(), -1);
  tbb::parallel_for(std::size_t{0}, side_.size(), [&](std::size_t v) {
    const Vector3d p = V_.row(static_cast<Eigen::Index>(v)).transpose();
    if (!tets_.may_reach(p)) return;
    const auto [face, mm] = tets_.nearest_cut(p);
    way_[v] = mm / tets_.cube_mm();
    contact_[v] = face->contact;
  });
  const std::vector<Edge> edges = edges_in_reach();
  for (std::size_t c = 0; c < tets_.parting().contacts.size(); ++c)
    settle(static_cast<std::int32_t>(c), edges);
}

double SurfaceSides::crossing(std::int32_t a, std::int32_t b) const {
  const double here = level_[static_cast<std::size_t>(a)], there = level_[static_cast<std::size_t>(b)];
  return here + there > 0 ? std::clamp(here / (here + there), kNearEnd, 1 - kNearEnd) : 0.5;
}

Vector3d SurfaceSides::normal(std::int32_t f) const {
  return (at(F_(f, 1)) - at(F_(f, 0))).cross(at(F_(f, 2)) - at(F_(f, 0))).normalized();
}

Vector3d SurfaceSides::middle(std::int32_t f) const {
  return (at(F_(f, 0)) + at(F_(f, 1)) + at(F_(f, 2))) / 3;
}

// Between two vertices runs a border as long as the way between the middles of the triangles beside.
double SurfaceSides::price(const Edge& edge) const {
  const Vector3d on = 0.5 * (at(edge.at[0]) + at(edge.at[1]));
  double length = 0;
  for (const std::int32_t f : edge.face) length += f < 0 ? 0 : (middle(f) - on).norm();
  const double cost = tets_.cube_mm() * length;
  if (edge.face[0] < 0 || edge.face[1] < 0) return cost;
  const Vector3d n = normal(edge.face[0]);
  const bool goes_in = n.dot(middle(edge.face[1]) - on) > 0;
  return goes_in && n.dot(normal(edge.face[1])) < kSharp ? kCrease * cost : cost;
}

// Of the triangles with a vertex near a cut; beyond them edges have one triangle.
std::vector<SurfaceSides::Edge> SurfaceSides::edges_in_reach() const {
  const auto near = [&](std::int32_t v) { return way_[static_cast<std::size_t>(v)] <= PartedTets::kReach; };
  std::vector<std::int32_t> rows;
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(F_.rows()); ++f) {
    if (near(F_(f, 0)) || near(F_(f, 1)) || near(F_(f, 2))) rows.push_back(f);
  }
  Triangles about(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t f = 0; f < rows.size(); ++f) about.row(static_cast<Eigen::Index>(f)) = F_.row(rows[f]);
  std::vector<Edge> out;
  geometry::each_edge(geometry::sorted_edges(about), [&](std::span<const geometry::HalfEdge> same) {
    Edge edge{{same[0].low, same[0].high}, {-1, -1}};
    for (std::size_t i = 0; i < std::min<std::size_t>(same.size(), 2); ++i)
      edge.face[i] = rows[static_cast<std::size_t>(same[i].triangle)];
    out.push_back(edge);
  });
  return out;
}

void SurfaceSides::settle(std::int32_t contact, const std::vector<Edge>& edges) {
  const Contact& of = tets_.parting().contacts[static_cast<std::size_t>(contact)];
  std::vector<std::int32_t> row(side_.size(), -1), open;
  for (std::size_t v = 0; v < side_.size(); ++v) {
    const bool either = side_[v] == of.limb || side_[v] == of.other_limb;
    if (!either || contact_[v] != contact || way_[v] > PartedTets::kReach) continue;
    row[v] = static_cast<std::int32_t>(open.size());
    open.push_back(static_cast<std::int32_t>(v));
  }
  if (open.empty()) return;
  std::vector<double> area(side_.size(), 0);
  for (Eigen::Index f = 0; f < F_.rows(); ++f) {
    const double twice = (at(F_(f, 1)) - at(F_(f, 0))).cross(at(F_(f, 2)) - at(F_(f, 0))).norm();
    for (int c = 0; c < 3; ++c) area[static_cast<std::size_t>(F_(f, c))] += twice / 6;
  }
  CutGraph graph(static_cast<std::int32_t>(open.size()));
  const auto lean = [&](std::int32_t to, int side, double cost) {
    if (side == of.limb) graph.hold_inside(to, cost);
    if (side == of.other_limb) graph.hold_outside(to, cost);
  };
  for (std::size_t i = 0; i < open.size(); ++i) {
    const auto v = static_cast<std::size_t>(open[i]);
    lean(static_cast<std::int32_t>(i), side_[v], area[v] * way_[v]);
  }
  for (const Edge& edge : edges) {
    const std::int32_t a = row[static_cast<std::size_t>(edge.at[0])];
    const std::int32_t b = row[static_cast<std::size_t>(edge.at[1])];
    if (a >= 0 && b >= 0) graph.tie(a, b, price(edge));
    if (a >= 0 && b < 0) lean(a, side(edge.at[1]), price(edge));
    if (a < 0 && b >= 0) lean(b, side(edge.at[0]), price(edge));
  }
  const std::vector<std::uint8_t> inside = graph.inside();
  for (std::size_t i = 0; i < open.size(); ++i)
    side_[static_cast<std::size_t>(open[i])] = inside[i] != 0 ? of.limb : of.other_limb;
  smooth(of, open, row, edges);
}

// 1 on the limb and -1 on the other, each vertex then the mean of itself and those beside: where that is 0
// runs the border.
void SurfaceSides::smooth(const Contact& of, const std::vector<std::int32_t>& open,
                          const std::vector<std::int32_t>& row, const std::vector<Edge>& edges) {
  const auto sign = [&](std::int32_t v) {
    return side(v) == of.limb ? 1.0 : side(v) == of.other_limb ? -1.0 : 0.0;
  };
  std::vector<double> level(open.size());
  for (std::size_t i = 0; i < open.size(); ++i) level[i] = sign(open[i]);
  double length = 0;
  std::vector<const Edge*> own;
  for (const Edge& edge : edges) {
    if (row[static_cast<std::size_t>(edge.at[0])] < 0 && row[static_cast<std::size_t>(edge.at[1])] < 0)
      continue;
    own.push_back(&edge);
    length += (at(edge.at[0]) - at(edge.at[1])).norm();
  }
  if (own.empty()) return;
  const double steps = tets_.cube_mm() * static_cast<double>(own.size()) / length;  // edges along a cube
  const int passes = std::clamp(static_cast<int>(std::lround(steps * steps)), kFewestPasses, kMostPasses);
  for (int pass = 0; pass < passes; ++pass) {
    std::vector<double> sum(open.size(), 0), count(open.size(), 0);
    const auto value = [&](std::int32_t v) {
      const std::int32_t at = row[static_cast<std::size_t>(v)];
      return at >= 0 ? level[static_cast<std::size_t>(at)] : sign(v);
    };
    for (const Edge* edge : own) {
      for (std::size_t end = 0; end < 2; ++end) {
        const std::int32_t here = row[static_cast<std::size_t>(edge->at[end])], beside = edge->at[1 - end];
        if (here < 0 || sign(beside) == 0) continue;
        sum[static_cast<std::size_t>(here)] += value(beside);
        count[static_cast<std::size_t>(here)] += 1;
      }
    }
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (count[i] > 0) level[i] = 0.5 * (level[i] + sum[i] / count[i]);
    }
  }
  for (std::size_t i = 0; i < open.size(); ++i) {
    side_[static_cast<std::size_t>(open[i])] = level[i] >= 0 ? of.limb : of.other_limb;
    level_[static_cast<std::size_t>(open[i])] = std::abs(level[i]);
  }
}

}  // namespace ecorche::parting
