// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <algorithm>
#include <deque>
#include <map>
#include <set>
#include <utility>

#include "core/geometry/nearest_point.hpp"
#include "preprocess/parting/fill_gaps.hpp"
#include "preprocess/parting/part_surface.hpp"

namespace ecorche::parting {
namespace {

using Eigen::Vector3d;
using Corners = std::array<std::int32_t, 3>;

constexpr float kSolid = 0.5F;  // of a face that closes the skin
constexpr double kSnap = 1.5;   // cubes from a cap's border to the rim
constexpr int kSmoothings = 10;
constexpr std::size_t kDetour = 24;  // edges of a rim along one of a cap

// A cut as a surface: corners are nodes of the mesh before it was cut.
class Sheet {
 public:
  explicit Sheet(const PartedTets& tets) : tets_(tets) {
    for (const OpenFace& face : tets.parting().faces) {
      if (face.solid < kSolid) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::int32_t a = place(face.inner[c]), b = place(face.inner[(c + 1) % 3]);
        beside_[a].insert(b);
        beside_[b].insert(a);
        ++faces_at_[{std::min(a, b), std::max(a, b)}];
        if (face.inner[c] != face.outer[c]) parted_.insert(a);
      }
    }
    for (const auto& [node, others] : beside_) at_[node] = tets.parting().V.row(node).transpose();
    for (const auto& [edge, faces] : faces_at_) {
      if (faces == 1) border_.insert({edge.first, edge.second});
    }
  }

  std::int32_t place(std::int32_t node) const {
    const Parting& parting = tets_.parting();
    const auto before =
        static_cast<std::int32_t>(parting.V.rows() - static_cast<Eigen::Index>(parting.copied.size()));
    return node < before ? node : parting.copied[static_cast<std::size_t>(node - before)];
  }
  const Vector3d& at(std::int32_t place) const { return at_.at(place); }
  bool is_border(std::int32_t a, std::int32_t b) const { return border_.count(std::minmax(a, b)) != 0; }

  // Towards the rim where it is near, before the inside is smoothed.
  void snap(const Points& rim) {
    if (rim.rows() == 0) return;
    std::vector<std::int32_t> all(static_cast<std::size_t>(rim.rows()));
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::int32_t>(i);
    const geometry::NearestPoint nearest(rim, all);
    const double most = kSnap * tets_.cube_mm();
    for (const auto& [a, b] : border_) {
      for (const std::int32_t node : {a, b}) {
        if (parted_.count(node) == 0 || snapped_.count(node) != 0) continue;
        double distance2 = 0;
        const std::int32_t row = nearest.find(at_[node], distance2);
        if (distance2 > most * most) continue;
        snapped_[node] = row;
      }
    }
    for (const auto& [node, row] : snapped_) at_[node] = rim.row(row).transpose();
  }
  /// The row of the rim that a border's node was snapped to, or -1.
  std::int32_t snapped(std::int32_t place) const {
    const auto found = snapped_.find(place);
    return found == snapped_.end() ? -1 : found->second;
  }

  void smooth() {
    std::set<std::int32_t> fixed;
    for (const auto& [a, b] : border_) fixed.insert({a, b});
    for (int pass = 0; pass < kSmoothings; ++pass) {
      std::map<std::int32_t, Vector3d> next = at_;
      for (const auto& [node, others] : beside_) {
        if (fixed.count(node) != 0) continue;
        Vector3d sum = Vector3d::Zero();
        for (const std::int32_t other : others) sum += at_[other];
        next[node] = sum / static_cast<double>(others.size());
      }
      at_ = std::move(next);
    }
  }

 private:
  const PartedTets& tets_;
  std::map<std::int32_t, std::set<std::int32_t>> beside_;
  std::map<std::pair<std::int32_t, std::int32_t>, int> faces_at_;
  std::set<std::pair<std::int32_t, std::int32_t>> border_;
  std::set<std::int32_t> parted_;  // nodes that are two now: all but those where the cut ends in the flesh
  std::map<std::int32_t, Vector3d> at_;
  std::map<std::int32_t, std::int32_t> snapped_;
};

// The vertices along a rim from one to another, without the first; empty where that leads too far about.
class RimWalk {
 public:
  explicit RimWalk(const CutRim& cut) {
    for (const auto& [a, b] : cut.edges) {
      beside_[a].insert(b);
      beside_[b].insert(a);
    }
  }
  std::vector<std::int32_t> way(std::int32_t from, std::int32_t to) const {
    std::map<std::int32_t, std::pair<std::int32_t, std::size_t>> came{{from, {from, 0}}};
    std::deque<std::int32_t> open{from};
    while (!open.empty() && came.count(to) == 0) {
      const std::int32_t v = open.front();
      open.pop_front();
      const std::size_t steps = came[v].second + 1;
      const auto others = beside_.find(v);
      if (others == beside_.end() || steps > kDetour) continue;
      for (const std::int32_t other : others->second) {
        if (came.try_emplace(other, v, steps).second) open.push_back(other);
      }
    }
    std::vector<std::int32_t> out;
    if (came.count(to) == 0) return out;
    for (std::int32_t v = to; v != from; v = came[v].first) out.push_back(v);
    std::reverse(out.begin(), out.end());
    return out;
  }

 private:
  std::map<std::int32_t, std::set<std::int32_t>> beside_;
};

// The vertices of a cut, and those that lie at the same place.
class RimVertices {
 public:
  RimVertices(const Tissue& skin, const std::vector<CutRim>& cuts) {
    for (const CutRim& cut : cuts) {
      for (const auto& edge : cut.edges) {
        for (const std::int32_t v : edge) rows_[key(skin, v)][cut.part] = v;
      }
    }
    points_.resize(static_cast<Eigen::Index>(rows_.size()), 3);
    Eigen::Index row = 0;
    for (const auto& [place, sides] : rows_) {
      points_.row(row++) << place[0], place[1], place[2];
      sides_.push_back(&sides);
    }
  }
  const Points& points() const { return points_; }
  /// The skin's vertex there on that side, or -1.
  std::int32_t vertex(std::int32_t row, int part) const {
    const auto& sides = *sides_[static_cast<std::size_t>(row)];
    const auto found = sides.find(part);
    return found == sides.end() ? -1 : found->second;
  }

 private:
  static std::array<float, 3> key(const Tissue& skin, std::int32_t v) {
    return {skin.V(v, 0), skin.V(v, 1), skin.V(v, 2)};
  }

  std::map<std::array<float, 3>, std::map<int, std::int32_t>> rows_;
  std::vector<const std::map<int, std::int32_t>*> sides_;
  Points points_;
};

// Vertices from `first` on that no triangle has.
void drop_unused(Tissue& skin, std::int32_t first) {
  std::vector<std::int32_t> row(static_cast<std::size_t>(skin.V.rows() - first), -1);
  for (const std::int32_t v : skin.F.reshaped()) {
    if (v >= first) row[static_cast<std::size_t>(v - first)] = 0;
  }
  std::int32_t next = first;
  for (std::int32_t v = first; v < static_cast<std::int32_t>(skin.V.rows()); ++v) {
    std::int32_t& to = row[static_cast<std::size_t>(v - first)];
    if (to < 0) continue;
    to = next++;
    skin.V.row(to) = skin.V.row(v).eval();
    skin.barycentric.row(to) = skin.barycentric.row(v).eval();
    skin.tet[static_cast<std::size_t>(to)] = skin.tet[static_cast<std::size_t>(v)];
  }
  skin.V.conservativeResize(next, 3);
  skin.barycentric.conservativeResize(next, 4);
  skin.tet.resize(static_cast<std::size_t>(next));
  for (std::int32_t& v : skin.F.reshaped()) {
    if (v >= first) v = row[static_cast<std::size_t>(v - first)];
  }
}

}  // namespace

void close_cuts(Tissue& skin, const std::vector<CutRim>& cuts, Eigen::Index given, const PartedTets& tets,
                const Context& context) {
  if (cuts.empty()) return;
  const Parting& parting = tets.parting();
  const RimVertices rim(skin, cuts);
  Sheet sheet(tets);
  sheet.snap(rim.points());
  sheet.smooth();

  const auto first = static_cast<std::int32_t>(skin.V.rows());
  std::vector<NewVertex> added;
  std::map<std::int32_t, std::int32_t> row_of;  // of a node of the cut mesh, on its own side
  const auto corner = [&](std::int32_t node, int part) {
    const std::int32_t place = sheet.place(node);
    if (const std::int32_t row = sheet.snapped(place); row >= 0) {
      if (const std::int32_t v = rim.vertex(row, part); v >= 0) return v;
    }
    const auto [entry, fresh] = row_of.try_emplace(node, first + static_cast<std::int32_t>(added.size()));
    if (fresh) added.push_back({sheet.at(place), part});
    return entry->second;
  };
  std::map<int, RimWalk> walks;
  for (const CutRim& cut : cuts) walks.emplace(cut.part, RimWalk(cut));
  std::vector<Corners> triangles;
  const auto close = [&](const Corners& nodes, int part) {
    Corners v{};
    for (std::size_t c = 0; c < 3; ++c) v[c] = corner(nodes[c], part);
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) return;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t d = (c + 1) % 3, e = (c + 2) % 3;
      const bool on_rim =
          sheet.is_border(sheet.place(nodes[c]), sheet.place(nodes[d])) && v[c] < first && v[d] < first;
      if (!on_rim || walks.count(part) == 0) continue;
      // The corner across fans out over the cut.
      std::int32_t from = v[c];
      const std::vector<std::int32_t> way = walks.at(part).way(v[c], v[d]);
      if (way.size() < 2 || std::find(way.begin(), way.end(), v[e]) != way.end()) continue;
      for (const std::int32_t to : way) {
        triangles.push_back({from, to, v[e]});
        from = to;
      }
      return;
    }
    triangles.push_back(v);
  };
  for (const OpenFace& face : parting.faces) {
    if (face.solid < kSolid) continue;
    const Contact& contact = parting.contacts[static_cast<std::size_t>(face.contact)];
    close(face.inner, contact.limb);
    close({face.outer[0], face.outer[2], face.outer[1]}, contact.other_limb);
  }

  append_vertices(skin, added, tets, context);
  const Eigen::Index before = skin.F.rows();
  skin.F.conservativeResize(before + static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    skin.F.row(before + static_cast<Eigen::Index>(f)) << triangles[f][0], triangles[f][1], triangles[f][2];
  }
  std::set<std::int32_t> rim_vertices;
  for (const CutRim& cut : cuts) {
    for (const auto& edge : cut.edges) rim_vertices.insert({edge[0], edge[1]});
  }
  for (std::int32_t v = first; v < static_cast<std::int32_t>(skin.V.rows()); ++v) rim_vertices.insert(v);
  fill_gaps(skin, rim_vertices, given, tets, context);
  drop_unused(skin, static_cast<std::int32_t>(given));
}

}  // namespace ecorche::parting
