// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/split_tet.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/geometry/dihedral.hpp"

namespace ecorche::tet {
namespace {

using Id = std::int32_t;
using Triangle = std::array<Id, 3>;

class Splitter {
 public:
  Splitter(CutPoints& points, std::vector<Piece>& pieces) : points_(points), pieces_(pieces) {}

  /// One material, perhaps with interface nodes.
  void whole(const std::array<Id, 4>& n, std::uint16_t material) { emit(n[0], n[1], n[2], n[3], material); }

  /// Nodes `a` of one material, `b` of another, `z` of both.
  void two(const std::vector<Id>& a, const std::vector<Id>& b, const std::vector<Id>& z, std::uint16_t of_a,
           std::uint16_t of_b) {
    if (a.size() < b.size()) return two(b, a, z, of_b, of_a);
    const auto cut = [&](std::size_t i, std::size_t j) { return points_.on_edge(a[i], b[j]); };
    if (a.size() == 1) {  // 1 + 1
      emit(a[0], cut(0, 0), z[0], z[1], of_a);
      emit(b[0], cut(0, 0), z[0], z[1], of_b);
    } else if (b.size() == 2) {  // 2 + 2
      two_and_two(a, b, of_a, of_b);
    } else if (a.size() == 2) {  // 2 + 1
      emit(b[0], cut(0, 0), cut(1, 0), z[0], of_b);
      for (const Triangle& t : quad(a[0], a[1], cut(0, 0), cut(1, 0))) emit(t[0], t[1], t[2], z[0], of_a);
    } else {  // 3 + 1
      const Triangle top{cut(0, 0), cut(1, 0), cut(2, 0)};
      emit(b[0], top[0], top[1], top[2], of_b);
      const Triangle base{a[0], a[1], a[2]};
      prism(base, top, {upward(base, top, 0), upward(base, top, 1), upward(base, top, 2)}, of_a);
    }
  }

  /// Three or four materials, no interface nodes.
  void star(const MixedTet& tet) {
    std::vector<std::pair<Triangle, std::uint16_t>> faces;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int meetings = 0;
    for (std::size_t skipped = 0; skipped < 4; ++skipped) {
      const std::size_t f[3] = {(skipped + 1) % 4, (skipped + 2) % 4, (skipped + 3) % 4};
      const auto material = [&](std::size_t c) { return tet.material[f[c % 3]]; };
      const auto node = [&](std::size_t c) { return tet.node[f[c % 3]]; };
      if (material(0) == material(1) && material(1) == material(2)) {
        faces.push_back({{node(0), node(1), node(2)}, material(0)});
        continue;
      }
      if (material(0) != material(1) && material(1) != material(2) && material(0) != material(2)) {
        const Id middle = points_.on_face(node(0), node(1), node(2));
        sum += points_.at(middle);
        ++meetings;
        for (std::size_t c = 0; c < 3; ++c) {
          faces.push_back({{node(c), points_.on_edge(node(c), node(c + 1)), middle}, material(c)});
          faces.push_back({{node(c), middle, points_.on_edge(node(c), node(c + 2))}, material(c)});
        }
        continue;
      }
      std::size_t odd = 0;
      while (material(odd + 1) != material(odd + 2)) ++odd;
      const Id c1 = points_.on_edge(node(odd), node(odd + 1)), c2 = points_.on_edge(node(odd), node(odd + 2));
      faces.push_back({{node(odd), c1, c2}, material(odd)});
      for (const Triangle& t : quad(node(odd + 1), node(odd + 2), c1, c2))
        faces.push_back({t, material(odd + 1)});
    }
    const Id centre = points_.add(sum / meetings);
    for (const auto& [t, material] : faces) emit(t[0], t[1], t[2], centre, material);
  }

 private:
  const Eigen::Vector3d& at(Id n) const { return points_.at(n); }

  void emit(Id a, Id b, Id c, Id d, std::uint16_t material) {
    if ((at(b) - at(a)).cross(at(c) - at(a)).dot(at(d) - at(a)) < 0) std::swap(c, d);
    pieces_.push_back({{a, b, c, d}, material});
  }

  /// Whether the quadrilateral a0, a1, b1, b0 is cut from a0 to b1. Depends on the points alone, not on their
  /// order: both tets at a face must agree.
  bool from_first(Id a0, Id a1, Id b0, Id b1) const {
    if (a0 > a1) return !from_first(a1, a0, b1, b0);
    return (at(a0) - at(b1)).squaredNorm() <= (at(a1) - at(b0)).squaredNorm();
  }
  bool upward(const Triangle& base, const Triangle& top, std::size_t side) const {
    const std::size_t next = (side + 1) % 3;
    return from_first(base[side], base[next], top[side], top[next]);
  }

  std::array<Triangle, 2> quad(Id a0, Id a1, Id b0, Id b1) const {
    if (from_first(a0, a1, b0, b1)) return {Triangle{a0, a1, b1}, Triangle{a0, b1, b0}};
    return {Triangle{a0, a1, b0}, Triangle{a1, b1, b0}};
  }

  /// Side s of the prism, from base s and s + 1 to the top, is cut from base[s] where up[s], else from
  /// base[s + 1].
  void prism(const Triangle& base, const Triangle& top, const std::array<bool, 3>& up,
             std::uint16_t material) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      if (!up[i] || up[k]) continue;  // base[i] has the diagonals of both its sides
      emit(base[i], top[i], top[j], top[k], material);
      if (up[j]) {
        emit(base[i], base[j], base[k], top[k], material);
        emit(base[i], base[j], top[k], top[j], material);
      } else {
        emit(base[i], base[j], base[k], top[j], material);
        emit(base[i], base[k], top[k], top[j], material);
      }
      return;
    }
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // the diagonals run round: no tets without another point
    for (std::size_t i = 0; i < 3; ++i) sum += at(base[i]) + at(top[i]);
    const Id centre = points_.add(sum / 6);
    emit(base[0], base[1], base[2], centre, material);
    emit(top[0], top[1], top[2], centre, material);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      if (up[i]) {
        emit(base[i], base[j], top[j], centre, material);
        emit(base[i], top[j], top[i], centre, material);
      } else {
        emit(base[i], base[j], top[i], centre, material);
        emit(base[j], top[j], top[i], centre, material);
      }
    }
  }

  /// Two wedges, of which the quadrilateral between them may be cut either way: the better way.
  void two_and_two(const std::vector<Id>& a, const std::vector<Id>& b, std::uint16_t of_a,
                   std::uint16_t of_b) {
    const auto cut = [&](std::size_t i, std::size_t j) { return points_.on_edge(a[i], b[j]); };
    const Triangle a_base{a[0], cut(0, 0), cut(0, 1)}, a_top{a[1], cut(1, 0), cut(1, 1)};
    const Triangle b_base{b[0], cut(0, 0), cut(1, 0)}, b_top{b[1], cut(0, 1), cut(1, 1)};
    const auto wedges = [&](bool straight) {  // from cut(0, 0) to cut(1, 1), else from cut(0, 1) to cut(1, 0)
      // Face quadrilaterals run along the nodes: their rule is asked with the nodes first.
      const auto side = [&](const Triangle& base, const Triangle& top, std::size_t n) {
        return from_first(base[0], top[0], base[n], top[n]);  // from base[0] to top[n]
      };
      prism(a_base, a_top, {side(a_base, a_top, 1), straight, !side(a_base, a_top, 2)}, of_a);
      prism(b_base, b_top, {side(b_base, b_top, 1), straight, !side(b_base, b_top, 2)}, of_b);
    };
    const std::size_t before = pieces_.size();
    wedges(true);
    const std::size_t middle = pieces_.size();
    wedges(false);
    const bool straight = pieces_.size() - middle != middle - before
                              ? pieces_.size() - middle > middle - before  // fewer: without a further point
                              : sharpest(before, middle) <= sharpest(middle, pieces_.size());
    const auto first = pieces_.begin() + static_cast<std::ptrdiff_t>(straight ? middle : before);
    pieces_.erase(first, straight ? pieces_.end() : pieces_.begin() + static_cast<std::ptrdiff_t>(middle));
  }

  /// The largest cosine of a dihedral angle among pieces.
  double sharpest(std::size_t begin, std::size_t end) const {
    double worst = -1;
    for (std::size_t n = begin; n < end; ++n) {
      const auto& p = pieces_[n].node;
      worst = std::max(worst, geometry::tet_shape({at(p[0]), at(p[1]), at(p[2]), at(p[3])}).greatest_cosine);
    }
    return worst;
  }

  CutPoints& points_;
  std::vector<Piece>& pieces_;
};

}  // namespace

void split_tet(const MixedTet& tet, std::uint16_t flat, CutPoints& points, std::vector<Piece>& pieces) {
  std::vector<std::uint16_t> materials;
  std::vector<Id> a, b, z;
  for (std::size_t c = 0; c < 4; ++c) {
    const std::uint16_t m = tet.material[c];
    if (m == MixedTet::at_interface) {
      z.push_back(tet.node[c]);
      continue;
    }
    if (std::find(materials.begin(), materials.end(), m) == materials.end()) materials.push_back(m);
    if (materials.size() <= 2) (m == materials[0] ? a : b).push_back(tet.node[c]);
  }
  Splitter splitter(points, pieces);
  if (materials.size() <= 1) {
    splitter.whole(tet.node, materials.empty() ? flat : materials[0]);
  } else if (materials.size() == 2) {
    splitter.two(a, b, z, materials[0], materials[1]);
  } else {
    splitter.star(tet);
  }
}

}  // namespace ecorche::tet
