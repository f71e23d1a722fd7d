// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/self_contact.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace ecorche::fem {
namespace {

using Eigen::Vector3d;

constexpr double kInside = 1e-6;  // of barycentric coordinates: what only touches is not inside

using Faces = std::vector<std::array<std::int32_t, 3>>;

/// Faces that one tet alone has.
Faces surface_of(const Tets& T) {
  constexpr std::array<std::array<int, 3>, 4> kFaces{{{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}}};
  Faces faces;
  faces.reserve(4 * static_cast<std::size_t>(T.rows()));
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    for (const auto& face : kFaces) {
      std::array<std::int32_t, 3> f{T(t, face[0]), T(t, face[1]), T(t, face[2])};
      std::sort(f.begin(), f.end());
      faces.push_back(f);
    }
  }
  tbb::parallel_sort(faces.begin(), faces.end());
  Faces out;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end] == faces[i]) ++end;
    if (end == i + 1) out.push_back(faces[i]);
    i = end;
  }
  return out;
}

std::vector<std::int32_t> nodes_of(const Faces& faces) {
  std::vector<std::int32_t> out;
  for (const auto& face : faces) out.insert(out.end(), face.begin(), face.end());
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

/// Of the faces those that lie on another one.
Faces lying_on_others(const Faces& faces, const Points& X) {
  // Nodes at one place go by the lowest of them.
  std::vector<std::int32_t> nodes = nodes_of(faces);
  const auto place = [&](std::int32_t n) { return std::array<double, 3>{X(n, 0), X(n, 1), X(n, 2)}; };
  tbb::parallel_sort(nodes.begin(), nodes.end(), [&](std::int32_t a, std::int32_t b) {
    return std::pair{place(a), a} < std::pair{place(b), b};
  });
  std::vector<std::int32_t> lowest(static_cast<std::size_t>(X.rows()), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const bool same = i > 0 && place(nodes[i]) == place(nodes[i - 1]);
    lowest[static_cast<std::size_t>(nodes[i])] =
        same ? lowest[static_cast<std::size_t>(nodes[i - 1])] : nodes[i];
  }
  std::vector<std::pair<std::array<std::int32_t, 3>, std::size_t>> placed(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    std::array<std::int32_t, 3> at = faces[f];
    for (std::int32_t& node : at) node = lowest[static_cast<std::size_t>(node)];
    std::sort(at.begin(), at.end());
    placed[f] = {at, f};
  }
  tbb::parallel_sort(placed.begin(), placed.end());
  Faces out;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const bool before = i > 0 && placed[i].first == placed[i - 1].first;
    const bool after = i + 1 < placed.size() && placed[i].first == placed[i + 1].first;
    if (before || after) out.push_back(faces[placed[i].second]);
  }
  return out;
}

geometry::FaceTree tree_of(const Faces& faces, const Points& X) {
  std::vector<geometry::FaceTree::Corners> corners;
  corners.reserve(faces.size());
  for (const auto& [a, b, c] : faces) corners.push_back({X.row(a), X.row(b), X.row(c)});
  return geometry::FaceTree(corners);
}

bool holds(const Points& x, const Tets& T, Eigen::Index t, const Vector3d& p) {
  const Vector3d a = x.row(T(t, 0)), b = x.row(T(t, 1)), c = x.row(T(t, 2)), d = x.row(T(t, 3));
  const double all = tet_det(a, b, c, d);
  if (!(all > 0)) return false;
  const double least = kInside * all;
  return tet_det(p, b, c, d) > least && tet_det(a, p, c, d) > least && tet_det(a, b, p, d) > least &&
         tet_det(a, b, c, p) > least;
}

/// Tets by the cells of a grid that their boxes touch.
class Grid {
 public:
  Grid(const Points& x, const Tets& T) : x_(x), T_(T) {
    low_ = x.colwise().minCoeff().transpose();
    const Vector3d size = x.colwise().maxCoeff().transpose() - low_;
    cell_ = 1.5 *
            std::cbrt(std::max(size.prod(), 1.0) / static_cast<double>(std::max<Eigen::Index>(T.rows(), 1)));
    for (int a = 0; a < 3; ++a) count_[a] = static_cast<std::int64_t>(size[a] / cell_) + 1;
    for (Eigen::Index t = 0; t < T.rows(); ++t) {
      Vector3d least = x.row(T(t, 0)), most = least;
      for (int c = 1; c < 4; ++c) {
        least = least.cwiseMin(x.row(T(t, c)).transpose());
        most = most.cwiseMax(x.row(T(t, c)).transpose());
      }
      const auto from = cell(least), to = cell(most);
      for (std::int64_t i = from[0]; i <= to[0]; ++i)
        for (std::int64_t j = from[1]; j <= to[1]; ++j)
          for (std::int64_t k = from[2]; k <= to[2]; ++k) entries_.push_back({key(i, j, k), t});
    }
    tbb::parallel_sort(entries_.begin(), entries_.end());
  }

  /// The first tet that has not `node` as a corner and holds its place; -1 for none.
  Eigen::Index foreign(std::int32_t node) const {
    const Vector3d p = x_.row(node);
    const auto [i, j, k] = cell(p);
    const std::int64_t here = key(i, j, k);
    for (auto at = std::lower_bound(entries_.begin(), entries_.end(), std::pair{here, Eigen::Index{0}});
         at != entries_.end() && at->first == here; ++at) {
      const auto tet = T_.row(at->second);
      if (std::find(tet.begin(), tet.end(), node) == tet.end() && holds(x_, T_, at->second, p))
        return at->second;
    }
    return -1;
  }

 private:
  std::array<std::int64_t, 3> cell(const Vector3d& p) const {
    std::array<std::int64_t, 3> out{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      out[a] = std::clamp<std::int64_t>(static_cast<std::int64_t>((p[axis] - low_[axis]) / cell_), 0,
                                        count_[a] - 1);
    }
    return out;
  }
  std::int64_t key(std::int64_t i, std::int64_t j, std::int64_t k) const {
    return (i * count_[1] + j) * count_[2] + k;
  }

  const Points& x_;
  const Tets& T_;
  Vector3d low_;
  double cell_ = 1;
  std::array<std::int64_t, 3> count_{};
  std::vector<std::pair<std::int64_t, Eigen::Index>> entries_;
};

/// Of each node the foreign tet that holds it, or -1.
std::vector<Eigen::Index> holders(const Points& x, const Tets& T, const std::vector<std::int32_t>& nodes) {
  const Grid grid(x, T);
  std::vector<Eigen::Index> out(nodes.size());
  tbb::parallel_for(std::size_t{0}, nodes.size(), [&](std::size_t n) { out[n] = grid.foreign(nodes[n]); });
  return out;
}

/// Where the flesh at p, which the tet holds, is at rest.
Vector3d at_rest(const Points& X, const Points& x, const Tets& T, Eigen::Index t, const Vector3d& p) {
  const Vector3d a = x.row(T(t, 0)), b = x.row(T(t, 1)), c = x.row(T(t, 2)), d = x.row(T(t, 3));
  const double all = tet_det(a, b, c, d);
  return (tet_det(p, b, c, d) * X.row(T(t, 0)) + tet_det(a, p, c, d) * X.row(T(t, 1)) +
          tet_det(a, b, p, d) * X.row(T(t, 2)) + tet_det(a, b, c, p) * X.row(T(t, 3)))
             .transpose() /
         all;
}

}  // namespace

SelfContactFinder::SelfContactFinder(const Points& X, const Tets& T) : X_(X), T_(T) {
  const Faces faces = surface_of(T);
  surface_ = std::make_unique<const geometry::FaceTree>(tree_of(faces, X));
  if (const Faces cut = lying_on_others(faces, X); !cut.empty()) {
    cut_ = std::make_unique<const geometry::FaceTree>(tree_of(cut, X));
    for (const auto& [a, b, c] : cut)
      step_.push_back(std::max({(X.row(a) - X.row(b)).squaredNorm(), (X.row(b) - X.row(c)).squaredNorm(),
                                (X.row(c) - X.row(a)).squaredNorm()}));
  }
  const std::vector<std::int32_t> all = nodes_of(faces);
  const std::vector<Eigen::Index> held = holders(X, T, all);
  for (std::size_t n = 0; n < all.size(); ++n)
    if (held[n] < 0) nodes_.push_back(all[n]);
}

bool SelfContactFinder::in_steps(const Vector3d& at) const {
  if (!cut_) return false;
  const geometry::FaceTree::Hit near = cut_->nearest(at);
  return near.squared <= step_[static_cast<std::size_t>(near.face)];
}

SelfContact SelfContactFinder::operator()(const Points& x) const {
  const std::vector<Eigen::Index> held = holders(x, T_, nodes_);
  SelfContact out;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    if (held[n] < 0) continue;
    const Vector3d p = x.row(nodes_[n]).transpose();
    const Vector3d rest = at_rest(X_, x, T_, held[n], p);
    if (in_steps(rest)) continue;
    ++out.nodes;
    out.at += p;
    const double depth = std::sqrt(surface_->nearest(rest).squared);
    if (depth <= out.depth_mm) continue;
    out.depth_mm = depth;
    out.deepest = p;
  }
  if (out.nodes > 0) out.at /= static_cast<double>(out.nodes);
  return out;
}

SelfContact self_contact(const Points& X, const Points& x, const Tets& T) {
  return SelfContactFinder(X, T)(x);
}

}  // namespace ecorche::fem
