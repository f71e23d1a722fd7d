// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/part_surface.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "preprocess/geometry/surface_edges.hpp"
#include "preprocess/parting/minimum_cut.hpp"

namespace ecorche::parting {
namespace {

using Eigen::Vector3d;

constexpr double kCrease = 0.1;  // of the cost of a border along a crease
constexpr double kSharp = 0.94;  // cosine between the normals of a crease that goes in

struct Edge {
  std::array<std::int32_t, 2> at{};  // ascending
  std::array<std::int32_t, 2> face{-1, -1};
};

// Of the triangles with a vertex that is chosen; beyond them edges have one triangle.
template <class Chosen>
std::vector<Edge> edges_about(const Triangles& F, const Chosen& chosen) {
  std::vector<std::int32_t> rows;
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(F.rows()); ++f) {
    if (chosen(F(f, 0)) || chosen(F(f, 1)) || chosen(F(f, 2))) rows.push_back(f);
  }
  Triangles about(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t f = 0; f < rows.size(); ++f) about.row(static_cast<Eigen::Index>(f)) = F.row(rows[f]);
  std::vector<Edge> out;
  geometry::each_edge(geometry::sorted_edges(about), [&](std::span<const geometry::HalfEdge> same) {
    Edge edge{{same[0].low, same[0].high}, {-1, -1}};
    for (std::size_t i = 0; i < std::min<std::size_t>(same.size(), 2); ++i)
      edge.face[i] = rows[static_cast<std::size_t>(same[i].triangle)];
    out.push_back(edge);
  });
  return out;
}

// The sides of a surface's vertices, and what they cost.
class Sides {
 public:
  Sides(const Tissue& tissue, const PartedTets& tets)
      : V_(tissue.V.cast<double>()), F_(tissue.F), tets_(tets), side_(tissue.tet.size()) {
    for (std::size_t v = 0; v < side_.size(); ++v) side_[v] = tets.part_of(tissue.tet[v]);
    crosses_ = crossing();
  }

  const std::vector<int>& sides() const { return side_; }
  bool any_crosses() const { return crosses_; }

  void straighten() {
    way_.assign(side_.size(), std::numeric_limits<double>::infinity());
    contact_.assign(side_.size(), -1);
    tbb::parallel_for(std::size_t{0}, side_.size(), [&](std::size_t v) {
      const Vector3d p = V_.row(static_cast<Eigen::Index>(v)).transpose();
      if (!tets_.may_reach(p)) return;
      const auto [face, mm] = tets_.nearest_cut(p);
      way_[v] = mm / tets_.cube_mm();
      contact_[v] = face->contact;
    });
    const std::vector<Edge> edges = edges_about(
        F_, [&](std::int32_t v) { return way_[static_cast<std::size_t>(v)] <= PartedTets::kReach; });
    for (std::size_t c = 0; c < tets_.parting().contacts.size(); ++c)
      straighten(static_cast<std::int32_t>(c), edges);
  }

 private:
  bool crossing() const {
    for (Eigen::Index f = 0; f < F_.rows(); ++f) {
      const int a = side(F_(f, 0));
      if (a != side(F_(f, 1)) || a != side(F_(f, 2))) return true;
    }
    return false;
  }
  int side(std::int32_t v) const { return side_[static_cast<std::size_t>(v)]; }
  Vector3d at(std::int32_t v) const { return V_.row(v).transpose(); }
  Vector3d normal(std::int32_t f) const {
    return (at(F_(f, 1)) - at(F_(f, 0))).cross(at(F_(f, 2)) - at(F_(f, 0))).normalized();
  }
  Vector3d middle(std::int32_t f) const { return (at(F_(f, 0)) + at(F_(f, 1)) + at(F_(f, 2))) / 3; }

  // Between two vertices runs a border as long as the way between the middles of the triangles beside.
  double price(const Edge& edge) const {
    const Vector3d on = 0.5 * (at(edge.at[0]) + at(edge.at[1]));
    double length = 0;
    for (const std::int32_t f : edge.face) length += f < 0 ? 0 : (middle(f) - on).norm();
    const double cost = tets_.cube_mm() * length;
    if (edge.face[0] < 0 || edge.face[1] < 0) return cost;
    const Vector3d n = normal(edge.face[0]);
    const bool goes_in = n.dot(middle(edge.face[1]) - on) > 0;
    return goes_in && n.dot(normal(edge.face[1])) < kSharp ? kCrease * cost : cost;
  }

  void straighten(std::int32_t contact, const std::vector<Edge>& edges) {
    const Contact& of = tets_.parting().contacts[static_cast<std::size_t>(contact)];
    std::vector<std::int32_t> vertex(side_.size(), -1), open;
    for (std::size_t v = 0; v < side_.size(); ++v) {
      const bool either = side_[v] == of.limb || side_[v] == of.other_limb;
      if (!either || contact_[v] != contact || way_[v] > PartedTets::kReach) continue;
      vertex[v] = static_cast<std::int32_t>(open.size());
      open.push_back(static_cast<std::int32_t>(v));
    }
    std::vector<double> area(side_.size(), 0);
    for (Eigen::Index f = 0; f < F_.rows(); ++f) {
      const double twice = (at(F_(f, 1)) - at(F_(f, 0))).cross(at(F_(f, 2)) - at(F_(f, 0))).norm();
      for (int c = 0; c < 3; ++c) area[static_cast<std::size_t>(F_(f, c))] += twice / 6;
    }
    CutGraph graph(static_cast<std::int32_t>(open.size()));
    const auto lean = [&](std::int32_t row, int to, double cost) {
      if (to == of.limb) graph.hold_inside(row, cost);
      if (to == of.other_limb) graph.hold_outside(row, cost);
    };
    for (std::size_t row = 0; row < open.size(); ++row) {
      const auto v = static_cast<std::size_t>(open[row]);
      lean(static_cast<std::int32_t>(row), side_[v], area[v] * way_[v]);
    }
    for (const Edge& edge : edges) {
      const std::int32_t a = vertex[static_cast<std::size_t>(edge.at[0])],
                         b = vertex[static_cast<std::size_t>(edge.at[1])];
      if (a < 0 && b < 0) continue;
      if (a >= 0 && b >= 0)
        graph.tie(a, b, price(edge));
      else if (a >= 0)
        lean(a, side(edge.at[1]), price(edge));
      else
        lean(b, side(edge.at[0]), price(edge));
    }
    const std::vector<std::uint8_t> inside = graph.inside();
    for (std::size_t row = 0; row < open.size(); ++row)
      side_[static_cast<std::size_t>(open[row])] = inside[row] != 0 ? of.limb : of.other_limb;
  }

  Points V_;
  const Triangles& F_;
  const PartedTets& tets_;
  std::vector<int> side_;
  std::vector<double> way_;  // to the nearest cut, in cubes
  std::vector<std::int32_t> contact_;
  bool crosses_ = false;
};

// A vertex on a side that is not the one of its tet, or not its only one.
using Copy = std::pair<std::int32_t, int>;

// Rows for the copies: that of the vertex itself where no triangle is left to it, else new ones at the end. F
// gets them.
std::map<Copy, std::int32_t> rows_of(const std::map<Copy, std::int32_t>& copies, Triangles& F,
                                     Eigen::Index vertices) {
  std::vector<std::uint8_t> used(static_cast<std::size_t>(vertices), 0);
  for (const std::int32_t v : F.reshaped()) {
    if (v < vertices) used[static_cast<std::size_t>(v)] = 1;
  }
  std::map<Copy, std::int32_t> out;
  std::vector<std::int32_t> row(copies.size());
  auto next = static_cast<std::int32_t>(vertices);
  for (const auto& [of, provisional] : copies) {
    std::uint8_t& taken = used[static_cast<std::size_t>(of.first)];
    const std::int32_t own = taken == 0 ? of.first : next++;
    taken = 1;
    out[of] = row[static_cast<std::size_t>(provisional - vertices)] = own;
  }
  for (std::int32_t& v : F.reshaped()) {
    if (v >= vertices) v = row[static_cast<std::size_t>(v - vertices)];
  }
  return out;
}

void bind_copies(Tissue& tissue, const PartedTets& tets, const std::map<Copy, std::int32_t>& rows,
                 Eigen::Index vertices, const Context& context) {
  std::map<int, std::vector<std::pair<std::int32_t, std::int32_t>>> by_part;  // vertex, row of its copy
  Eigen::Index count = vertices;
  for (const auto& [of, row] : rows) {
    by_part[of.second].emplace_back(of.first, row);
    count = std::max(count, Eigen::Index{row} + 1);
  }
  tissue.V.conservativeResize(count, 3);
  tissue.barycentric.conservativeResize(count, 4);
  tissue.tet.resize(static_cast<std::size_t>(count));
  for (const auto& [part, copies] : by_part) {
    Points points(static_cast<Eigen::Index>(copies.size()), 3);
    for (std::size_t i = 0; i < copies.size(); ++i)
      points.row(static_cast<Eigen::Index>(i)) = tissue.V.row(copies[i].first).cast<double>();
    const PartedTets::Bound bound = tets.bind(part, points, context);
    for (std::size_t i = 0; i < copies.size(); ++i) {
      const auto [vertex, copy] = copies[i];
      tissue.V.row(copy) = tissue.V.row(vertex);
      tissue.tet[static_cast<std::size_t>(copy)] = bound.tet[i];
      tissue.barycentric.row(copy) = bound.barycentric.row(static_cast<Eigen::Index>(i));
    }
  }
}

// Edges that two triangles shared before, and share no more. `taken`: the side of each triangle; `copied`: of
// the vertices before.
std::vector<Seam> seams_of(const Triangles& before, const Triangles& F, const std::vector<int>& taken,
                           const std::vector<std::uint8_t>& copied) {
  std::vector<Seam> seams;
  const auto add = [&](std::int32_t f, const std::array<std::int32_t, 2>& at) {
    const int part = taken[static_cast<std::size_t>(f)];
    auto seam = std::find_if(seams.begin(), seams.end(), [&](const Seam& s) { return s.part == part; });
    if (seam == seams.end()) seam = seams.insert(seams.end(), Seam{part, {}});
    for (int c = 0; c < 3; ++c) {
      const int d = (c + 1) % 3;
      if (std::minmax(before(f, c), before(f, d)) == std::minmax(at[0], at[1]))
        seam->edges.push_back({F(f, c), F(f, d)});
    }
  };
  const auto is_parted = [&](const Edge& edge) {
    for (int c = 0; c < 3; ++c) {
      const std::int32_t v = before(edge.face[0], c), now = F(edge.face[0], c);
      const bool on_edge = v == edge.at[0] || v == edge.at[1];
      if (on_edge && (F.row(edge.face[1]).array() != now).all()) return true;
    }
    return false;
  };
  const auto is_copied = [&](std::int32_t v) { return copied[static_cast<std::size_t>(v)] != 0; };
  for (const Edge& edge : edges_about(before, is_copied)) {
    if (edge.face[0] < 0 || edge.face[1] < 0 || !is_parted(edge)) continue;
    add(edge.face[0], edge.at);
    add(edge.face[1], edge.at);
  }
  return seams;
}

}  // namespace

std::vector<Seam> part_surface(Tissue& tissue, const PartedTets& tets, const Context& context) {
  if (tissue.segment != Tissue::by_tets || tissue.F.rows() == 0) return {};
  Sides sides(tissue, tets);
  if (!sides.any_crosses()) return {};
  sides.straighten();
  const std::vector<int>& side = sides.sides();

  // Each triangle takes the side of most of its vertices; those that another side carries there are copied.
  const Eigen::Index vertices = tissue.V.rows();
  std::map<Copy, std::int32_t> copies;  // a provisional row, from `vertices` on
  const auto corner = [&](std::int32_t v, int part) {
    const int own = tets.part_of(tissue.tet[static_cast<std::size_t>(v)]);
    if (own == part || !tets.are_cut(own, part, tissue.V.row(v).cast<double>().transpose())) return v;
    const auto next = static_cast<std::int32_t>(vertices) + static_cast<std::int32_t>(copies.size());
    return copies.try_emplace({v, part}, next).first->second;
  };
  std::vector<int> taken(static_cast<std::size_t>(tissue.F.rows()));
  Triangles F = tissue.F;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    std::array<int, 3> s{};
    for (int c = 0; c < 3; ++c) s[static_cast<std::size_t>(c)] = side[static_cast<std::size_t>(F(f, c))];
    const int part = s[1] == s[2] ? s[1] : s[0];
    taken[static_cast<std::size_t>(f)] = part;
    for (int c = 0; c < 3; ++c) F(f, c) = corner(F(f, c), part);
  }
  if (copies.empty()) return {};

  const std::map<Copy, std::int32_t> rows = rows_of(copies, F, vertices);
  bind_copies(tissue, tets, rows, vertices, context);
  std::vector<std::uint8_t> copied(static_cast<std::size_t>(vertices), 0);
  for (const auto& [of, row] : rows) copied[static_cast<std::size_t>(of.first)] = 1;
  std::swap(tissue.F, F);
  return seams_of(F, tissue.F, taken, copied);
}

}  // namespace ecorche::parting
