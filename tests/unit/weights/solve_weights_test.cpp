// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <cstring>
#include <random>
#include <string>

#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

/// A beam along z with three bones: the first and last 20 mm, and one in the middle, each in a segment of its
/// own.
struct Beam {
  TetMesh mesh = test::box_mesh({6, 6, 30}, 5, [](const Eigen::Vector3d& p) -> std::uint16_t {
    if ((p.head<2>() - Eigen::Vector2d(15, 15)).norm() > 8) return TetMesh::soft;
    if (p.z() < 20) return 1;
    if (p.z() > 65 && p.z() < 85) return 2;
    return p.z() > 130 ? 3 : TetMesh::soft;
  });
  Case patient;
  std::vector<std::int32_t> bone_segment{4, 0, 2};
  Beam() { patient.bones.resize(3); }
};

std::vector<double> dense_row(const Weights& w, std::size_t n, std::size_t segments) {
  std::vector<double> row(segments, 0);
  for (auto e = w.offsets[n]; e < w.offsets[n + 1]; ++e) row[w.segment[e]] = static_cast<double>(w.weight[e]);
  return row;
}

/// What model.hpp promises of stored weights.
void expect_valid(const Weights& w, std::size_t nodes) {
  ASSERT_EQ(w.offsets.size(), nodes + 1);
  ASSERT_EQ(w.segment.size(), w.weight.size());
  for (std::size_t n = 0; n < nodes; ++n) {
    ASSERT_LT(w.offsets[n], w.offsets[n + 1]);
    double sum = 0;
    for (auto e = w.offsets[n]; e < w.offsets[n + 1]; ++e) {
      sum += static_cast<double>(w.weight[e]);
      EXPECT_GE(static_cast<double>(w.weight[e]), 1e-6);
      EXPECT_LE(w.weight[e], 1.0F);
      if (e > w.offsets[n]) {
        EXPECT_LT(w.segment[e - 1], w.segment[e]);
      }
    }
    EXPECT_NEAR(sum, 1, 1e-6);
  }
}

TEST(SolveWeights, OfABeam) {
  const Beam beam;
  for (const std::string_view solver : solver_names()) {
    const WeightsResult result =
        solve_weights(beam.mesh, beam.patient, beam.bone_segment, 6, {solver, true}, {});
    expect_valid(result.weights, static_cast<std::size_t>(beam.mesh.V.rows()));
    const Certificate& c = result.certificate;
    EXPECT_LT(c.solver_residual, 1e-12);
    EXPECT_LT(c.solved_row_sum_error, 1e-9);
    EXPECT_GE(c.solved_min_weight, -1e-12);
    EXPECT_LE(c.solved_max_weight, 1 + 1e-12);
    EXPECT_EQ(c.repaired_rows, 0U);
    EXPECT_EQ(c.positive_offdiagonal_share, 0);
    EXPECT_GE(c.min_weight, 1e-6);
    EXPECT_EQ(c.max_weight, 1);
    EXPECT_LT(c.row_sum_error, 1e-6);
    const auto owner = bone_nodes(beam.mesh, beam.patient, beam.bone_segment);
    ASSERT_EQ(result.solved.cols(), 6);
    for (std::size_t n = 0; n < owner.size(); ++n) {
      const auto row = dense_row(result.weights, n, 6);
      EXPECT_EQ(row[1] + row[3] + row[5], 0);  // segments without a bone
      for (std::size_t s = 0; s < 6; ++s) {
        EXPECT_NEAR(row[s], result.solved(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(s)), 3e-6);
      }
      if (owner[n] >= 0) {
        EXPECT_EQ(row[static_cast<std::size_t>(owner[n])], 1);
      }
    }
  }
}

TEST(SolveWeights, APartWithoutABoneFollowsItsNeighbour) {
  Beam beam;
  // A slab 10 mm beyond the end of the beam.
  beam.mesh = test::box_mesh({6, 6, 36}, 5, [&](const Eigen::Vector3d& p) -> std::uint16_t {
    if (p.z() > 150 && p.z() < 160) return test::kHole;
    if (p.z() < 20) return 1;
    if (p.z() > 65 && p.z() < 85) return 2;
    return p.z() > 130 && p.z() < 150 ? 3 : TetMesh::soft;
  });
  int warnings = 0;
  Context context;
  context.log = [&](LogLevel, std::string_view) { ++warnings; };
  const WeightsResult result = solve_weights(beam.mesh, beam.patient, beam.bone_segment, 5, {}, context);
  EXPECT_EQ(warnings, 1);
  expect_valid(result.weights, static_cast<std::size_t>(beam.mesh.V.rows()));
  for (Eigen::Index n = 0; n < beam.mesh.V.rows(); ++n) {
    if (beam.mesh.V(n, 2) >= 160) {
      EXPECT_EQ(dense_row(result.weights, static_cast<std::size_t>(n), 5)[2], 1);
    }
  }
}

/// A beam whose bones touch, where weights jump from 0 to 1, and whose soft nodes wander at random as long as
/// no tet falls below `worst` of its first volume: slivers.
Beam shaken(double worst) {
  Beam beam;
  beam.mesh = test::box_mesh({6, 6, 16}, 5, [](const Eigen::Vector3d& p) -> std::uint16_t {
    if ((p.head<2>() - Eigen::Vector2d(15, 15)).norm() > 8) return TetMesh::soft;
    return p.z() < 25 ? 1 : p.z() < 55 ? 2 : 3;
  });
  TetMesh& mesh = beam.mesh;
  for (auto& bone : beam.patient.bones) {  // contested nodes ask for a surface: one point will do
    bone.surface.V =
        Points::Constant(3, 3, 15 + 25.0 * static_cast<double>(&bone - beam.patient.bones.data()));
    bone.surface.F = Triangles(1, 3);
    bone.surface.F << 0, 1, 2;
  }
  std::vector<std::vector<Eigen::Index>> tets_of(static_cast<std::size_t>(mesh.V.rows()));
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    for (Eigen::Index k = 0; k < 4; ++k) tets_of[static_cast<std::size_t>(mesh.T(t, k))].push_back(t);
  }
  std::mt19937 random(12);
  std::uniform_real_distribution<double> step(-1, 1);
  for (int pass = 0; pass < 20; ++pass) {
    for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
      const Eigen::RowVector3d before = mesh.V.row(n);
      if ((before.head<2>() - Eigen::RowVector2d(15, 15)).norm() < 9) continue;
      for (Eigen::Index k = 0; k < 3; ++k) mesh.V(n, k) += step(random);
      for (const Eigen::Index t : tets_of[static_cast<std::size_t>(n)]) {
        const auto p = [&](Eigen::Index k) { return mesh.V.row(mesh.T(t, k)); };
        if (tet_det(p(0), p(1), p(2), p(3)) < worst * 125) {
          mesh.V.row(n) = before;
          break;
        }
      }
    }
  }
  return beam;
}

TEST(SolveWeights, ViolationsAreRepairedAndCounted) {
  const Beam beam = shaken(0.5);
  std::string said;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { said += line; };
  const WeightsResult result =
      solve_weights(beam.mesh, beam.patient, beam.bone_segment, 5, {"auto", true}, context);
  const Certificate& c = result.certificate;
  EXPECT_NE(said.find("weights left [0, 1] by up to 0."), std::string::npos) << said;
  EXPECT_NE(said.find(" beside bad tets: solved again"), std::string::npos) << said;
  // What was hidden by solving again: the equation as it stands, solved here once more.
  const auto owner = bone_nodes(beam.mesh, beam.patient, beam.bone_segment);
  std::vector<std::uint8_t> fixed(owner.size(), 0);
  solve::Block boundary = solve::Block::Zero(beam.mesh.V.rows(), 5);
  for (std::size_t n = 0; n < owner.size(); ++n) {
    if (owner[n] < 0) continue;
    fixed[n] = 1;
    boundary(static_cast<Eigen::Index>(n), owner[n]) = 1;
  }
  const auto solver = make_solver("eigen");
  const solve::Block plain =
      solve_harmonic(stiffness(beam.mesh.V, beam.mesh.T, {}, nullptr), fixed, boundary, *solver, {}).values;
  EXPECT_NEAR(c.first_violation, std::max(-plain.minCoeff(), plain.maxCoeff() - 1), 1e-9);
  EXPECT_GT(c.first_violation, 1e-3);
  EXPECT_GT(c.mended_nodes, 0U);
  EXPECT_NEAR(c.mended_largest_change, (plain - result.solved).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT(c.mended_largest_change, 1e-3);
  EXPECT_GE(c.solved_min_weight, -1e-3);
  EXPECT_LE(c.solved_max_weight, 1 + 1e-3);
  EXPECT_LT(c.solved_row_sum_error, 1e-9);
  std::printf(
      "  solved in [%.2e, 1 + %.2e], %llu rows repaired, largest change %.2e, positive off-diagonals %.3f\n",
      c.solved_min_weight, c.solved_max_weight - 1, static_cast<unsigned long long>(c.repaired_rows),
      c.repaired_largest_change, c.positive_offdiagonal_share);
  EXPECT_LT(c.solved_min_weight, -1e-9);
  EXPECT_GT(c.repaired_rows, 0U);
  EXPECT_LE(c.repaired_largest_change, 1e-2);
  EXPECT_GT(c.positive_offdiagonal_share, 0.01);
  expect_valid(result.weights, static_cast<std::size_t>(beam.mesh.V.rows()));
}

TEST(SolveWeights, SliversAreRefusedByName) {
  const Beam beam = shaken(1e-4);
  try {
    const WeightsResult result = solve_weights(beam.mesh, beam.patient, beam.bone_segment, 5, {}, {});
    FAIL() << "passed with a change of " << result.certificate.repaired_largest_change << ", solved down to "
           << result.certificate.solved_min_weight;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_NE(error.problem().find(" of 833 nodes need mending; its tets: "), std::string::npos)
        << error.what();
  }
}

TEST(SolveWeights, NeedABone) {
  Beam beam;
  std::fill(beam.mesh.label.begin(), beam.mesh.label.end(), TetMesh::soft);
  try {
    solve_weights(beam.mesh, beam.patient, beam.bone_segment, 5, {}, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_EQ(error.problem(), "no tet lies in a bone");
  }
}

TEST(SolveWeights, AreTheSameBytesForOneAndTwoThreads) {
  const Beam beam = shaken(0.5);
  const auto with = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] {
      return solve_weights(beam.mesh, beam.patient, beam.bone_segment, 5, {"auto", true}, {});
    });
  };
  const WeightsResult one = with(1), two = with(2);
  EXPECT_EQ(one.weights.offsets, two.weights.offsets);
  EXPECT_EQ(one.weights.segment, two.weights.segment);
  EXPECT_EQ(one.weights.weight, two.weights.weight);
  EXPECT_EQ(one.solved, two.solved);
}

TEST(SolveWeights, StopsWhenAskedAndReportsProgress) {
  const Beam beam;
  std::stop_source source;
  Context context;
  context.stop = source.get_token();
  double last = 0;
  context.progress = [&](double fraction) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1);
    last = fraction;
  };
  solve_weights(beam.mesh, beam.patient, beam.bone_segment, 5, {}, context);
  EXPECT_EQ(last, 1);
  last = 0;
  context.progress = [&](double fraction) {
    if (fraction > 0.15) source.request_stop();
  };
  try {
    solve_weights(beam.mesh, beam.patient, beam.bone_segment, 5, {}, context);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::interrupted);
  }
}

}  // namespace
}  // namespace ecorche::weights
