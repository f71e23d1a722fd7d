// SPDX-License-Identifier: Apache-2.0
#include "tests/support/toy_model.hpp"
#include "tests/unit/model_file/test_files.hpp"

namespace ecorche::test {
namespace {

class RoundTrip : public ModelFileTest {};

TEST_F(RoundTrip, KeepsEveryMember) {
  for (const Model& model : {toy_model(), full_model()}) {
    model_file::write(model, file("a.hdf"), {});
    expect_same(model_file::read(file("a.hdf"), {}), model);
  }
}

TEST_F(RoundTrip, KeepsTheOrderOfTissuesAndVolumes) {
  Model model = full_model();
  std::swap(model.tissues[1], model.tissues[4]);
  std::swap(model.volumes[0], model.volumes[1]);
  std::swap(model.spheres[0], model.spheres[1]);
  model_file::write(model, file("a.hdf"), {});
  expect_same(model_file::read(file("a.hdf"), {}), model);
}

TEST_F(RoundTrip, TakesABodyWithoutVolumesOrTissues) {
  Model model = toy_model();
  model.volumes.clear();
  model.tissues.clear();
  model.spheres.clear();
  model.provenance.clear();
  model_file::write(model, file("a.hdf"), {});
  expect_same(model_file::read(file("a.hdf"), {}), model);
}

TEST_F(RoundTrip, SameModelSameBytes) {
  model_file::write(full_model(), file("a.hdf"), {});
  model_file::write(full_model(), file("b.hdf"), {});
  EXPECT_EQ(load(file("a.hdf")), load(file("b.hdf")));
  model_file::write(model_file::read(file("a.hdf"), {}), file("c.hdf"), {});
  EXPECT_EQ(load(file("a.hdf")), load(file("c.hdf")));
}

TEST_F(RoundTrip, DigestsAreGood) {
  model_file::write(full_model(), file("a.hdf"), {});
  const auto checks = model_file::check_digests(file("a.hdf"), {});
  EXPECT_EQ(checks.size() + 3,
            model_file::list(file("a.hdf")).size());  // all but the contents page itself
  for (const auto& check : checks) EXPECT_TRUE(check.good) << check.dataset;
}

TEST_F(RoundTrip, ReportsProgressAndHearsStop) {
  double last = 0;
  Context context;
  context.progress = [&](double fraction) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1);
    last = fraction;
  };
  model_file::write(toy_model(), file("a.hdf"), context);
  EXPECT_EQ(last, 1);
  last = 0;
  model_file::read(file("a.hdf"), context);
  EXPECT_EQ(last, 1);
  std::stop_source source;
  source.request_stop();
  context.stop = source.get_token();
  EXPECT_EQ(error_of([&] { model_file::read(file("a.hdf"), context); }).kind(), ErrorKind::interrupted);
}

// What a pose is meant for: the rig; a frame: the surfaces; the whole: everything but provenance.
TEST(Digests, ChangeWithWhatTheyCover) {
  const Model model = full_model();
  const auto identity = model_file::identity(model);
  const auto rig = model_file::rig_digest(model.rig);
  const auto topology = model_file::topology_digest(model);
  EXPECT_EQ(identity, model_file::identity(full_model()));

  Model other = full_model();
  other.provenance["mesher"] = "another";
  EXPECT_EQ(model_file::identity(other), identity);
  other.weights.weight[3] = std::nextafter(other.weights.weight[3], 0.0f);
  EXPECT_NE(model_file::identity(other), identity);
  EXPECT_EQ(model_file::rig_digest(other.rig), rig);
  EXPECT_EQ(model_file::topology_digest(other), topology);

  const auto rig_changes = [&](auto change) {
    Model changed = full_model();
    change(changed.rig.skeleton.segments[1]);
    EXPECT_NE(model_file::rig_digest(changed.rig), rig);
    EXPECT_NE(model_file::identity(changed), identity);
  };
  rig_changes([](Segment& s) { s.name = "other"; });
  rig_changes([](Segment& s) { s.parent = -1; });
  rig_changes([](Segment& s) { s.joint.name = "other"; });
  rig_changes([](Segment& s) { s.joint.kind = JointKind::fixed; });
  rig_changes([](Segment& s) { s.joint.center[2] += 1e-12 + 1e-10; });
  rig_changes([](Segment& s) { s.joint.axes(0, 1) += 1e-10; });
  rig_changes([](Segment& s) { std::swap(s.joint.sequence[0], s.joint.sequence[1]); });
  rig_changes([](Segment& s) { s.joint.sequence[0].sign = -1; });

  const auto topology_changes = [&](auto change) {
    Model changed = full_model();
    change(changed.tissues[1]);
    EXPECT_NE(model_file::topology_digest(changed), topology);
    EXPECT_NE(model_file::identity(changed), identity);
  };
  topology_changes([](Tissue& t) { t.name = "other"; });
  topology_changes([](Tissue& t) { std::swap(t.F(0, 0), t.F(0, 1)); });
  topology_changes([](Tissue& t) { t.V.conservativeResize(t.V.rows() + 1, 3), t.V.bottomRows(1).setZero(); });
}

}  // namespace
}  // namespace ecorche::test
