// SPDX-License-Identifier: Apache-2.0
// Skinning as the papers write it: double precision, global transforms, node by node. The oracle of
// runtime/skin.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::test {

struct ReferenceEntry {
  std::size_t segment;
  double weight;
};

/// The weights of a node that are at least `cut`, divided by their sum.
inline std::vector<ReferenceEntry> reference_weights(const Model& model, std::size_t node, double cut) {
  std::vector<ReferenceEntry> row;
  double sum = 0;
  for (std::size_t e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
    const double w = static_cast<double>(model.weights.weight[e]);
    if (w < cut) continue;
    row.push_back({model.weights.segment[e], w});
    sum += w;
  }
  for (ReferenceEntry& entry : row) entry.weight /= sum;
  return row;
}

inline Eigen::Vector3d reference_lbs(const std::vector<ReferenceEntry>& row,
                                     const std::vector<RigidTransform>& segments, const Eigen::Vector3d& x) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [s, w] : row) sum += w * (segments[s] * x);
  return sum;
}

inline Eigen::Quaterniond scaled(const Eigen::Quaterniond& q, double factor) {
  return Eigen::Quaterniond(q.coeffs() * factor);
}

/// Kavan08: blend unit dual quaternions q + e/2 t q, divide by the length of the real part, apply. The dual
/// part's component along the real part drops out of the translation.
inline Eigen::Vector3d reference_dqs(const std::vector<ReferenceEntry>& row,
                                     const std::vector<RigidTransform>& segments, const Eigen::Vector3d& x) {
  Eigen::Quaterniond real(0, 0, 0, 0), dual(0, 0, 0, 0);
  for (const auto& [s, w] : row) {
    const Eigen::Vector3d& t = segments[s].t;
    real.coeffs() += w * segments[s].q.coeffs();
    dual.coeffs() += w * 0.5 * (Eigen::Quaterniond(0, t.x(), t.y(), t.z()) * segments[s].q).coeffs();
  }
  const double length = real.norm();
  real = scaled(real, 1 / length);
  dual = scaled(dual, 1 / length);
  return real.toRotationMatrix() * x + 2 * (dual * real.conjugate()).vec();
}

/// LeHodgins16: the turn of the blended quaternion about the centre, which itself moves by linear blending.
inline Eigen::Vector3d reference_cor(const std::vector<ReferenceEntry>& row,
                                     const std::vector<RigidTransform>& segments, const Eigen::Vector3d& x,
                                     const Eigen::Vector3d& centre) {
  Eigen::Quaterniond blend(0, 0, 0, 0);
  for (const auto& [s, w] : row) blend.coeffs() += w * segments[s].q.coeffs();
  const Eigen::Matrix3d R = blend.normalized().toRotationMatrix();
  return R * (x - centre) + reference_lbs(row, segments, centre);
}

/// All nodes. `segments`: global motions with their signs fixed down the tree; `cut`: 1e-4 for what the run
/// time keeps, 0 for everything that is stored.
inline std::vector<Eigen::Vector3d> reference_nodes(const Model& model,
                                                    const std::vector<RigidTransform>& segments,
                                                    runtime::Skinning skinning, double cut) {
  std::vector<Eigen::Vector3d> out(model.node_count());
  for (std::size_t n = 0; n < out.size(); ++n) {
    const auto r = static_cast<Eigen::Index>(n);
    const Eigen::Vector3d x = model.nodes.row(r).cast<double>().transpose();
    const auto row = reference_weights(model, n, cut);
    if (skinning == runtime::Skinning::dqs) {
      out[n] = reference_dqs(row, segments, x);
    } else if (skinning == runtime::Skinning::cor && model.cor.has_centre[n] != 0) {
      out[n] = reference_cor(row, segments, x, model.cor.centre.row(r).cast<double>().transpose());
    } else {
      out[n] = reference_lbs(row, segments, x);
    }
  }
  return out;
}

/// All vertices of a tissue from reference nodes: the affine map of its tet, or its segment's motion.
inline std::vector<Eigen::Vector3d> reference_tissue(const Model& model, const Tissue& tissue,
                                                     const std::vector<RigidTransform>& segments,
                                                     const std::vector<Eigen::Vector3d>& nodes) {
  std::vector<Eigen::Vector3d> out(static_cast<std::size_t>(tissue.V.rows()), Eigen::Vector3d::Zero());
  for (std::size_t v = 0; v < out.size(); ++v) {
    const auto r = static_cast<Eigen::Index>(v);
    if (tissue.segment != Tissue::by_tets) {
      out[v] = segments[static_cast<std::size_t>(tissue.segment)] *
               Eigen::Vector3d(tissue.V.row(r).cast<double>().transpose());
      continue;
    }
    const std::array<double, 3> b{static_cast<double>(tissue.barycentric(r, 1)),
                                  static_cast<double>(tissue.barycentric(r, 2)),
                                  static_cast<double>(tissue.barycentric(r, 3))};
    const auto node = [&](int c) -> const Eigen::Vector3d& {
      return nodes[static_cast<std::size_t>(model.tets(tissue.tet[v], c))];
    };
    out[v] = (1 - b[0] - b[1] - b[2]) * node(0) + b[0] * node(1) + b[1] * node(2) + b[2] * node(3);
  }
  return out;
}

/// Largest distance, mm, between 3 * #points floats and points.
inline double farthest(const std::vector<float>& found, const std::vector<Eigen::Vector3d>& expected) {
  double worst = found.size() == 3 * expected.size() ? 0 : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < expected.size() && std::isfinite(worst); ++i) {
    const Eigen::Vector3d x(static_cast<double>(found[3 * i]), static_cast<double>(found[3 * i + 1]),
                            static_cast<double>(found[3 * i + 2]));
    worst = std::max(worst, (x - expected[i]).norm());
  }
  return worst;
}

/// Rows of a 3-column matrix as points.
inline std::vector<Eigen::Vector3d> points_of(const PointsF& rows) {
  std::vector<Eigen::Vector3d> out;
  for (Eigen::Index r = 0; r < rows.rows(); ++r) out.emplace_back(rows.row(r).cast<double>().transpose());
  return out;
}

}  // namespace ecorche::test
