// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/plain_eigen.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <unordered_map>

namespace ecorche::bench {
namespace {

using Eigen::Matrix4f;
using Eigen::Quaternionf;
using Eigen::Vector3f;

constexpr std::size_t kRows = 2048;

template <class Work>
void over(std::size_t count, Work work) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kRows), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) work(i);
  });
}

template <class Corner>
Matrix4f corners(const Model& model, std::int32_t tet, Corner corner) {
  Matrix4f out = Matrix4f::Ones();
  for (int c = 0; c < 4; ++c) out.col(c).head<3>() = corner(static_cast<std::size_t>(model.tets(tet, c)));
  return out;
}

}  // namespace

PlainEigen::PlainEigen(const Model& model) : posed(model.node_count()), model_(model) {
  std::unordered_map<std::int32_t, std::uint32_t> row;
  for (const Tissue& tissue : model.tissues) {
    vertices.emplace_back(static_cast<std::size_t>(tissue.V.rows()));
    of_vertex_.emplace_back();
    for (const std::int32_t tet : tissue.tet) {
      const auto [place, fresh] = row.try_emplace(tet, static_cast<std::uint32_t>(tets_.size()));
      if (fresh) tets_.push_back(tet);
      of_vertex_.back().push_back(place->second);
    }
  }
  for (const std::int32_t tet : tets_) {
    rest_.push_back(corners(model, tet, [&](std::size_t n) -> Vector3f {
                      return model.nodes.row(static_cast<Eigen::Index>(n)).transpose();
                    }).inverse());
  }
  matrix_.resize(tets_.size());
}

void PlainEigen::nodes(const std::vector<RigidTransform>& segments, runtime::Skinning skinning) {
  const Weights& weights = model_.weights;
  std::vector<Matrix4f> matrices;
  std::vector<Quaternionf> real, dual;
  for (const RigidTransform& segment : segments) {
    Matrix4f m = Matrix4f::Identity();
    m.topLeftCorner<3, 3>() = segment.q.toRotationMatrix().cast<float>();
    m.topRightCorner<3, 1>() = segment.t.cast<float>();
    matrices.push_back(m);
    real.push_back(segment.q.cast<float>());
    dual.push_back(
        (Eigen::Quaterniond(0, segment.t.x() / 2, segment.t.y() / 2, segment.t.z() / 2) * segment.q)
            .cast<float>());
  }
  over(posed.size(), [&](std::size_t n) {
    const auto r = static_cast<Eigen::Index>(n);
    const Vector3f x = model_.nodes.row(r).transpose();
    Matrix4f blend = Matrix4f::Zero();
    Quaternionf q(0, 0, 0, 0), d(0, 0, 0, 0);
    float sum = 0;
    for (auto e = weights.offsets[n]; e < weights.offsets[n + 1]; ++e) {
      const float w = weights.weight[e];
      if (w < 1e-4F) continue;
      const std::size_t s = weights.segment[e];
      sum += w;
      if (skinning != runtime::Skinning::dqs) blend += w * matrices[s];
      if (skinning != runtime::Skinning::lbs) q.coeffs() += w * real[s].coeffs();
      if (skinning == runtime::Skinning::dqs) d.coeffs() += w * dual[s].coeffs();
    }
    blend /= sum;
    if (skinning == runtime::Skinning::dqs) {
      const float length = q.norm();
      q.coeffs() /= length;
      d.coeffs() /= length;
      posed[n] = q * x + 2 * (d * q.conjugate()).vec();
    } else if (skinning == runtime::Skinning::lbs || model_.cor.has_centre[n] == 0) {
      posed[n] = (blend * x.homogeneous()).head<3>();
    } else {
      const Vector3f p = model_.cor.centre.row(r).transpose();
      posed[n] = q.normalized() * Vector3f(x - p) + (blend * p.homogeneous()).head<3>();
    }
  });
}

void PlainEigen::tissues(const std::vector<RigidTransform>& segments) {
  over(tets_.size(), [&](std::size_t t) {
    matrix_[t] = corners(model_, tets_[t], [&](std::size_t n) { return posed[n]; }) * rest_[t];
  });
  for (std::size_t t = 0; t < vertices.size(); ++t) {
    const Tissue& tissue = model_.tissues[t];
    over(vertices[t].size(), [&](std::size_t v) {
      const Vector3f x = tissue.V.row(static_cast<Eigen::Index>(v)).transpose();
      if (tissue.segment == Tissue::by_tets) {
        vertices[t][v] = (matrix_[of_vertex_[t][v]] * x.homogeneous()).head<3>();
      } else {
        const RigidTransform& segment = segments[static_cast<std::size_t>(tissue.segment)];
        vertices[t][v] = segment.q.cast<float>() * x + segment.t.cast<float>();
      }
    });
  }
}

}  // namespace ecorche::bench
