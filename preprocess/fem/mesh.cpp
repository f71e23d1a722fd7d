// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/mesh.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::fem {
namespace {

constexpr std::array<std::string_view, 3> kElementNames{"p1", "p2", "p2p0"};

Rule linear() {
  Rule out;
  out.gradient[0].setZero();
  out.gradient[0].topRows<4>().setIdentity();
  return out;
}

/// N_a = l_a (2 l_a - 1) at corners, 4 l_a l_b at the middles; four points, exact for quadratic functions.
Rule quadratic() {
  const double far = (5 - std::sqrt(5.0)) / 20, near = 1 - 3 * far;
  Rule out;
  out.nodes = 10;
  out.points = 4;
  for (int p = 0; p < 4; ++p) {
    Eigen::Vector4d l = Eigen::Vector4d::Constant(far);
    l[p] = near;
    Eigen::Matrix<double, 10, 4>& gradient = out.gradient[static_cast<std::size_t>(p)];
    gradient.setZero();
    for (int a = 0; a < 4; ++a) gradient(a, a) = 4 * l[a] - 1;
    for (int e = 0; e < 6; ++e) {
      const auto [a, b] = kEdges[static_cast<std::size_t>(e)];
      gradient(4 + e, a) = 4 * l[b];
      gradient(4 + e, b) = 4 * l[a];
    }
  }
  return out;
}

std::array<std::int32_t, 2> edge(std::int32_t a, std::int32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

RestTet rest_tet(const Points& V, const Tets& T, Eigen::Index t) {
  Eigen::Matrix<double, 4, 3> corner;
  for (int c = 0; c < 4; ++c) corner.row(c) = V.row(T(t, c));
  RestTet out = elastic::rest_tet(corner);
  if (!(out.volume > 0)) {
    throw Error(ErrorKind::data, "fem",
                "tet " + std::to_string(t) + " has the volume " + std::to_string(out.volume) + " mm^3",
                "prepare the model again: every tet must have a positive volume");
  }
  return out;
}

}  // namespace

std::string_view element_name(Element element) {
  return kElementNames[static_cast<std::size_t>(element)];
}

Element element_from_name(std::string_view name) {
  const auto found = std::find(kElementNames.begin(), kElementNames.end(), name);
  if (found == kElementNames.end())
    throw Error(ErrorKind::usage, "--element", "there is no element '" + std::string(name) + "'",
                "use p1, p2 or p2p0");
  return static_cast<Element>(found - kElementNames.begin());
}

const Rule& rule_of(Element element) {
  static const Rule p1 = linear(), p2 = quadratic();
  return element == Element::p1 ? p1 : p2;
}

std::vector<std::array<std::int32_t, 2>> edges_of(const Tets& T) {
  std::vector<std::array<std::int32_t, 2>> out;
  out.reserve(6 * static_cast<std::size_t>(T.rows()));
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (const auto& [a, b] : kEdges) out.push_back(edge(T(t, a), T(t, b)));
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

Mesh make_mesh(Element element, const Points& V, const Tets& T, const std::vector<std::uint8_t>& held,
               const std::vector<std::array<std::int32_t, 2>>& held_edges) {
  Mesh mesh;
  mesh.element = element;
  mesh.X = V;
  if (element != Element::p1) mesh.middle = edges_of(T);
  mesh.X = with_middles(mesh, V);
  const auto nodes = static_cast<std::size_t>(mesh.rule().nodes);
  mesh.corner.reserve(nodes * static_cast<std::size_t>(T.rows()));
  mesh.rest.reserve(static_cast<std::size_t>(T.rows()));
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    mesh.rest.push_back(rest_tet(V, T, t));
    for (int c = 0; c < 4; ++c) mesh.corner.push_back(T(t, c));
    if (element == Element::p1) continue;
    for (const auto& [a, b] : kEdges) {
      const auto at = std::lower_bound(mesh.middle.begin(), mesh.middle.end(), edge(T(t, a), T(t, b)));
      mesh.corner.push_back(static_cast<std::int32_t>(V.rows() + (at - mesh.middle.begin())));
    }
  }
  mesh.free.assign(static_cast<std::size_t>(mesh.X.rows()), -1);
  for (const std::int32_t n : mesh.corner) mesh.free[static_cast<std::size_t>(n)] = 0;
  for (std::size_t n = 0; n < held.size(); ++n)
    if (held[n] != 0) mesh.free[n] = -1;
  for (std::size_t m = 0; m < mesh.middle.size(); ++m)
    if (std::binary_search(held_edges.begin(), held_edges.end(), mesh.middle[m]))
      mesh.free[held.size() + m] = -1;
  for (std::int32_t& f : mesh.free)
    if (f == 0) f = static_cast<std::int32_t>(mesh.free_nodes++);
  return mesh;
}

double Mesh::mean_stiffness() const {
  double sum = 0, volume = 0;
  for (std::size_t t = 0; t < tets(); ++t) {
    sum += stiffness_of(t) * rest[t].volume;
    volume += rest[t].volume;
  }
  return stiffness.empty() || volume == 0 ? 1 : sum / volume;
}

Points with_middles(const Mesh& mesh, const Points& x) {
  const auto middles = static_cast<Eigen::Index>(mesh.middle.size());
  Points out(x.rows() + middles, 3);
  out.topRows(x.rows()) = x;
  for (Eigen::Index m = 0; m < middles; ++m) {
    const auto [a, b] = mesh.middle[static_cast<std::size_t>(m)];
    out.row(x.rows() + m) = (x.row(a) + x.row(b)) / 2;
  }
  return out;
}

}  // namespace ecorche::fem
