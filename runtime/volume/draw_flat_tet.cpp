// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "runtime/volume/draw_tets.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

// A plane is let out by kFlatMargin of edge x edge x distance, which covers rounding; a tet thinner than
// kNothing is left to its neighbours, whose margin is larger.
constexpr double kFlatMargin = 1e-10;
constexpr double kNothing = 1e-12;

struct FlatCorners {
  std::array<Vector3d, 4> x;
};

FlatCorners corners_of(const DrawTets& job, std::span<const std::int32_t> points, std::uint32_t id) {
  const double one = 1 << job.bits;
  FlatCorners out;
  for (int c = 0; c < 4; ++c) {
    const std::int32_t* p = &points[3 * static_cast<std::size_t>(job.tets(id, c))];
    out.x[static_cast<std::size_t>(c)] = Vector3d(p[0] / one, p[1] / one, p[2] / one);
  }
  return out;
}

double det_of(const FlatCorners& c) {
  return (c.x[1] - c.x[0]).cross(c.x[2] - c.x[0]).dot(c.x[3] - c.x[0]);
}

double longest_edge(const FlatCorners& c) {
  double longest = 0;
  for (std::size_t a = 0; a < 4; ++a) {
    for (std::size_t b = a + 1; b < 4; ++b) longest = std::max(longest, (c.x[a] - c.x[b]).norm());
  }
  return longest;
}

// Barycentric coordinates of a point are row * (point, 1).
struct Coordinate {
  Vector3d slope;
  double at = 0, margin = 0;
  double of(const Vector3d& p) const { return slope.dot(p) + at; }
};

}  // namespace

double posed_det(const DrawTets& job, std::uint32_t id) {
  return (job.left_handed ? -1 : 1) * det_of(corners_of(job, job.posed, id));
}

void draw_flat_tet(const DrawTets& job, const VoxelRange& range, std::uint32_t id, VoxelBatch& batch,
                   const BatchSink& sink) {
  const FlatCorners posed = corners_of(job, job.posed, id), rest = corners_of(job, job.rest, id);
  const double det = det_of(posed), edge = longest_edge(posed);
  if (!(std::abs(det) > kNothing * edge * edge * edge)) return;
  std::array<Coordinate, 4> coordinates;
  for (std::size_t f = 0; f < 4; ++f) {
    const Vector3d& a = posed.x[(f + 1) % 4];
    const Vector3d u = posed.x[(f + 2) % 4] - a, v = posed.x[(f + 3) % 4] - a;
    const Vector3d normal = u.cross(v);
    const double height = normal.dot(posed.x[f] - a);
    coordinates[f] = {normal / height, -normal.dot(a) / height,
                      kFlatMargin * u.norm() * v.norm() * edge / std::abs(height)};
  }
  VoxelRange box = range;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = posed.x[0][static_cast<Eigen::Index>(axis)], high = low;
    for (const Vector3d& x : posed.x) {
      low = std::min(low, x[static_cast<Eigen::Index>(axis)]);
      high = std::max(high, x[static_cast<Eigen::Index>(axis)]);
    }
    box.first[axis] = std::max(box.first[axis], static_cast<std::int32_t>(std::ceil(low)));
    box.last[axis] = std::min(box.last[axis], static_cast<std::int32_t>(std::floor(high)));
  }
  for (std::int32_t k = box.first[2]; k <= box.last[2]; ++k) {
    for (std::int32_t j = box.first[1]; j <= box.last[1]; ++j) {
      for (std::int32_t i = box.first[0]; i <= box.last[0]; ++i) {
        if (job.only && !job.only.has(i, j, k)) continue;
        const Vector3d at(i, j, k);
        std::array<double, 4> share;
        bool inside = true;
        for (std::size_t c = 0; c < 4; ++c) {
          share[c] = coordinates[c].of(at);
          inside = inside && share[c] >= -coordinates[c].margin;
        }
        if (!inside) continue;
        Vector3d place = rest.x[0];
        for (std::size_t c = 1; c < 4; ++c) place += share[c] * (rest.x[c] - rest.x[0]);
        if (batch.count == VoxelBatch::capacity) {
          sink.sample(sink.to, batch);
          batch.count = 0;
        }
        const auto row = static_cast<std::uint32_t>(job.size[1] * k + j);
        batch.offset[batch.count] =
            row * static_cast<std::uint32_t>(job.size[0]) + static_cast<std::uint32_t>(i);
        for (std::size_t c = 0; c < 3; ++c) {
          const double x = place[static_cast<Eigen::Index>(c)], whole = std::floor(x);
          batch.base[c][batch.count] = static_cast<std::int32_t>(whole);
          batch.part[c][batch.count] = static_cast<float>(x - whole);
        }
        ++batch.count;
      }
    }
  }
}

}  // namespace ecorche::runtime
