// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <set>
#include <utility>

#include <ecorche/values/error.hpp>
#include "preprocess/fem/reference.hpp"
#include "tests/unit/fem/boned_beam.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::fem {
namespace {

TEST(Body, HoldsBonesAndLeavesOutWhatNothingShapes) {
  Model model = boned(14);  // less than two tets: some have corners on both
  // A tet of its own, far off; and one that hangs on two nodes of a bone, a hinge: its part is the whole
  // flesh.
  const Eigen::Index n = model.nodes.rows(), t = model.tets.rows();
  model.nodes.conservativeResize(n + 6, 3);
  model.nodes.bottomRows(6) << 500, 0, 0, 510, 0, 0, 500, 10, 0, 500, 0, 10, -30, -30, 10, -40, -30, 10;
  model.tets.conservativeResize(t + 2, 4);
  model.tets.row(t) << static_cast<int>(n), static_cast<int>(n + 1), static_cast<int>(n + 2),
      static_cast<int>(n + 3);
  model.tets.row(t + 1) << 0, static_cast<int>(n + 5), static_cast<int>(n + 4), 9;
  model.tet_label.insert(model.tet_label.end(), 2, TetMesh::soft);
  const auto corner = [&](int c) { return model.nodes.row(model.tets(t + 1, c)); };
  if (tet_det(corner(0), corner(1), corner(2), corner(3)) < 0)
    std::swap(model.tets(t + 1, 0), model.tets(t + 1, 1));
  for (const Element element : {Element::p1, Element::p2p0}) {
    const Body body = body_of(model, element);
    std::size_t bone = 0, on_bones = 0, soft = 0;
    std::vector<std::int32_t> between;
    std::vector<std::int32_t> segment(static_cast<std::size_t>(n + 6), -1);
    for (std::size_t i = 0; i < model.tet_count(); ++i)
      for (int c = 0; c < 4 && model.tet_label[i] != TetMesh::soft; ++c)
        segment[static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(i), c))] =
            model.tet_label[i] - 1;
    for (std::size_t i = 0; i < model.tet_count(); ++i) {
      int held = 0;
      for (int c = 0; c < 4; ++c)
        held += segment[static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(i), c))] >= 0 ? 1 : 0;
      ++(model.tet_label[i] != TetMesh::soft ? bone : soft);
      if (model.tet_label[i] != TetMesh::soft) continue;
      std::set<std::int32_t> of;
      for (int c = 0; c < 4; ++c)
        of.insert(segment[static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(i), c))]);
      of.erase(-1);
      if (held == 4) {
        ++on_bones;
      } else if (of.size() > 1) {
        between.push_back(static_cast<std::int32_t>(i));
      }
    }
    EXPECT_GT(bone, 50U);
    EXPECT_EQ(body.soft_tets, soft);
    EXPECT_EQ(body.on_bones, on_bones);
    EXPECT_EQ(body.between, between);
    EXPECT_GT(between.size(), 0U);
    EXPECT_EQ(body.floating, 2U);
    EXPECT_EQ(body.mesh.tets(), soft - on_bones - between.size() - 2);
    EXPECT_TRUE(std::equal(segment.begin(), segment.end(), body.segment.begin()));
    for (std::size_t i = 0; i < body.segment.size(); ++i)
      EXPECT_TRUE(body.segment[i] < 0 || body.mesh.free[i] < 0);
    EXPECT_LT(body.mesh.free[static_cast<std::size_t>(n)], 0);
  }
}

TEST(Reference, OfTheRestPoseIsRest) {
  const Model model = boned();
  const Pose rest = bent(model, 0);
  const Reference solved = solve_pose(model, rest, skinned(model, rest), {}, {});
  EXPECT_TRUE(solved.trusted());
  EXPECT_LT((solved.nodes - model.nodes.cast<double>()).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_NEAR(solved.posed_mm3, solved.rest_mm3, 1e-6 * solved.rest_mm3);
  EXPECT_EQ(solved.to_skinned.nodes, 0U);
}

TEST(Reference, IsOneSolutionFromTwoStartsForAnyNumberOfThreads) {
  const Model model = boned();
  const Pose pose = bent(model, 45);
  const std::vector<float> start = skinned(model, pose);
  for (const Element element : {Element::p1, Element::p2p0}) {
    ReferenceOptions options;
    options.element = element;
    Points first;
    for (const int threads : {1, 2}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                      static_cast<std::size_t>(threads));
      const Reference solved = solve_pose(model, pose, start, options, {});
      EXPECT_TRUE(solved.trusted());
      EXPECT_EQ(solved.from, "skinned");
      EXPECT_LT(solved.between_starts_mm, 1e-3);
      EXPECT_LT(solved.newton.residual, 1e-4);
      EXPECT_EQ(solved.newton.total.inverted_tets, 0U);
      EXPECT_LT(std::abs(solved.posed_mm3 / solved.rest_mm3 - 1), 0.02);
      EXPECT_GT(solved.to_skinned.nodes, 50U);
      EXPECT_GT(solved.to_skinned.max_mm, 1);
      EXPECT_GE(solved.to_skinned.max_mm, solved.to_skinned.p95_mm);
      EXPECT_GE(solved.to_skinned.p95_mm, solved.to_skinned.mean_mm);
      if (threads == 1) first = solved.nodes;
      EXPECT_EQ(solved.nodes, first);
      const Body body = body_of(model, element);
      for (std::size_t n = 0; n < solved.solved.size(); ++n)
        EXPECT_TRUE(body.segment[n] < 0 || solved.solved[n] == 0);
    }
  }
}

TEST(Reference, SaysWhereItIsNotToBeBelieved) {
  const Model model = boned();
  const Pose pose = bent(model, 140);
  const Reference solved = solve_pose(model, pose, skinned(model, pose), {}, {});
  EXPECT_FALSE(solved.trusted());
  const Pose mild = bent(model, 20);
  ReferenceOptions one;
  one.two_starts = false;
  const Reference alone = solve_pose(model, mild, skinned(model, mild), one, {});
  EXPECT_TRUE(alone.converged());
  EXPECT_FALSE(alone.trusted());
}

TEST(Reference, ComesToAnEndAboutFoldsToo) {
  const Model model = boned();
  const Pose pose = bent(model, 140);
  ReferenceOptions options;
  options.two_starts = options.settles = false;
  const Reference solved = solve_pose(model, pose, skinned(model, pose), options, {});
  EXPECT_TRUE(solved.inverted());
  EXPECT_TRUE(solved.converged());
  EXPECT_LT(solved.newton.step_mm, 1e-5);
  EXPECT_FALSE(solved.trusted());
}

TEST(Reference, TriesTheSameFoldNoSecondTimeInFullStride) {
  const Model model = boned();
  const Pose pose = bent(model, 130);
  ReferenceOptions options;
  options.settles = false;
  const Reference solved = solve_pose(model, pose, skinned(model, pose), options, {});
  EXPECT_EQ(solved.reached, 1);
  EXPECT_EQ(solved.refused, 1);  // 2 where each step is twice the one before, whatever lies ahead
}

TEST(Reference, RefusesABodyWithoutBones) {
  Model model = boned();
  model.tet_label.assign(model.tet_count(), TetMesh::soft);
  try {
    solve_pose(model, bent(model, 0), skinned(model, bent(model, 0)), {}, {});
    FAIL() << "solved for a body that nothing holds";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_NE(error.problem().find("no soft tet hangs on a bone"), std::string::npos) << error.what();
  }
}

TEST(Assembly, CountsWhatIsInvertedAndCrushed) {
  Mesh mesh =
      make_mesh(Element::p1, test::box_mesh({1, 1, 1}, 10).V, test::box_mesh({1, 1, 1}, 10).T, {}, {});
  const auto material = make_material("stable_neo_hookean", 0.45);
  const auto total = [&](double times) {
    Points x = mesh.X;
    x.col(0) *= times;
    return Assembly(mesh).total(*material, x);
  };
  EXPECT_EQ(total(0.31).crushed_tets, 0U);
  EXPECT_EQ(total(0.29).crushed_tets, 6U);
  EXPECT_EQ(total(0.29).inverted_tets, 0U);
  EXPECT_EQ(total(-1).inverted_tets, 6U);
  EXPECT_EQ(total(-1).inverted, std::vector<std::uint8_t>(6, 1));
}

/// The box, and again so far along x.
std::pair<Points, Tets> two_boxes(const TetMesh& box, double apart) {
  std::pair<Points, Tets> out{Points(2 * box.V.rows(), 3), Tets(2 * box.T.rows(), 4)};
  out.first << box.V, box.V.rowwise() + Eigen::RowVector3d(apart, 0, 0);
  out.second << box.T, box.T.array() + static_cast<std::int32_t>(box.V.rows());
  return out;
}

/// A node of the surface in a tet that is not its own, asked of all pairs.
TEST(SelfContact, AgreesWithAllPairs) {
  const TetMesh box = test::box_mesh({3, 3, 3}, 10);
  const auto [X, T] = two_boxes(box, 40);
  for (const double into : {5.0, 13.0, 22.7}) {
    Points x = X;
    x.bottomRows(box.V.rows()).rowwise() += Eigen::RowVector3d(-into, 3.3, -4.1);
    std::size_t count = 0;
    double deepest = 0;
    for (Eigen::Index n = 0; n < x.rows(); ++n) {
      const Eigen::RowVector3d at = X.row(n) - (n < box.V.rows() ? 0 : 40) * Eigen::RowVector3d::UnitX();
      if ((at.array() > 0.1 && at.array() < 29.9).all()) continue;  // no node of the surface
      const bool first = n < box.V.rows();
      const Eigen::RowVector3d low = x.row(first ? box.V.rows() : 0), p = x.row(n) - low;
      if (!(p.array() > 0 && p.array() < 30).all()) continue;
      ++count;
      deepest = std::max(deepest, std::min(p.minCoeff(), 30 - p.maxCoeff()));
    }
    const SelfContact found = self_contact(X, x, T);
    EXPECT_EQ(found.nodes, count) << into;
    EXPECT_EQ(count > 0, into > 10);
    EXPECT_NEAR(found.depth_mm, deepest, 1e-9) << into;
  }
  EXPECT_EQ(self_contact(X, X, T).nodes, 0U);
}

/// Two boxes side by side, as limbs that were cut free: along their common wall edges are up to 14.1 mm long.
TEST(SelfContact, StepsOfACutDoNotCount) {
  const TetMesh box = test::box_mesh({3, 3, 3}, 10);
  auto boxes = two_boxes(box, 30);
  Points& X = boxes.first;
  const auto shifted = [&](double into, double along) {
    Points x = X;
    x.bottomRows(box.V.rows()).rowwise() += Eigen::RowVector3d(-into, along, -1.2 * along);
    return self_contact(X, x, boxes.second);
  };
  for (const double into : {0.0, 3.0, 9.9, 14.1}) EXPECT_EQ(shifted(into, 3.3).nodes, 0U) << into;
  const SelfContact deep = shifted(16, 3.3);
  EXPECT_GT(deep.nodes, 0U);
  EXPECT_GT(deep.depth_mm, 3.2);  // the sides that the boxes are shifted along are no cut
  // With a gap between them, however small, nothing was cut.
  X.bottomRows(box.V.rows()).col(0).array() += 1e-3;
  EXPECT_GT(shifted(3, 3.3).nodes, 0U);
}

}  // namespace
}  // namespace ecorche::fem
