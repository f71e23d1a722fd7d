// SPDX-License-Identifier: Apache-2.0
// The arterial and the venous tree.
#include "phantom/body.hpp"

namespace ecorche::phantom {

namespace {

Part vessel(std::string name, Shape shape, int small_vertices) {
  Part part;
  part.name = std::move(name);
  part.group = Group::vessel;
  part.shape = std::move(shape);
  part.detail = 4;
  part.hounsfield = 160;  // with contrast medium
  part.small_vertices = small_vertices;
  return part;
}

}  // namespace

std::vector<Part> make_vessels(const Landmarks& at) {
  const Vec &h = at.hip, &k = at.knee, &g = at.shoulder, &e = at.elbow;
  const Vec forearm = (at.wrist - e).normalized();
  const Vec front = forearm.cross(at.elbow_axis).y() < 0 ? Vec(forearm.cross(at.elbow_axis))
                                                         : Vec(at.elbow_axis.cross(forearm));

  const Shape trunk = tube({{2, -30, 1322},
                            {-4, -24, 1352},
                            {6, -8, 1374},
                            {16, 18, 1360},
                            {17, 29, 1320},
                            {14, 20, 1240},
                            {10, 8, 1172},
                            {8, -4, 1095},
                            {8, -4, 1062}},
                           12, 9, 40);
  const Shape leg =
      tube({Vec(8, -4, 1064), Vec(28, -10, 1016), Vec(49, -26, 964), h + Vec(-20, -47, 22),
            h + Vec(-5, -50, -24), h + Vec(0, -44, -60), h + Vec(4, -32, -110), h + Vec(18, 2, -215),
            k + Vec(-14, 38, 60), k + Vec(-4, 52, 0), k + Vec(0, 46, -60), k + Vec(2, 36, -130)},
           7.5, 4.5, 60);
  const Shape carotid = tube({{7, -6, 1372}, {20, -14, 1420}, {27, -2, 1470}, {29, -4, 1535}}, 5.5, 4.5, 20);
  const Shape arm =
      tube({Vec(10, 4, 1370), Vec(34, 2, 1420), Vec(64, 2, 1437), Vec(96, 4, 1432), Vec(122, 0, 1404),
            g + Vec(-30, -2, -36), g + Vec(-6, -2, -92), g + 0.62 * (e - g) + Vec(-22, -4, 0),
            e + 32 * front - 14 * forearm, e + 30 * front + 22 * forearm, e + 22 * front + 56 * forearm},
           6, 4, 50);
  const Shape side = unite({leg, carotid, arm}, 4);

  const Shape cava = tube({{-20, 2, 1040},
                           {-20, -4, 1095},
                           {-20, 6, 1172},
                           {-18, 0, 1236},
                           {-24, -22, 1290},
                           {-26, -22, 1345},
                           {-24, -22, 1388}},
                          10, 9, 36);
  const Shape right = tube({{-24, -22, 1386}, {-30, -8, 1425}, {-39, 2, 1470}, {-40, 2, 1535}}, 7, 5, 16);
  const Shape left =
      tube({{-22, -26, 1390}, {8, -36, 1398}, {32, -16, 1425}, {39, 2, 1470}, {40, 2, 1535}}, 6.5, 5, 20);
  const Shape iliac_left =
      tube({Vec(-20, 2, 1042), Vec(-6, 12, 1018), Vec(24, 12, 994), Vec(42, -4, 962), Vec(50, -16, 944)}, 8,
           6.5, 20);
  const Shape iliac_right =
      tube({Vec(-20, 2, 1042), Vec(-27, 10, 1010), Vec(-40, 2, 974), Vec(-49, -14, 946)}, 8, 6.5, 16);
  return {vessel("aorta", unite({trunk, side, mirrored(side)}, 4), 380),
          vessel("vena_cava", unite({cava, right, left, iliac_left, iliac_right}, 4), 170)};
}

}  // namespace ecorche::phantom
