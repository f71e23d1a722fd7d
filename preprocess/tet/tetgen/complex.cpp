// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/tetgen/complex.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace ecorche::tet {
namespace {

struct Face {
  std::array<std::int32_t, 3> nodes;
  std::int32_t tet;
};

/// Every face of every tet, those of two tets side by side.
std::vector<Face> sorted_faces(const TetMesh& mesh) {
  std::vector<Face> faces;
  faces.reserve(4 * static_cast<std::size_t>(mesh.T.rows()));
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (Eigen::Index skipped = 0; skipped < 4; ++skipped) {
      Face face{{}, static_cast<std::int32_t>(t)};
      std::size_t n = 0;
      for (Eigen::Index c = 0; c < 4; ++c)
        if (c != skipped) face.nodes[n++] = mesh.T(t, c);
      std::sort(face.nodes.begin(), face.nodes.end());
      faces.push_back(face);
    }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return a.nodes != b.nodes ? a.nodes < b.nodes : a.tet < b.tet;
  });
  return faces;
}

class Groups {
 public:
  explicit Groups(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::int32_t{0}); }
  std::int32_t find(std::int32_t a) {
    std::int32_t root = a;
    while (parent_[static_cast<std::size_t>(root)] != root) root = parent_[static_cast<std::size_t>(root)];
    while (a != root) a = std::exchange(parent_[static_cast<std::size_t>(a)], root);
    return root;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = find(a);
    b = find(b);
    parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }

 private:
  std::vector<std::int32_t> parent_;
};

/// Nodes of the triangles, each half way to the mean of its neighbours along them, at most `reach` away.
Points smoothed(const Points& V, const std::vector<std::array<std::int32_t, 3>>& triangles, double reach) {
  Points sum = Points::Zero(V.rows(), 3);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(V.rows());
  for (const auto& t : triangles)
    for (std::size_t c = 0; c < 3; ++c)
      for (const std::size_t other : {(c + 1) % 3, (c + 2) % 3}) {
        sum.row(t[c]) += V.row(t[other]);
        count[t[c]] += 1;
      }
  Points out = V;
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    if (count[v] == 0) continue;
    const Eigen::RowVector3d step = 0.5 * (sum.row(v) / count[v] - V.row(v));
    out.row(v) += step * std::min(1.0, reach / std::max(step.norm(), 1e-300));
  }
  return out;
}

}  // namespace

Complex complex_of_surfaces(const Case& patient) {
  Complex complex;
  std::map<std::array<double, 3>, int> number;
  std::set<std::array<int, 3>> seen;
  const auto add = [&](const SurfaceMesh& surface) {
    for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
      std::array<int, 3> t{};
      for (std::size_t c = 0; c < 3; ++c) {
        const auto p = surface.V.row(surface.F(f, static_cast<Eigen::Index>(c)));
        const auto [entry, fresh] =
            number.try_emplace({p[0], p[1], p[2]}, static_cast<int>(complex.vertices()));
        if (fresh) complex.points.insert(complex.points.end(), {p[0], p[1], p[2]});
        t[c] = entry->second;
      }
      std::array<int, 3> sorted = t;
      std::sort(sorted.begin(), sorted.end());
      if (sorted[0] != sorted[1] && sorted[1] != sorted[2] && seen.insert(sorted).second)
        complex.triangles.push_back(t);
    }
  };
  add(patient.skin);
  for (const CaseBone& bone : patient.bones) add(bone.surface);
  return complex;
}

Complex complex_of_lattice(const TetMesh& mesh, double side) {
  const std::vector<Face> faces = sorted_faces(mesh);
  const auto label = [&](std::int32_t tet) { return mesh.label[static_cast<std::size_t>(tet)]; };
  std::vector<std::array<std::int32_t, 3>> triangles;
  Groups regions(static_cast<std::size_t>(mesh.T.rows()));
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const bool inner = f + 1 < faces.size() && faces[f].nodes == faces[f + 1].nodes;
    if (inner && label(faces[f].tet) == label(faces[f + 1].tet)) {
      regions.join(faces[f].tet, faces[f + 1].tet);
    } else {
      triangles.push_back(faces[f].nodes);
    }
    if (inner) ++f;
  }
  const Points V = smoothed(mesh.V, triangles, 0.2 * side);
  Complex complex;
  complex.speck = side * side * side;
  std::vector<int> number(static_cast<std::size_t>(V.rows()), -1);
  for (std::array<std::int32_t, 3> t : triangles) {
    for (std::int32_t& node : t) {
      int& n = number[static_cast<std::size_t>(node)];
      if (n < 0) {
        n = static_cast<int>(complex.vertices());
        complex.points.insert(complex.points.end(), {V(node, 0), V(node, 1), V(node, 2)});
      }
      node = n;
    }
    complex.triangles.push_back({t[0], t[1], t[2]});
  }
  for (std::int32_t t = 0; t < mesh.T.rows(); ++t) {
    if (regions.find(t) != t) continue;
    const Eigen::RowVector3d middle =
        0.25 * (V.row(mesh.T(t, 0)) + V.row(mesh.T(t, 1)) + V.row(mesh.T(t, 2)) + V.row(mesh.T(t, 3)));
    complex.seeds.push_back({{middle[0], middle[1], middle[2]}, label(t)});
  }
  return complex;
}

Hollows label_by_seeds(TetMesh& mesh, const std::vector<int>& regions, const Complex& complex) {
  int highest = 0;
  for (const Complex::Seed& seed : complex.seeds) highest = std::max(highest, 1 + seed.label);
  const auto seeded = [&](int region) { return region >= 1 && region <= highest; };
  struct Hollow {
    double volume = 0;
    std::set<std::uint16_t> around;  // labels at its faces
  };
  std::map<int, Hollow> hollows;
  mesh.label.resize(regions.size());
  for (std::size_t t = 0; t < regions.size(); ++t) {
    mesh.label[t] = static_cast<std::uint16_t>(seeded(regions[t]) ? regions[t] - 1 : 0);
    if (seeded(regions[t])) continue;
    const auto row = static_cast<Eigen::Index>(t);
    hollows[regions[t]].volume += tet_det(mesh.V.row(mesh.T(row, 0)), mesh.V.row(mesh.T(row, 1)),
                                          mesh.V.row(mesh.T(row, 2)), mesh.V.row(mesh.T(row, 3))) /
                                  6;
  }
  if (hollows.empty()) return {};
  const std::vector<Face> faces = sorted_faces(mesh);
  for (std::size_t f = 0; f + 1 < faces.size(); ++f) {
    if (faces[f].nodes != faces[f + 1].nodes) continue;
    const auto a = static_cast<std::size_t>(faces[f].tet), b = static_cast<std::size_t>(faces[f + 1].tet);
    if (regions[a] == regions[b]) continue;
    if (!seeded(regions[a])) hollows[regions[a]].around.insert(mesh.label[b]);
    if (!seeded(regions[b])) hollows[regions[b]].around.insert(mesh.label[a]);
  }
  Hollows out;
  std::map<int, std::uint16_t> filled;
  for (const auto& [region, hollow] : hollows) {
    const bool amid_one = hollow.around.size() == 1 && *hollow.around.begin() > 0;
    if (amid_one || hollow.volume <= complex.speck)
      filled[region] = amid_one ? *hollow.around.begin() : std::uint16_t{0};
    else
      ++out.left;
  }
  out.filled = filled.size();
  std::vector<Eigen::Index> kept;
  std::vector<std::uint16_t> label;
  for (std::size_t t = 0; t < regions.size(); ++t) {
    const auto found = filled.find(regions[t]);
    if (!seeded(regions[t]) && found == filled.end()) continue;
    kept.push_back(static_cast<Eigen::Index>(t));
    label.push_back(found == filled.end() ? mesh.label[t] : found->second);
  }
  mesh.label = std::move(label);
  if (out.left == 0) return out;
  std::vector<std::int32_t> number(static_cast<std::size_t>(mesh.V.rows()), -1);
  std::vector<std::int32_t> nodes;
  Tets tets(static_cast<Eigen::Index>(kept.size()), 4);
  for (std::size_t t = 0; t < kept.size(); ++t)
    for (Eigen::Index c = 0; c < 4; ++c) {
      std::int32_t& n = number[static_cast<std::size_t>(mesh.T(kept[t], c))];
      if (n < 0) {
        n = static_cast<std::int32_t>(nodes.size());
        nodes.push_back(mesh.T(kept[t], c));
      }
      tets(static_cast<Eigen::Index>(t), c) = n;
    }
  Points places(static_cast<Eigen::Index>(nodes.size()), 3);
  for (std::size_t n = 0; n < nodes.size(); ++n)
    places.row(static_cast<Eigen::Index>(n)) = mesh.V.row(nodes[n]);
  mesh.T = std::move(tets);
  mesh.V = std::move(places);
  return out;
}

}  // namespace ecorche::tet
