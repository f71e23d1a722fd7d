// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/model_file/test_files.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <tuple>

#include <ecorche/model_file/model_file.hpp>
#include "core/model_file/figures.hpp"
#include "tests/support/toy_model.hpp"

// HDF5 1.10 itself loses a block whenever H5Gopen or H5Dopen refuses a damaged header; a C program of those
// calls alone shows the same.
// NOLINTNEXTLINE(bugprone-reserved-identifier): its name is the sanitizer's
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libhdf5_serial";
}

namespace ecorche::test {

namespace fs = std::filesystem;

ModelFileTest::ModelFileTest() {
  model_file::leave_hdf5_open_at_exit();  // as a program does that reads damaged models
  std::string pattern = (fs::temp_directory_path() / "ecorche-model-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
  folder_ = pattern;
}

ModelFileTest::~ModelFileTest() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::vector<std::string> ModelFileTest::names() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

Bytes load(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void store(const fs::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

Model full_model() {
  Model model = toy_model();
  std::vector<Segment>& segments = model.rig.skeleton.segments;
  segments[2].joint.coupled = {{"middle_joint", "flexion", "tilt", 0.5},
                               {"base_joint", "twist", "twist", -0.25}};
  segments[1].joint.rule = CenterRule::sphere_fit;
  segments[1].joint.center_bone = "bone_base";
  segments[1].joint.facing_bone = "bone_middle";
  segments[1].joint.axes = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  segments[2].joint.kind = JointKind::free;
  segments[0].aliases.clear();
  segments[1].aliases = {"Toy1", "mixamorig:Hips", "H\u00fcfte"};
  model.rig.fits[1] = {"middle_joint", CenterRule::sphere_fit, 12.5, 0.125, 0.75, 321, 0.625};
  ModelVolume field{"field", Image(model.volumes[0].image.grid, ScalarType::f32, 2), -1, false, {}};
  const auto values = field.image.scalars<float>();
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i) / 7;
  field.image.grid.direction = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  model.volumes.insert(model.volumes.begin() + 1, field);
  VolumetricSkeleton few = model.spheres[0];
  few.name = "few";
  few.metric = DistanceMetric::chamfer345;
  few.grid.origin = {1, 2, 3};
  few.voxel.resize(2);
  few.distance = {3, 3};
  few.deficit = {0.5F, 0.25F};
  few.parent = {VolumetricSkeleton::none, VolumetricSkeleton::none};
  few.segment = {2, 0};
  model.spheres.insert(model.spheres.begin(), few);
  const Model corrected = corrected_toy_model();
  model.corrections = corrected.corrections;
  // The last mode fits in bytes.
  std::vector<std::int16_t>& steps = model.corrections[0].field;
  for (std::size_t i = 2 * steps.size() / 3; i < steps.size(); ++i)
    steps[i] = static_cast<std::int16_t>(steps[i] / 512 * 4);
  model.pose_corrections = corrected.pose_corrections;
  model.safe_ranges = corrected.safe_ranges;
  model.materials = corrected.materials;
  double figure = 1;
  Certificate& c = model.certificate;
  for (double* value :
       {&c.solver_residual, &c.solved_min_weight, &c.solved_max_weight, &c.solved_row_sum_error,
        &c.repaired_largest_change, &c.min_weight, &c.max_weight, &c.row_sum_error, &c.min_dihedral_deg,
        &c.max_dihedral_deg, &c.positive_offdiagonal_share, &c.max_outside_mm, &c.bone_rigidity_mm,
        &c.first_violation, &c.mended_largest_change, &c.min_edge_mm, &c.contested_share, &c.least_bone_share,
        &c.bone_tet_change}) {
    *value = (figure += 1) / 3;
  }
  c.repaired_rows = 11;
  c.inverted_tets = 12;
  c.degenerate_tets = 13;
  c.tissue_vertices = 14;
  c.outside_vertices = 15;
  c.mended_nodes = 16;
  c.bone_tets = 17;
  c.contested_tets = 18;
  model.provenance["input/k\u00f6rper.stl"] = "0123456789abcdef";
  model.provenance["empty"] = "";
  return model;
}

namespace {

template <class M>
bool same(const M& a, const M& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         (a.size() == 0 ||
          std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof *a.data()) == 0);
}

void expect_same(const Joint& a, const Joint& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.rule, b.rule);
  EXPECT_EQ(a.center, b.center);
  EXPECT_EQ(a.center_bone, b.center_bone);
  EXPECT_EQ(a.facing_bone, b.facing_bone);
  EXPECT_EQ(a.axes, b.axes);
  EXPECT_EQ(a.limits_source, b.limits_source);
  ASSERT_EQ(a.sequence.size(), b.sequence.size());
  for (std::size_t i = 0; i < a.sequence.size(); ++i) {
    EXPECT_EQ(a.sequence[i].name, b.sequence[i].name);
    EXPECT_EQ(a.sequence[i].axis, b.sequence[i].axis);
    EXPECT_EQ(a.sequence[i].sign, b.sequence[i].sign);
    EXPECT_EQ(a.sequence[i].rest, b.sequence[i].rest);
    EXPECT_EQ(a.sequence[i].min, b.sequence[i].min);
    EXPECT_EQ(a.sequence[i].max, b.sequence[i].max);
  }
  ASSERT_EQ(a.coupled.size(), b.coupled.size());
  for (std::size_t i = 0; i < a.coupled.size(); ++i) {
    EXPECT_EQ(a.coupled[i].joint, b.coupled[i].joint);
    EXPECT_EQ(a.coupled[i].angle, b.coupled[i].angle);
    EXPECT_EQ(a.coupled[i].drives, b.coupled[i].drives);
    EXPECT_EQ(a.coupled[i].ratio, b.coupled[i].ratio);
  }
}

void expect_same(const Rig& a, const Rig& b) {
  EXPECT_EQ(a.skeleton.name, b.skeleton.name);
  ASSERT_EQ(a.skeleton.segments.size(), b.skeleton.segments.size());
  for (std::size_t i = 0; i < a.skeleton.segments.size(); ++i) {
    EXPECT_EQ(a.skeleton.segments[i].name, b.skeleton.segments[i].name);
    EXPECT_EQ(a.skeleton.segments[i].parent, b.skeleton.segments[i].parent);
    EXPECT_EQ(a.skeleton.segments[i].aliases, b.skeleton.segments[i].aliases);
    expect_same(a.skeleton.segments[i].joint, b.skeleton.segments[i].joint);
  }
  ASSERT_EQ(a.fits.size(), b.fits.size());
  for (std::size_t i = 0; i < a.fits.size(); ++i) {
    EXPECT_EQ(a.fits[i].joint, b.fits[i].joint);
    EXPECT_EQ(a.fits[i].rule, b.fits[i].rule);
    EXPECT_EQ(a.fits[i].radius_mm, b.fits[i].radius_mm);
    EXPECT_EQ(a.fits[i].residual_mm, b.fits[i].residual_mm);
    EXPECT_EQ(a.fits[i].inlier_share, b.fits[i].inlier_share);
    EXPECT_EQ(a.fits[i].points, b.fits[i].points);
    EXPECT_EQ(a.fits[i].confidence, b.fits[i].confidence);
  }
}

void expect_same(const Certificate& a, const Certificate& b) {
  std::vector<double> figures;
  model_file::for_each_figure(a, [&](auto, auto figure) { figures.push_back(static_cast<double>(figure)); });
  std::size_t i = 0;
  model_file::for_each_figure(b, [&](std::string_view name, auto figure) {
    EXPECT_EQ(figures[i++], static_cast<double>(figure)) << name;
  });
}

}  // namespace

void expect_same(const Model& a, const Model& b) {
  EXPECT_EQ(a.name, b.name);
  expect_same(a.rig, b.rig);
  EXPECT_TRUE(same(a.nodes, b.nodes));
  EXPECT_TRUE(same(a.tets, b.tets));
  EXPECT_EQ(a.tet_label, b.tet_label);
  EXPECT_EQ(a.contested, b.contested);
  EXPECT_EQ(a.bone_names, b.bone_names);
  EXPECT_EQ(a.bone_segment, b.bone_segment);
  EXPECT_EQ(a.weights.offsets, b.weights.offsets);
  EXPECT_EQ(a.weights.segment, b.weights.segment);
  EXPECT_EQ(a.weights.weight, b.weights.weight);
  EXPECT_TRUE(same(a.cor.centre, b.cor.centre));
  EXPECT_EQ(a.cor.has_centre, b.cor.has_centre);
  EXPECT_EQ(a.cor.sigma, b.cor.sigma);
  ASSERT_EQ(a.tissues.size(), b.tissues.size());
  for (std::size_t i = 0; i < a.tissues.size(); ++i) {
    EXPECT_EQ(a.tissues[i].name, b.tissues[i].name);
    EXPECT_EQ(a.tissues[i].group, b.tissues[i].group);
    EXPECT_TRUE(same(a.tissues[i].V, b.tissues[i].V));
    EXPECT_TRUE(same(a.tissues[i].F, b.tissues[i].F));
    EXPECT_EQ(a.tissues[i].segment, b.tissues[i].segment);
    EXPECT_EQ(a.tissues[i].tet, b.tissues[i].tet);
    EXPECT_TRUE(same(a.tissues[i].barycentric, b.tissues[i].barycentric));
  }
  ASSERT_EQ(a.volumes.size(), b.volumes.size());
  for (std::size_t i = 0; i < a.volumes.size(); ++i) {
    EXPECT_EQ(a.volumes[i].name, b.volumes[i].name);
    EXPECT_EQ(a.volumes[i].image.grid, b.volumes[i].image.grid);
    EXPECT_EQ(a.volumes[i].image.type, b.volumes[i].image.type);
    EXPECT_EQ(a.volumes[i].image.components, b.volumes[i].image.components);
    EXPECT_EQ(a.volumes[i].image.bytes, b.volumes[i].image.bytes);
    EXPECT_EQ(a.volumes[i].background, b.volumes[i].background);
    EXPECT_EQ(a.volumes[i].labels, b.volumes[i].labels);
    EXPECT_EQ(a.volumes[i].table, b.volumes[i].table);
  }
  ASSERT_EQ(a.spheres.size(), b.spheres.size());
  for (std::size_t i = 0; i < a.spheres.size(); ++i) {
    EXPECT_EQ(a.spheres[i].name, b.spheres[i].name);
    EXPECT_EQ(a.spheres[i].grid, b.spheres[i].grid);
    EXPECT_EQ(a.spheres[i].metric, b.spheres[i].metric);
    EXPECT_EQ(a.spheres[i].thinness, b.spheres[i].thinness);
    EXPECT_EQ(a.spheres[i].voxel, b.spheres[i].voxel);
    EXPECT_EQ(a.spheres[i].distance, b.spheres[i].distance);
    EXPECT_EQ(a.spheres[i].deficit, b.spheres[i].deficit);
    EXPECT_EQ(a.spheres[i].parent, b.spheres[i].parent);
    EXPECT_EQ(a.spheres[i].segment, b.spheres[i].segment);
  }
  EXPECT_EQ(a.materials.tissue, b.materials.tissue);
  EXPECT_EQ(a.materials.young_kpa, b.materials.young_kpa);
  EXPECT_EQ(a.materials.of_tet, b.materials.of_tet);
  ASSERT_EQ(a.corrections.size(), b.corrections.size());
  for (std::size_t i = 0; i < a.corrections.size(); ++i) {
    EXPECT_EQ(a.corrections[i].joint, b.corrections[i].joint);
    EXPECT_TRUE(same(a.corrections[i].turn, b.corrections[i].turn));
    EXPECT_TRUE(same(a.corrections[i].mix, b.corrections[i].mix));
    EXPECT_EQ(a.corrections[i].scale, b.corrections[i].scale);
    EXPECT_EQ(a.corrections[i].node, b.corrections[i].node);
    EXPECT_EQ(a.corrections[i].field, b.corrections[i].field);
  }
  ASSERT_EQ(a.pose_corrections.size(), b.pose_corrections.size());
  for (std::size_t i = 0; i < a.pose_corrections.size(); ++i) {
    const PoseCorrection &p = a.pose_corrections[i], &q = b.pose_corrections[i];
    EXPECT_EQ(std::tie(p.pose, p.joint, p.reach, p.scale, p.node, p.field),
              std::tie(q.pose, q.joint, q.reach, q.scale, q.node, q.field));
    EXPECT_TRUE(same(p.turn, q.turn));
  }
  ASSERT_EQ(a.safe_ranges.size(), b.safe_ranges.size());
  for (std::size_t i = 0; i < a.safe_ranges.size(); ++i) {
    const SafeRange &p = a.safe_ranges[i], &q = b.safe_ranges[i];
    EXPECT_EQ(std::tie(p.joint, p.angle, p.way, p.looked, p.bones),
              std::tie(q.joint, q.angle, q.way, q.looked, q.bones));
    EXPECT_EQ(std::tie(p.skinned.inverted, p.skinned.volume, p.skinned.contact),
              std::tie(q.skinned.inverted, q.skinned.volume, q.skinned.contact));
    EXPECT_EQ(std::tie(p.corrected.inverted, p.corrected.volume, p.corrected.contact),
              std::tie(q.corrected.inverted, q.corrected.volume, q.corrected.contact));
  }
  expect_same(a.certificate, b.certificate);
  EXPECT_EQ(a.provenance, b.provenance);
}

}  // namespace ecorche::test
