// SPDX-License-Identifier: Apache-2.0
// Muscles as spindles along their lines of action, wrapped round the rib cage where they cross it. Left side;
// the right one is its mirror image.
#include <cmath>
#include <numbers>

#include "phantom/bones.hpp"

namespace ecorche::phantom {

namespace {

constexpr int kLinks = 18;

double spindle(double t, double r0, double belly, double r1) {
  const double ends = r0 + (r1 - r0) * t;
  return ends + (belly - ends) * std::pow(std::sin(std::numbers::pi * t), 1.3);
}

/// A belly between two tendons.
Shape strand(const std::vector<Vec>& line, double r0, double belly, double r1) {
  std::vector<double> radii;
  for (int i = 0; i < kLinks; ++i)
    radii.push_back(spindle(static_cast<double>(i) / (kLinks - 1), r0, belly, r1));
  return chain(smooth_path(line, kLinks), radii);
}

/// A sheet of such strands that lies on `bed`: they are pushed out of it, blended together and flattened
/// against it.
Shape sheet(const Shape& bed, const std::vector<std::vector<Vec>>& lines, double r0, double belly, double r1,
            double blend) {
  std::vector<Shape> strands;
  for (const std::vector<Vec>& line : lines) {
    std::vector<Vec> path = smooth_path(line, kLinks);
    std::vector<double> radii;
    for (std::size_t i = 0; i < path.size(); ++i) {
      radii.push_back(spindle(static_cast<double>(i) / (kLinks - 1), r0, belly, r1));
      for (int step = 0; step < 5; ++step) {
        const Shape::Sample at = bed.sample(path[i]);
        path[i] += std::max(0.45 * radii[i] - at.distance, 0.0) * at.normal;
      }
    }
    strands.push_back(chain(path, radii));
  }
  return subtract(unite(strands, blend), bed, 2);
}

struct Muscle {
  std::string name;
  Shape shape;
  int small_vertices;
};

std::vector<Muscle> leg_muscles(const Landmarks& at) {
  const Vec &h = at.hip, &k = at.knee, &a = at.ankle;
  const Vec thigh = (h + k) / 2, shank = (k + a) / 2;
  const auto foot = [&](double left, double back, double up) -> Vec {
    return a + at.foot * Vec(left, back, up);
  };
  return {
      {"rectus_femoris",
       strand({h + Vec(6, -40, 40), h + Vec(16, -52, -90), thigh + Vec(12, -50, -20), k + Vec(2, -44, 52)}, 9,
              25, 8),
       56},
      {"vastus_lateralis",
       strand({h + Vec(72, -8, -70), thigh + Vec(52, -16, 10), k + Vec(34, -30, 90), k + Vec(22, -36, 54)},
              11, 28, 8),
       56},
      {"vastus_medialis",
       strand(
           {h + Vec(32, -26, -130), thigh + Vec(-12, -28, -40), k + Vec(-32, -22, 82), k + Vec(-22, -34, 52)},
           10, 25, 9),
       56},
      {"biceps_femoris",
       strand({h + Vec(-12, 36, -92), thigh + Vec(34, 44, 10), k + Vec(40, 42, 60), k + Vec(48, 30, -34)}, 10,
              24, 6),
       50},
      {"semitendinosus",
       strand({h + Vec(-24, 34, -100), thigh + Vec(-8, 50, 10), k + Vec(-38, 53, 60), k + Vec(-48, 39, -44)},
              10, 23, 6),
       50},
      {"adductor_magnus",
       strand(
           {h + Vec(-46, -2, -92), thigh + Vec(-24, 20, 60), thigh + Vec(-12, 22, -50), k + Vec(-26, 10, 84)},
           11, 27, 7),
       50},
      {"gluteus_maximus",
       unite({strand({Vec(34, 100, 980), h + Vec(24, 84, 10), h + Vec(66, 44, -78)}, 12, 32, 11),
              strand({Vec(26, 104, 925), h + Vec(6, 84, -24), h + Vec(58, 42, -112)}, 10, 30, 10)},
             10),
       64},
      {"gluteus_medius", strand({h + Vec(50, 6, 118), h + Vec(68, 12, 66), h + Vec(84, 14, 2)}, 13, 22, 10),
       44},
      {"gastrocnemius",
       unite({strand({k + Vec(20, 59, 22), k + Vec(24, 49, -90), shank + Vec(8, 34, 20), foot(3, 48, 50),
                      foot(3, 50, -24)},
                     9, 25, 4.5),
              strand({k + Vec(-20, 59, 22), k + Vec(-22, 49, -100), shank + Vec(-4, 34, 10), foot(3, 48, 50),
                      foot(3, 50, -24)},
                     9, 26, 4.5)},
             5),
       84},
      {"tibialis_anterior",
       strand({k + Vec(20, -14, -78), shank + Vec(18, -18, 60), a + Vec(6, -20, 110), foot(-8, -34, 38)}, 9,
              18, 5),
       44},
  };
}

std::vector<Muscle> arm_muscles(const Landmarks& at) {
  const Vec &g = at.shoulder, &e = at.elbow, &w = at.wrist;
  const Vec arm = (g + e) / 2, down = (w - e).normalized(), upper = (e - g).normalized();
  const Vec front =
      down.cross(at.elbow_axis).y() < 0 ? Vec(down.cross(at.elbow_axis)) : Vec(at.elbow_axis.cross(down));
  const Vec &axis = at.elbow_axis, dorsal = at.hand.col(0);
  const double length = (w - e).norm();
  return {
      {"deltoid",
       unite({strand({g + Vec(-34, -26, 34), g + Vec(18, -37, -6), g + Vec(50, -8, -122)}, 8, 18, 7),
              strand({g + Vec(18, 4, 48), g + Vec(43, 2, -4), g + Vec(54, 2, -126)}, 8, 18, 7),
              strand({g + Vec(4, 45, 20), g + Vec(24, 38, -12), g + Vec(50, 14, -122)}, 8, 18, 7)},
             14),
       80},
      {"biceps_brachii",
       strand({g + Vec(6, -34, -46), arm + Vec(-4, -27, -8), e - 54 * upper + Vec(-4, -29, 0),
               e + 33 * front + 14 * down},
              7, 22, 7),
       50},
      {"triceps_brachii",
       strand({g + Vec(16, 30, -62), arm + Vec(6, 27, 10), e - 80 * upper + Vec(2, 24, 0),
               e - 27 * front - 36 * down},
              8, 23, 7),
       50},
      {"forearm_flexors",
       strand({e - 30 * axis + 24 * down + 8 * front, e - 12 * axis + 0.38 * length * down - 20 * dorsal,
               w - 15 * dorsal - 60 * down, w - 14 * dorsal - 14 * down},
              8, 20, 5),
       44},
      {"forearm_extensors",
       strand({e + 30 * axis + 22 * down + 6 * front, e + 16 * axis + 0.36 * length * down + 12 * dorsal,
               w + 14 * dorsal - 66 * down, w + 13 * dorsal - 14 * down},
              8, 19, 4.5),
       44},
  };
}

std::vector<Muscle> trunk_muscles(const Landmarks& at, const Shape& scapula) {
  const Shape ribs = grow(thorax_envelope(), 6), back = unite({ribs, grow(scapula, 3)}, 10);
  const Vec &h = at.hip, &g = at.shoulder;
  const Vec crest = g + Vec(24, -26, -72);  // of the greater tubercle
  return {
      {"sternocleidomastoid",
       strand({{17, -60, 1430}, {34, -34, 1480}, {50, 4, 1540}, {60, 30, 1584}}, 6, 9, 6), 36},
      {"pectoralis_major",
       sheet(ribs,
             {{Vec(44, -66, 1404), Vec(100, -60, 1396), crest + Vec(0, 0, 14)},
              {Vec(22, -84, 1376), Vec(84, -84, 1380), Vec(140, -52, 1368), crest + Vec(0, 0, 6)},
              {Vec(22, -94, 1342), Vec(84, -92, 1348), Vec(140, -56, 1348), crest + Vec(0, 0, -6)},
              {Vec(26, -100, 1310), Vec(84, -94, 1316), Vec(140, -54, 1332), crest + Vec(0, 0, -14)}},
             9, 17, 8, 20),
       80},
      {"external_oblique",
       sheet(ribs,
             {{{104, -74, 1204}, {108, -68, 1120}, {88, -76, 1030}, {70, -66, 990}},
              {{122, -46, 1200}, {124, -42, 1112}, {104, -54, 1020}},
              {{132, -16, 1196}, {132, -14, 1110}, {118, -26, 1048}},
              {{134, 14, 1190}, {132, 14, 1110}, {124, 6, 1068}}},
             8, 13, 8, 20),
       76},
      {"rectus_abdominis",
       unite({strand({Vec(14, h.y() - 68, h.z() - 2), {17, -94, 1020}, {18, -101, 1120}, {22, -100, 1206}}, 8,
                     12, 8),
              strand({Vec(20, h.y() - 66, h.z() + 4), {37, -90, 1020}, {39, -96, 1120}, {40, -96, 1206}}, 8,
                     12, 8)},
             12),
       64},
      {"latissimus_dorsi",
       sheet(back,
             {{Vec(24, 92, 1190), Vec(92, 92, 1250), Vec(148, 44, 1306), g + Vec(2, 14, -72)},
              {Vec(34, 86, 1140), Vec(100, 82, 1216), Vec(148, 40, 1290), g + Vec(2, 14, -84)},
              {Vec(58, 78, 1096), Vec(114, 66, 1190), Vec(150, 34, 1278), g + Vec(4, 12, -94)},
              {Vec(88, 64, 1066), Vec(126, 46, 1164), Vec(152, 28, 1264), g + Vec(6, 10, -104)}},
             7, 12, 8, 16),
       90},
      {"trapezius",
       sheet(back,
             {{Vec(17, 56, 1532), Vec(36, 58, 1482), g + Vec(-48, 22, 56)},
              {Vec(17, 70, 1498), Vec(48, 72, 1464), g + Vec(-34, 40, 52)},
              {Vec(17, 88, 1452), Vec(64, 86, 1440), g + Vec(-24, 56, 44)},
              {Vec(16, 96, 1400), Vec(58, 98, 1410), g + Vec(-44, 72, 34)},
              {Vec(16, 100, 1340), Vec(44, 104, 1372), g + Vec(-66, 84, 20)}},
             8, 10, 8, 18),
       84},
      {"erector_spinae",
       strand({{28, 90, 1004}, {36, 80, 1060}, {38, 78, 1115}, {37, 86, 1160}, {34, 97, 1192}}, 9, 16, 8),
       44},
  };
}

}  // namespace

std::vector<Part> make_muscles(const Landmarks& at, const Shape& scapula, const Shape& keepout,
                               const std::vector<Part>& neighbours) {
  std::vector<Shape> others;
  for (const Part& part : neighbours) others.push_back(part.shape);
  std::vector<Shape> taken{keepout, grow(unite(others), 2)};
  std::vector<Part> muscles;
  for (const auto& group : {trunk_muscles(at, scapula), arm_muscles(at), leg_muscles(at)}) {
    for (const Muscle& muscle : group) {
      Part part;
      part.name = muscle.name;
      part.group = Group::muscle;
      // Those before it have the right of way.
      part.shape = subtract(muscle.shape, unite(taken, 2), 5);
      part.outline = muscle.shape;
      part.detail = 6;
      part.hounsfield = 55;
      part.small_vertices = muscle.small_vertices * 17 / 20;
      add_pair(muscles, part);
      taken.push_back(grow(muscle.shape, 1.5));
    }
  }
  return muscles;
}

}  // namespace ecorche::phantom
