// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <memory>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/preprocess/pipeline.hpp>
#include "preprocess/cache/kept_stage.hpp"
#include "tests/unit/pipeline/two_bones.hpp"

namespace ecorche::preprocess {
namespace {

// A store in memory that counts.
class MemoryStore : public StageStore {
 public:
  std::uint64_t program() const override { return program_; }
  std::optional<std::string> find(std::string_view name) override {
    const auto at = held.find(std::string(name));
    return at == held.end() ? std::nullopt : std::optional(at->second);
  }
  void keep(std::string_view name, std::string_view bytes) override {
    if (full) throw Error(ErrorKind::io, "store", "no room", "make some");
    held[std::string(name)] = bytes;
  }

  std::map<std::string, std::string> held;
  std::uint64_t program_ = 1;
  bool full = false;
};

Options coarse() {
  Options options;
  options.mesher = "lattice";
  options.voxel_mm = 5;
  return options;
}

// Names of the stages that were taken from the store.
std::string taken(const Result& result) {
  std::string names;
  for (const StageTime& stage : result.stages) names += stage.kept ? stage.name + " " : "";
  return names;
}

TEST(KeptStages, a_second_run_takes_all_and_gives_the_same_model) {
  MemoryStore store;
  const Result plain = run(test::two_bones(), coarse(), {}, {});
  const Result first = run(test::two_bones(), coarse(), {}, {.store = &store});
  EXPECT_EQ(taken(first), "");
  EXPECT_EQ(store.held.size(), 6U);
  const Result again = run(test::two_bones(), coarse(), {}, {.store = &store});
  EXPECT_EQ(taken(again), "rig voxelize mesh weights cor mapping ");
  EXPECT_EQ(model_file::identity(again.model), model_file::identity(plain.model));
  EXPECT_EQ(model_file::identity(first.model), model_file::identity(plain.model));
  EXPECT_EQ(again.model.provenance, plain.model.provenance);
  EXPECT_EQ(again.warnings, plain.warnings);
}

TEST(KeptStages, spheres_are_kept_too) {
  MemoryStore store;
  Options options = coarse();
  options.spheres_tp = 0.3;
  const Result first = run(test::two_bones(), options, {}, {.store = &store});
  EXPECT_EQ(store.held.size(), 7U);
  const Result again = run(test::two_bones(), options, {}, {.store = &store});
  EXPECT_EQ(taken(again), "rig voxelize spheres mesh weights cor mapping ");
  EXPECT_EQ(model_file::identity(again.model), model_file::identity(first.model));
  EXPECT_EQ(again.warnings, first.warnings);
  options.spheres_tp = 0.2;
  EXPECT_EQ(taken(run(test::two_bones(), options, {}, {.store = &store})),
            "rig voxelize mesh weights cor mapping ");
  Case other = test::two_bones();
  other.skeleton.segments[1].joint.center.x() += 1;  // they hang on the rig
  const std::string moved = taken(run(other, options, {}, {.store = &store}));
  EXPECT_EQ(moved.find("spheres"), std::string::npos) << moved;
}

TEST(KeptStages, only_what_reads_the_change_is_made_again) {
  MemoryStore store;
  const auto after = [&](const Case& patient, const Options& options) {
    return taken(run(patient, options, {}, {.store = &store}));
  };
  after(test::two_bones(), coarse());

  Options sigma = coarse();
  sigma.cor_sigma = 0.08;
  EXPECT_EQ(after(test::two_bones(), sigma), "rig voxelize mesh weights mapping ");
  Options solver = coarse();
  solver.solver = "eigen";  // its weights differ in the last bits from amg's and cholmod's
  const std::string eigen = after(test::two_bones(), solver);
  EXPECT_EQ(eigen.substr(0, 18), "rig voxelize mesh ") << "skinning does not mesh again";
  EXPECT_EQ(eigen.find("weights"), std::string::npos);
  Options smooth = coarse();
  smooth.weights = "quasi-harmonic";
  const std::string other = after(test::two_bones(), smooth);
  EXPECT_EQ(other.substr(0, 18), "rig voxelize mesh ");
  EXPECT_EQ(other.find("weights"), std::string::npos);
  Options voxel = coarse();
  voxel.voxel_mm = 6;
  EXPECT_EQ(after(test::two_bones(), voxel), "rig ");
  Options tets = coarse();
  tets.max_tets = 900'000;
  EXPECT_EQ(after(test::two_bones(), tets), "rig voxelize weights cor mapping ") << "the same mesh came out";

  Case muscle = test::two_bones();
  muscle.tissues[0].surface.V.rowwise() += Eigen::RowVector3d(0.5, 0, 0);
  EXPECT_EQ(after(muscle, coarse()), "rig voxelize mesh weights cor ");
  Case bone = test::two_bones();
  bone.bones[0].surface.V(0, 0) += 1e-9;
  EXPECT_EQ(after(bone, coarse()).find("mesh"), std::string::npos);
  store.program_ = 2;
  EXPECT_EQ(after(test::two_bones(), coarse()), "") << "another build";
}

// The rig goes by all that finds it, not by what only later stages read.
TEST(KeptStages, a_rig_goes_by_its_joints_and_how_they_are_to_be_found) {
  MemoryStore store;
  const auto rig_is_kept = [&](const Case& patient) {
    return taken(run(patient, coarse(), {}, {.store = &store})).starts_with("rig ");
  };
  EXPECT_FALSE(rig_is_kept(test::two_bones()));
  EXPECT_TRUE(rig_is_kept(test::two_bones()));
  const auto with = [](auto&& change) {
    Case patient = test::two_bones();
    change(patient, patient.skeleton.segments[1].joint);
    return patient;
  };
  const Case changed[] = {
      with([](Case&, Joint& joint) { joint.center.x() += 1; }),
      with([](Case&, Joint& joint) {
        joint.axes = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).matrix();
      }),
      with([](Case&, Joint& joint) { joint.name += "_other"; }),
      with([](Case&, Joint& joint) { joint.limits_source = "a book"; }),
      with([](Case& patient, Joint&) { patient.skeleton.segments[1].aliases = {"Other"}; }),
      with([](Case& patient, Joint&) { patient.regions.emplace_back().name = "r"; }),
      with([](Case&, Joint& joint) {
        JointRule rule;
        rule.center.point = joint.center;
        joint.how = std::make_shared<const JointRule>(rule);
      }),
      with([](Case&, Joint& joint) {
        JointRule rule;
        rule.center.point = joint.center + Eigen::Vector3d(0, 0, 1);
        joint.how = std::make_shared<const JointRule>(rule);
      }),
      with([](Case&, Joint& joint) {
        JointRule rule;
        rule.center.point = joint.center;
        DirectionSource along;
        along.direction = Eigen::Vector3d(0, 1, 1).normalized();
        rule.axes = {{1, along}, {0, {}}};
        rule.axes[1].second.direction = Eigen::Vector3d::UnitX();
        joint.how = std::make_shared<const JointRule>(rule);
      }),
      with([](Case& patient, Joint&) { patient.bones[1].surface.V(0, 0) += 1e-9; })};
  for (const Case& patient : changed) {
    EXPECT_FALSE(rig_is_kept(patient)) << &patient - changed;
    EXPECT_TRUE(rig_is_kept(patient)) << &patient - changed;
  }
  Case muscle = test::two_bones();
  muscle.tissues[0].surface.V.rowwise() += Eigen::RowVector3d(0.5, 0, 0);
  EXPECT_TRUE(rig_is_kept(muscle));
}

TEST(KeptStages, an_interrupted_run_goes_on_at_its_last_stage) {
  MemoryStore store;
  std::stop_source stop;
  Context context;
  context.stop = stop.get_token();
  EXPECT_THROW(run(test::two_bones(), coarse(), context,
                   {.on_stage =
                        [&](std::string_view name, int, int) {
                          if (name == "cor") stop.request_stop();
                        },
                    .store = &store}),
               Error);
  EXPECT_EQ(taken(run(test::two_bones(), coarse(), {}, {.store = &store})), "rig voxelize mesh weights ");
}

TEST(KeptStages, warnings_come_again) {
  MemoryStore store;
  Case patient = test::two_bones();
  patient.tissues[0].surface.V.rowwise() +=
      Eigen::RowVector3d(0, 0, 46);  // 12 mm out of the top: over five voxels
  Options options = coarse();
  options.voxel_mm = 2;
  const Result first = run(patient, options, {}, {.store = &store});
  const Result again = run(patient, options, {}, {.store = &store});
  EXPECT_FALSE(first.warnings.empty());
  EXPECT_EQ(again.warnings, first.warnings);
  EXPECT_NE(taken(again).find("mapping"), std::string::npos);
}

TEST(KeptStages, what_is_damaged_is_made_again) {
  MemoryStore store;
  const auto identity = model_file::identity(run(test::two_bones(), coarse(), {}, {.store = &store}).model);
  const std::map<std::string, std::string> good = store.held;
  for (const std::size_t cut : {1, 2, 3, 4, 5, 6}) {
    for (auto& [name, bytes] : store.held) {
      const std::string& whole = good.at(name);
      bytes = whole.substr(0, std::array<std::size_t, 7>{0, 0, 1, 7, 8, 100, whole.size() - 1}[cut]);
    }
    const Result result = run(test::two_bones(), coarse(), {}, {.store = &store});
    EXPECT_EQ(taken(result), "") << cut;
    EXPECT_EQ(model_file::identity(result.model), identity);
  }
  for (auto& [name, bytes] : store.held) bytes = good.at(name) + "x";
  EXPECT_EQ(taken(run(test::two_bones(), coarse(), {}, {.store = &store})), "");
  for (auto& [name, bytes] : store.held) std::fill_n(bytes.begin(), 8, '\xff');  // 2^64 - 1 warnings
  EXPECT_EQ(taken(run(test::two_bones(), coarse(), {}, {.store = &store})), "");
}

TEST(KeptStages, a_store_that_is_full_is_warned_of) {
  MemoryStore store;
  store.full = true;
  const Result result = run(test::two_bones(), coarse(), {}, {.store = &store});
  ASSERT_EQ(result.warnings.size(), 6U);
  EXPECT_EQ(result.warnings[0].substr(0, 14), "not kept: rig-") << result.warnings[0];
  EXPECT_NE(result.warnings[0].find("no room"), std::string::npos);
}

TEST(Archive, every_value_comes_back) {
  Certificate certificate;
  certificate.solver_residual = 1e-13;
  certificate.bone_rigidity_mm = 2;
  Image image(ImageGrid{{2, 3, 4}, {1, 2, 3}, {4, 5, 6}, {0, 1, 0, 1, 0, 0, 0, 0, -1}}, ScalarType::i16, 2);
  image.bytes[7] = std::byte{9};
  Tissue tissue;
  tissue.name = "m";
  tissue.group = Group::nerve;
  tissue.V = PointsF::Random(5, 3);
  tissue.tet = {1, 2, 3, 4, 5};
  tissue.barycentric.setRandom(5, 4);
  VolumetricSkeleton spheres;
  spheres.grid = image.grid;
  spheres.voxel = {{1, 2, 3}};
  spheres.metric = DistanceMetric::chamfer345;
  cache::Packer pack;
  pack(certificate, image, tissue, spheres, std::map<std::string, double>{{"a", 1.5}});
  const std::string bytes = pack.take();
  Certificate certificate_back;
  Image image_back;
  Tissue tissue_back;
  VolumetricSkeleton spheres_back;
  cache::Unpacker unpack(std::string_view(bytes).substr(0, bytes.size()));
  unpack(certificate_back, image_back, tissue_back, spheres_back);
  EXPECT_FALSE(unpack.done());
  EXPECT_EQ(certificate_back.solver_residual, 1e-13);
  EXPECT_EQ(certificate_back.bone_rigidity_mm, 2);
  EXPECT_EQ(image_back.grid, image.grid);
  EXPECT_EQ(image_back.type, image.type);
  EXPECT_EQ(image_back.components, 2);
  EXPECT_EQ(image_back.bytes, image.bytes);
  EXPECT_EQ(tissue_back.name, "m");
  EXPECT_EQ(tissue_back.group, Group::nerve);
  EXPECT_EQ(tissue_back.V, tissue.V);
  EXPECT_EQ(tissue_back.F.rows(), 0);
  EXPECT_EQ(tissue_back.tet, tissue.tet);
  EXPECT_EQ(tissue_back.barycentric, tissue.barycentric);
  EXPECT_EQ(spheres_back.voxel, spheres.voxel);
  EXPECT_EQ(spheres_back.metric, spheres.metric);
}

TEST(Archive, a_rig_comes_back) {
  Rig rig;
  rig.skeleton.name = "s";
  rig.skeleton.segments.resize(2);
  Segment& segment = rig.skeleton.segments[1];
  segment.name = "shank";
  segment.parent = 0;
  segment.aliases = {"A", "B"};
  Joint& joint = segment.joint;
  joint.name = "knee";
  joint.kind = JointKind::hinge;
  joint.rule = CenterRule::between;
  joint.center = {1, 2, 3};
  joint.center_bone = "c";
  joint.facing_bone = "f";
  joint.axes << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  joint.sequence = {{"flexion", 2, -1, 0.25, -0.5, 2}};
  joint.limits_source = "l";
  joint.coupled = {{"knee", "flexion", "y_mm", 3.5}};
  rig.fits = {{"knee", CenterRule::plane_fit, 1, 2, 0.5, 77, 0.75}};
  cache::Packer pack;
  pack(rig);
  const std::string bytes = pack.take();
  Rig back;
  cache::Unpacker unpack(bytes);
  unpack(back);
  EXPECT_TRUE(unpack.done());
  EXPECT_EQ(back.skeleton.name, "s");
  ASSERT_EQ(back.skeleton.segments.size(), 2U);
  const Segment& s = back.skeleton.segments[1];
  EXPECT_EQ(back.skeleton.segments[0].parent, -1);
  EXPECT_EQ(s.name, "shank");
  EXPECT_EQ(s.parent, 0);
  EXPECT_EQ(s.aliases, segment.aliases);
  EXPECT_EQ(s.joint.name, "knee");
  EXPECT_EQ(s.joint.kind, JointKind::hinge);
  EXPECT_EQ(s.joint.rule, CenterRule::between);
  EXPECT_EQ(s.joint.center, joint.center);
  EXPECT_EQ(s.joint.center_bone, "c");
  EXPECT_EQ(s.joint.facing_bone, "f");
  EXPECT_EQ(s.joint.axes, joint.axes);
  ASSERT_EQ(s.joint.sequence.size(), 1U);
  const AngleAxis& angle = s.joint.sequence[0];
  EXPECT_EQ(angle.name, "flexion");
  EXPECT_EQ(angle.axis, 2);
  EXPECT_EQ((std::array{angle.sign, angle.rest, angle.min, angle.max}), (std::array{-1.0, 0.25, -0.5, 2.0}));
  EXPECT_EQ(s.joint.limits_source, "l");
  ASSERT_EQ(s.joint.coupled.size(), 1U);
  EXPECT_EQ(s.joint.coupled[0].drives, "y_mm");
  EXPECT_EQ(s.joint.coupled[0].ratio, 3.5);
  ASSERT_EQ(back.fits.size(), 1U);
  EXPECT_EQ(back.fits[0].rule, CenterRule::plane_fit);
  EXPECT_EQ(back.fits[0].points, 77);
  EXPECT_EQ(back.fits[0].confidence, 0.75);
  for (std::size_t length = 0; length < bytes.size(); ++length) {  // every cut is noticed
    Rig cut;
    cache::Unpacker some(std::string_view(bytes).substr(0, length));
    EXPECT_THROW(some(cut), cache::Misread) << length;
  }
}

TEST(Archive, any_byte_and_any_border_between_values_changes_the_hash) {
  const auto hash = [](const auto&... values) {
    cache::Hasher hasher;
    hasher(values...);
    return hasher.value();
  };
  const std::string a = "a", b = "b", ab = "ab", none;
  EXPECT_NE(hash(ab, none), hash(a, b));
  EXPECT_NE(hash(std::vector<int>{1}, std::vector<int>{2}), hash(std::vector<int>{1, 2}, std::vector<int>{}));
  EXPECT_NE(hash(0.0), hash(-0.0));
  EXPECT_EQ(hash(ab, 1.5), hash(ab, 1.5));
}

}  // namespace
}  // namespace ecorche::preprocess
