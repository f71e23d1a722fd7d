// SPDX-License-Identifier: Apache-2.0
// What tissues enclose while a patch of the body relaxes: none may come out farther from its rest volume.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Volumes of the closed tissues that hang on tets, and how far each may go.
class TissueVolumes {
 public:
  /// `nodes`: as skinned, 3 * #nodes; what the tissues enclose there is as far from rest as they may be,
  /// beside `tolerance` of their rest volume.
  TissueVolumes(const Model& model, std::span<const float> nodes, double tolerance);

  struct Row {
    std::size_t tissue = 0;  ///< of Model::tissues
    double rest = 0;         ///< mm^3
    double low = 0, high = 0;
  };
  const std::vector<Row>& rows() const { return rows_; }
  /// Volumes at `nodes`, mm^3, one a row.
  std::vector<double> at(std::span<const float> nodes) const;
  /// By how much of its rest volume a row's `volume` is out of its bounds; 0 within.
  double beyond(std::size_t row, double volume) const;

  const Model& model() const { return model_; }

 private:
  const Model& model_;
  std::vector<Row> rows_;
};

/// The part of them that moves with a patch's free nodes.
class PatchVolumes {
 public:
  PatchVolumes() = default;
  /// `free`: per node of the body its place among the patch's free nodes, -1 elsewhere. `now`: what the
  /// tissues enclose at `nodes`. `density`: tets a mm^3 of rest, which makes a volume as dear as shapes are.
  PatchVolumes(const TissueVolumes& tissues, std::span<const std::int32_t> free, std::span<const float> nodes,
               std::span<const double> now, double density);
  /// Of how many patches each row is: each takes its share of what the bounds leave.
  void share_out(std::span<const std::size_t> patches);

  /// Rows of TissueVolumes that hang on the patch.
  std::vector<std::size_t> rows() const;
  /// The augmented Lagrangian of the bounds at the free nodes `x`; adds its derivative to `gradient`.
  double operator()(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) const;
  /// Raises the price of the bounds that `x` does not keep; returns the largest breach, of a rest volume.
  double tighten(const Eigen::VectorXd& x);

 private:
  struct Vertex {
    std::array<std::int32_t, 4> row{-1, -1, -1, -1};  // of the free nodes
    std::array<double, 4> share{};
    Eigen::Vector3d held = Eigen::Vector3d::Zero();  // what the other corners give
  };
  struct Part {
    std::size_t row = 0;
    double rest = 0, before = 0;  // mm^3; of the triangles below
    double low = 0, high = 0;     // of the change, in rest volumes
    double price_low = 0, price_high = 0, stiff = 0;
    std::vector<Vertex> vertices;
    std::vector<std::array<std::int32_t, 3>> triangles;
  };

  double volume(const Part& part, const Eigen::VectorXd& x) const;
  void pull(const Part& part, double price, Eigen::VectorXd& gradient) const;

  std::vector<Part> parts_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  mutable std::vector<Eigen::Vector3d> placed_, pulls_;
};

}  // namespace ecorche::runtime
