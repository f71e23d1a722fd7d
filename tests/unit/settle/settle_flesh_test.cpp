// SPDX-License-Identifier: Apache-2.0
// Settling, held against the finite elements of preprocess/fem, which solve the same to the end.
#include "runtime/settle/settle_flesh.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/values/error.hpp>
#include "preprocess/fem/reference.hpp"
#include "preprocess/weights/harmonic.hpp"
#include "runtime/settle/carry_tissues.hpp"
#include "tests/unit/fem/boned_beam.hpp"

namespace ecorche::runtime {
namespace {

using fem::bent;
using fem::boned;

struct Bent {
  std::shared_ptr<const Model> model;
  Pose pose;
  BodyPoser poser;
  PosedBody body;

  explicit Bent(double degrees, const Model& of = boned())
      : model(std::make_shared<const Model>(of)),
        pose(bent(*model, degrees)),
        poser(model),
        body(poser.make_frame()) {
    EXPECT_TRUE(poser.run(pose, Skinning::cor, poser.all_tissues(), body).ok());
    // Prepared models skin the nodes of bones rigidly; the toy's weights do not.
    Points x = nodes();
    fem::place_held(fem::body_of(*model, fem::Element::p1), body.segments, x);
    const PointsF placed = x.cast<float>();
    body.nodes.assign(placed.data(), placed.data() + placed.size());
    carry_tissues(*model, std::vector<std::uint8_t>(model->node_count(), 1), body);
  }
  Points nodes() const {
    return Eigen::Map<const PointsF>(body.nodes.data(), model->nodes.rows(), 3).cast<double>();
  }
};

double largest_row(const Points& rows) {
  return rows.rowwise().norm().maxCoeff();
}

/// Every third soft tet four times as stiff as the others.
Model unequal() {
  Model model = boned();
  model.materials = {{-1, 4}, {5, 20}, std::vector<std::uint16_t>(model.tet_count(), 0)};
  for (std::size_t t = 0; t < model.tet_count(); t += 3)
    if (model.tet_label[t] == TetMesh::soft) model.materials.of_tet[t] = 1;
  return model;
}

void expect_energy_of_finite_elements(const Bent& bend) {
  const FleshSettler settler(*bend.model, {});
  std::vector<double> gradient;
  const double energy = settler.energy(bend.body.nodes, gradient);
  const fem::Body body = fem::body_of(*bend.model, fem::Element::p1);
  const fem::Assembly assembly(body.mesh);
  const auto material = fem::make_material("stable_neo_hookean", 0.45);
  EXPECT_NEAR(energy, assembly.total(*material, bend.nodes()).energy, 1e-9 * energy);
  Points forces;
  solve::SparseMatrix H;
  assembly.derivatives(*material, bend.nodes(), false, nullptr, forces, H);
  ASSERT_EQ(settler.free_nodes().size(), body.mesh.free_nodes);
  for (std::size_t r = 0; r < settler.free_nodes().size(); ++r)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(gradient[3 * r + static_cast<std::size_t>(c)], forces(settler.free_nodes()[r], c),
                  1e-9 * forces.cwiseAbs().maxCoeff());
}

TEST(SettleFlesh, HasTheEnergyOfFiniteElements) {
  expect_energy_of_finite_elements(Bent(50));
  expect_energy_of_finite_elements(Bent(50, unequal()));
  std::vector<double> unused;
  const Bent plain(50), stiffer(50, unequal());
  EXPECT_GT(FleshSettler(*stiffer.model, {}).energy(stiffer.body.nodes, unused),
            1.5 * FleshSettler(*plain.model, {}).energy(plain.body.nodes, unused));
}

TEST(SettleFlesh, ItsGradientIsThatOfDifferences) {
  Bent bend(140);  // where tets are inside out, too
  const FleshSettler settler(*bend.model, {});
  std::vector<double> gradient, unused;
  settler.energy(bend.body.nodes, gradient);
  double largest = 0;
  for (const double g : gradient) largest = std::max(largest, std::abs(g));
  std::mt19937 random(3);
  for (int trial = 0; trial < 40; ++trial) {
    const std::size_t i = random() % gradient.size();
    float& x = bend.body.nodes[3 * static_cast<std::size_t>(settler.free_nodes()[i / 3]) + i % 3];
    const float here = x, above = here + 1e-2F, below = here - 1e-2F;
    x = above;
    const double more = settler.energy(bend.body.nodes, unused);
    x = below;
    const double less = settler.energy(bend.body.nodes, unused);
    x = here;
    EXPECT_NEAR((more - less) / (static_cast<double>(above) - static_cast<double>(below)), gradient[i],
                1e-4 * largest);
  }
}

TEST(SettleFlesh, ComesToTheSolutionOfFiniteElements) {
  for (const double degrees : {45.0, 70.0}) {
    Bent bend(degrees);
    fem::ReferenceOptions alone;
    alone.settles = false;
    const fem::Reference solved = fem::solve_pose(*bend.model, bend.pose, bend.body.nodes, alone, {});
    ASSERT_TRUE(solved.converged());
    const double before = largest_row(bend.nodes() - solved.nodes);
    EXPECT_GT(before, 1);
    const FleshSettler settler(*bend.model, {});
    const Settled done = settler.run(bend.body, {.most_steps = 500, .enough_mm = 1e-4}, {});
    EXPECT_TRUE(done.came_to_rest);
    EXPECT_LT(largest_row(bend.nodes() - solved.nodes), 0.01) << degrees;
    EXPECT_NEAR(done.energy_after, solved.newton.total.energy, 1e-6 * done.energy_after);
    EXPECT_GT(done.energy_before, 1.1 * done.energy_after);
    EXPECT_GT(done.largest_move_mm, 1);
    // As it is offered: a tenth of the way is left, at most.
    Bent soon(degrees);
    const Settled offered = settler.run(soon.body, {}, {});
    EXPECT_LE(offered.steps, SettleOptions{}.most_steps);
    EXPECT_LT((soon.nodes() - solved.nodes).norm(), 0.1 * (Bent(degrees).nodes() - solved.nodes).norm());
  }
}

TEST(SettleFlesh, FindsBackFromFarOff) {
  Bent bend(45), lost(45);
  const FleshSettler settler(*bend.model, {});
  settler.run(bend.body, {.most_steps = 500, .enough_mm = 1e-4}, {});
  const auto n = static_cast<std::size_t>(settler.free_nodes()[settler.free_nodes().size() / 2]);
  lost.body.nodes[3 * n] += 2000;
  const Settled done = settler.run(lost.body, {.most_steps = 500, .enough_mm = 1e-4}, {});
  EXPECT_GT(done.energy_before, 1e6 * done.energy_after);
  EXPECT_LT(largest_row(lost.nodes() - bend.nodes()), 0.05);
}

TEST(SettleFlesh, NewtonGoesOnFromWhereItEnds) {
  const Bent bend(60);
  fem::ReferenceOptions options;
  options.settles = false;
  const fem::Reference alone = fem::solve_pose(*bend.model, bend.pose, bend.body.nodes, options, {});
  const fem::Reference after = fem::solve_pose(*bend.model, bend.pose, bend.body.nodes, {}, {});
  ASSERT_TRUE(after.converged());
  EXPECT_TRUE(after.compared);
  EXPECT_LT(after.between_starts_mm, 1e-3);
  EXPECT_EQ(alone.newton.settling_steps, 0);
  EXPECT_GT(after.newton.settling_steps, 5);
  EXPECT_LT(after.newton.iterations, alone.newton.iterations);
  EXPECT_LT(largest_row(after.nodes - alone.nodes), 1e-3);
}

TEST(SettleFlesh, NewtonTakesNoStartThatIsWorse) {
  const Bent bend(60);
  const fem::Body body = fem::body_of(*bend.model, fem::Element::p1);
  const fem::Assembly assembly(body.mesh);
  const auto material = fem::make_material("stable_neo_hookean", 0.45);
  const auto solver = weights::make_solver("auto");
  const auto solved = [&](const fem::NewtonOptions& options) {
    fem::StepSolver steps(assembly, *solver);
    Points x = bend.nodes();
    const fem::NewtonResult done = fem::minimise(assembly, *material, steps, options, x, {});
    EXPECT_TRUE(done.converged);
    return x;
  };
  fem::NewtonOptions misled;
  misled.settle = [&](Points& x, const Context&) {
    for (Eigen::Index n = 0; n < x.rows(); ++n)
      if (body.mesh.free[static_cast<std::size_t>(n)] >= 0) x(n, 0) += n % 2 == 0 ? 0.2 : -0.2;
    return 1;
  };
  EXPECT_EQ(solved(misled), solved({}));
}

TEST(SettleFlesh, LeavesBonesAndAllThatIsNoFleshToTheBit) {
  Bent bend(60);
  const std::vector<float> before = bend.body.nodes;
  const FleshSettler settler(*bend.model, {});
  const Settled done = settler.run(bend.body, {}, {});
  std::vector<std::uint8_t> free(bend.model->node_count(), 0);
  for (const std::int32_t n : settler.free_nodes()) free[static_cast<std::size_t>(n)] = 1;
  const elastic::Flesh flesh = elastic::flesh_of(*bend.model);
  std::size_t moved = 0, bones = 0;
  for (std::size_t n = 0; n < free.size(); ++n) {
    const bool same = std::equal(&before[3 * n], &before[3 * n] + 3, &bend.body.nodes[3 * n]);
    EXPECT_TRUE(same || free[n] != 0);
    EXPECT_TRUE(flesh.segment[n] < 0 || free[n] == 0);
    moved += same ? 0 : 1;
    bones += flesh.segment[n] >= 0 ? 1 : 0;
  }
  EXPECT_GT(bones, 20U);
  EXPECT_EQ(moved, done.moved_nodes);
  EXPECT_GT(moved, 100U);
}

TEST(SettleFlesh, RestStaysRestToTheBit) {
  Bent bend(0);
  const std::vector<float> nodes = bend.body.nodes;
  const auto tissues = bend.body.tissues;
  const Settled done = FleshSettler(*bend.model, {}).run(bend.body, {}, {});
  EXPECT_EQ(bend.body.nodes, nodes);
  EXPECT_EQ(bend.body.tissues, tissues);
  EXPECT_EQ(done.moved_nodes, 0U);
  EXPECT_EQ(done.largest_move_mm, 0);
}

TEST(SettleFlesh, CarriesTissuesAndOpensFolds) {
  Bent bend(100);
  const auto inverted = [&] {
    const std::vector<float> det_f = tet_det_f(*bend.model, bend.body.nodes);
    return std::count_if(det_f.begin(), det_f.end(), [](float det) { return det <= 0; });
  };
  const auto before = inverted();
  const std::vector<std::vector<float>> tissues = bend.body.tissues;
  ASSERT_GT(before, 0);
  FleshSettler(*bend.model, {}).run(bend.body, {}, {});
  EXPECT_LT(inverted(), before);
  EXPECT_NE(bend.body.tissues, tissues);
  for (std::size_t i = 0; i < tissues.size(); ++i) {
    const Tissue& tissue = bend.model->tissues[i];
    for (std::size_t v = 0; v < tissue.tet.size(); ++v) {
      Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
      for (int k = 0; k < 4; ++k)
        at += static_cast<double>(tissue.barycentric(static_cast<Eigen::Index>(v), k)) *
              bend.nodes().row(bend.model->tets(tissue.tet[v], k));
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(bend.body.tissues[i][3 * v + c], at[static_cast<Eigen::Index>(c)], 1e-4);
    }
  }
}

TEST(SettleFlesh, HasTheSameBitsForAnyNumberOfThreads) {
  std::vector<float> first;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Bent bend(60);
    FleshSettler(*bend.model, {}).run(bend.body, {}, {});
    if (threads == 1) first = bend.body.nodes;
    EXPECT_EQ(bend.body.nodes, first);
  }
}

TEST(SettleFlesh, RefusesABodyWithoutFleshOrBones) {
  for (const std::uint16_t label : {TetMesh::soft, std::uint16_t{1}}) {
    Model model = boned();
    model.tet_label.assign(model.tet_count(), label);
    try {
      const FleshSettler settler(model, {});
      FAIL() << "settles what nothing holds, or nothing at all";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::data);
      EXPECT_NE(error.problem().find("no soft tet hangs on a bone"), std::string::npos) << error.what();
    }
  }
}

TEST(SettleFlesh, CanBeStopped) {
  Bent bend(60);
  const FleshSettler settler(*bend.model, {});
  const std::vector<float> before = bend.body.nodes;
  std::stop_source source;
  source.request_stop();
  Context context;
  context.stop = source.get_token();
  EXPECT_THROW(settler.run(bend.body, {}, context), Error);
  EXPECT_EQ(bend.body.nodes, before);
}

}  // namespace
}  // namespace ecorche::runtime
