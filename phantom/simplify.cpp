// SPDX-License-Identifier: Apache-2.0
#include "phantom/simplify.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <queue>
#include <tuple>
#include <vector>

namespace ecorche::phantom {

namespace {

using Eigen::Vector3d;

/// Squared distance to a set of planes: x'Ax - 2b'x + c.
struct Quadric {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  double c = 0;

  void add_plane(const Vector3d& normal, double offset, double weight) {
    A += weight * normal * normal.transpose();
    b += weight * offset * normal;
    c += weight * offset * offset;
  }
  Quadric& operator+=(const Quadric& o) {
    A += o.A;
    b += o.b;
    c += o.c;
    return *this;
  }
  double operator()(const Vector3d& x) const { return x.dot(A * x) - 2 * b.dot(x) + c; }
};

class Collapser {
 public:
  explicit Collapser(const SurfaceMesh& mesh) {
    for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) position_.emplace_back(mesh.V.row(v).transpose());
    faces_of_.resize(position_.size());
    quadric_.resize(position_.size());
    stamp_.assign(position_.size(), 0);
    alive_ = static_cast<int>(position_.size());
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
      faces_.push_back({mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2)});
      for (const int v : faces_.back()) faces_of_[index(v)].push_back(static_cast<int>(f));
    }
    for (const auto& face : faces_) {
      const Vector3d n = normal(face);
      const double area = n.norm() / 2;
      if (area <= 0) continue;
      const Vector3d unit = n.normalized();
      for (const int v : face) {
        quadric_[index(v)].add_plane(unit, unit.dot(position_[index(face[0])]), area);
        // A little pull towards where the vertex was keeps flat regions from crumpling.
        for (int a = 0; a < 3; ++a)
          quadric_[index(v)].add_plane(Vector3d::Unit(a), position_[index(v)][a], 1e-3 * area);
      }
    }
    for (const auto& face : faces_) {
      for (std::size_t i = 0; i < 3; ++i) {
        if (face[i] < face[(i + 1) % 3]) push(face[i], face[(i + 1) % 3]);
      }
    }
  }

  void run(int vertices) {
    while (alive_ > vertices && !heap_.empty()) {
      const Candidate best = heap_.top();
      heap_.pop();
      if (best.stamp != stamp_[index(best.a)] + stamp_[index(best.b)] || removed(best.a) || removed(best.b))
        continue;
      if (allowed(best)) collapse(best);
    }
  }

  SurfaceMesh result() const {
    SurfaceMesh mesh;
    std::vector<int> row(position_.size(), -1);
    mesh.V.resize(alive_, 3);
    int next = 0;
    for (std::size_t v = 0; v < position_.size(); ++v) {
      if (faces_of_[v].empty()) continue;
      row[v] = next;
      mesh.V.row(next++) = position_[v].transpose();
    }
    mesh.V.conservativeResize(next, 3);
    mesh.F.resize(static_cast<Eigen::Index>(faces_.size()), 3);
    Eigen::Index count = 0;
    for (const auto& f : faces_) {
      if (f[0] >= 0) mesh.F.row(count++) << row[index(f[0])], row[index(f[1])], row[index(f[2])];
    }
    mesh.F.conservativeResize(count, 3);
    return mesh;
  }

 private:
  using Face = std::array<int, 3>;
  struct Candidate {
    double cost;
    int a, b;
    std::uint32_t stamp;
    Vector3d position;
    bool operator<(const Candidate& o) const { return std::tie(o.cost, o.a, o.b) < std::tie(cost, a, b); }
  };

  static std::size_t index(int v) { return static_cast<std::size_t>(v); }
  bool removed(int v) const { return faces_of_[index(v)].empty(); }
  Vector3d normal(const Face& f) const {
    const Vector3d& a = position_[index(f[0])];
    return (position_[index(f[1])] - a).cross(position_[index(f[2])] - a);
  }

  std::vector<int> neighbours(int v) const {
    std::vector<int> ring;
    for (const int f : faces_of_[index(v)]) {
      for (const int u : faces_[index(f)]) {
        if (u != v) ring.push_back(u);
      }
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    return ring;
  }

  void push(int a, int b) {
    if (a > b) std::swap(a, b);
    Quadric q = quadric_[index(a)];
    q += quadric_[index(b)];
    // The pull above makes A regular.
    const Vector3d x = q.A.ldlt().solve(q.b);
    heap_.push({std::max(q(x), 0.0), a, b, stamp_[index(a)] + stamp_[index(b)], x});
  }

  bool allowed(const Candidate& c) const {
    const std::vector<int> ring_a = neighbours(c.a), ring_b = neighbours(c.b);
    std::vector<int> common;
    std::set_intersection(ring_a.begin(), ring_a.end(), ring_b.begin(), ring_b.end(),
                          std::back_inserter(common));
    if (common.size() != 2 || ring_a.size() + ring_b.size() < 8) return false;
    for (const int u : common) {
      if (faces_of_[index(u)].size() < 4) return false;
    }
    return keeps_shape(c.a, c.b, c.position) && keeps_shape(c.b, c.a, c.position);
  }

  /// Whether the triangles of `v` that stay keep their side and do not become slivers when `v` moves to `x`.
  bool keeps_shape(int v, int other, const Vector3d& x) const {
    for (const int f : faces_of_[index(v)]) {
      const Face& face = faces_[index(f)];
      if (std::find(face.begin(), face.end(), other) != face.end()) continue;
      std::array<Vector3d, 3> p;
      for (std::size_t i = 0; i < 3; ++i) p[i] = face[i] == v ? x : position_[index(face[i])];
      const Vector3d before = normal(face), after = (p[1] - p[0]).cross(p[2] - p[0]);
      const double longest =
          std::max({(p[1] - p[0]).squaredNorm(), (p[2] - p[0]).squaredNorm(), (p[2] - p[1]).squaredNorm()});
      if (after.norm() < 0.12 * longest || after.dot(before) < 0.5 * after.norm() * before.norm())
        return false;
    }
    return true;
  }

  void collapse(const Candidate& c) {
    position_[index(c.a)] = c.position;
    quadric_[index(c.a)] += quadric_[index(c.b)];
    for (const int f : faces_of_[index(c.b)]) {
      Face& face = faces_[index(f)];
      if (std::find(face.begin(), face.end(), c.a) != face.end()) {
        for (const int u : face) {
          if (u != c.b) std::erase(faces_of_[index(u)], f);
        }
        face = {-1, -1, -1};
      } else {
        std::replace(face.begin(), face.end(), c.b, c.a);
        faces_of_[index(c.a)].push_back(f);
      }
    }
    faces_of_[index(c.b)].clear();
    --alive_;
    ++stamp_[index(c.a)];
    for (const int u : neighbours(c.a)) push(c.a, u);
  }

  std::vector<Vector3d> position_;
  std::vector<Face> faces_;
  std::vector<std::vector<int>> faces_of_;
  std::vector<Quadric> quadric_;
  std::vector<std::uint32_t> stamp_;  // of a vertex; a candidate is stale when the sum of its two has changed
  std::priority_queue<Candidate> heap_;
  int alive_ = 0;
};

}  // namespace

SurfaceMesh simplify(const SurfaceMesh& mesh, int vertices) {
  Collapser collapser(mesh);
  collapser.run(vertices);
  return collapser.result();
}

}  // namespace ecorche::phantom
