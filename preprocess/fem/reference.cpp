// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/reference.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/kinematics/interpolate.hpp>
#include "preprocess/fem/settling.hpp"
#include "preprocess/fem/stopwatch.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::fem {
namespace {

constexpr double kStep = 30 * std::numbers::pi / 180;  // of the joint that turns most, on the way from rest

double largest_turn(const Pose& pose) {
  double out = 0;
  for (const Eigen::Quaterniond& q : pose.rotation)
    out = std::max(out, q.angularDistance(Eigen::Quaterniond::Identity()));
  return out;
}

bool good(const NewtonResult& newton) {
  return newton.converged && newton.total.inverted_tets == 0;
}

double largest_distance(const Mesh& mesh, const Points& a, const Points& b) {
  double out = 0;
  for (std::size_t n = 0; n < mesh.free.size(); ++n) {
    const auto row = static_cast<Eigen::Index>(n);
    if (mesh.free[n] >= 0) out = std::max(out, (a.row(row) - b.row(row)).norm());
  }
  return out;
}

std::size_t inverted(const Points& x, const Tets& T, const std::vector<std::int32_t>& rows) {
  return static_cast<std::size_t>(std::count_if(rows.begin(), rows.end(), [&](std::int32_t t) {
    return !(tet_det(x.row(T(t, 0)), x.row(T(t, 1)), x.row(T(t, 2)), x.row(T(t, 3))) > 0);
  }));
}

Distances distances(const Mesh& mesh, const Points& skinned, const Points& x) {
  std::vector<double> all;
  for (Eigen::Index n = 0; n < skinned.rows(); ++n) {
    if (mesh.free[static_cast<std::size_t>(n)] < 0) continue;
    const double moved = std::max((skinned.row(n) - mesh.X.row(n)).norm(), (x.row(n) - mesh.X.row(n)).norm());
    if (moved > kMovedMm) all.push_back((x.row(n) - skinned.row(n)).norm());
  }
  Distances out;
  out.nodes = all.size();
  if (all.empty()) return out;
  std::sort(all.begin(), all.end());
  for (const double d : all) out.mean_mm += d / static_cast<double>(all.size());
  out.p95_mm = all[all.size() * 95 / 100];
  out.max_mm = all.back();
  return out;
}

}  // namespace

Reference solve_pose(const Model& model, const Pose& pose, std::span<const float> skinned,
                     const ReferenceOptions& options, const Context& context) {
  Reference out;
  const auto material = make_material(options.material, options.poisson);
  const auto solver = weights::make_solver(options.solver);
  const Pose rest = Pose::rest(pose.rotation.size());
  const Eigen::Index nodes = model.nodes.rows();

  std::unique_ptr<const Body> body;
  std::unique_ptr<const Assembly> assembly;
  {
    const Stopwatch watch(out.seconds_build);
    body = std::make_unique<const Body>(body_of(model, options.element));
    assembly = std::make_unique<const Assembly>(body->mesh);
  }
  if (body->mesh.free_nodes == 0)
    throw Error(ErrorKind::data, "fem", "no soft tet hangs on a bone: there is nothing to solve for",
                "give a model of a body with flesh and bones");
  const auto held_at = [&](double t, Points& x) {
    place_held(*body, kinematics::forward(model.rig, kinematics::between(rest, pose, t)), x);
  };
  StepSolver steps(*assembly, *solver);
  NewtonOptions newton;
  if (options.settles) newton.settle = settling(body->mesh, *material);

  // From where skinning puts the nodes.
  const Points start = Eigen::Map<const PointsF>(skinned.data(), nodes, 3).cast<double>();
  Points x = with_middles(body->mesh, start);
  held_at(1, x);
  {
    const Stopwatch watch(out.seconds_skinned);
    out.newton = minimise(*assembly, *material, steps, newton, x, context);
  }
  out.from = "skinned";
  out.skinned_good = good(out.newton);
  context.report(0.4);

  // From rest: the second opinion, and what is left where skinning's folds do not come undone.
  if (options.two_starts) {
    FollowOptions way;
    way.last = newton;
    way.first_step = std::min(1.0, kStep / std::max(largest_turn(pose), 1e-9));
    Points other = body->mesh.X;
    FollowResult followed;
    {
      const Stopwatch watch(out.seconds_rest);
      followed = follow(*assembly, *material, steps, held_at, way, other, context.quiet());
    }
    out.reached = followed.reached;
    out.steps = followed.steps;
    out.refused = followed.refused;
    out.rest_good = good(followed.newton);
    if (out.newton.converged && followed.newton.converged) {
      out.compared = true;
      out.between_starts_mm = largest_distance(body->mesh, x, other);
    }
    const bool better =
        !out.newton.converged || followed.newton.total.inverted_tets < out.newton.total.inverted_tets;
    if (followed.newton.converged && better) {
      x = std::move(other);
      out.newton = std::move(followed.newton);
      out.from = "rest";
    }
  }
  context.report(0.9);

  out.tets = body->mesh.tets();
  out.free_nodes = body->mesh.free_nodes;
  out.soft_tets = body->soft_tets;
  out.on_bones = body->on_bones;
  out.between = body->between.size();
  out.floating = body->floating;
  out.material_tets.resize(model.materials.tissue.size());
  for (const std::int32_t t : body->tet)
    if (!out.material_tets.empty()) ++out.material_tets[model.materials.of_tet[static_cast<std::size_t>(t)]];
  out.rest_mm3 = body->rest_mm3;
  out.posed_mm3 = out.newton.total.volume;
  out.nodes = x.topRows(nodes);
  out.solved.resize(static_cast<std::size_t>(nodes));
  for (std::size_t n = 0; n < out.solved.size(); ++n) {
    out.solved[n] = body->mesh.free[n] >= 0 ? 1 : 0;
    const auto row = static_cast<Eigen::Index>(n);
    if (out.solved[n] == 0) out.nodes.row(row) = start.row(row);
  }
  out.squeezed = inverted(out.nodes, model.tets, body->between);
  out.to_skinned = distances(body->mesh, start, out.nodes);
  out.contact = self_contact(model.nodes.cast<double>(), out.converged() ? out.nodes : start, model.tets);
  context.report(1);
  return out;
}

}  // namespace ecorche::fem
