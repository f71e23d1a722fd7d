// SPDX-License-Identifier: Apache-2.0
#include "phantom/bones.hpp"

namespace ecorche::phantom {

namespace {

Part organ(std::string name, Shape shape, double hounsfield, double detail, int small_vertices) {
  Part part;
  part.name = std::move(name);
  part.group = Group::organ;
  part.shape = std::move(shape);
  part.detail = detail;
  part.hounsfield = hounsfield;
  part.small_vertices = small_vertices;
  return part;
}

Shape colon() {
  return tube({{-86, 6, 1006},
               {-90, -2, 1060},
               {-84, -14, 1098},
               {-46, -60, 1092},
               {0, -70, 1086},
               {50, -58, 1096},
               {84, -14, 1110},
               {90, 0, 1060},
               {84, 8, 1004},
               {52, 22, 972},
               {22, 36, 962},
               {6, 44, 930},
               {0, 46, 906}},
              20, 15, 60);
}

Shape small_intestine() {
  // Rows of loops behind the rectus, back and forth.
  std::vector<Vec> path;
  for (int row = 0; row < 5; ++row) {
    const double z = 1052 - 25.0 * row, reach = row == 4 ? 34 : 56 - 3.0 * row;
    for (int i = -1; i <= 1; ++i)
      path.emplace_back((row % 2 == 0 ? i : -i) * reach, -56 + (i == 0 ? -10 : 6) + 3.0 * row, z);
  }
  return tube(path, 14, 14, 90);
}

}  // namespace

std::vector<Part> make_organs(const Landmarks&, const std::vector<Part>& bones,
                              const std::vector<Part>& vessels) {
  std::vector<Shape> bone_shapes, vessel_shapes;
  for (const Part& part : bones) bone_shapes.push_back(part.shape);
  for (const Part& part : vessels) vessel_shapes.push_back(part.shape);
  const Shape solid = unite({grow(unite(bone_shapes), 3), grow(unite(vessel_shapes), 2)});

  const Shape envelope = thorax_envelope();
  const Shape cavity = unite({grow(envelope, -13), ellipsoid({0, -4, 1070}, {112, 84, 165})}, 20);
  const auto clear = [&](const Shape& shape, const std::vector<Shape>& others) {
    std::vector<Shape> away{solid};
    if (!others.empty()) away.push_back(grow(unite(others), 3));
    return subtract(shape, unite(away, 3), 3);
  };

  const Eigen::Matrix3d tilt =
      (Eigen::AngleAxisd(-0.62, Vec::UnitY()) * Eigen::AngleAxisd(0.3, Vec::UnitX())).toRotationMatrix();
  const Shape raw_heart =
      unite({ellipsoid({16, -34, 1284}, {38, 36, 52}, tilt), ellipsoid({-8, -24, 1306}, {28, 30, 30})}, 14);
  const Shape raw_liver = intersect(
      unite({ellipsoid({-48, -6, 1188}, {76, 72, 56}), ellipsoid({14, -38, 1202}, {54, 34, 28})}, 20), cavity,
      8);
  const Shape raw_stomach = intersect(
      tube({{44, 8, 1226}, {62, -6, 1204}, {62, -28, 1168}, {40, -48, 1136}, {8, -52, 1128}}, 31, 17, 24),
      cavity, 6);
  const Shape raw_spleen = intersect(
      ellipsoid({86, 26, 1196}, {21, 32, 34}, Eigen::AngleAxisd(0.3, Vec::UnitX()).toRotationMatrix()),
      grow(cavity, -1), 4);
  const Shape kidney = subtract(
      ellipsoid({60, 46, 1128}, {23, 19, 46}, Eigen::AngleAxisd(-0.2, Vec::UnitY()).toRotationMatrix()),
      ellipsoid({36, 42, 1126}, {12, 14, 14}), 8);
  const Shape raw_trachea =
      unite({tube({{0, -20, 1535}, {0, 2, 1460}, {-6, 17, 1400}, {-6, 22, 1362}}, 8, 8, 20),
             tube({{-6, 22, 1364}, {-22, 22, 1342}, {-34, 22, 1326}}, 6.5, 5.5, 8),
             tube({{-6, 22, 1364}, {4, 14, 1342}, {30, 6, 1326}}, 6, 5.5, 8)},
            4);
  const Shape raw_colon = intersect(colon(), grow(cavity, 6), 4);

  const Shape heart = clear(raw_heart, {});
  const Shape trachea = clear(raw_trachea, {});
  // Each lung: a side of the chest, hollowed by the mediastinum and standing on the diaphragm.
  const Shape mediastinum = ellipsoid({0, 14, 1310}, {24, 90, 190});
  const Shape diaphragm_left = ellipsoid({62, 0, 1118}, {110, 110, 112}),
              diaphragm_right = ellipsoid({-56, 0, 1130}, {110, 110, 112});
  const auto lung = [&](double side, const Shape& diaphragm) {
    const Shape half = subtract(grow(envelope, -13), half_space({side * 10, 0, 0}, {side, 0, 0}));
    return clear(subtract(half, unite({mediastinum, diaphragm}), 10),
                 {raw_heart, raw_trachea, raw_liver, raw_stomach, raw_spleen});
  };
  const Shape cerebrum = subtract(grow(skull_cavity(), -4), round_box({0, -10, 1727}, {2.5, 70, 10}, 2), 6);

  std::vector<Part> organs;
  organs.push_back(organ("brain", clear(cerebrum, {}), 38, 20, 100));
  organs.push_back(organ("trachea", trachea, -400, 5, 60));
  organs.push_back(organ("heart", heart, 110, 15, 90));
  organs.push_back(organ("lung_left", lung(1, diaphragm_left), -780, 15, 120));
  organs.push_back(organ("lung_right", lung(-1, diaphragm_right), -780, 15, 120));
  organs.push_back(organ("liver", clear(raw_liver, {}), 95, 15, 110));
  organs.push_back(organ("stomach", clear(raw_stomach, {raw_liver}), 30, 12, 70));
  organs.push_back(organ("spleen", clear(raw_spleen, {raw_stomach}), 120, 12, 44));
  organs.push_back(organ("kidney_left", clear(kidney, {raw_spleen}), 180, 12, 50));
  organs.push_back(organ("kidney_right", clear(mirrored(kidney), {raw_liver}), 180, 12, 50));
  organs.push_back(organ("colon",
                         clear(raw_colon, {raw_liver, raw_stomach, raw_spleen, kidney, mirrored(kidney)}), 20,
                         10, 220));
  organs.push_back(
      organ("small_intestine", clear(intersect(small_intestine(), cavity, 4), {raw_colon}), 40, 10, 200));
  organs.push_back(organ(
      "bladder", clear(ellipsoid({0, -8, 922}, {30, 25, 23}), {raw_colon, small_intestine()}), 8, 12, 44));
  return organs;
}

}  // namespace ecorche::phantom
