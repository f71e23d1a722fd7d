// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/cut_lattice.hpp"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>
#include <vector>

#include "preprocess/tet/lattice/grade.hpp"
#include "preprocess/tet/lattice/manifold_labels.hpp"
#include "preprocess/tet/lattice/split_tet.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

constexpr double kNearLong = 0.25, kNearShort = 0.41;  // shares of an edge, LabelleShewchuk07's

using Eigen::Vector3d;
using Quad = std::array<std::int32_t, 4>;

class Cutter : public CutPoints, private Quiet {
 public:
  Cutter(const BccLattice& lattice, NodeMaterials materials, const Context& context)
      : lattice_(lattice),
        context_(context),
        material_(std::move(materials.label)),
        held_(std::move(materials.lent)) {
    out_.report.lent = materials.lent_count;
  }

  CutMesh run(const PlaceCuts& place_cuts) {
    choose_tets();
    hold_nodes();
    find_edges();
    place_cuts(edges_, material_);
    find_cuts_at_nodes();
    hold_thin_parts();
    warp_nodes();
    number_points();
    split();
    out_.report.relabelled = make_manifold(quads_, points_.size(), labels_, context_);
    gather();
    return std::move(out_);
  }

  const Vector3d& at(std::int32_t point) const override { return points_[static_cast<std::size_t>(point)]; }
  std::int32_t on_edge(std::int32_t a, std::int32_t b) const override {
    LatticeEdge edge{node_of_[static_cast<std::size_t>(std::min(a, b))],
                     node_of_[static_cast<std::size_t>(std::max(a, b))]};
    if (edge.a > edge.b) std::swap(edge.a, edge.b);
    return std::lower_bound(edges_.begin(), edges_.end(), edge)->point;
  }
  std::int32_t on_face(std::int32_t a, std::int32_t b, std::int32_t c) override {
    std::array<std::int32_t, 3> face{a, b, c};
    std::sort(face.begin(), face.end());
    const auto [entry, fresh] = faces_.try_emplace(face, 0);
    if (fresh)
      entry->second = add(
          (at(on_edge(face[0], face[1])) + at(on_edge(face[1], face[2])) + at(on_edge(face[0], face[2]))) /
          3);
    return entry->second;
  }
  std::int32_t add(const Vector3d& p) override {
    points_.push_back(p);
    return static_cast<std::int32_t>(points_.size() - 1);
  }

 private:
  bool quiet(std::int64_t node) const override {
    const auto n = static_cast<std::size_t>(node);
    return number_[n] >= 0 && busy_[n] == 0;
  }
  std::uint16_t material(std::int64_t node) const override {
    return material_[static_cast<std::size_t>(node)];
  }
  bool is_long(const LatticeEdge& e) const { return lattice_.is_centre(e.a) == lattice_.is_centre(e.b); }
  double nearest_share(const LatticeEdge& e) const { return is_long(e) ? kNearLong : kNearShort; }

  /// Calls `visit(slot, nodes)` for all slots of the lattice.
  template <class Visit>
  void each_slot(const Visit& visit) const {
    const auto& n = lattice_.cubes();
    for (std::int32_t k = 1; k < n[2]; ++k) {
      context_.check_stop();
      for (std::int32_t j = 1; j < n[1]; ++j)
        for (std::int32_t i = 1; i < n[0]; ++i) {
          const std::int64_t first = BccLattice::slots_per_cube * lattice_.cube({i, j, k});
          if (!near_.empty() && !near_cube(i, j, k)) continue;
          for (std::int64_t s = first; s < first + BccLattice::slots_per_cube; ++s) visit(lattice_.nodes(s));
        }
    }
  }
  bool near_cube(std::int32_t i, std::int32_t j, std::int32_t k) const {
    return near_[static_cast<std::size_t>(lattice_.cube({i, j, k}))] != 0;
  }

  /// All tets near the body: two rings about it, so that what is outside is known around every node of it.
  void choose_tets() {
    const auto& n = lattice_.cubes();
    std::vector<std::uint8_t> bodily(static_cast<std::size_t>(lattice_.cube_count()), 0);
    for (std::int64_t node = 0; node < lattice_.node_count(); ++node) {
      if (material(node) == voxel::outside) continue;
      const BccLattice::Cell c = lattice_.node_cell(node);
      bodily[static_cast<std::size_t>(lattice_.cube(c))] = 1;
    }
    near_.assign(bodily.size(), 0);
    constexpr std::int32_t kReach = 2;
    for (std::int32_t k = kReach; k < n[2] - kReach; ++k)
      for (std::int32_t j = kReach; j < n[1] - kReach; ++j)
        for (std::int32_t i = kReach; i < n[0] - kReach; ++i) {
          if (bodily[static_cast<std::size_t>(lattice_.cube({i, j, k}))] == 0) continue;
          for (std::int32_t z = k - kReach; z <= k + kReach; ++z)
            for (std::int32_t y = j - kReach; y <= j + kReach; ++y) {
              const auto row = static_cast<std::size_t>(lattice_.cube({i - kReach, y, z}));
              std::fill_n(near_.begin() + static_cast<std::ptrdiff_t>(row), 2 * kReach + 1, std::uint8_t{1});
            }
        }
  }

  /// Nodes whose tets see three materials or more.
  void hold_nodes() {
    constexpr std::uint16_t none = 0xffff;
    std::vector<std::uint16_t> other(material_.size(), none);
    each_slot([&](const std::array<std::int64_t, 4>& nodes) {
      for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t d = 0; d < 4; ++d) {
          const auto node = static_cast<std::size_t>(nodes[c]);
          const std::uint16_t seen = material(nodes[d]);
          if (seen == material_[node]) continue;
          if (other[node] == none) other[node] = seen;
          if (other[node] != seen) held_[node] = 1;
        }
    });
  }

  void find_edges() {
    each_slot([&](const std::array<std::int64_t, 4>& nodes) {
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t d = c + 1; d < 4; ++d)
          if (material(nodes[c]) != material(nodes[d]))
            edges_.push_back({std::min(nodes[c], nodes[d]), std::max(nodes[c], nodes[d])});
    });
    tbb::parallel_sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    edges_.shrink_to_fit();
  }

  void find_cuts_at_nodes() {
    first_.assign(material_.size() + 1, 0);
    for (const LatticeEdge& e : edges_)
      for (const std::int64_t node : {e.a, e.b}) ++first_[static_cast<std::size_t>(node) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    edges_at_.resize(first_.back());
    for (std::size_t n = 0; n < edges_.size(); ++n)
      for (const std::int64_t node : {edges_[n].a, edges_[n].b})
        edges_at_[next[static_cast<std::size_t>(node)]++] = n;
  }

  /// The cut of an edge as seen from one of its ends, where it is so near that the end should move to it.
  struct Near {
    const LatticeEdge* edge;
    std::int64_t other;
    double away;  // cubes
  };
  void look_from(std::size_t node, std::vector<Near>& near) const {
    near.clear();
    for (std::size_t n = first_[node]; n < first_[node + 1]; ++n) {
      const LatticeEdge& e = edges_[edges_at_[n]];
      const bool from_a = e.a == static_cast<std::int64_t>(node);
      const double share = from_a ? e.share : 1 - e.share;
      if (share < nearest_share(e))
        near.push_back({&e, from_a ? e.b : e.a, share * (is_long(e) ? 1.0 : std::sqrt(0.75))});
    }
  }

  /// A node with such cuts on both sides of it is the middle of a thin part, which would be lost if it moved.
  void hold_thin_parts() {
    std::vector<Near> near;
    for (std::size_t node = 0; node < material_.size(); ++node) {
      if (held_[node] != 0 || first_[node] == first_[node + 1]) continue;
      look_from(node, near);
      const Vector3d twice = 2 * lattice_.position(static_cast<std::int64_t>(node));
      for (std::size_t x = 1; x < near.size() && held_[node] == 0; ++x)
        for (std::size_t y = 0; y < x; ++y)
          if ((lattice_.position(near[x].other) + lattice_.position(near[y].other) - twice).norm() <
              1e-6 * lattice_.side())
            held_[node] = 1;
    }
  }

  void warp_nodes() {
    warped_.assign(material_.size(), 0);
    std::vector<Near> near;
    for (std::size_t node = 0; node < material_.size(); ++node) {
      if (held_[node] != 0 || first_[node] == first_[node + 1]) continue;
      look_from(node, near);
      const Near* nearest = nullptr;
      for (const Near& each : near)
        if (!is_warped(each.other) && (nearest == nullptr || each.away < nearest->away)) nearest = &each;
      if (nearest == nullptr) continue;
      warped_[node] = 1;
      ++out_.report.warped;
      moved_.emplace(static_cast<std::int64_t>(node), place_of(*nearest->edge));
    }
  }

  Vector3d place_of(const LatticeEdge& e) const {
    return (1 - e.share) * lattice_.position(e.a) + e.share * lattice_.position(e.b);
  }
  bool is_warped(std::int64_t node) const { return warped_[static_cast<std::size_t>(node)] != 0; }

  void number_points() {
    number_.assign(material_.size(), -1);
    each_slot([&](const std::array<std::int64_t, 4>& nodes) {
      for (const std::int64_t node : nodes) {
        std::int32_t& number = number_[static_cast<std::size_t>(node)];
        if (number >= 0) continue;
        number = add(is_warped(node) ? moved_.at(node) : lattice_.position(node));
        node_of_.push_back(node);
      }
    });
    for (LatticeEdge& e : edges_) {
      if (is_warped(e.a) || is_warped(e.b)) continue;
      const double least = nearest_share(e);
      const double low = held_[static_cast<std::size_t>(e.a)] != 0 ? least : 0;
      const double high = held_[static_cast<std::size_t>(e.b)] != 0 ? 1 - least : 1;
      e.share = std::clamp(e.share, low, high);
      e.point = add(place_of(e));
      ++out_.report.cut;
    }
  }

  double volume(const Quad& q) const {
    return std::abs((at(q[1]) - at(q[0])).cross(at(q[2]) - at(q[0])).dot(at(q[3]) - at(q[0])));
  }

  bool is_near(const std::array<std::int64_t, 4>& nodes) const {
    return std::all_of(nodes.begin(), nodes.end(),
                       [&](std::int64_t node) { return number_[static_cast<std::size_t>(node)] >= 0; });
  }
  /// Of one material, and with no node moved.
  bool is_plain(const std::array<std::int64_t, 4>& nodes) const {
    return std::all_of(nodes.begin(), nodes.end(), [&](std::int64_t node) {
      return material(node) == material(nodes[0]) && !is_warped(node);
    });
  }

  void fill(const std::array<std::int64_t, 4>& nodes) {
    Quad quad{};
    for (std::size_t c = 0; c < 4; ++c) quad[c] = number_[static_cast<std::size_t>(nodes[c])];
    if ((at(quad[1]) - at(quad[0])).cross(at(quad[2]) - at(quad[0])).dot(at(quad[3]) - at(quad[0])) < 0)
      std::swap(quad[2], quad[3]);
    quads_.push_back(quad);
    labels_.push_back(material(nodes[0]));
  }

  void split() {
    busy_.assign(material_.size(), 0);
    each_slot([&](const std::array<std::int64_t, 4>& nodes) {
      if (is_plain(nodes) && material(nodes[0]) != voxel::outside) return;
      for (const std::int64_t node : nodes) busy_[static_cast<std::size_t>(node)] = 1;
    });
    const Graded graded = grade(lattice_, *this);
    for (const LatticeTet& nodes : graded.large) fill(nodes);
    out_.report.large = static_cast<std::int64_t>(graded.large.size());
    for (const LatticeTet& nodes : graded.fine) {
      if (!is_near(nodes)) continue;
      if (is_plain(nodes))
        fill(nodes);
      else
        split_mixed(nodes);
    }
  }

  void split_mixed(const std::array<std::int64_t, 4>& nodes) {
    MixedTet tet{};
    std::array<std::uint16_t, 4> own{};
    for (std::size_t c = 0; c < 4; ++c) {
      tet.node[c] = number_[static_cast<std::size_t>(nodes[c])];
      own[c] = material(nodes[c]);
      tet.material[c] = is_warped(nodes[c]) ? MixedTet::at_interface : own[c];
    }
    std::array<std::uint16_t, 4> sorted = own;
    std::sort(sorted.begin(), sorted.end());
    const std::uint16_t most = sorted[2];  // for a tet whose nodes all moved to the interface
    if (std::unique(sorted.begin(), sorted.end()) - sorted.begin() > 2) ++out_.report.stars;
    pieces_.clear();
    split_tet(tet, most, *this, pieces_);
    double misfit = -volume(tet.node);
    for (const Piece& piece : pieces_) misfit += volume(piece.node);
    out_.report.largest_misfit = std::max(out_.report.largest_misfit, std::abs(misfit) / volume(tet.node));
    for (const Piece& piece : pieces_) {
      quads_.push_back(piece.node);
      labels_.push_back(piece.material);
    }
  }

  void gather() {
    TetMesh& mesh = out_.mesh;
    const auto count =
        labels_.size() - static_cast<std::size_t>(std::count(labels_.begin(), labels_.end(), voxel::outside));
    mesh.T.resize(static_cast<Eigen::Index>(count), 4);
    mesh.label.reserve(count);
    std::vector<std::int32_t> renamed(points_.size(), -1);
    std::vector<std::int32_t> used;
    Eigen::Index row = 0;
    for (std::size_t t = 0; t < quads_.size(); ++t) {
      if (labels_[t] == voxel::outside) continue;
      for (std::size_t c = 0; c < 4; ++c) {
        std::int32_t& name = renamed[static_cast<std::size_t>(quads_[t][c])];
        if (name < 0) {
          name = static_cast<std::int32_t>(used.size());
          used.push_back(quads_[t][c]);
        }
        mesh.T(row, static_cast<Eigen::Index>(c)) = name;
      }
      mesh.label.push_back(static_cast<std::uint16_t>(labels_[t] - voxel::soft));
      ++row;
    }
    mesh.V.resize(static_cast<Eigen::Index>(used.size()), 3);
    for (std::size_t n = 0; n < used.size(); ++n)
      mesh.V.row(static_cast<Eigen::Index>(n)) = at(used[n]).transpose();
  }

  const BccLattice& lattice_;
  const Context& context_;
  std::vector<std::uint16_t> material_;  // per lattice node
  std::vector<std::uint8_t> held_, warped_;
  std::vector<std::uint8_t> near_;             // per cube
  std::vector<LatticeEdge> edges_;             // sorted
  std::vector<std::size_t> first_, edges_at_;  // of edges_, by node
  std::unordered_map<std::int64_t, Vector3d> moved_;
  std::vector<std::int32_t> number_;   // of a lattice node in points_
  std::vector<std::int64_t> node_of_;  // of the first points
  std::vector<Vector3d> points_;
  std::map<std::array<std::int32_t, 3>, std::int32_t> faces_;
  std::vector<std::uint8_t> busy_;  // per node: at a tet that is cut, moved, of several materials or outside
  std::vector<Piece> pieces_;       // of the tet at hand
  std::vector<Quad> quads_;
  std::vector<std::uint16_t> labels_;
  CutMesh out_;
};

}  // namespace

CutMesh cut_lattice(const BccLattice& lattice, NodeMaterials materials, const PlaceCuts& place_cuts,
                    const Context& context) {
  return Cutter(lattice, std::move(materials), context).run(place_cuts);
}

CutMesh cut_lattice(const BccLattice& lattice, const Input& input, const Context& context) {
  const LatticeSurfaces surfaces(input.patient, input.labels, lattice, context);
  return cut_lattice(
      lattice, node_materials(surfaces, input.labels, lattice, context),
      [&](std::vector<LatticeEdge>& edges, const std::vector<std::uint16_t>& materials) {
        place_on_surfaces(edges, materials, surfaces, context);
      },
      context);
}

}  // namespace ecorche::tet
