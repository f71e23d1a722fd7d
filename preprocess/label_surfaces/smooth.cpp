// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/hold.hpp"
#include "preprocess/label_surfaces/surface_net.hpp"

namespace ecorche::label_surfaces {
namespace {

using Eigen::Vector3d;

// Taubin's two weights pass waves longer than about a dozen voxels and keep the volume.
constexpr double kShrink = 0.5, kSwell = -0.52;
constexpr int kPasses = 20;

// The neighbours of every vertex, one after another.
struct Neighbours {
  std::vector<std::int32_t> first, list;
};

template <class F>
void for_each_edge(const SurfaceNet& net, F&& visit) {  // each edge twice, once in each direction
  for (const auto& q : net.quads) {
    for (std::size_t i = 0; i < 4; ++i) visit(q[i], q[(i + 1) % 4]);
  }
  for (const auto& t : net.triangles) {
    for (std::size_t i = 0; i < 3; ++i) visit(t[i], t[(i + 1) % 3]);
  }
}

Neighbours neighbours_of(const SurfaceNet& net) {
  Neighbours out;
  out.first.assign(net.vertices.size() + 1, 0);
  for_each_edge(net, [&](std::int32_t a, std::int32_t) { ++out.first[static_cast<std::size_t>(a) + 1]; });
  for (std::size_t v = 1; v < out.first.size(); ++v) out.first[v] += out.first[v - 1];
  out.list.resize(static_cast<std::size_t>(out.first.back()));
  std::vector<std::int32_t> at(out.first.begin(), out.first.end() - 1);
  for_each_edge(net, [&](std::int32_t a, std::int32_t b) {
    out.list[static_cast<std::size_t>(at[static_cast<std::size_t>(a)]++)] = b;
  });
  return out;
}

}  // namespace

void smooth(SurfaceNet& net, const Context& context) {
  const Neighbours neighbours = neighbours_of(net);
  std::vector<Vector3d> next(net.vertices.size());
  for (int pass = 0; pass < 2 * kPasses; ++pass) {
    context.check_stop();
    const double weight = pass % 2 == 0 ? kShrink : kSwell;
    for (std::size_t v = 0; v < next.size(); ++v) {
      if (is_pinned(net.homes[v])) {
        next[v] = net.vertices[v];
        continue;
      }
      const auto from = static_cast<std::size_t>(neighbours.first[v]),
                 to = static_cast<std::size_t>(neighbours.first[v + 1]);
      Vector3d sum = Vector3d::Zero();
      for (std::size_t n = from; n < to; ++n)
        sum += net.vertices[static_cast<std::size_t>(neighbours.list[n])];
      const Vector3d step = sum / static_cast<double>(to - from) - net.vertices[v];
      next[v] = hold(net.vertices[v] + weight * step, net.homes[v]);
    }
    net.vertices.swap(next);
  }
}

SurfaceMesh triangulate(const SurfaceNet& net) {
  SurfaceMesh mesh;
  mesh.V.resize(static_cast<Eigen::Index>(net.vertices.size()), 3);
  for (std::size_t v = 0; v < net.vertices.size(); ++v)
    mesh.V.row(static_cast<Eigen::Index>(v)) = net.vertices[v].transpose();
  mesh.F.resize(static_cast<Eigen::Index>(2 * net.quads.size() + net.triangles.size()), 3);
  Eigen::Index f = 0;
  for (const auto& q : net.quads) {
    const auto p = [&](std::size_t i) -> const Vector3d& {
      return net.vertices[static_cast<std::size_t>(q[i])];
    };
    // Along the shorter diagonal; its two cells share no other edge, so that no other quad has it.
    const std::size_t s = (p(0) - p(2)).squaredNorm() <= (p(1) - p(3)).squaredNorm() ? 0 : 1;
    mesh.F.row(f++) << q[s], q[s + 1], q[s + 2];
    mesh.F.row(f++) << q[s], q[s + 2], q[(s + 3) % 4];
  }
  for (const auto& t : net.triangles) mesh.F.row(f++) << t[0], t[1], t[2];
  return mesh;
}

}  // namespace ecorche::label_surfaces
