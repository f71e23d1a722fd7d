// SPDX-License-Identifier: Apache-2.0
// An arm that the scan has fused with the trunk: found, cut free, and raised.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>

#include <ecorche/preprocess/pipeline.hpp>
#include "preprocess/check/touching_limbs.hpp"
#include "preprocess/label_surfaces/label_surfaces.hpp"
#include "preprocess/parting/cut_contacts.hpp"
#include "tests/unit/pipeline/arm_at_side.hpp"

namespace ecorche::parting {
namespace {

using Eigen::RowVector3d;
using Eigen::Vector3d;

// The body of arm_at_side as one label map of 3 mm voxels: its skin is one surface, also where arm and trunk
// touch. The muscle is a slab that spans both.
Case fused(double gap_mm) {
  Case patient = test::arm_at_side(gap_mm);
  ImageGrid grid;
  grid.size = {60, 26, 106};
  grid.origin = {-6, -6, -6};
  grid.spacing = {3, 3, 3};
  CaseLabels labels;
  labels.image = Image(grid, ScalarType::u8);
  labels.table = {{1, "flesh"}, {2, "muscle"}};
  const double x = 100 + gap_mm;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto p = grid.point(i, j, k);
        const auto within = [&](double x0, double y0, double z0, double x1, double y1, double z1) {
          return p[0] >= x0 && p[0] <= x1 && p[1] >= y0 && p[1] <= y1 && p[2] >= z0 && p[2] <= z1;
        };
        const bool body = within(0, 0, 0, 100, 60, 300) || within(x, 15, 50, x + 30, 45, 300) ||
                          within(90, 15, 260, x + 1, 45, 300);
        if (!body) continue;
        const bool muscle = within(80, 20, 100, x + 25, 40, 200);
        labels.image.scalars<std::uint8_t>()[grid.offset(i, j, k)] = muscle ? 2 : 1;
      }
    }
  }
  patient.labels = labels;
  const auto source = [](std::vector<std::int64_t> ids) {
    LabelSource out;
    out.ids = std::move(ids);
    out.where = "case.yaml:1:test";
    return out;
  };
  patient.skin = {};
  patient.skin_source = source({});
  patient.tissues.push_back({"muscle", Group::muscle, {}, source({2})});
  label_surfaces::resolve(patient, {});
  return patient;
}

preprocess::Options coarse() {
  preprocess::Options options;
  options.mesher = "lattice";
  options.voxel_mm = 3;
  options.max_tets = 40'000;
  return options;
}

Model made(const Case& patient) {
  return preprocess::run(patient, coarse(), {}).model;
}

double volume(const Model& model) {
  double six = 0;
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    const auto at = [&](int c) { return model.nodes.row(model.tets(t, c)); };
    six += tet_det(at(0), at(1), at(2), at(3));
  }
  return six / 6;
}

// Edges that not exactly two triangles have, which run along it in opposite ways.
std::size_t open_edges(const Triangles& F) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::array<int, 2>> seen;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const std::int32_t a = F(f, c), b = F(f, (c + 1) % 3);
      ++seen[{std::min(a, b), std::max(a, b)}][a < b ? 0 : 1];
    }
  }
  std::size_t out = 0;
  for (const auto& [edge, ways] : seen) out += ways != std::array<int, 2>{1, 1};
  return out;
}

// The nodes after the arm turned about its joint, by linear blending.
PointsF raised(const Model& model, double degrees) {
  const Vector3d joint = model.rig.skeleton.segments[1].joint.center;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(-degrees * std::numbers::pi / 180, Vector3d::UnitY()).toRotationMatrix();
  PointsF out = model.nodes;
  for (Eigen::Index n = 0; n < out.rows(); ++n) {
    const Vector3d p = model.nodes.row(n).cast<double>().transpose();
    const Vector3d turned = joint + turn * (p - joint);
    double arm = 0;
    const auto at = static_cast<std::size_t>(n);
    for (std::uint64_t i = model.weights.offsets[at]; i < model.weights.offsets[at + 1]; ++i)
      arm += model.weights.segment[i] == 0 ? 0 : static_cast<double>(model.weights.weight[i]);
    out.row(n) = (p + arm * (turned - p)).cast<float>().transpose();
  }
  return out;
}

Points carried(const Tissue& tissue, const Model& model, const PointsF& nodes) {
  Points out(tissue.V.rows(), 3);
  for (Eigen::Index v = 0; v < out.rows(); ++v) {
    out.row(v).setZero();
    for (int c = 0; c < 4; ++c)
      out.row(v) += static_cast<double>(tissue.barycentric(v, c)) *
                    nodes.row(model.tets(tissue.tet[static_cast<std::size_t>(v)], c)).cast<double>();
  }
  return out;
}

// The area at rest of triangles of which an edge is more than `times` as long then.
double stretched(const Tissue& tissue, const Points& posed, double times) {
  double out = 0;
  for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
    const auto at = [&](int c) -> RowVector3d { return tissue.V.row(tissue.F(f, c % 3)).cast<double>(); };
    bool far = false;
    for (int c = 0; c < 3; ++c) {
      const double before = (at(c + 1) - at(c)).norm();
      far = far || (posed.row(tissue.F(f, (c + 1) % 3)) - posed.row(tissue.F(f, c))).norm() > times * before;
    }
    if (far) out += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
  return out;
}

TEST(Contacts, a_fused_arm_is_cut_free_and_no_flesh_is_lost) {
  Case patient = fused(0);
  const Model cut = made(patient);
  patient.contacts.cut = false;
  const Model joined = made(patient);
  ASSERT_EQ(joined.provenance.count("cut_contacts"), 0U);

  const std::vector<CutContact> found = cut_contacts(cut);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].limb, "arm");
  EXPECT_EQ(found[0].other_limb, "");
  EXPECT_EQ(found[0].other, "trunk");
  // 30 mm deep, from 50 to some 254 mm; more where voxels are of the body that the skin only touches, and
  // where the cut is no plane.
  EXPECT_GT(found[0].cm2, 30 * 204 / 100.0 - 5);
  EXPECT_LT(found[0].cm2, 1.5 * 30 * 204 / 100.0);
  EXPECT_NEAR(found[0].at.x(), 100, 10);
  EXPECT_GT(found[0].confidence, 0.6);
  EXPECT_TRUE(describe(found[0]).starts_with("arm was cut free of the trunk: ")) << describe(found[0]);
  EXPECT_TRUE(check::touching_limbs(cut).empty());
  EXPECT_EQ(check::touching_limbs(joined).size(), 1U);

  // The same tets in the same places, some with nodes of their own.
  ASSERT_EQ(cut.tets.rows(), joined.tets.rows());
  EXPECT_GT(cut.nodes.rows(), joined.nodes.rows());
  for (Eigen::Index t = 0; t < cut.tets.rows(); ++t) {
    for (int c = 0; c < 4; ++c) ASSERT_EQ(cut.nodes.row(cut.tets(t, c)), joined.nodes.row(joined.tets(t, c)));
  }
  EXPECT_EQ(volume(cut), volume(joined));
}

TEST(Contacts, raised_it_drags_nothing_along_and_the_skin_is_whole) {
  Case patient = fused(0);
  const Model cut = made(patient);
  patient.contacts.cut = false;
  const Model joined = made(patient);
  const PointsF free = raised(cut, 60), dragged = raised(joined, 60);
  ASSERT_EQ(cut.tissues[0].group, Group::skin);
  ASSERT_EQ(open_edges(joined.tissues[0].F), 0U);
  EXPECT_EQ(open_edges(cut.tissues[0].F), 0U);
  for (const std::size_t row : {std::size_t{0}, cut.tissues.size() - 1}) {
    const Tissue &after = cut.tissues[row], &before = joined.tissues[row];
    SCOPED_TRACE(after.name);
    // Where it lay, to a tenth of a millimetre.
    EXPECT_LT((carried(after, cut, cut.nodes) - after.V.cast<double>()).cwiseAbs().maxCoeff(), 1e-3);
    const double is = stretched(after, carried(after, cut, free), 3);
    const double was = stretched(before, carried(before, joined, dragged), 3);
    EXPECT_GT(was, 1000);
    EXPECT_LT(is, 0.1 * was);
  }
  // The muscle across both went apart: its triangles are of one side each.
  const Tissue& muscle = cut.tissues.back();
  EXPECT_GT(muscle.F.rows(), joined.tissues.back().F.rows());
  EXPECT_GT(muscle.V.rows(), joined.tissues.back().V.rows());
}

TEST(Contacts, a_gap_that_tets_bridge_comes_apart_and_a_free_arm_stays_as_it_was) {
  preprocess::Options options = coarse();
  options.max_tets = 2000;
  Case patient = test::arm_at_side(12);
  const Model bridged = preprocess::run(patient, options, {}).model;
  EXPECT_EQ(cut_contacts(bridged).size(), 1U);
  // What the arm's skin has in tets of the trunk goes with the arm all the same.
  const Tissue& skin = bridged.tissues[0];
  const Points posed = carried(skin, bridged, raised(bridged, 60));
  for (Eigen::Index f = 0; f < skin.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c)
      ASSERT_LT((posed.row(skin.F(f, c)) - posed.row(skin.F(f, (c + 1) % 3))).norm(), 40) << f;
  }
  patient = test::arm_at_side(30);
  const Model free = preprocess::run(patient, coarse(), {}).model;
  EXPECT_TRUE(cut_contacts(free).empty());
  patient.contacts.cut = false;
  const Model same = preprocess::run(patient, coarse(), {}).model;
  EXPECT_EQ(free.nodes, same.nodes);
  EXPECT_EQ(free.weights.weight, same.weights.weight);
}

TEST(Contacts, a_case_may_say_that_two_stay_joined) {
  Case patient = test::arm_at_side(0);
  patient.contacts.joined = {{"hand", "trunk"}};  // any segments of the two
  const Model joined = made(patient);
  EXPECT_TRUE(cut_contacts(joined).empty());
  EXPECT_EQ(check::touching_limbs(joined).size(), 1U);
  patient.contacts.joined = {{"arm", "hand"}};  // one limb
  EXPECT_EQ(cut_contacts(made(patient)).size(), 1U);
}

// It hangs on no bone, and its nodes follow whatever is nearest: no border within it is a contact.
TEST(Contacts, a_body_beside_without_bones_is_not_cut) {
  Case patient = test::arm_at_side(30);
  const SurfaceMesh beside = test::box({0, 100, 0}, {190, 160, 300});  // before both
  const Eigen::Index v = patient.skin.V.rows(), f = patient.skin.F.rows();
  patient.skin.V.conservativeResize(v + beside.V.rows(), 3);
  patient.skin.F.conservativeResize(f + beside.F.rows(), 3);
  patient.skin.V.bottomRows(beside.V.rows()) = beside.V;
  patient.skin.F.bottomRows(beside.F.rows()) = beside.F.array() + static_cast<std::int32_t>(v);
  const preprocess::Result made = preprocess::run(patient, coarse(), {});
  EXPECT_TRUE(cut_contacts(made.model).empty());
  ASSERT_FALSE(made.warnings.empty());
  EXPECT_NE(made.warnings[0].find("touches no bone"), std::string::npos) << made.warnings[0];
}

TEST(Contacts, what_provenance_says_is_read_back_and_nonsense_is_not) {
  Model model;
  Contact contact;
  Skeleton skeleton;
  for (const char* const name : {"trunk", "arm", "leg"}) {
    Segment segment;
    segment.name = name;
    skeleton.segments.push_back(segment);
  }
  contact.limb = contact.own = 1;
  contact.other_limb = contact.other = 2;
  contact.area_mm2 = 1234;
  contact.at = {1.5, -2, 3};
  contact.confidence = 0.75;
  Contact of_trunk = contact;
  of_trunk.other_limb = -1;
  of_trunk.other = 0;
  model.provenance["cut_contacts"] = cut_contacts_text({contact, of_trunk}, skeleton);
  const std::vector<CutContact> read = cut_contacts(model);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0].other_limb, "leg");
  EXPECT_EQ(read[1].other_limb, "");
  EXPECT_EQ(read[1].other, "trunk");
  EXPECT_NEAR(read[0].cm2, 12.34, 1e-9);
  EXPECT_EQ(read[0].at, Vector3d(1.5, -2, 3));
  EXPECT_EQ(describe(read[0]),
            "arm was cut free of leg: 12.3 cm2, most of arm and leg, at [1.5, -2.0, 3.0], confidence 75 %");
  for (const char* const nonsense :
       {"", ";", "arm", "arm - arm trunk x y z", "arm - arm trunk 1 1 nan 0 0", ";;;"}) {
    model.provenance["cut_contacts"] = nonsense;
    EXPECT_TRUE(cut_contacts(model).empty()) << nonsense;
  }
}

}  // namespace
}  // namespace ecorche::parting
