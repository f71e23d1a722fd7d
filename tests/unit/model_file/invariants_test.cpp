// SPDX-License-Identifier: Apache-2.0
// Every invariant can be broken, and the message then names the dataset.
#include "core/model_file/invariants.hpp"

#include <algorithm>
#include <functional>
#include <limits>

#include "tests/unit/model_file/test_files.hpp"

namespace ecorche::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();

struct Break {
  const char* dataset;
  std::function<void(Model&)> how;
};

Segment& segment(Model& m, std::size_t row) {
  return m.rig.skeleton.segments[row];
}

const std::vector<Break> kBreaks{
    {"/ecorche/skeleton/segment", [](Model& m) { segment(m, 1).name = "base"; }},
    {"/ecorche/skeleton/segment", [](Model& m) { segment(m, 1).name = "Middle"; }},
    {"/ecorche/skeleton/segment", [](Model& m) { segment(m, 1).name = std::string(65, 'a'); }},
    {"/ecorche/skeleton/segment", [](Model& m) { m.rig.skeleton.segments.clear(); }},
    {"/ecorche/skeleton/parent", [](Model& m) { segment(m, 1).parent = 2; }},
    {"/ecorche/skeleton/parent", [](Model& m) { segment(m, 1).parent = 1; }},
    {"/ecorche/skeleton/parent", [](Model& m) { segment(m, 1).parent = -1; }},
    {"/ecorche/skeleton/parent", [](Model& m) { segment(m, 0).parent = 0; }},
    {"/ecorche/skeleton/joint", [](Model& m) { segment(m, 1).joint.name = "base_joint"; }},
    {"/ecorche/skeleton/center", [](Model& m) { segment(m, 1).joint.center[1] = kNan; }},
    {"/ecorche/skeleton/axes", [](Model& m) { segment(m, 1).joint.axes *= 1.001; }},
    {"/ecorche/skeleton/axes", [](Model& m) { segment(m, 1).joint.axes.col(0) *= -1; }},
    {"/ecorche/skeleton/axes", [](Model& m) { segment(m, 1).joint.axes(0, 0) = kNan; }},
    {"/ecorche/skeleton/angle_joint", [](Model& m) { segment(m, 1).joint.sequence.pop_back(); }},
    {"/ecorche/skeleton/angle_name", [](Model& m) { segment(m, 1).joint.sequence[0].name = "tilt"; }},
    {"/ecorche/skeleton/angle_axis", [](Model& m) { segment(m, 1).joint.sequence[0].axis = 3; }},
    {"/ecorche/skeleton/angle_axis", [](Model& m) { segment(m, 1).joint.sequence[0].axis = 1; }},
    {"/ecorche/skeleton/angle_sign", [](Model& m) { segment(m, 1).joint.sequence[0].sign = 0; }},
    {"/ecorche/skeleton/angle_rest", [](Model& m) { segment(m, 1).joint.sequence[0].rest = kNan; }},
    {"/ecorche/skeleton/angle_min", [](Model& m) { segment(m, 1).joint.sequence[0].min = 3; }},
    {"/ecorche/skeleton/angle_min", [](Model& m) { segment(m, 1).joint.sequence[0].max = kNan; }},
    {"/ecorche/skeleton/coupling_leader", [](Model& m) { segment(m, 2).joint.coupled[0].joint = "none"; }},
    {"/ecorche/skeleton/coupling_leader",
     [](Model& m) { segment(m, 2).joint.coupled[0].joint = "tip_joint"; }},
    {"/ecorche/skeleton/coupling_angle", [](Model& m) { segment(m, 2).joint.coupled[0].angle = "none"; }},
    {"/ecorche/skeleton/coupling_angle", [](Model& m) { segment(m, 2).joint.coupled[0].drives = "none"; }},
    {"/ecorche/skeleton/coupling_ratio", [](Model& m) { segment(m, 2).joint.coupled[0].ratio = kNan; }},
    {"/ecorche/skeleton/fit_joint", [](Model& m) { m.rig.fits.pop_back(); }},
    {"/ecorche/skeleton/fit_joint", [](Model& m) { m.rig.fits[1].joint = "tip_joint"; }},
    {"/ecorche/skeleton/fit_residual_mm", [](Model& m) { m.rig.fits[1].residual_mm = kNan; }},
    {"/ecorche/skeleton/fit_residual_mm", [](Model& m) { m.rig.fits[1].confidence = 1.5; }},
    {"/VTKHDF/Points", [](Model& m) { m.nodes(5, 1) = kNanF; }},
    {"/VTKHDF/Points", [](Model& m) { m.nodes.resize(0, 3); }},
    {"/VTKHDF/Connectivity", [](Model& m) { m.tets(7, 3) = static_cast<std::int32_t>(m.nodes.rows()); }},
    {"/VTKHDF/Connectivity", [](Model& m) { m.tets(7, 3) = -1; }},
    {"/VTKHDF/Connectivity", [](Model& m) { std::swap(m.tets(7, 2), m.tets(7, 3)); }},
    {"/VTKHDF/Connectivity", [](Model& m) { m.tets(7, 3) = m.tets(7, 2); }},
    {"/VTKHDF/Connectivity", [](Model& m) { std::swap(m.tets(0, 2), m.tets(0, 3)); }},
    {"/VTKHDF/Connectivity", [](Model& m) { m.tets.resize(0, 4), m.tet_label.clear(); }},
    {"/VTKHDF/CellData/label", [](Model& m) { m.tet_label[9] = 4; }},
    {"/VTKHDF/CellData/label", [](Model& m) { m.tet_label.pop_back(); }},
    {"/VTKHDF/CellData/label", [](Model& m) { m.contested = {1}; }},  // tets of bones do not come first
    {"/ecorche/labels/contested", [](Model& m) { m.contested.assign(m.tet_count() + 1, 1); }},
    {"/ecorche/labels/contested",
     [](Model& m) {
       std::fill(m.tet_label.begin(), m.tet_label.end(), 0), m.contested = {1, 0};
     }},
    {"/ecorche/labels/contested",
     [](Model& m) {
       std::fill(m.tet_label.begin(), m.tet_label.end(), 0), m.contested = {1, 4};
     }},
    {"/ecorche/labels/bone", [](Model& m) { m.bone_names[0] = m.bone_names[1]; }},
    {"/ecorche/labels/segment", [](Model& m) { m.bone_segment[0] = 3; }},
    {"/ecorche/labels/segment", [](Model& m) { m.bone_segment[0] = -1; }},
    {"/ecorche/labels/segment", [](Model& m) { m.bone_segment.pop_back(); }},
    {"/ecorche/weights/offsets", [](Model& m) { m.weights.offsets[4] = m.weights.offsets[3]; }},
    {"/ecorche/weights/offsets", [](Model& m) { m.weights.offsets[4] = ~std::uint64_t{0}; }},
    {"/ecorche/weights/offsets", [](Model& m) { m.weights.offsets.front() = 1; }},
    {"/ecorche/weights/offsets", [](Model& m) { m.weights.offsets.back() += 1; }},
    {"/ecorche/weights/offsets", [](Model& m) { m.weights.offsets.pop_back(); }},
    {"/ecorche/weights/segment", [](Model& m) { m.weights.segment[5] = 3; }},
    {"/ecorche/weights/segment", [](Model& m) { m.weights.segment.pop_back(); }},
    {"/ecorche/weights/segment",
     [](Model& m) {
       std::size_t n = 0;
       while (m.weights.offsets[n + 1] - m.weights.offsets[n] < 2) ++n;
       std::swap(m.weights.segment[m.weights.offsets[n]], m.weights.segment[m.weights.offsets[n] + 1]);
     }},
    {"/ecorche/weights/weight", [](Model& m) { m.weights.weight[5] = -1e-7f; }},
    {"/ecorche/weights/weight", [](Model& m) { m.weights.weight[5] = 1.0001f; }},
    {"/ecorche/weights/weight", [](Model& m) { m.weights.weight[5] = kNanF; }},
    {"/ecorche/weights/weight", [](Model& m) { m.weights.weight[5] *= 0.99999f; }},
    {"/ecorche/cor/centre", [](Model& m) { m.cor.centre(5, 1) = kNanF; }},
    {"/ecorche/cor/centre", [](Model& m) { m.cor.centre.conservativeResize(4, 3); }},
    {"/ecorche/cor/has_centre", [](Model& m) { m.cor.has_centre[5] = 2; }},
    {"/ecorche/cor/has_centre", [](Model& m) { m.cor.has_centre.pop_back(); }},
    {"/ecorche/cor/sigma", [](Model& m) { m.cor.sigma = 0; }},
    {"/ecorche/tissues", [](Model& m) { m.tissues[4].name = "skin"; }},
    {"/ecorche/tissues", [](Model& m) { m.tissues[4].name = "a/b"; }},
    {"/ecorche/tissues", [](Model& m) { m.tissues[4].name = ""; }},
    {"/ecorche/tissues/skin/points", [](Model& m) { m.tissues[0].V(3, 2) = kNanF; }},
    {"/ecorche/tissues/skin/triangles", [](Model& m) { m.tissues[0].F(3, 2) = -1; }},
    {"/ecorche/tissues/skin/triangles", [](Model& m) { m.tissues[0].F(3, 2) = 1 << 20; }},
    {"/ecorche/tissues/skin/tet", [](Model& m) { m.tissues[0].tet[3] = 432; }},
    {"/ecorche/tissues/skin/tet", [](Model& m) { m.tissues[0].tet[3] = -1; }},
    {"/ecorche/tissues/skin/tet", [](Model& m) { m.tissues[0].tet.pop_back(); }},
    {"/ecorche/tissues/skin/barycentric", [](Model& m) { m.tissues[0].barycentric(3, 2) = kNanF; }},
    {"/ecorche/tissues/skin/barycentric", [](Model& m) { m.tissues[0].barycentric(3, 2) += 1e-3f; }},
    {"/ecorche/tissues/skin/barycentric",
     [](Model& m) { m.tissues[0].barycentric.conservativeResize(3, 4); }},
    {"/ecorche/tissues/bone_base/segment", [](Model& m) { m.tissues[1].segment = 3; }},
    {"/ecorche/tissues/bone_base/segment", [](Model& m) { m.tissues[1].segment = -2; }},
    {"/ecorche/tissues/bone_base/tet", [](Model& m) { m.tissues[1].tet.resize(3); }},
    {"/ecorche/volumes", [](Model& m) { m.volumes[0].name = "labels"; }},
    {"/ecorche/volumes/ct/size", [](Model& m) { m.volumes[0].image.grid.size[1] = 0; }},
    {"/ecorche/volumes/ct/size", [](Model& m) { m.volumes[0].image.grid.size[1] = -6; }},
    {"/ecorche/volumes/ct/voxels", [](Model& m) { m.volumes[0].image.grid.size[1] = 7; }},
    {"/ecorche/volumes/ct/components", [](Model& m) { m.volumes[0].image.components = 0; }},
    {"/ecorche/volumes/ct/origin", [](Model& m) { m.volumes[0].image.grid.origin[0] = kNan; }},
    {"/ecorche/volumes/ct/spacing", [](Model& m) { m.volumes[0].image.grid.spacing[2] = 0; }},
    {"/ecorche/volumes/ct/direction", [](Model& m) { m.volumes[0].image.grid.direction[0] = 1.01; }},
    {"/ecorche/volumes/ct/background", [](Model& m) { m.volumes[0].background = kNan; }},
    {"/ecorche/spheres", [](Model& m) { m.spheres[0].name = "body"; }},
    {"/ecorche/spheres", [](Model& m) { m.spheres[0].name = "../x"; }},
    {"/ecorche/spheres/few", [](Model& m) { m.spheres[0].distance[1] = 7; }},
    {"/ecorche/spheres/body", [](Model& m) { m.spheres[1].grid.spacing[1] = 11; }},
    {"/ecorche/spheres/body", [](Model& m) { std::swap(m.spheres[1].voxel[3], m.spheres[1].voxel[4]); }},
    {"/ecorche/spheres/body", [](Model& m) { m.spheres[1].parent[0] = 7; }},
    {"/ecorche/spheres/body/parent", [](Model& m) { m.spheres[1].parent.clear(); }},
    {"/ecorche/spheres/body/segment", [](Model& m) { m.spheres[1].segment.clear(); }},
    {"/ecorche/spheres/body/segment", [](Model& m) { m.spheres[1].segment[5] = VolumetricSkeleton::none; }},
    {"/ecorche/spheres/body/segment", [](Model& m) { m.spheres[1].segment[5] = 3; }},
    {"/ecorche/packed_correction", [](Model& m) { std::swap(m.corrections[0], m.corrections[1]); }},
    {"/ecorche/packed_correction", [](Model& m) { m.corrections[1].joint = 3; }},
    {"/ecorche/packed_correction", [](Model& m) { m.corrections[0].joint = -1; }},
    {"/ecorche/packed_correction/middle_joint/turn", [](Model& m) { m.corrections[0].turn.resize(0, 3); }},
    {"/ecorche/packed_correction/middle_joint/turn", [](Model& m) { m.corrections[0].turn(1, 0) = kNan; }},
    {"/ecorche/packed_correction/middle_joint/turn", [](Model& m) { m.corrections[0].turn(1, 0) = 4; }},
    {"/ecorche/packed_correction/middle_joint/turn",
     [](Model& m) { m.corrections[0].turn.row(1).setZero(); }},
    {"/ecorche/packed_correction/middle_joint/turn",
     [](Model& m) { m.corrections[0].turn.row(1) = m.corrections[0].turn.row(0); }},
    {"/ecorche/packed_correction/middle_joint/turn", [](Model& m) { m.corrections[0].turn(1, 2) = 0.1; }},
    {"/ecorche/packed_correction/tip_joint/mix", [](Model& m) { m.corrections[1].mix(1, 1) = kNanF; }},
    {"/ecorche/packed_correction/tip_joint/mix", [](Model& m) { m.corrections[1].mix.resize(4, 2); }},
    {"/ecorche/packed_correction/tip_joint/mix",
     [](Model& m) { m.corrections[1].mix.resize(5, 0), m.corrections[1].scale.clear(); }},
    {"/ecorche/packed_correction/tip_joint/scale", [](Model& m) { m.corrections[1].scale[1] = kNanF; }},
    {"/ecorche/packed_correction/tip_joint/node", [](Model& m) { m.corrections[1].node.clear(); }},
    {"/ecorche/packed_correction/tip_joint/node", [](Model& m) { m.corrections[1].node.back() = 1 << 20; }},
    {"/ecorche/packed_correction/tip_joint/node",
     [](Model& m) { std::swap(m.corrections[1].node[0], m.corrections[1].node[1]); }},
    {"/ecorche/packed_correction/tip_joint/node",
     [](Model& m) {
       m.corrections[1].node = {static_cast<std::uint32_t>(m.tets(
           std::find_if(m.tet_label.begin(), m.tet_label.end(), [](auto label) { return label != 0; }) -
               m.tet_label.begin(),
           0))};
     }},
    {"/ecorche/packed_correction/tip_joint/field", [](Model& m) { m.corrections[1].field.pop_back(); }},
    {"/ecorche/packed_pose_correction/place_1/joint",
     [](Model& m) {
       m.pose_corrections[0].joint = {2, 1};
     }},
    {"/ecorche/packed_pose_correction/place_1/joint",
     [](Model& m) {
       m.pose_corrections[0].joint = {0, 1};
     }},
    {"/ecorche/packed_pose_correction/place_1/joint",
     [](Model& m) {
       m.pose_corrections[0].joint = {1, 3};
     }},
    {"/ecorche/packed_pose_correction/place_1/joint", [](Model& m) { m.pose_corrections[0].joint.clear(); }},
    {"/ecorche/packed_pose_correction/place_1/turn",
     [](Model& m) { m.pose_corrections[0].turn.conservativeResize(1, 3); }},
    {"/ecorche/packed_pose_correction/place_1/turn",
     [](Model& m) { m.pose_corrections[0].turn(1, 2) = kNan; }},
    {"/ecorche/packed_pose_correction/place_1/reach", [](Model& m) { m.pose_corrections[0].reach = 0; }},
    {"/ecorche/packed_pose_correction/place_1/reach", [](Model& m) { m.pose_corrections[0].reach = 0.9; }},
    {"/ecorche/packed_pose_correction/place_1/reach", [](Model& m) { m.pose_corrections[0].reach = kNan; }},
    {"/ecorche/packed_pose_correction/place_1/scale", [](Model& m) { m.pose_corrections[0].scale = kNanF; }},
    {"/ecorche/packed_pose_correction/place_1/node",
     [](Model& m) { m.pose_corrections[0].node.back() = 1 << 20; }},
    {"/ecorche/packed_pose_correction/place_1/field",
     [](Model& m) { m.pose_corrections[0].field.pop_back(); }},
    {"/ecorche/safe_range/joint", [](Model& m) { m.safe_ranges[1].joint = 3; }},
    {"/ecorche/safe_range/joint", [](Model& m) { m.safe_ranges[1].way = -1; }},
    {"/ecorche/safe_range/angle", [](Model& m) { m.safe_ranges[1].angle = 3; }},
    {"/ecorche/safe_range/way", [](Model& m) { m.safe_ranges[1].way = 0; }},
    {"/ecorche/safe_range/looked", [](Model& m) { m.safe_ranges[1].looked = kNan; }},
    {"/ecorche/safe_range/skinned_volume", [](Model& m) { m.safe_ranges[1].skinned.volume = kNan; }},
    {"/ecorche/safe_range/corrected_inverted", [](Model& m) { m.safe_ranges[1].corrected.inverted = -0.1; }},
    {"/ecorche/safe_range/bones", [](Model& m) { m.safe_ranges[1].bones = 2.6; }},
    {"/ecorche/safe_range/skinned_contact", [](Model& m) { m.safe_ranges[1].skinned.contact = 2.6; }},
    {"/ecorche/safe_range/corrected_contact", [](Model& m) { m.safe_ranges[0].corrected.contact = -0.1; }},
    {"/ecorche/safe_range/skinned_contact", [](Model& m) { m.safe_ranges[1].corrected.contact = kNan; }},
    {"/ecorche/materials/tissue", [](Model& m) { m.materials.tissue[0] = 0; }},
    {"/ecorche/materials/tissue", [](Model& m) { m.materials.tissue[1] = -1; }},
    {"/ecorche/materials/tissue",
     [](Model& m) { m.materials.tissue[1] = static_cast<std::int32_t>(m.tissues.size()); }},
    {"/ecorche/materials/young_kpa", [](Model& m) { m.materials.young_kpa[1] = 0; }},
    {"/ecorche/materials/young_kpa", [](Model& m) { m.materials.young_kpa[0] = kNan; }},
    {"/ecorche/materials/young_kpa", [](Model& m) { m.materials.young_kpa.pop_back(); }},
    {"/ecorche/materials/tet", [](Model& m) { m.materials.of_tet[5] = 2; }},
    {"/ecorche/materials/tet", [](Model& m) { m.materials.of_tet.pop_back(); }},
    {"/ecorche/materials/tet", [](Model& m) { m.materials.tissue.clear(), m.materials.young_kpa.clear(); }},
};

TEST(Invariants, HoldForAGoodModel) {
  EXPECT_NO_THROW(model_file::check_invariants(full_model(), "model", ErrorKind::data, {}));
}

TEST(Invariants, AreEachNoticed) {
  const Model good = full_model();
  for (std::size_t i = 0; i < kBreaks.size(); ++i) {
    Model model = good;
    kBreaks[i].how(model);
    const Error error = error_of([&] { model_file::check_invariants(model, "model", ErrorKind::data, {}); });
    EXPECT_EQ(error.where(), std::string("model:") + kBreaks[i].dataset) << i << ": " << error.what();
    EXPECT_EQ(error.kind(), ErrorKind::data);
  }
}

// Before anything is read by it.
TEST(Invariants, ACornerBehindTheLastNodeIsSaidToBeOne) {
  Model model = full_model();
  model.tets(0, 3) = static_cast<std::int32_t>(model.nodes.rows());
  const Error error = error_of([&] { model_file::check_invariants(model, "model", ErrorKind::data, {}); });
  EXPECT_NE(std::string(error.what()).find("row 0 names a row that does not exist"), std::string::npos)
      << error.what();
}

}  // namespace
}  // namespace ecorche::test
