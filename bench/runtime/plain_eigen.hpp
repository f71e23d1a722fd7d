// SPDX-License-Identifier: Apache-2.0
// The straightforward version of Sujar18 4, as one would write it from the paper with Eigen: the yardstick.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::bench {

/// All nodes by all their weights above 1e-4, then a matrix per tet that a vertex hangs on, then the vertices
/// by that matrix. In float, row by row; parallel over rows in the caller's arena.
class PlainEigen {
 public:
  explicit PlainEigen(const Model& model);
  void nodes(const std::vector<RigidTransform>& segments, runtime::Skinning skinning);
  void tissues(const std::vector<RigidTransform>& segments);

  std::vector<Eigen::Vector3f> posed;                  ///< #nodes
  std::vector<std::vector<Eigen::Vector3f>> vertices;  ///< per tissue

 private:
  const Model& model_;
  std::vector<std::int32_t> tets_;                     // that a vertex hangs on
  std::vector<Eigen::Matrix4f> rest_;                  // per tets_: inverse of its corners with a row of ones
  std::vector<Eigen::Matrix4f> matrix_;                // per tets_
  std::vector<std::vector<std::uint32_t>> of_vertex_;  // per tissue and vertex, row of tets_
};

}  // namespace ecorche::bench
