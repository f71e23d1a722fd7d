// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/carry_back.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>

#include "core/linear/decompositions.hpp"
#include "preprocess/mapping/tet_corners.hpp"

namespace ecorche::mapping {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The tet's edges from its first corner.
Matrix3d edges_of(const PointsF& nodes, const Tets& tets, std::int32_t tet) {
  const std::array<Vector3d, 4> x = corners_of(nodes, tets, tet);
  Matrix3d out;
  for (std::size_t c = 1; c < 4; ++c) out.col(static_cast<Eigen::Index>(c) - 1) = x[c] - x[0];
  return out;
}

// The deformation gradient from rest, apart: u * stretch * v^T.
class Gradient {
 public:
  Gradient(const Matrix3d& rest, const Matrix3d& posed) : svd_(gradient(rest, posed)) {
    inside_out_ = (posed.determinant() < 0) != (rest.determinant() < 0);
  }

  bool folded() const { return inside_out_ || !(svd_.s[2] >= kLeastStretch); }

  Vector3d back(const Vector3d& way) const {
    const Vector3d stretch = svd_.s.cwiseMax(kLeastStretch);
    return svd_.V * (svd_.U.transpose() * way).cwiseQuotient(stretch);
  }

 private:
  // A tet without volume at rest (rounded nodes of a sliver) has none.
  static linear::Svd gradient(const Matrix3d& rest, const Matrix3d& posed) {
    const Matrix3d f = posed * rest.inverse();
    return linear::svd(f.allFinite() ? f : Matrix3d::Zero());
  }

  linear::Svd svd_;
  bool inside_out_ = false;
};

}  // namespace

bool is_folded(const CarryingTets& body, std::int32_t tet) {
  return Gradient(edges_of(body.rest, body.tets, tet), edges_of(body.posed, body.tets, tet)).folded();
}

CarriedBack carry_back(const CarryingTets& body, const Points& points, std::span<const std::int32_t> tet,
                       const Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor>& share,
                       const Context& context) {
  constexpr Eigen::Index kBlock = 4096;
  CarriedBack out;
  out.points.resize(points.rows(), 3);
  out.folded.assign(static_cast<std::size_t>(points.rows()), 0);
  tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, points.rows(), kBlock), [&](const auto& range) {
    context.check_stop();
    for (Eigen::Index p = range.begin(); p < range.end(); ++p) {
      const std::int32_t t = tet[static_cast<std::size_t>(p)];
      const Matrix3d rest = edges_of(body.rest, body.tets, t), posed = edges_of(body.posed, body.tets, t);
      const Vector3d along = share.row(p).tail<3>().transpose().cast<double>();
      const auto first = [&](const PointsF& nodes) -> Vector3d {
        return nodes.row(body.tets(t, 0)).transpose().cast<double>();
      };
      const Vector3d put = first(body.posed) + posed * along;
      const Gradient gradient(rest, posed);
      const Vector3d back = first(body.rest) + rest * along + gradient.back(points.row(p).transpose() - put);
      out.points.row(p) = back.transpose();
      out.folded[static_cast<std::size_t>(p)] = gradient.folded() ? 1 : 0;
    }
  });
  return out;
}

}  // namespace ecorche::mapping
