// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/solve_sample.hpp"

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/kinematics/interpolate.hpp>
#include "preprocess/correct/skinned_node.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::correct {
namespace {

constexpr double kToleranceMm = 1e-3;  // a fiftieth of what is kept at all
constexpr double kHalf = 0.5;          // of the way from a sample to the next, which is short

// Where flesh buckles, the way leads through balances so shallow that Newton walks on for hundreds of steps,
// to another one that is centimetres off. What is near to balance on this way is worth more than that, and
// folds on the way are no reason to go back: they are counted in the end.
fem::FollowOptions through_folds(fem::NewtonOptions newton) {
  constexpr double kNearMm = 0.5;
  fem::FollowOptions way;
  newton.tolerance_mm = kNearMm;
  way.last = newton;
  way.between_mm = kNearMm;
  way.most_iterations = 400;
  way.folds_below = 1;
  return way;
}

}  // namespace

SampleSolver::SampleSolver(const Model& model, const Neighbourhood& part, const fem::Material& material,
                           double folds)
    : model_(model),
      part_(part),
      material_(material),
      folds_(folds),
      assembly_(part.mesh),
      solver_(
          weights::make_solver(weights::solver_for(static_cast<std::int64_t>(3 * part.mesh.free_nodes)))) {}

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

Points SampleSolver::displaced(const Skinned& skinned, const std::vector<float>& displacement) const {
  Points x = skinned.at;
  for (std::size_t i = 0; i < part_.node.size() && !displacement.empty(); ++i) {
    if (part_.mesh.free[i] < 0) continue;
    const Eigen::Vector3d u = Eigen::Map<const Eigen::Vector3f>(&displacement[3 * i]).cast<double>();
    x.row(static_cast<Eigen::Index>(i)) += (skinned.turn[i] * u).transpose();
  }
  return x;
}

fem::FollowResult SampleSolver::follow(fem::StepSolver& steps, const fem::FollowOptions& way,
                                       const Nearer& from, const Pose& pose, Points& x,
                                       const Context& context) const {
  x = displaced(skin(from.pose), from.displacement);
  const auto held_at = [&](double t, Points& to) {
    const Points at = skin(t < 1 ? kinematics::between(from.pose, pose, t) : pose).at;
    for (std::size_t i = 0; i < part_.node.size(); ++i)
      if (part_.mesh.free[i] < 0) to.row(static_cast<Eigen::Index>(i)) = at.row(static_cast<Eigen::Index>(i));
  };
  return fem::follow(assembly_, material_, steps, held_at, way, x, context.quiet());
}

SolvedSample SampleSolver::solve(const Pose& pose, const Nearer* nearer, const Context& context) {
  const std::vector<float> none;
  const Pose rest = Pose::rest(pose.rotation.size());
  const Nearer from = nearer != nullptr ? *nearer : Nearer{rest, none};
  const Skinned skinned = skin(pose);
  const std::size_t by_skinning = assembly_.total(material_, skinned.at).inverted_tets;
  fem::StepSolver steps(assembly_, *solver_);
  fem::NewtonOptions newton;
  newton.tolerance_mm = kToleranceMm;
  Points x = displaced(skinned, from.displacement);
  fem::NewtonResult found = fem::minimise(assembly_, material_, steps, newton, x, context);
  SolvedSample out;
  out.iterations = found.iterations;
  if (!found.converged || found.total.inverted_tets > 0) {
    fem::FollowOptions way{.last = newton};
    if (!from.displacement.empty()) way.first_step = kHalf;
    if (!found.converged) way = through_folds(newton);
    Points followed;
    fem::NewtonResult other = follow(steps, way, from, pose, followed, context).newton;
    out.iterations += other.iterations;
    // The balance of the nearer sample may be one that ends on the way; that of rest is another.
    if (!other.converged && !found.converged && !from.displacement.empty()) {
      other = follow(steps, way, Nearer{rest, none}, pose, followed, context).newton;
      out.iterations += other.iterations;
    }
    if (other.converged && (!found.converged || other.total.inverted_tets < found.total.inverted_tets)) {
      found = std::move(other);
      x = std::move(followed);
    }
  }
  out.inverted_tets = found.total.inverted_tets;
  out.by_skinning = by_skinning;
  const bool few = static_cast<double>(out.inverted_tets) <= folds_ * static_cast<double>(by_skinning);
  out.clean = found.converged && few ? 1 : 0;
  if (out.clean == 0) return out;
  out.displacement.assign(3 * part_.node.size(), 0.0F);
  for (std::size_t i = 0; i < part_.node.size(); ++i) {
    if (part_.mesh.free[i] < 0) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d u = skinned.turn[i].conjugate() * (x.row(row) - skinned.at.row(row)).transpose();
    Eigen::Map<Eigen::Vector3f>(&out.displacement[3 * i]) = u.cast<float>();
  }
  return out;
}

}  // namespace ecorche::correct
