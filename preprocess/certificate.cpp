// SPDX-License-Identifier: Apache-2.0
// What is measured on a model before it is believed.
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/preprocess/pipeline.hpp>
#include "core/geometry/closest_point.hpp"
#include "core/geometry/dihedral.hpp"
#include "core/geometry/edges.hpp"
#include "core/linear/decompositions.hpp"
#include "preprocess/bounds.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::preprocess {
namespace {

// A vertex this near to its tet is in it: the accuracy of rest in, rest out. 0.001 mm of a man; never finer
// than the places that float32 has for it.
constexpr double kInside = 6e-7;     // of the body's length
constexpr double kInsideGrains = 2;  // half of one a coordinate is rounding, of vertex and corners

using Range = tbb::blocked_range<std::int64_t>;
constexpr std::int64_t kGrain = 1 << 14;

// Extremes and counts over all rows 0 .. count: `Part` has add(row) and merge(Part). Neither depends on the
// order, so the result is the same for any number of threads.
template <class Part>
Part over(std::int64_t count, const Part& none, const Context& context) {
  return tbb::parallel_reduce(
      Range(0, count, kGrain), none,
      [&](const Range& range, Part part) {
        context.check_stop();
        for (std::int64_t i = range.begin(); i < range.end(); ++i) part.add(i);
        return part;
      },
      [](Part a, const Part& b) {
        a.merge(b);
        return a;
      });
}

struct WeightsPart {
  const Weights* weights;
  double min = 1, max = 0, row_sum_error = 0;

  void add(std::int64_t node) {
    double sum = 0;
    for (auto i = weights->offsets[static_cast<std::size_t>(node)];
         i < weights->offsets[static_cast<std::size_t>(node) + 1]; ++i) {
      const double w = weights->weight[i];
      min = std::min(min, w);
      max = std::max(max, w);
      sum += w;
    }
    row_sum_error = std::max(row_sum_error, std::abs(sum - 1));
  }
  void merge(const WeightsPart& other) {
    min = std::min(min, other.min);
    max = std::max(max, other.max);
    row_sum_error = std::max(row_sum_error, other.row_sum_error);
  }
};

std::array<Eigen::Vector3d, 4> corners_of(const Model& model, std::int64_t tet) {
  std::array<Eigen::Vector3d, 4> corner;
  for (int c = 0; c < 4; ++c) {
    corner[static_cast<std::size_t>(c)] = model.nodes.row(model.tets(tet, c)).transpose().cast<double>();
  }
  return corner;
}

struct TetsPart {
  const Model* model;
  double short_edge;                              // mm
  double least_cosine = 1, greatest_cosine = -1;  // of the dihedral angles
  double min_edge = std::numeric_limits<double>::infinity();
  std::uint64_t inverted = 0, degenerate = 0;

  void add(std::int64_t tet) {
    const std::array<Eigen::Vector3d, 4> corner = corners_of(*model, tet);
    const geometry::TetShape shape = geometry::tet_shape(corner);
    const double edge = geometry::shortest_edge(corner);
    min_edge = std::min(min_edge, edge);
    inverted += shape.inverted() ? 1 : 0;
    degenerate += shape.flat || edge < short_edge ? 1 : 0;
    if (shape.flat) return;  // its angles say nothing
    least_cosine = std::min(least_cosine, shape.least_cosine);
    greatest_cosine = std::max(greatest_cosine, shape.greatest_cosine);
  }
  void merge(const TetsPart& other) {
    least_cosine = std::min(least_cosine, other.least_cosine);
    greatest_cosine = std::max(greatest_cosine, other.greatest_cosine);
    min_edge = std::min(min_edge, other.min_edge);
    inverted += other.inverted;
    degenerate += other.degenerate;
  }
};

double degrees_of_cosine(double cosine) {
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

struct TissuePart {
  const Model* model;
  const Tissue* tissue;
  double inside_mm;
  std::uint64_t outside = 0;
  double max_outside_mm = 0;

  void add(std::int64_t vertex) {
    const Eigen::Vector3d p = tissue->V.row(vertex).transpose().cast<double>();
    const double distance =
        geometry::distance_to_tet(p, corners_of(*model, tissue->tet[static_cast<std::size_t>(vertex)]));
    outside += distance > inside_mm ? 1 : 0;
    if (distance > inside_mm) max_outside_mm = std::max(max_outside_mm, distance);
  }
  void merge(const TissuePart& other) {
    outside += other.outside;
    max_outside_mm = std::max(max_outside_mm, other.max_outside_mm);
  }
};

// Every joint turned at once, whatever its limits: a pose that no bone can pass by accident.
Pose probe_pose(std::size_t joints) {
  Pose pose = Pose::rest(joints);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.rotation.assign(joints, turn);
  pose.root_translation = {200, -200, 200};
  return pose;
}

// A float32 motion as the run time's: turned about the bone's own middle, shifted in double.
PointsF moved(const PointsF& V, const RigidTransform& motion) {
  const Eigen::RowVector3f middle = 0.5F * (V.colwise().minCoeff() + V.colwise().maxCoeff());
  const Eigen::Matrix3f rotation = motion.q.toRotationMatrix().cast<float>();
  const Eigen::RowVector3d to = (motion * Eigen::Vector3d(middle.transpose().cast<double>())).transpose();
  const PointsF turned = (V.rowwise() - middle) * rotation.transpose();
  return (turned.cast<double>().rowwise() + to).cast<float>();
}

// The largest distance, mm, that remains between `to` and the best rigid motion of `from`.
double rigid_residual(const PointsF& from, const PointsF& to) {
  const Points a = from.cast<double>(), b = to.cast<double>();
  const Eigen::RowVector3d mean_a = a.colwise().mean(), mean_b = b.colwise().mean();
  const Eigen::Matrix3d turn =
      linear::nearest_turn((b.rowwise() - mean_b).transpose() * (a.rowwise() - mean_a));
  const Points fitted = ((a.rowwise() - mean_a) * turn.transpose()).rowwise() + mean_b;
  return (fitted - b).rowwise().norm().maxCoeff();
}

double bone_rigidity(const Model& model, const Context& context) {
  const std::vector<RigidTransform> motion =
      kinematics::forward(model.rig, probe_pose(model.segment_count()));
  double worst = 0;
  for (const Tissue& tissue : model.tissues) {
    context.check_stop();
    if (tissue.segment == Tissue::by_tets || tissue.V.rows() == 0) continue;
    worst = std::max(
        worst, rigid_residual(tissue.V, moved(tissue.V, motion[static_cast<std::size_t>(tissue.segment)])));
  }
  return worst;
}

// Of the tets of bones, their nodes moved in double precision by their weights as LBS moves them: whoever
// weighs 1 goes rigidly, by every skinning method.
struct BonesPart {
  const Model* model;
  const std::vector<RigidTransform>* motion;
  double change = 0;

  void add(std::int64_t tet) {
    if (model->tet_label[static_cast<std::size_t>(tet)] == TetMesh::soft) return;
    const std::array<Eigen::Vector3d, 4> rest = corners_of(*model, tet);
    std::array<Eigen::Vector3d, 4> posed;
    for (std::size_t c = 0; c < 4; ++c)
      posed[c] = blended(static_cast<std::size_t>(model->tets(tet, static_cast<Eigen::Index>(c))), rest[c]);
    change = std::max(change, geometry::tet_change(rest, posed));
  }
  void merge(const BonesPart& other) { change = std::max(change, other.change); }

 private:
  Eigen::Vector3d blended(std::size_t node, const Eigen::Vector3d& at) const {
    const Weights& weights = model->weights;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (auto e = weights.offsets[node]; e < weights.offsets[node + 1]; ++e)
      sum += static_cast<double>(weights.weight[e]) * ((*motion)[weights.segment[e]] * at);
    return sum;
  }
};

void measure_bones(const Model& model, const Context& context, Certificate& out) {
  const std::vector<RigidTransform> motion =
      kinematics::forward(model.rig, probe_pose(model.segment_count()));
  const auto tets = static_cast<std::int64_t>(model.tet_count());
  out.bone_tet_change = over(tets, BonesPart{&model, &motion}, context).change;

  struct Volume {
    double own = 0, contested = 0;
  };
  std::vector<Volume> bones(model.bone_names.size() + 1);  // by label
  out.bone_tets = out.contested_tets = 0;
  const auto volume = [&](std::int64_t tet) {
    const std::array<Eigen::Vector3d, 4> c = corners_of(model, tet);
    return (c[1] - c[0]).cross(c[2] - c[0]).dot(c[3] - c[0]) / 6;
  };
  for (std::int64_t t = 0; t < tets; ++t) {
    const std::uint16_t label = model.tet_label[static_cast<std::size_t>(t)];
    if (label == TetMesh::soft) continue;
    ++out.bone_tets;
    bones.at(label).own += volume(t);
  }
  for (const std::uint16_t label : model.contested) {
    bones.at(label).contested += volume(static_cast<std::int64_t>(out.bone_tets + out.contested_tets));
    ++out.contested_tets;
  }
  Volume all;
  out.least_bone_share = 1;
  for (const Volume& bone : bones) {
    all.own += bone.own;
    all.contested += bone.contested;
    if (bone.contested > 0)
      out.least_bone_share = std::min(out.least_bone_share, bone.own / (bone.own + bone.contested));
  }
  out.contested_share = all.contested > 0 ? all.contested / (all.own + all.contested) : 0;
}

}  // namespace

Certificate measure(const Model& model, const Context& context) {
  Certificate out = model.certificate;

  const auto weights =
      over(static_cast<std::int64_t>(model.node_count()), WeightsPart{&model.weights}, context);
  out.min_weight = weights.min;
  out.max_weight = weights.max;
  out.row_sum_error = weights.row_sum_error;
  context.report(0.1);

  const auto tets = over(static_cast<std::int64_t>(model.tet_count()),
                         TetsPart{&model, geometry::unresolved_edge(model.nodes)}, context);
  out.min_dihedral_deg = degrees_of_cosine(tets.greatest_cosine);
  out.max_dihedral_deg = degrees_of_cosine(tets.least_cosine);
  out.inverted_tets = tets.inverted;
  out.degenerate_tets = tets.degenerate;
  out.min_edge_mm = tets.min_edge;
  context.report(0.3);

  out.positive_offdiagonal_share = 1;  // the worst, where a tet has no gradients at all
  if (tets.inverted + tets.degenerate == 0) {
    weights::stiffness(model.nodes.cast<double>(), model.tets, {}, &out.positive_offdiagonal_share);
  }
  context.check_stop();
  context.report(0.8);

  out.tissue_vertices = out.outside_vertices = 0;
  out.max_outside_mm = 0;
  const BodySize size = body_size(model);
  const double inside_mm = std::max(kInside * size.length_mm, kInsideGrains * size.grain_mm);
  for (const Tissue& tissue : model.tissues) {
    out.tissue_vertices += static_cast<std::uint64_t>(tissue.V.rows());
    if (tissue.segment != Tissue::by_tets) continue;
    const auto part = over(tissue.V.rows(), TissuePart{&model, &tissue, inside_mm}, context);
    out.outside_vertices += part.outside;
    out.max_outside_mm = std::max(out.max_outside_mm, part.max_outside_mm);
  }
  context.report(0.95);

  measure_bones(model, context, out);
  out.bone_rigidity_mm = bone_rigidity(model, context);
  return out;
}

}  // namespace ecorche::preprocess
