// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/split_nodes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

namespace ecorche::parting {
namespace {

// Sets that are joined; each is known by its lowest.
class Sets {
 public:
  explicit Sets(std::size_t count) : up_(count) { std::iota(up_.begin(), up_.end(), 0); }
  std::int32_t find(std::int32_t a) {
    while (up(a) != a) {
      up(a) = up(up(a));
      a = up(a);
    }
    return a;
  }
  void join(std::int32_t a, std::int32_t b) {
    a = find(a), b = find(b);
    up(std::max(a, b)) = std::min(a, b);
  }

 private:
  std::int32_t& up(std::int32_t a) { return up_[static_cast<std::size_t>(a)]; }
  std::vector<std::int32_t> up_;
};

Sets pieces_without(const Tets& T, const FaceNeighbours& across, const std::vector<Face>& cut) {
  const FaceSet open(across, cut);
  Sets pieces(static_cast<std::size_t>(T.rows()));
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(T.rows()); ++t) {
    for (int c = 0; c < 4; ++c) {
      const std::int32_t next = across.behind({t, c});
      if (next > t && !open.has({t, c})) pieces.join(t, next);
    }
  }
  return pieces;
}

// Which pieces hold a tet of a bone, by the piece's lowest tet.
std::vector<std::uint8_t> boned_pieces(const TetMesh& mesh, Sets& pieces) {
  std::vector<std::uint8_t> out(mesh.label.size(), 0);
  for (std::size_t t = 0; t < mesh.label.size(); ++t) {
    if (mesh.label[t] != TetMesh::soft)
      out[static_cast<std::size_t>(pieces.find(static_cast<std::int32_t>(t)))] = 1;
  }
  return out;
}

double area_of(const TetMesh& mesh, const Face& face) {
  const std::array<Eigen::Vector3d, 3> p = corners_of(mesh, face);
  return 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).norm();
}

}  // namespace

FaceSet::FaceSet(const FaceNeighbours& across, const std::vector<Face>& faces) {
  for (const Face& face : faces) keys_.insert({key(face), key(across.other(face))});
}

std::vector<std::uint8_t> on_bones(const TetMesh& mesh, const FaceNeighbours& across) {
  Sets pieces = pieces_without(mesh.T, across, {});
  const std::vector<std::uint8_t> boned = boned_pieces(mesh, pieces);
  std::vector<std::uint8_t> out(mesh.label.size());
  for (std::size_t t = 0; t < out.size(); ++t)
    out[t] = boned[static_cast<std::size_t>(pieces.find(static_cast<std::int32_t>(t)))];
  return out;
}

bool give_loose_pieces(const TetMesh& mesh, const FaceNeighbours& across, const std::vector<Face>& cut,
                       std::vector<std::int16_t>& part) {
  Sets pieces = pieces_without(mesh.T, across, cut);
  const std::vector<std::uint8_t> boned = boned_pieces(mesh, pieces);
  // Of each piece without bone what it has in common with the parts beside.
  std::map<std::int32_t, std::map<std::int16_t, double>> shared;
  for (const Face& face : cut) {
    const std::int32_t next = across.behind(face), a = pieces.find(face.tet), b = pieces.find(next);
    if (a == b) continue;
    const double area = area_of(mesh, face);
    if (boned[static_cast<std::size_t>(a)] == 0) shared[a][part[static_cast<std::size_t>(next)]] += area;
    if (boned[static_cast<std::size_t>(b)] == 0) shared[b][part[static_cast<std::size_t>(face.tet)]] += area;
  }
  if (shared.empty()) return false;
  std::map<std::int32_t, std::int16_t> given;
  for (const auto& [piece, beside] : shared) {
    given[piece] = std::max_element(beside.begin(), beside.end(), [](const auto& a, const auto& b) {
                     return a.second < b.second;
                   })->first;
  }
  for (std::size_t t = 0; t < part.size(); ++t) {
    const auto to = given.find(pieces.find(static_cast<std::int32_t>(t)));
    if (to != given.end()) part[t] = to->second;
  }
  return true;
}

void split_nodes(TetMesh& mesh, const FaceNeighbours& across, const std::vector<Face>& cut) {
  const FaceSet open(across, cut);
  std::vector<std::int32_t> touched(static_cast<std::size_t>(mesh.V.rows()), -1);  // row of `nodes`
  std::vector<std::int32_t> nodes;
  for (const Face& face : cut) {
    for (int c = 0; c < 3; ++c) {
      const std::int32_t node = node_of(mesh.T, face, c);
      std::int32_t& row = touched[static_cast<std::size_t>(node)];
      if (row >= 0) continue;
      row = static_cast<std::int32_t>(nodes.size());
      nodes.push_back(node);
    }
  }
  std::sort(nodes.begin(), nodes.end());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    touched[static_cast<std::size_t>(nodes[i])] = static_cast<std::int32_t>(i);
  std::vector<std::vector<std::int32_t>> tets(nodes.size());
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh.T.rows()); ++t) {
    for (int c = 0; c < 4; ++c) {
      const std::int32_t row = touched[static_cast<std::size_t>(mesh.T(t, c))];
      if (row >= 0) tets[static_cast<std::size_t>(row)].push_back(t);
    }
  }
  std::vector<std::pair<Face, std::int32_t>> renamed;  // a tet's corner, and its new node
  std::vector<std::int32_t> added;                     // the nodes that the new ones lie on
  const Eigen::Index before = mesh.V.rows();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::vector<std::int32_t>& own = tets[i];
    const auto row_of = [&](std::int32_t t) {
      const auto at = std::lower_bound(own.begin(), own.end(), t);
      return at != own.end() && *at == t ? static_cast<std::int32_t>(at - own.begin()) : -1;
    };
    Sets fans(own.size());
    for (std::size_t k = 0; k < own.size(); ++k) {
      for (int c = 0; c < 4; ++c) {
        const Face face{own[k], c};
        if (mesh.T(own[k], c) == nodes[i]) continue;  // the face across from the node has it not
        const std::int32_t next = across.behind(face);
        if (next >= 0 && !open.has(face)) fans.join(static_cast<std::int32_t>(k), row_of(next));
      }
    }
    std::map<std::int32_t, std::int32_t> node_of_fan{{0, nodes[i]}};
    for (std::size_t k = 0; k < own.size(); ++k) {
      const std::int32_t fan = fans.find(static_cast<std::int32_t>(k));
      const auto [entry, fresh] = node_of_fan.try_emplace(
          fan, static_cast<std::int32_t>(before + static_cast<Eigen::Index>(added.size())));
      if (fresh) added.push_back(nodes[i]);
      if (entry->second == nodes[i]) continue;
      for (int c = 0; c < 4; ++c) {
        if (mesh.T(own[k], c) == nodes[i]) renamed.push_back({{own[k], c}, entry->second});
      }
    }
  }
  for (const auto& [corner, node] : renamed) mesh.T(corner.tet, corner.corner) = node;
  mesh.V.conservativeResize(before + static_cast<Eigen::Index>(added.size()), 3);
  for (std::size_t n = 0; n < added.size(); ++n)
    mesh.V.row(before + static_cast<Eigen::Index>(n)) = mesh.V.row(added[n]);
}

}  // namespace ecorche::parting
