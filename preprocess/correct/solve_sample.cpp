// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/solve_sample.hpp"

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/kinematics/interpolate.hpp>
#include "preprocess/correct/skinned_node.hpp"
#include "preprocess/fem/follow.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::correct {
namespace {

constexpr double kToleranceMm = 1e-3;  // a fiftieth of what is kept at all

}  // namespace

SampleSolver::SampleSolver(const Model& model, const Neighbourhood& part, const fem::Material& material,
                           double folds)
    : model_(model),
      part_(part),
      material_(material),
      most_folds_(static_cast<std::size_t>(folds * static_cast<double>(part.mesh.tets()))),
      assembly_(part.mesh),
      solver_(weights::make_solver(weights::solver_for(static_cast<std::int64_t>(3 * part.mesh.free_nodes)))),
      steps_(assembly_, *solver_) {}

SampleSolver::Skinned SampleSolver::skin(const Pose& pose) const {
  const std::vector<RigidTransform> segments = kinematics::forward(model_.rig, pose);
  Skinned out{Points(part_.mesh.X.rows(), 3), {}};
  for (std::size_t i = 0; i < part_.node.size(); ++i) {
    const SkinnedNode node = skin_node(model_, part_.node[i], segments);
    out.at.row(static_cast<Eigen::Index>(i)) = node.at.transpose();
    out.turn.push_back(node.turn);
  }
  return out;
}

SolvedSample SampleSolver::solve(const Pose& pose, const std::vector<float>& start, const Context& context) {
  const fem::Mesh& mesh = part_.mesh;
  const Skinned skinned = skin(pose);
  const auto is_free = [&](std::size_t i) { return mesh.free[i] >= 0; };
  const std::size_t by_skinning = assembly_.total(material_, skinned.at).inverted_tets;
  const auto clean = [&](const fem::NewtonResult& newton) {
    const std::size_t folds = newton.total.inverted_tets;
    return newton.converged && (folds == 0 || (folds <= most_folds_ && folds < by_skinning));
  };
  Points x = skinned.at;
  for (std::size_t i = 0; i < part_.node.size() && !start.empty(); ++i) {
    if (!is_free(i)) continue;
    const Eigen::Vector3d u = Eigen::Map<const Eigen::Vector3f>(&start[3 * i]).cast<double>();
    x.row(static_cast<Eigen::Index>(i)) += (skinned.turn[i] * u).transpose();
  }
  fem::NewtonOptions newton;
  newton.tolerance_mm = kToleranceMm;
  fem::NewtonResult found = fem::minimise(assembly_, material_, steps_, newton, x, context);
  SolvedSample out;
  out.iterations = found.iterations;
  if (!clean(found)) {
    const Pose rest = Pose::rest(pose.rotation.size());
    fem::FollowOptions way;
    way.last = newton;
    Points followed = mesh.X;
    const auto held_at = [&](double t, Points& to) {
      const Points at = t < 1 ? skin(kinematics::between(rest, pose, t)).at : skinned.at;
      for (std::size_t i = 0; i < part_.node.size(); ++i)
        if (!is_free(i)) to.row(static_cast<Eigen::Index>(i)) = at.row(static_cast<Eigen::Index>(i));
    };
    found = fem::follow(assembly_, material_, steps_, held_at, way, followed, context.quiet()).newton;
    out.iterations += found.iterations;
    x = std::move(followed);
  }
  out.inverted_tets = found.total.inverted_tets;
  out.clean = clean(found) ? 1 : 0;
  if (out.clean == 0) return out;
  out.displacement.assign(3 * part_.node.size(), 0.0F);
  for (std::size_t i = 0; i < part_.node.size(); ++i) {
    if (!is_free(i)) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d u = skinned.turn[i].conjugate() * (x.row(row) - skinned.at.row(row)).transpose();
    Eigen::Map<Eigen::Vector3f>(&out.displacement[3 * i]) = u.cast<float>();
  }
  return out;
}

}  // namespace ecorche::correct
