// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "phantom/bones.hpp"

namespace ecorche::phantom {

namespace {

/// A stretch of spine: bodies and discs, arches, spinous and transverse processes. Its ends are round, their
/// tips at `z0` and `z1`, so that neighbours can roll on each other.
Shape spine(double z0, double z1, double r0, double r1, int vertebrae, double spinous, double transverse) {
  std::vector<Shape> parts;
  std::vector<Vec> bodies, arch;
  std::vector<double> radii, arch_radii;
  for (int i = 0; i <= 2 * vertebrae; ++i) {
    const double t = static_cast<double>(i) / (2 * vertebrae);
    const double r = r0 + (r1 - r0) * t;
    bodies.push_back(spine_at(z0 + r0 + (z1 - r1 - z0 - r0) * t));
    radii.push_back(i % 2 == 0 ? r : 0.88 * r);  // waisted bodies between wider end plates
  }
  parts.push_back(chain(bodies, radii));
  for (int i = 0; i < vertebrae; ++i) {
    const double t = (i + 0.5) / vertebrae, r = r0 + (r1 - r0) * t;
    const Vec c = spine_at(z0 + r0 + (z1 - r1 - z0 - r0) * t);
    const Vec back = c + Vec(0, r + 5, -2);
    arch.push_back(back);
    arch_radii.push_back(0.45 * r);
    parts.push_back(round_cone(back, 0.4 * r, back + Vec(0, spinous, -0.6 * spinous), 0.28 * r));
    for (const double side : {-1.0, 1.0}) {
      parts.push_back(
          round_cone(c + Vec(0, 0.8 * r, 0), 0.42 * r, c + Vec(side * transverse, 0.9 * r, 2), 0.3 * r));
    }
  }
  parts.push_back(chain(arch, arch_radii));
  return unite(parts, 3);
}

/// The point at depth 3 mm under the thorax's envelope, at height `z`, `angle` round from the spine to the
/// left and front.
Vec on_thorax(const Shape& envelope, double angle, double z) {
  const Vec axis(0, 0, z), way(std::sin(angle), std::cos(angle), 0);
  double inner = 0, outer = 250;
  for (int i = 0; i < 40; ++i) {
    const double t = (inner + outer) / 2;
    (envelope.distance(axis + t * way) < -3 ? inner : outer) = t;
  }
  return axis + inner * way;
}

/// Rib 1 to 10, left: along the envelope from the spine, falling, then rising again as cartilage to the
/// sternum.
Vec rib_point(const Shape& envelope, int rib, double s) {
  const double z_spine = 1434 - 25.0 * (rib - 1), z_front = 1388 - 19.0 * (rib - 1);
  const double z = z_spine + (z_front - z_spine) * s -
                   (4 + 8.0 * rib) * std::pow(std::sin(std::numbers::pi * std::min(s, 1.0)), 1.3);
  return on_thorax(envelope, (0.10 + 0.88 * s) * std::numbers::pi, z);
}

Shape rib(const Shape& envelope, int number) {
  // The seventh and those above reach the sternum; the next three end on the seventh's cartilage.
  const std::array<double, 11> ends{0, 1, 1, 1, 1, 1, 1, 1, 0.80, 0.72, 0.64};
  const double end = ends[static_cast<std::size_t>(number)];
  std::vector<Vec> points{spine_at(1434 - 25.0 * (number - 1)) + Vec(10, 12, 0)};
  constexpr int steps = 22;
  for (int i = 0; i <= steps; ++i) points.push_back(rib_point(envelope, number, end * i / steps));
  if (number > 7) points.push_back(rib_point(envelope, 7, end + 0.1));
  return chain(points, std::vector<double>(points.size(), 5.5));
}

Shape hip_bone(const Landmarks& at) {
  const Vec& h = at.hip;
  // The wing: a bowl, thick at its crest.
  const Eigen::Matrix3d tilt =
      (Eigen::AngleAxisd(0.32, Vec::UnitZ()) * Eigen::AngleAxisd(0.42, Vec::UnitY())).toRotationMatrix();
  const Vec wing = h + Vec(12, 24, 82);
  Shape ilium = ellipsoid(wing, {17, 74, 70}, tilt);
  ilium = subtract(ilium, ellipsoid(wing + tilt * Vec(-24, -6, 8), {27, 76, 76}, tilt), 4);
  std::vector<Vec> crest;
  for (int i = 0; i <= 12; ++i) {
    const double a = (25 + 130.0 * i / 12) / 180 * std::numbers::pi;
    crest.push_back(wing + tilt * Vec(5, -72 * std::cos(a), 67 * std::sin(a)));
  }
  const Shape crest_tube = chain(crest, std::vector<double>(crest.size(), 7.5));
  const Shape body = unite({round_cone(h + Vec(-2, 10, 30), 21, h + Vec(6, 20, 60), 12),
                            round_cone(h + Vec(-14, 6, 14), 35, h + Vec(-7, 3, 6), 37)},
                           10);
  const Shape ischium = tube({h + Vec(-6, 20, -14), h + Vec(-14, 30, -50), h + Vec(-22, 24, -78)}, 17, 15, 8);
  const Shape upper_ramus =
      tube({h + Vec(-18, -18, 0), h + Vec(-46, -44, -8), Vec(9, h.y() - 56, h.z() - 22)}, 14, 11, 10);
  const Shape symphysis = round_cone({5, h.y() - 56, h.z() - 20}, 11, {5, h.y() - 50, h.z() - 44}, 9);
  const Shape lower_ramus =
      tube({Vec(8, h.y() - 50, h.z() - 44), h + Vec(-56, -14, -72), h + Vec(-26, 18, -82)}, 9, 11, 10);
  const Shape joint = round_cone(h + Vec(-12, 62, 84), 16, h + Vec(-56, 54, 72), 19);  // to the sacrum
  return unite({ilium, crest_tube, body, ischium, upper_ramus, symphysis, lower_ramus, joint}, 9);
}

}  // namespace

Vec spine_at(double z) {
  // Sacrum, lumbar lordosis, thoracic kyphosis, cervical lordosis.
  static const std::vector<Vec> curve = smooth_path({{0, 80, 900},
                                                     {0, 68, 960},
                                                     {0, 42, 1016},
                                                     {0, 34, 1090},
                                                     {0, 46, 1172},
                                                     {0, 60, 1270},
                                                     {0, 63, 1340},
                                                     {0, 50, 1452},
                                                     {0, 30, 1510},
                                                     {0, 16, 1566},
                                                     {0, 12, 1600}},
                                                    401);
  const auto above = std::lower_bound(curve.begin(), curve.end(), z,
                                      [](const Vec& p, double height) { return p.z() < height; });
  if (above == curve.begin()) return {0, curve.front().y(), z};
  if (above == curve.end()) return {0, curve.back().y(), z};
  const Vec &a = *(above - 1), &b = *above;
  return {0, a.y() + (b.y() - a.y()) * (z - a.z()) / (b.z() - a.z()), z};
}

Shape thorax_envelope() {
  return unite({ellipsoid({0, 2, 1278}, {134, 94, 158}), ellipsoid({0, 8, 1385}, {92, 68, 82})}, 40);
}

Shape pelvis_bone(const Landmarks& at) {
  const Shape hip = hip_bone(at);
  const Shape sacrum =
      unite({round_cone({16, 62, 984}, 21, {6, 90, 905}, 9), round_cone({-16, 62, 984}, 21, {-6, 90, 905}, 9),
             round_cone({0, 58, 990}, 22, {0, 92, 880}, 7)},
            6);
  Shape pelvis = unite({hip, mirrored(hip), sacrum}, 6);
  // The sockets: spherical, opening outwards, forwards and down.
  Shape socket = sphere(at.hip, kFemoralHead + kBallGap);
  const Vec opening = Vec(0.82, -0.30, -0.48).normalized();
  socket = unite({socket, cylinder(at.hip + 4 * opening, at.hip + 80 * opening, 48, 2)});
  return subtract(subtract(pelvis, socket, 4), mirrored(socket), 4);
}

Shape lumbar_spine(const Landmarks& at) {
  return spine(at.lumbar.z() + kGap / 2, at.thorax.z() - kGap / 2, 22, 19.5, 5, 18, 34);
}

Shape rib_cage(const Landmarks& at) {
  const Shape envelope = thorax_envelope();
  std::vector<Shape> ribs;
  for (int i = 1; i <= 10; ++i) ribs.push_back(rib(envelope, i));
  const Shape left = unite(ribs, 4);
  std::vector<Vec> breast;
  std::vector<double> radii;
  for (int i = 0; i <= 10; ++i) {
    const double z = 1392 - 14.0 * i;
    breast.push_back(on_thorax(envelope, std::numbers::pi, z));
    radii.push_back(i == 10 ? 5 : 9);
  }
  std::vector<Vec> beside = breast;
  for (Vec& p : beside) p.x() = 9;
  const Shape half_sternum = chain(beside, radii);
  const Shape manubrium = round_box(breast[0] + Vec(0, 0, -4), {24, 8, 15}, 7);
  const Shape sternum = unite({chain(breast, radii), half_sternum, mirrored(half_sternum), manubrium}, 5);
  const Shape column = spine(at.thorax.z() + kGap / 2, at.neck.z() - kGap / 2, 19, 14, 12, 13, 24);
  return unite({column, left, mirrored(left), sternum}, 3);
}

Shape cervical_spine(const Landmarks& at) {
  return spine(at.neck.z() + kGap / 2, at.head.z() - kGap / 2, 13.5, 12.5, 7, 14, 21);
}

Shape skull_cavity() {
  return unite({ellipsoid({0, 6, 1662}, {65, 80, 66}), ellipsoid({0, 34, 1618}, {44, 38, 28})}, 20);
}

Shape skull_bone(const Landmarks&) {
  const Shape cranium =
      unite({ellipsoid({0, 6, 1660}, {73, 88, 75}), ellipsoid({0, 34, 1616}, {52, 46, 36})}, 24);
  const Shape brow =
      chain({{-44, -64, 1650}, {-20, -77, 1655}, {20, -77, 1655}, {44, -64, 1650}}, {11, 12, 12, 11});
  const Shape face =
      unite({round_box({0, -48, 1608}, {36, 30, 40}, 20), round_box({0, -66, 1580}, {25, 15, 16}, 10)}, 16);
  const Shape cheek = tube({{34, -66, 1608}, {58, -46, 1606}, {68, -14, 1612}}, 11, 7, 10);
  const Shape nasal = round_cone({0, -80, 1646}, 7, {0, -94, 1622}, 4.5);
  const Shape base = round_cone({0, -20, 1590}, 22, {0, 14, 1586}, 14);
  Shape skull = unite({cranium, brow, face, cheek, mirrored(cheek), nasal, base}, 10);
  const Shape orbit = ellipsoid({32, -84, 1630}, {18, 17, 14});
  const Shape aperture = ellipsoid({0, -92, 1602}, {10, 16, 13});
  const Shape magnum = cylinder({0, 24, 1570}, {0, 30, 1625}, 16, 2);  // joins the cavity to the outside
  skull = subtract(skull, unite({orbit, mirrored(orbit), aperture}), 4);
  return subtract(skull, unite({skull_cavity(), magnum}, 4));
}

Shape mandible_bone(const Landmarks&) {
  const Shape half =
      tube({{0, -82, 1546}, {26, -70, 1547}, {44, -36, 1551}, {52, -10, 1566}, {55, -4, 1596}}, 10, 7.5, 18);
  return unite({half, mirrored(half), round_cone({0, -84, 1542}, 11, {0, -82, 1556}, 9)}, 6);
}

}  // namespace ecorche::phantom
