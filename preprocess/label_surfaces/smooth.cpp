// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <numbers>

#include "preprocess/label_surfaces/hold.hpp"
#include "preprocess/label_surfaces/surface_net.hpp"

namespace ecorche::label_surfaces {
namespace {

using Eigen::Vector3d;

// Waves shorter than about this many voxels go: steps, and terraces of shallow slopes.
constexpr double kPassedVoxels = 8;
constexpr int kTerms = 20;  // of the filter's series; its edge is as sharp as they are many
constexpr int kRounds = 2;  // filtering moves vertices out of their bounds, the bounds leave waves

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

// Each vertex' mean of its neighbours. Its eigenvalues lie in [-1, 1]: near 1 for long waves.
void mean_of_neighbours(const Neighbours& neighbours, const std::vector<Vector3d>& from,
                        std::vector<Vector3d>& to) {
  for (std::size_t v = 0; v < from.size(); ++v) {
    const auto first = static_cast<std::size_t>(neighbours.first[v]),
               last = static_cast<std::size_t>(neighbours.first[v + 1]);
    Vector3d sum = Vector3d::Zero();
    for (std::size_t n = first; n < last; ++n) sum += from[static_cast<std::size_t>(neighbours.list[n])];
    to[v] = sum / static_cast<double>(last - first);
  }
}

// The Chebyshev series of the step that passes eigenvalues above cos(edge), under a Hamming window, 1 at 1.
std::array<double, kTerms + 1> low_pass() {
  const double pi = std::numbers::pi;
  // A wave along one of the net's two directions has the eigenvalue (1 + cos(2 pi / length)) / 2.
  const double edge = std::acos((1 + std::cos(2 * pi / kPassedVoxels)) / 2);
  std::array<double, kTerms + 1> terms{};
  double sum = 0;
  for (int n = 0; n <= kTerms; ++n) {
    const double window = 0.54 + 0.46 * std::cos(n * pi / (kTerms + 1));
    terms[static_cast<std::size_t>(n)] = n == 0 ? edge / pi : window * 2 * std::sin(n * edge) / (n * pi);
    sum += terms[static_cast<std::size_t>(n)];
  }
  for (double& term : terms) term /= sum;
  return terms;
}

}  // namespace

void smooth(SurfaceNet& net, const Context& context) {
  const Neighbours neighbours = neighbours_of(net);
  const std::array<double, kTerms + 1> terms = low_pass();
  const std::size_t count = net.vertices.size();
  std::vector<Vector3d> sum(count), before, at(count), next(count);
  for (int round = 0; round < kRounds; ++round) {
    before = net.vertices;  // T_0 and T_1; then T_{n+1} = 2 M T_n - T_{n-1}
    mean_of_neighbours(neighbours, before, at);
    for (std::size_t v = 0; v < count; ++v) sum[v] = terms[0] * before[v] + terms[1] * at[v];
    for (std::size_t n = 2; n < terms.size(); ++n) {
      context.check_stop();
      mean_of_neighbours(neighbours, at, next);
      for (std::size_t v = 0; v < count; ++v) {
        next[v] = 2 * next[v] - before[v];
        sum[v] += terms[n] * next[v];
      }
      before.swap(at);
      at.swap(next);
    }
    for (std::size_t v = 0; v < count; ++v) {
      if (!is_pinned(net.homes[v])) net.vertices[v] = hold(sum[v], net.homes[v]);
    }
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
