// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/part_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

#include "preprocess/parting/surface_sides.hpp"

namespace ecorche::parting {
namespace {

using Eigen::Vector3d;
using Corners = std::array<std::int32_t, 3>;

// Splits triangles along the border between sides.
class Splitter {
 public:
  Splitter(const Tissue& tissue, const PartedTets& tets, const SurfaceSides& sides)
      : tissue_(tissue), tets_(tets), sides_(sides), next_(static_cast<std::int32_t>(tissue.V.rows())) {
    for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
      if (!is_cut(f)) continue;
      for (int c = 0; c < 3; ++c) {
        const std::int32_t a = tissue.F(f, c), b = tissue.F(f, (c + 1) % 3);
        if (side(a) != side(b)) cross(a, b);
      }
    }
    for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) split(f);
  }

  bool changes() const { return !crossings_.empty(); }
  const std::vector<NewVertex>& added() const { return added_; }
  const std::vector<CutRim>& cuts() const { return cuts_; }
  Triangles triangles() const {
    Triangles F(static_cast<Eigen::Index>(triangles_.size()), 3);
    for (std::size_t f = 0; f < triangles_.size(); ++f)
      F.row(static_cast<Eigen::Index>(f)) << triangles_[f][0], triangles_[f][1], triangles_[f][2];
    return F;
  }

 private:
  // Where the border crosses an edge: a vertex for each side, or one for both where they hang together.
  struct Crossing {
    std::map<int, std::int32_t> of;  // side to vertex
  };

  int side(std::int32_t v) const { return sides_.side(v); }
  Vector3d at(std::int32_t v) const { return tissue_.V.row(v).cast<double>().transpose(); }
  Vector3d between(std::int32_t a, std::int32_t b) const {
    return at(a) + sides_.crossing(a, b) * (at(b) - at(a));
  }
  bool is_cut(std::int32_t a, std::int32_t b) const {
    return side(a) != side(b) && tets_.are_cut(side(a), side(b), between(a, b));
  }
  bool is_cut(Eigen::Index f) const {
    const std::int32_t a = tissue_.F(f, 0), b = tissue_.F(f, 1), c = tissue_.F(f, 2);
    if (side(a) == side(b) && side(b) == side(c)) return false;
    return is_cut(a, b) || is_cut(b, c) || is_cut(c, a);
  }

  std::int32_t add(const Vector3d& at, int part) {
    added_.push_back({at, part});
    return next_++;
  }
  void cross(std::int32_t a, std::int32_t b) {
    if (a > b) std::swap(a, b);
    const auto [entry, fresh] = crossings_.try_emplace({a, b});
    if (!fresh) return;
    const Vector3d on = between(a, b);
    std::map<int, std::int32_t>& of = entry->second.of;
    of[side(a)] = add(on, side(a));
    of[side(b)] = tets_.are_cut(side(a), side(b), on) ? add(on, side(b)) : of[side(a)];
  }
  const Crossing* crossing(std::int32_t a, std::int32_t b) const {
    const auto found = crossings_.find({std::min(a, b), std::max(a, b)});
    return found == crossings_.end() ? nullptr : &found->second;
  }

  void emit(std::int32_t a, std::int32_t b, std::int32_t c) { triangles_.push_back({a, b, c}); }
  void border(int part, std::int32_t from, std::int32_t to) {
    auto cut = std::find_if(cuts_.begin(), cuts_.end(), [&](const CutRim& s) { return s.part == part; });
    if (cut == cuts_.end()) cut = cuts_.insert(cuts_.end(), CutRim{part, {}});
    cut->edges.push_back({from, to});
  }

  void split(Eigen::Index f) {
    const Corners v{tissue_.F(f, 0), tissue_.F(f, 1), tissue_.F(f, 2)};
    std::array<const Crossing*, 3> on{};  // the edge from corner c to the next
    int crossed = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      on[c] = crossing(v[c], v[(c + 1) % 3]);
      crossed += on[c] != nullptr ? 1 : 0;
    }
    if (crossed == 0) return emit(v[0], v[1], v[2]);
    if (crossed == 3) return split_in_three(v, on);
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t d = (c + 1) % 3, e = (c + 2) % 3;
      if (crossed == 1 && on[c] != nullptr) return split_at(v[c], v[d], v[e], *on[c]);
      // The border runs about corner c.
      if (crossed == 2 && on[c] != nullptr && on[e] != nullptr)
        return split_about(v[c], v[d], v[e], *on[c], *on[e]);
    }
  }
  // One edge has a vertex, which both sides share: here the border ends.
  void split_at(std::int32_t a, std::int32_t b, std::int32_t c, const Crossing& ab) {
    emit(a, ab.of.at(side(a)), c);
    emit(ab.of.at(side(b)), b, c);
  }
  void split_about(std::int32_t a, std::int32_t b, std::int32_t c, const Crossing& ab, const Crossing& ca) {
    const std::int32_t near_b = ab.of.at(side(a)), near_c = ca.of.at(side(a));
    const std::int32_t far_b = ab.of.at(side(b)), far_c = ca.of.at(side(c));
    emit(a, near_b, near_c);
    emit(far_b, b, far_c);
    emit(b, c, far_c);
    border(side(a), near_b, near_c);
    border(side(b), far_c, far_b);
  }
  // Three sides meet.
  void split_in_three(const Corners& v, const std::array<const Crossing*, 3>& on) {
    const Vector3d middle = (at(v[0]) + at(v[1]) + at(v[2])) / 3;
    for (std::size_t c = 0; c < 3; ++c) {
      const int part = side(v[c]);
      const std::int32_t before = on[(c + 2) % 3]->of.at(part), after = on[c]->of.at(part),
                         in = add(middle, part);
      emit(v[c], after, in);
      emit(v[c], in, before);
      border(part, after, in);
      border(part, in, before);
    }
  }

  const Tissue& tissue_;
  const PartedTets& tets_;
  const SurfaceSides& sides_;
  std::int32_t next_;
  std::map<std::pair<std::int32_t, std::int32_t>, Crossing> crossings_;  // of edges, the lower vertex first
  std::vector<NewVertex> added_;
  std::vector<Corners> triangles_;
  std::vector<CutRim> cuts_;
};

// Vertices that lie in a tet of another side than their own.
void bind_anew(Tissue& tissue, const PartedTets& tets, const SurfaceSides& sides, const Context& context) {
  std::map<int, std::vector<std::int32_t>> by_part;
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(tissue.V.rows()); ++v) {
    const int own = tets.part_of(tissue.tet[static_cast<std::size_t>(v)]), part = sides.side(v);
    if (own != part && tets.are_cut(own, part, tissue.V.row(v).cast<double>().transpose()))
      by_part[part].push_back(v);
  }
  for (const auto& [part, rows] : by_part) bind_rows(tissue, rows, part, tets, context);
}

}  // namespace

std::vector<CutRim> part_surface(Tissue& tissue, const PartedTets& tets, const Context& context) {
  if (tissue.segment != Tissue::by_tets || tissue.F.rows() == 0) return {};
  SurfaceSides sides(tissue, tets);
  if (!sides.any_crosses()) return {};
  sides.settle();
  bind_anew(tissue, tets, sides, context);
  const Splitter splitter(tissue, tets, sides);
  if (!splitter.changes()) return {};
  const Triangles F = splitter.triangles();
  append_vertices(tissue, splitter.added(), tets, context);
  tissue.F = F;
  return splitter.cuts();
}

}  // namespace ecorche::parting
