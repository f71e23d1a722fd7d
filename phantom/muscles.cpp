// SPDX-License-Identifier: Apache-2.0
// Muscles as spindles along their lines of action, wrapped round the rib cage where they cross it. Left side; the right
// one is its mirror image.
#include <cmath>

#include "phantom/bones.hpp"

namespace ecorche::phantom {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kLinks = 18;

double spindle(double t, double r0, double belly, double r1) {
  const double ends = r0 + (r1 - r0) * t;
  return ends + (belly - ends) * std::pow(std::sin(kPi * t), 1.3);
}

/// A belly between two tendons.
Shape strand(const std::vector<Vec>& line, double r0, double belly, double r1) {
  std::vector<double> radii;
  for (int i = 0; i < kLinks; ++i) radii.push_back(spindle(static_cast<double>(i) / (kLinks - 1), r0, belly, r1));
  return chain(smooth_path(line, kLinks), radii);
}

/// The same, kept off the rib cage.
Shape wrapped(const std::vector<Vec>& line, double r0, double belly, double r1) {
  static const Shape envelope = thorax_envelope();
  std::vector<Vec> path = smooth_path(line, kLinks);
  std::vector<double> radii;
  for (std::size_t i = 0; i < path.size(); ++i) {
    radii.push_back(spindle(static_cast<double>(i) / (kLinks - 1), r0, belly, r1));
    for (int step = 0; step < 4; ++step) {
      const double lacking = radii[i] + 6 - envelope.distance(path[i]);
      if (lacking > 0) path[i] += lacking * envelope.sample(path[i]).normal;
    }
  }
  return chain(path, radii);
}

struct Muscle {
  std::string name;
  Shape shape;
  int small_vertices;
};

std::vector<Muscle> leg_muscles(const Landmarks& at) {
  const Vec &h = at.hip, &k = at.knee, &a = at.ankle;
  const Vec thigh = (h + k) / 2, shank = (k + a) / 2;
  const auto foot = [&](double left, double back, double up) -> Vec { return a + at.foot * Vec(left, back, up); };
  return {
      {"rectus_femoris", strand({h + Vec(6, -40, 40), h + Vec(16, -52, -90), thigh + Vec(12, -50, -20), k + Vec(2, -44, 52)}, 9, 25, 8), 56},
      {"vastus_lateralis", strand({h + Vec(72, -8, -70), thigh + Vec(52, -16, 10), k + Vec(34, -30, 90), k + Vec(22, -36, 54)}, 11, 28, 8), 56},
      {"vastus_medialis", strand({h + Vec(32, -26, -130), thigh + Vec(-12, -28, -40), k + Vec(-32, -22, 82), k + Vec(-22, -34, 52)}, 10, 25, 9), 56},
      {"biceps_femoris", strand({h + Vec(-12, 36, -92), thigh + Vec(34, 44, 10), k + Vec(40, 42, 60), k + Vec(48, 30, -34)}, 10, 24, 6), 50},
      {"semitendinosus", strand({h + Vec(-24, 34, -100), thigh + Vec(-8, 50, 10), k + Vec(-36, 42, 60), k + Vec(-42, 22, -44)}, 10, 23, 6), 50},
      {"adductor_magnus", strand({h + Vec(-46, -2, -92), thigh + Vec(-22, 8, 60), thigh + Vec(-8, 10, -50), k + Vec(-28, 6, 76)}, 11, 27, 7), 50},
      {"gluteus_maximus", unite({strand({Vec(34, 100, 980), h + Vec(24, 84, 10), h + Vec(66, 44, -78)}, 12, 32, 11),
                                 strand({Vec(26, 104, 925), h + Vec(6, 84, -24), h + Vec(58, 42, -112)}, 10, 30, 10)}, 10), 64},
      {"gluteus_medius", strand({h + Vec(40, 2, 132), h + Vec(64, 8, 70), h + Vec(80, 12, -2)}, 13, 23, 9), 44},
      {"gastrocnemius", unite({strand({k + Vec(20, 46, 22), k + Vec(24, 46, -90), shank + Vec(8, 42, 20), foot(3, 48, 50), foot(3, 50, -24)}, 9, 25, 4.5),
                               strand({k + Vec(-20, 46, 22), k + Vec(-22, 46, -100), shank + Vec(-4, 42, 10), foot(3, 48, 50), foot(3, 50, -24)}, 9, 26, 4.5)}, 5), 84},
      {"tibialis_anterior", strand({k + Vec(20, -14, -78), shank + Vec(18, -18, 60), a + Vec(6, -20, 110), foot(-8, -34, 38)}, 9, 18, 5), 44},
  };
}

std::vector<Muscle> arm_muscles(const Landmarks& at) {
  const Vec &g = at.shoulder, &e = at.elbow, &w = at.wrist;
  const Vec arm = (g + e) / 2, down = (w - e).normalized(), upper = (e - g).normalized();
  const Vec front = down.cross(at.elbow_axis).y() < 0 ? Vec(down.cross(at.elbow_axis)) : Vec(at.elbow_axis.cross(down));
  const Vec &axis = at.elbow_axis, dorsal = at.hand.col(0);
  const double length = (w - e).norm();
  return {
      {"deltoid", unite({strand({g + Vec(-34, -26, 36), g + Vec(20, -38, -6), g + Vec(52, -8, -122)}, 8, 19, 7),
                         strand({g + Vec(16, 4, 54), g + Vec(46, 2, -4), g + Vec(56, 2, -126)}, 8, 19, 7),
                         strand({g + Vec(-12, 50, 34), g + Vec(26, 40, -12), g + Vec(52, 14, -122)}, 8, 19, 7)}, 8), 80},
      {"biceps_brachii", strand({g + Vec(6, -34, -46), arm + Vec(-4, -27, -8), e - 54 * upper + Vec(-4, -27, 0), e + 27 * front + 26 * down}, 7, 22, 5.5), 50},
      {"triceps_brachii", strand({g + Vec(16, 30, -62), arm + Vec(6, 27, 10), e - 80 * upper + Vec(2, 24, 0), e - 27 * front - 36 * down}, 8, 23, 7), 50},
      {"forearm_flexors", strand({e - 30 * axis + 24 * down + 8 * front, e - 12 * axis + 0.38 * length * down - 20 * dorsal, w - 15 * dorsal - 60 * down, w - 14 * dorsal - 14 * down}, 8, 20, 5), 44},
      {"forearm_extensors", strand({e + 30 * axis + 22 * down + 6 * front, e + 16 * axis + 0.36 * length * down + 12 * dorsal, w + 14 * dorsal - 66 * down, w + 13 * dorsal - 14 * down}, 8, 19, 4.5), 44},
  };
}

std::vector<Muscle> trunk_muscles(const Landmarks& at) {
  const Vec &h = at.hip, &g = at.shoulder;
  const Vec crest = g + Vec(24, -26, -72);  // of the greater tubercle
  return {
      {"sternocleidomastoid", strand({{17, -60, 1430}, {34, -34, 1480}, {50, 4, 1540}, {60, 30, 1584}}, 6, 9, 6), 36},
      {"pectoralis_major", unite({wrapped({Vec(44, -66, 1404), Vec(100, -60, 1396), crest + Vec(0, 0, 14)}, 8, 12, 8),
                                  wrapped({Vec(24, -90, 1356), Vec(84, -90, 1362), Vec(140, -56, 1356), crest}, 8, 15, 8),
                                  wrapped({Vec(24, -100, 1306), Vec(84, -92, 1318), Vec(142, -52, 1332), crest + Vec(0, 0, -14)}, 8, 15, 8)}, 10), 76},
      {"latissimus_dorsi", unite({wrapped({Vec(22, 92, 1172), Vec(92, 92, 1232), Vec(146, 44, 1300), g + Vec(2, 14, -76)}, 6, 11, 7),
                                  wrapped({Vec(48, 84, 1100), Vec(112, 66, 1190), Vec(150, 34, 1280), g + Vec(4, 12, -90)}, 6, 11, 7),
                                  wrapped({Vec(86, 66, 1064), Vec(126, 44, 1160), Vec(152, 26, 1262), g + Vec(6, 10, -102)}, 6, 10, 7)}, 9), 84},
      {"trapezius", unite({wrapped({Vec(17, 56, 1532), Vec(40, 54, 1478), g + Vec(-44, 22, 58)}, 6, 11, 7),
                           wrapped({Vec(18, 90, 1452), Vec(64, 84, 1452), g + Vec(-20, 52, 46)}, 6, 11, 7),
                           wrapped({Vec(16, 100, 1330), Vec(50, 104, 1372), g + Vec(-54, 80, 16)}, 6, 9, 7)}, 10), 80},
      {"erector_spinae", strand({{26, 92, 1006}, {34, 80, 1060}, {36, 80, 1130}, {34, 98, 1210}, {30, 108, 1262}}, 9, 17, 6), 44},
      {"rectus_abdominis", unite({strand({Vec(14, h.y() - 70, h.z() - 2), {18, -98, 1020}, {20, -106, 1120}, {24, -104, 1212}}, 7, 11, 7),
                                  strand({Vec(22, h.y() - 66, h.z() + 4), {40, -92, 1020}, {44, -99, 1120}, {46, -98, 1212}}, 7, 11, 7)}, 7), 64},
      {"external_oblique", unite({wrapped({{112, -62, 1206}, {118, -52, 1120}, {92, -66, 1030}, {72, -56, 985}}, 6, 10, 6),
                                  wrapped({{130, -20, 1196}, {130, -14, 1110}, {118, -34, 1020}}, 6, 10, 6),
                                  wrapped({{134, 22, 1184}, {130, 22, 1110}, {122, 10, 1062}}, 6, 10, 6)}, 10), 70},
  };
}

}  // namespace

std::vector<Part> make_muscles(const Landmarks& at, const Shape& keepout, const std::vector<Part>& neighbours) {
  std::vector<Shape> others;
  for (const Part& part : neighbours) others.push_back(part.shape);
  std::vector<Shape> taken{keepout, grow(unite(others), 2)};
  std::vector<Part> muscles;
  for (const auto& group : {trunk_muscles(at), arm_muscles(at), leg_muscles(at)}) {
    for (const Muscle& muscle : group) {
      Part part;
      part.name = muscle.name;
      part.group = Group::muscle;
      // Those before it have the right of way.
      part.shape = subtract(muscle.shape, unite(taken), 2);
      part.outline = muscle.shape;
      part.detail = 6;
      part.hounsfield = 55;
      part.small_vertices = muscle.small_vertices;
      add_pair(muscles, part);
      taken.push_back(grow(muscle.shape, 1.5));
    }
  }
  return muscles;
}

}  // namespace ecorche::phantom
