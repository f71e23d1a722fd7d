// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <numeric>

#include "preprocess/label_surfaces/hold.hpp"

namespace ecorche::label_surfaces {
namespace {

using Eigen::Vector3d;

constexpr int kVolumeRounds = 4;  // the bounds take a part of each move back

// Where a vertex stands on the voxels' own staircase.
Vector3d on_staircase(const SurfaceNet::Home& home) {
  Vector3d p(home.cell[0], home.cell[1], home.cell[2]);
  for (int a = 0; a < 3; ++a) {
    const bool along = (home.edges >> (4 * a) & 15) != 0;
    if (!is_pinned(home) || along) p[a] += 0.5;
  }
  return p;
}

// Twice the vector area and six times the volume, triangle by triangle of a net.
template <class At, class F>
void for_each_triangle(const SurfaceNet& net, const At& at, F&& visit) {
  const auto triangle = [&](std::int32_t a, std::int32_t b, std::int32_t c) {
    const Vector3d pa = at(a), pb = at(b), pc = at(c);
    visit(std::array{a, b, c}, Vector3d((pb - pa).cross(pc - pa)), pa.dot(pb.cross(pc)));
  };
  for (const auto& q : net.quads) {
    triangle(q[0], q[1], q[2]);
    triangle(q[0], q[2], q[3]);
  }
  for (const auto& t : net.triangles) triangle(t[0], t[1], t[2]);
}

// The connected piece of every vertex, numbered by its first vertex.
std::vector<std::int32_t> pieces_of(const SurfaceNet& net) {
  std::vector<std::int32_t> root(net.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](std::int32_t v) {
    while (root[static_cast<std::size_t>(v)] != v) {
      std::int32_t& up = root[static_cast<std::size_t>(v)];
      up = root[static_cast<std::size_t>(up)];
      v = up;
    }
    return v;
  };
  const auto join = [&](std::int32_t a, std::int32_t b) {
    a = find(a);
    b = find(b);
    root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  };
  for (const auto& q : net.quads) {
    for (std::size_t i = 1; i < 4; ++i) join(q[0], q[i]);
  }
  for (const auto& t : net.triangles) {
    for (std::size_t i = 1; i < 3; ++i) join(t[0], t[i]);
  }
  for (std::size_t v = 0; v < root.size(); ++v) root[v] = find(static_cast<std::int32_t>(v));
  return root;
}

}  // namespace

void restore_volume(SurfaceNet& net) {
  const std::size_t n = net.vertices.size();
  const std::vector<std::int32_t> piece = pieces_of(net);
  const auto piece_of = [&](std::int32_t v) {
    return static_cast<std::size_t>(piece[static_cast<std::size_t>(v)]);
  };
  std::vector<double> wanted(n, 0);  // six times the volume, at each piece's first vertex
  for_each_triangle(
      net, [&](std::int32_t v) { return on_staircase(net.homes[static_cast<std::size_t>(v)]); },
      [&](const auto& t, const Vector3d&, double six) { wanted[piece_of(t[0])] += six; });

  std::vector<double> held(n), twice_area(n);
  std::vector<Vector3d> normal(n);
  for (int round = 0; round < kVolumeRounds; ++round) {
    std::fill(held.begin(), held.end(), 0);
    std::fill(twice_area.begin(), twice_area.end(), 0);
    std::fill(normal.begin(), normal.end(), Vector3d::Zero());
    for_each_triangle(
        net, [&](std::int32_t v) { return net.vertices[static_cast<std::size_t>(v)]; },
        [&](const auto& t, const Vector3d& area, double six) {
          held[piece_of(t[0])] += six;
          twice_area[piece_of(t[0])] += area.norm();
          for (const std::int32_t v : t) normal[static_cast<std::size_t>(v)] += area;
        });
    for (std::size_t v = 0; v < n; ++v) {
      const auto p = static_cast<std::size_t>(piece[v]);
      const double length = normal[v].norm();
      if (length == 0 || twice_area[p] == 0 || is_pinned(net.homes[v])) continue;
      const double offset = (wanted[p] - held[p]) / (3 * twice_area[p]);
      net.vertices[v] =
          hold(net.vertices[v] + std::clamp(offset, -kReach, kReach) / length * normal[v], net.homes[v]);
    }
  }
}

}  // namespace ecorche::label_surfaces
