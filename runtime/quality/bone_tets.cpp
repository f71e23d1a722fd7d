// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/bone_tets.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ecorche::runtime {
namespace {

using Corners = std::array<Eigen::Vector3d, 4>;

double det(const Corners& c) {
  return (c[1] - c[0]).cross(c[2] - c[0]).dot(c[3] - c[0]);
}

double float_step(std::span<const float> nodes) {
  float far = 0;
  for (const float x : nodes) far = std::max(far, std::abs(x));
  return static_cast<double>(std::nextafter(far, std::numeric_limits<float>::infinity()) - far);
}

}  // namespace

BoneTets measure_bone_tets(const Model& model, std::span<const float> nodes) {
  const double rounding = 4 * float_step(nodes);
  const auto corners = [&](std::size_t tet, const float* from) {
    Corners out;
    for (std::size_t c = 0; c < 4; ++c) {
      const auto node =
          static_cast<Eigen::Index>(model.tets(static_cast<Eigen::Index>(tet), static_cast<Eigen::Index>(c)));
      out[c] = Eigen::Map<const Eigen::Vector3f>(from + 3 * node).cast<double>();
    }
    return out;
  };
  const auto add = [&](std::size_t tet, BoneTets& out) {
    const Corners rest = corners(tet, model.nodes.data()), posed = corners(tet, nodes.data());
    bool changed = !(det(posed) > 0);
    ++out.count;
    out.inverted += changed ? 1 : 0;
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = a + 1; b < 4; ++b) {
        const double was = (rest[b] - rest[a]).norm(), by = std::abs((posed[b] - posed[a]).norm() - was);
        out.largest_change_mm = std::max(out.largest_change_mm, by);
        changed = changed || !(by <= BoneTets::changed_by * was + rounding);
      }
    }
    out.changed += changed ? 1 : 0;
  };
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, model.tet_count(), 1 << 14), BoneTets{},
      [&](const auto& range, BoneTets part) {
        for (std::size_t t = range.begin(); t < range.end(); ++t)
          if (model.tet_label[t] != TetMesh::soft) add(t, part);
        return part;
      },
      [](BoneTets a, const BoneTets& b) {
        a.count += b.count;
        a.inverted += b.inverted;
        a.changed += b.changed;
        a.largest_change_mm = std::max(a.largest_change_mm, b.largest_change_mm);
        return a;
      });
}

}  // namespace ecorche::runtime
