// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>

#include "phantom/bones.hpp"

namespace ecorche::phantom {

Shape clavicle_bone(const Landmarks& at) {
  const Vec& s = at.sternoclavicular;
  return tube({s + Vec(9, 0, 2), s + Vec(46, -5, 10), s + Vec(88, 26, 22), at.shoulder + Vec(-26, 0, 38)},
              8.5, 6.5, 18);
}

Shape scapula_bone(const Landmarks& at) {
  const Vec& g = at.shoulder;
  const Shape envelope = thorax_envelope();
  // A blade that hugs the ribs.
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.18, Vec::UnitY()).toRotationMatrix();
  const Shape blade = intersect(subtract(grow(envelope, 18), grow(envelope, 9)),
                                ellipsoid({106, 66, 1335}, {33, 60, 80}, tilt), 4);
  const Vec facing = Vec(0.86, -0.50, 0).normalized();
  const Vec glenoid = g - 38 * facing;
  const Shape neck = tube({Vec(118, 66, 1372), glenoid + Vec(-6, 12, -6), glenoid}, 9, 17, 8);
  const Shape spine = tube(
      {Vec(80, 92, 1384), Vec(122, 82, 1404), g + Vec(-14, 44, 30), g + Vec(6, 20, 39), g + Vec(8, -2, 39)},
      6.5, 7.5, 20);
  const Shape coracoid =
      tube({glenoid + Vec(2, -2, 12), g + Vec(-36, -22, 24), g + Vec(-20, -40, 10)}, 8, 6, 10);
  const Shape bridge = round_cone({112, 76, 1390}, 8, {118, 62, 1370}, 9);
  Shape scapula = unite({blade, neck, spine, coracoid, bridge}, 7);
  return subtract(scapula, sphere(g, kHumeralHead + kBallGap));
}

Shape humerus_bone(const Landmarks& at) {
  const Vec& g = at.shoulder;
  const Vec& e = at.elbow;
  const Vec down = (e - g).normalized();
  const double length = (e - g).norm();
  const Vec out = Vec(1, 0, 0.2).normalized();
  const Shape shaft =
      chain(smooth_path({g + 9 * out + 12 * down, g + 12 * out + 50 * down,
                         g + 6 * out + 0.45 * length * down, g + 0.75 * length * down, e - 26 * down},
                        14),
            {18, 16.5, 15, 13.5, 12.5, 12, 11.5, 11, 11, 11, 11, 11.5, 12, 12.5});
  const Shape tubercle = round_cone(g + 17 * out - 2 * down, 10, g + 15 * out + 22 * down, 11);
  const Vec& axis = at.elbow_axis;
  const Shape trochlea = cylinder(e - 24 * axis, e + 22 * axis, kElbowRadius, 3);
  const Shape inner = round_cone(e - 27 * axis - 10 * down, 8, e - 6 * axis - 30 * down, 10);
  const Shape outer = round_cone(e + 22 * axis - 12 * down, 7, e + 6 * axis - 30 * down, 10);
  const Shape body = unite({unite({shaft, tubercle}, 8), unite({inner, outer, trochlea}, 4)}, 6);
  return unite({body, sphere(g, kHumeralHead)}, 1.5);
}

Shape ulna_bone(const Landmarks& at) {
  const Vec& e = at.elbow;
  const Vec down = (at.wrist - e).normalized();
  const Vec& axis = at.elbow_axis;
  const Vec back = axis.cross(down).y() > 0 ? Vec(axis.cross(down)) : Vec(-axis.cross(down));
  const Vec ulnar = at.hand.col(1);
  const Vec m = e - 9 * axis;
  const Shape olecranon =
      tube({m + 20 * back - 12 * down, m + 20 * back + 8 * down, m + 10 * back + 30 * down}, 9, 12, 8);
  const Shape coronoid = round_cone(m + 8 * back + 26 * down, 11, m - 10 * back + 22 * down, 7);
  const double length = (at.wrist - e).norm();
  const Shape shaft = tube({m + 10 * back + 30 * down, e - 10 * axis + 6 * back + 0.45 * length * down,
                            at.wrist + 15 * ulnar - 40 * down, at.wrist + 14 * ulnar - 13 * down},
                           10, 7.5, 14);
  const Shape ulna = unite({olecranon, coronoid, shaft}, 6);
  return subtract(ulna, cylinder(e - 45 * axis, e + 45 * axis, kElbowRadius + kGap, 0));
}

Shape radius_bone(const Landmarks& at) {
  const Vec& e = at.elbow;
  const Vec down = (at.wrist - e).normalized();
  const Vec& axis = at.elbow_axis;
  const Vec ulnar = at.hand.col(1);
  const double length = (at.wrist - e).norm();
  const Vec head = e + 13 * axis + 23 * down;
  const Shape shaft = tube({head + 6 * down, e + 10 * axis - 4 * ulnar + 0.5 * length * down,
                            at.wrist - 13 * ulnar - 45 * down, at.wrist - 8 * ulnar - 18 * down},
                           7, 10, 14);
  const Shape end = round_cone(at.wrist - 14 * ulnar - 17 * down, 11, at.wrist - 3 * ulnar - 15 * down, 10);
  const Shape disc = cylinder(head - 8 * down, head + 6 * down, 10.5, 2);
  const Shape radius = unite({shaft, end, disc}, 5);
  const Shape clear =
      unite({cylinder(e - 45 * axis, e + 45 * axis, kElbowRadius + kGap, 0), grow(ulna_bone(at), 3)});
  return subtract(radius, clear);
}

std::vector<Vec> digit_path(int digit) {
  if (digit == 0) return {{-4, -16, -20}, {-16, -36, -46}, {-22, -45, -76}, {-24, -50, -102}};
  const auto i = static_cast<std::size_t>(digit - 1);
  const std::array<double, 4> across{-25, -8.5, 8, 24}, palm{80, 83, 79, 72}, finger{82, 90, 84, 66};
  std::vector<Vec> path{{0, 0.55 * across[i], -18}, {2, across[i], -palm[i]}};
  for (int phalanx = 1; phalanx <= 3; ++phalanx) {
    const double s = phalanx == 1 ? 0.48 : phalanx == 2 ? 0.78 : 1.0;
    path.emplace_back(2 - 17 * s * s, across[i] * (1 + 0.62 * s), -palm[i] - finger[i] * s);
  }
  return path;
}

Shape hand_bone(const Landmarks& at) {
  const auto in_hand = [&](const Vec& p) -> Vec { return at.wrist + at.hand * p; };
  std::vector<Shape> parts{ellipsoid(in_hand({0, 1, -17}), {10, 25, 14}, at.hand)};
  for (int digit = 0; digit < 5; ++digit) {
    std::vector<Vec> points;
    std::vector<double> radii;
    const std::vector<Vec> path = digit_path(digit);
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (i > 0) {  // a waist between two joints
        points.push_back(in_hand((path[i - 1] + path[i]) / 2));
        radii.push_back(i + 1 == path.size() ? 4.2 : 4.6);
      }
      points.push_back(in_hand(path[i]));
      radii.push_back(i + 1 == path.size() ? 4.0 : i == 1 ? 6.2 : 5.6);
    }
    parts.push_back(chain(points, radii));
  }
  return unite(parts, 4);
}

Shape femur_bone(const Landmarks& at) {
  const Vec& h = at.hip;
  const Vec& k = at.knee;
  const Vec up = (h - k).normalized();
  const Vec& axis = at.knee_axis;
  const Shape neck = round_cone(h + Vec(8, 1, -5), 16, h + Vec(50, 6, -34), 17);
  const Shape trochanter = round_cone(h + Vec(60, 12, -12), 14, h + Vec(60, 8, -46), 17);
  const Shape lesser = round_cone(h + Vec(44, 16, -66), 11, h + Vec(38, 22, -70), 8);
  const Vec top = h + Vec(56, 6, -48);
  const Shape shaft = chain(smooth_path({top, top + 0.33 * (k - top) + Vec(0, -7, 0),
                                         top + 0.66 * (k - top) + Vec(0, -8, 0), k + 34 * up},
                                        14),
                            {19, 18, 17, 16, 15.5, 15, 15, 15, 15, 15.5, 16, 17, 18.5, 20});
  Shape condyles = cylinder(k - 37 * axis, k + 37 * axis, kKneeRadius, 6);
  condyles = subtract(condyles, round_box(k + Vec(0, 16, -12), {8, 18, 20}, 6), 3);
  const Shape flare = chain({k - 27 * axis + 8 * up, k + 36 * up, k + 27 * axis + 8 * up}, {14, 16, 14});
  const Shape body = unite({unite({neck, trochanter, lesser, shaft, flare}, 14), condyles}, 5);
  return unite({body, sphere(h, kFemoralHead)}, 2);
}

Shape tibia_bone(const Landmarks& at) {
  const Vec& k = at.knee;
  const Vec& a = at.ankle;
  const Shape plateau = round_box(k + Vec(0, 3, -36), {37, 25, 17}, 9);
  const Shape shaft =
      chain(smooth_path({k + Vec(0, 2, -54), k + 0.3 * (a - k) + Vec(-3, -6, 0),
                         k + 0.65 * (a - k) + Vec(-3, -3, 0), a + Vec(-2, 0, 44), a + Vec(-1, 0, 26)},
                        14),
            {23, 21, 18.5, 16.5, 15, 14, 13.5, 13, 12.5, 12.5, 13, 14, 16, 18});
  const Shape tuberosity = sphere(k + Vec(2, -19, -62), 11);
  const Shape malleolus = round_cone(a + at.foot * Vec(-21, 0, 22), 10, a + at.foot * Vec(-28, 0, -8), 7.5);
  const Shape tibia = unite({plateau, shaft, tuberosity, malleolus}, 14);
  const Shape knee = cylinder(k - 60 * at.knee_axis, k + 60 * at.knee_axis, kKneeRadius + kGap, 0);
  const Shape ankle = cylinder(a - 20.5 * at.ankle_axis, a + 20.5 * at.ankle_axis, kAnkleRadius + kGap, 2);
  return subtract(tibia, unite({knee, ankle}));
}

Shape fibula_bone(const Landmarks& at) {
  const Vec& k = at.knee;
  const Vec& a = at.ankle;
  const Shape shaft = chain(smooth_path({k + Vec(42, 18, -54), 0.5 * (k + a) + Vec(34, 14, 0),
                                         a + Vec(29, 9, 24), a + Vec(31, 8, -16)},
                                        14),
                            {10, 8.5, 7, 6.5, 6.5, 6.5, 6.5, 6.5, 6.5, 6.5, 7, 8, 9, 8});
  return subtract(
      shaft, unite({grow(tibia_bone(at), 3),
                    cylinder(a - 20.5 * at.ankle_axis, a + 20.5 * at.ankle_axis, kAnkleRadius + kGap, 2)}));
}

Shape patella_bone(const Landmarks& at) {
  const Vec& k = at.knee;
  const Shape body = ellipsoid(k + Vec(0, -(kKneeRadius + kGap + 8), 10), {20, 12, 23});
  return subtract(body, cylinder(k - 60 * at.knee_axis, k + 60 * at.knee_axis, kKneeRadius + kGap, 0), 2);
}

Shape foot_bone(const Landmarks& at) {
  const auto p = [&](double left, double back, double up) -> Vec {
    return at.ankle + at.foot * Vec(left, back, up);
  };
  const Shape trochlea = cylinder(p(-15, 0, 0), p(15, 0, 0), kAnkleRadius, 4);
  const Shape talus = chain({p(0, 4, -14), p(-3, -32, -26)}, {14, 13});
  const Shape calcaneus = chain({p(6, -26, -44), p(3, 10, -42), p(3, 36, -56)}, {11, 15, 18});
  const Shape midfoot = unite({chain({p(-3, -32, -26), p(-6, -64, -38)}, {13, 13}),
                               chain({p(8, -20, -46), p(15, -58, -52)}, {12, 12})},
                              6);
  std::vector<Shape> rays{unite({trochlea, unite({talus, calcaneus, midfoot}, 8)}, 3)};
  const std::array<Vec, 5> base{Vec(-16, -66, -42), Vec(-6, -68, -41), Vec(3, -68, -45), Vec(12, -66, -51),
                                Vec(20, -62, -57)};
  const std::array<Vec, 5> head{Vec(-26, -133, -70), Vec(-9, -136, -71), Vec(5, -132, -72),
                                Vec(18, -125, -73), Vec(31, -115, -74)};
  for (std::size_t i = 0; i < 5; ++i) {
    const double r = i == 0 ? 9 : 7;
    rays.push_back(chain({at.ankle + at.foot * base[i], at.ankle + at.foot * ((base[i] + head[i]) / 2),
                          at.ankle + at.foot * head[i]},
                         {r, r - 1.5, r}));
  }
  return unite(rays, 4);
}

Shape toe_bone(const Landmarks& at) {
  const std::array<Vec, 5> root{Vec(-26, -155, -72), Vec(-9, -156, -73), Vec(5, -152, -73),
                                Vec(19, -145, -74), Vec(32, -135, -75)};
  const std::array<double, 5> length{42, 42, 37, 31, 25};
  std::vector<Vec> row;
  std::vector<Shape> toes;
  for (std::size_t i = 0; i < 5; ++i) {
    const double r = i == 0 ? 7.5 : 5.5;
    const Vec tip = root[i] + Vec(i == 0 ? 3 : 0, -length[i], -2);
    const auto place = [&](const Vec& v) -> Vec { return at.ankle + at.foot * v; };
    row.push_back(place(root[i]));
    toes.push_back(chain({place(root[i]), place((root[i] + tip) / 2), place(tip)}, {r, r - 0.8, r - 0.5}));
  }
  toes.push_back(chain(row, {6, 5.5, 5.5, 5.5, 5.5}));
  return unite(toes, 2.5);
}

}  // namespace ecorche::phantom
