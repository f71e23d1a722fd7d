// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/relax_slivers.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

namespace ecorche::tet {
namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 4>;

constexpr int kPasses = 12;
constexpr std::size_t kChunk = 1 << 14;               // tets that one thread looks at
constexpr double kSurfaceShare = 0.25;                // of the shortest edge, in all
constexpr std::array kSteps{0.25, 0.1, 0.04, 0.015};  // of the shortest edge, per try
constexpr std::array<std::array<int, 3>, 4> kFaces{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

double det(const Corners& p) {
  return (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
}

/// 1 for the regular tet, 0 for a flat one, negative for an inverted one.
double quality(const Corners& p) {
  double squares = 0;
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b) squares += (p[a] - p[b]).squaredNorm();
  }
  const double rms = std::sqrt(squares / 6);
  return std::numbers::sqrt2 * det(p) / (rms * rms * rms);
}

/// Whether a dihedral angle lies beyond the bounds, given as cosines.
bool beyond(const Corners& p, double cos_min, double cos_max) {
  std::array<Vector3d, 4> normal;
  for (std::size_t f = 0; f < 4; ++f) {
    const auto corner = [&](std::size_t c) { return p[static_cast<std::size_t>(kFaces[f][c])]; };
    normal[f] = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
  }
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b) {
      const double cosine = -normal[a].dot(normal[b]);
      if (!(cosine < cos_min && cosine > cos_max)) return true;
    }
  }
  return false;
}

class Relaxation {
 public:
  Relaxation(TetMesh& mesh, const SliverBounds& bounds)
      : mesh_(mesh),
        cos_min_(std::cos(bounds.min_deg * std::numbers::pi / 180)),
        cos_max_(std::cos(bounds.max_deg * std::numbers::pi / 180)) {}

  SliverReport run(const Context& context) {
    SliverReport report;
    std::vector<std::int32_t> bad = all_beyond();
    report.before = static_cast<std::int64_t>(bad.size());
    if (bad.empty()) return report;  // as of every uncut lattice
    start_ = mesh_.V;
    link_nodes();
    mark_surfaces();
    make_directions();
    for (int pass = 0; pass < kPasses && !bad.empty(); ++pass) {
      sort_worst_first(bad);
      bool moved = false;
      for (const std::int32_t t : bad) {
        context.check_stop();
        moved |= improve(t);
      }
      bad = all_beyond();
      if (!moved) break;
    }
    report.after = static_cast<std::int64_t>(bad.size());
    for (Eigen::Index n = 0; n < mesh_.V.rows(); ++n) {
      const double move = (mesh_.V.row(n) - start_.row(n)).norm();
      report.largest_move_mm = std::max(report.largest_move_mm, move);
      if (on_surface_[static_cast<std::size_t>(n)]) {
        report.largest_surface_move_mm = std::max(report.largest_surface_move_mm, move);
      }
    }
    return report;
  }

 private:
  void link_nodes() {
    offsets_.assign(static_cast<std::size_t>(mesh_.V.rows()) + 1, 0);
    for (Eigen::Index t = 0; t < mesh_.T.rows(); ++t) {
      for (int c = 0; c < 4; ++c) ++offsets_[static_cast<std::size_t>(mesh_.T(t, c)) + 1];
    }
    std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
    tets_.resize(offsets_.back());
    std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
    for (Eigen::Index t = 0; t < mesh_.T.rows(); ++t) {
      for (int c = 0; c < 4; ++c) {
        tets_[next[static_cast<std::size_t>(mesh_.T(t, c))]++] = static_cast<std::int32_t>(t);
      }
    }
  }

  /// A node lies on a surface when a face at it has one tet only, or two of different labels.
  void mark_surfaces() {
    on_surface_.assign(static_cast<std::size_t>(mesh_.V.rows()), 0);
    struct Face {
      std::array<std::int32_t, 3> nodes;
      std::uint16_t label;
      auto operator<=>(const Face&) const = default;
    };
    std::vector<Face> faces;
    faces.reserve(4 * static_cast<std::size_t>(mesh_.T.rows()));
    for (Eigen::Index t = 0; t < mesh_.T.rows(); ++t) {
      for (const auto& f : kFaces) {
        Face face{{mesh_.T(t, f[0]), mesh_.T(t, f[1]), mesh_.T(t, f[2])},
                  mesh_.label[static_cast<std::size_t>(t)]};
        std::sort(face.nodes.begin(), face.nodes.end());
        faces.push_back(face);
      }
    }
    std::sort(faces.begin(), faces.end());
    for (std::size_t i = 0; i < faces.size();) {
      const bool inner = i + 1 < faces.size() && faces[i] == faces[i + 1];
      const std::size_t same = i + 1 < faces.size() && faces[i].nodes == faces[i + 1].nodes ? 2 : 1;
      if (!inner) {
        for (const std::int32_t n : faces[i].nodes) on_surface_[static_cast<std::size_t>(n)] = 1;
      }
      i += same;
    }
  }

  void make_directions() {
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        for (int z = -1; z <= 1; ++z) {
          if (x != 0 || y != 0 || z != 0) directions_.push_back(Vector3d(x, y, z).normalized());
        }
      }
    }
  }

  Corners corners(std::int32_t t) const {
    Corners p;
    for (int c = 0; c < 4; ++c) p[static_cast<std::size_t>(c)] = mesh_.V.row(mesh_.T(t, c)).transpose();
    return p;
  }

  std::vector<std::int32_t> all_beyond() const {
    const auto count = static_cast<std::size_t>(mesh_.T.rows());
    std::vector<std::vector<std::int32_t>> found(count / kChunk + 1);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
      for (std::size_t t = chunk * kChunk; t < std::min(count, (chunk + 1) * kChunk); ++t)
        if (beyond(corners(static_cast<std::int32_t>(t)), cos_min_, cos_max_))
          found[chunk].push_back(static_cast<std::int32_t>(t));
    });
    std::vector<std::int32_t> bad;
    for (const std::vector<std::int32_t>& some : found) bad.insert(bad.end(), some.begin(), some.end());
    return bad;
  }

  void sort_worst_first(std::vector<std::int32_t>& tets) const {
    std::vector<std::pair<double, std::int32_t>> order;
    order.reserve(tets.size());
    for (const std::int32_t t : tets) order.emplace_back(quality(corners(t)), t);
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < order.size(); ++i) tets[i] = order[i].second;
  }

  /// The worst quality around node `n` if it stood at `x`; stops early below `enough`.
  double worst_around(std::int32_t n, const Vector3d& x, double enough) const {
    double worst = std::numeric_limits<double>::infinity();
    const auto node = static_cast<std::size_t>(n);
    for (std::size_t e = offsets_[node]; e < offsets_[node + 1]; ++e) {
      const std::int32_t t = tets_[e];
      Corners p;
      for (int c = 0; c < 4; ++c) {
        p[static_cast<std::size_t>(c)] =
            mesh_.T(t, c) == n ? x : Vector3d(mesh_.V.row(mesh_.T(t, c)).transpose());
      }
      worst = std::min(worst, quality(p));
      if (worst <= enough) break;
    }
    return worst;
  }

  double shortest_edge(std::int32_t n) const {
    double shortest = std::numeric_limits<double>::infinity();
    const auto node = static_cast<std::size_t>(n);
    for (std::size_t e = offsets_[node]; e < offsets_[node + 1]; ++e) {
      for (int c = 0; c < 4; ++c) {
        const std::int32_t other = mesh_.T(tets_[e], c);
        if (other != n) shortest = std::min(shortest, (start_.row(other) - start_.row(n)).norm());
      }
    }
    return shortest;
  }

  /// Moves one node to the best of the places tried; false when none is better.
  bool move_node(std::int32_t n) {
    Vector3d at = mesh_.V.row(n).transpose();
    const Vector3d home = start_.row(n).transpose();
    const double edge = shortest_edge(n);
    const double reach = on_surface_[static_cast<std::size_t>(n)] ? kSurfaceShare * edge : 1e300;
    double best = worst_around(n, at, -1e300);
    bool moved = false;
    for (const double step : kSteps) {
      Vector3d better = at;
      for (const Vector3d& direction : directions_) {
        const Vector3d place = at + step * edge * direction;
        if ((place - home).norm() > reach) continue;
        const double worst = worst_around(n, place, best);
        if (worst > best) {
          best = worst;
          better = place;
        }
      }
      if (better != at) {
        at = better;
        moved = true;
      }
    }
    if (moved) mesh_.V.row(n) = at.transpose();
    return moved;
  }

  bool improve(std::int32_t t) {
    bool moved = false;
    for (int c = 0; c < 4; ++c) {
      if (!beyond(corners(t), cos_min_, cos_max_)) break;
      moved |= move_node(mesh_.T(t, c));
    }
    return moved;
  }

  TetMesh& mesh_;
  double cos_min_, cos_max_;
  Points start_;
  std::vector<std::uint8_t> on_surface_;
  std::vector<std::size_t> offsets_;  // node -> its tets
  std::vector<std::int32_t> tets_;
  std::vector<Vector3d> directions_;
};

}  // namespace

SliverReport relax_slivers(TetMesh& mesh, const SliverBounds& bounds, const Context& context) {
  return Relaxation(mesh, bounds).run(context);
}

}  // namespace ecorche::tet
