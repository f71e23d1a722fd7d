// SPDX-License-Identifier: Apache-2.0
// The outside of the body: bones and muscles under fat, and what gives trunk, head and limbs their outline.
#include "phantom/bones.hpp"

namespace ecorche::phantom {

namespace {

Shape head_outline() {
  const Shape cranium = ellipsoid({0, 6, 1661}, {79, 95, 79});
  const Shape occiput = ellipsoid({0, 36, 1618}, {58, 54, 46});
  const Shape face = ellipsoid({0, -36, 1604}, {61, 62, 76});
  const Shape jaw = unite(
      {ellipsoid({0, -52, 1566}, {46, 48, 36}), round_cone({56, -12, 1580}, 14, {30, -70, 1554}, 17)}, 14);
  const Shape chin = sphere({0, -88, 1548}, 19);
  const Shape brow = chain({{0, -86, 1654}, {30, -78, 1652}, {50, -54, 1648}}, {11, 12, 11});
  const Shape nose =
      unite({round_cone({0, -90, 1644}, 8, {0, -110, 1606}, 10), sphere({10, -102, 1604}, 7)}, 8);
  const Shape lips = ellipsoid({0, -94, 1574}, {25, 11, 10});
  const Shape cheek = sphere({40, -60, 1606}, 24);
  Shape head = unite({cranium, occiput, face, jaw, chin, brow, cheek}, 16);
  head = subtract(head, ellipsoid({32, -104, 1632}, {17, 14, 10}), 12);  // eye sockets
  head = unite({head, ellipsoid({32, -78, 1632}, {14, 13, 9})}, 5);      // closed eyes
  head = unite({head, nose, lips}, 9);
  const Eigen::Matrix3d tilt =
      (Eigen::AngleAxisd(0.4, Vec::UnitZ()) * Eigen::AngleAxisd(0.15, Vec::UnitX())).toRotationMatrix();
  Shape ear = ellipsoid({82, 14, 1624}, {7, 19, 32}, tilt);
  ear = subtract(ear, ellipsoid({91, 12, 1628}, {7, 11, 19}, tilt), 3);
  return unite({head, ear}, 5);
}

Shape trunk_outline(double fat) {
  const Shape chest = grow(thorax_envelope(), 12 + fat);
  const Shape belly = ellipsoid({0, -8, 1090}, {136 + fat, 104 + fat, 145});
  const Shape hips = ellipsoid({0, 10, 955}, {148 + fat, 96 + fat, 100});
  const Shape back = unite(
      {ellipsoid({44, 62, 1330}, {74, 50 + fat, 120}), ellipsoid({32, 60, 1150}, {60, 46 + fat, 160})}, 30);
  const Shape flank = ellipsoid({96, 14, 1040}, {44, 66, 70});
  const Shape groin = ellipsoid({0, -4, 880}, {70, 56, 62});
  Shape trunk = unite({chest, belly, hips, flank, back, groin}, 40);
  trunk = subtract(trunk, ellipsoid({0, -124 - fat, 1078}, {7, 16, 9}), 8);  // navel
  return subtract(trunk, chain({{0, 128, 1000}, {0, 122, 1150}, {0, 128, 1330}}, {8, 9, 8}), 20);
}

Shape arm_outline(const Landmarks& at) {
  const Vec &g = at.shoulder, &e = at.elbow, &w = at.wrist;
  const double f = at.fat;
  const Shape upper = chain({g + Vec(8, 2, -20), g + 0.5 * (e - g), e}, {38 + f, 34 + f, 31 + f});
  const Shape fore = chain({e, e + 0.3 * (w - e), e + 0.75 * (w - e), w}, {31 + f, 34 + f, 22 + f, 19 + f});
  const Shape shoulder = chain({Vec(70, 24, 1404), g + Vec(-8, 5, 10)}, {50, 47}),
              armpit = round_cone({116, 12, 1350}, 42, g + Vec(2, 4, -46), 40);
  return unite({upper, fore, shoulder, armpit}, 20);
}

Shape hand_outline(const Landmarks& at, const Shape& bones) {
  const auto in_hand = [&](const Vec& p) -> Vec { return at.wrist + at.hand * p; };
  std::vector<Shape> parts{grow(bones, 4.2)};
  parts.push_back(round_box(in_hand({-1, 0, -48}), {12, 37, 38}, 11, at.hand));
  parts.push_back(
      round_cone(in_hand({-10, -20, -28}), 13, in_hand({-14, -32, -48}), 12));  // ball of the thumb
  parts.push_back(round_cone(in_hand({-8, 24, -24}), 12, in_hand({-7, 26, -62}), 10));
  return unite(parts, 7);
}

Shape leg_outline(const Landmarks& at) {
  const Vec &h = at.hip, &k = at.knee, &a = at.ankle;
  const double f = at.fat;
  const Shape thigh = chain({h + Vec(20, 8, -46), h + 0.35 * (k - h) + Vec(8, 4, 0),
                             h + 0.7 * (k - h) + Vec(2, 2, 0), k + Vec(0, 0, 24)},
                            {76 + f, 72 + f, 62 + f, 46 + f});
  const Shape knee = chain({k + Vec(0, 4, 20), k + Vec(0, 6, -40)}, {46 + f, 45 + f});
  const Shape shank =
      chain({k + Vec(0, 6, -40), k + 0.35 * (a - k) + Vec(2, 10, 0), k + 0.75 * (a - k), a + Vec(0, 2, 26)},
            {45 + f, 48 + f, 34 + f, 28 + f});
  const Shape buttock = ellipsoid(h + Vec(-24, 60, -4), {66, 50 + f, 78});
  return unite({thigh, knee, shank, buttock}, 24);
}

Shape foot_outline(const Landmarks& at, const Shape& foot, const Shape& toes) {
  const auto p = [&](double left, double back, double up) -> Vec {
    return at.ankle + at.foot * Vec(left, back, up);
  };
  const Shape instep = chain({p(0, 2, -10), p(-3, -50, -42), p(0, -110, -62)}, {31, 26, 18});
  const Shape sole = chain({p(3, 38, -62), p(10, -40, -64), p(2, -120, -68)}, {23, 19, 16});
  const Shape ball = chain({p(-26, -130, -69), p(30, -112, -71)}, {15, 13});
  return unite({grow(foot, 5), grow(toes, 4.5), instep, sole, ball}, 8);
}

}  // namespace

Part make_skin(const Landmarks& at, const std::vector<Part>& bones, const std::vector<Part>& muscles,
               const std::vector<Part>& vessels) {
  const auto left_bone = [&](std::string_view name) -> const Shape& { return find_part(bones, name).shape; };
  std::vector<Shape> parts{head_outline(),
                           trunk_outline(at.fat),
                           arm_outline(at),
                           leg_outline(at),
                           hand_outline(at, left_bone("hand_bones_left")),
                           foot_outline(at, left_bone("foot_bones_left"), left_bone("toe_bones_left"))};
  parts.push_back(tube({{0, 46, 1430}, {0, 22, 1500}, {0, 14, 1560}}, 54, 52, 10));
  for (const Part& muscle : muscles) {
    if (muscle.mirror_of < 0) parts.push_back(grow(muscle.outline, at.fat));
  }
  for (const Part& vessel : vessels) parts.push_back(grow(vessel.shape, 4));
  for (const char* name : {"clavicle_left", "scapula_left", "humerus_left", "radius_left", "ulna_left",
                           "patella_left", "tibia_left", "fibula_left"}) {
    parts.push_back(grow(left_bone(name), 5));
  }
  for (const char* name : {"skull", "mandible", "pelvis"}) parts.push_back(grow(left_bone(name), 4.5));
  Part skin;
  skin.name = "skin";
  skin.group = Group::skin;
  skin.shape = symmetric(unite(parts, 14));
  skin.detail = 6;
  skin.hounsfield = -90;  // fat; see volume.cpp
  skin.small_vertices = 2150;
  return skin;
}

}  // namespace ecorche::phantom
