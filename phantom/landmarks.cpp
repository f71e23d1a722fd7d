// SPDX-License-Identifier: Apache-2.0
// Where the joints are: an adult of 1.74 m, standing, arms hanging a little away from the trunk.
#include <cmath>

#include "phantom/body.hpp"

namespace ecorche::phantom {

namespace {
constexpr double kRadians = 3.14159265358979323846 / 180;
}

Landmarks make_landmarks(const Proportions& of) {
  const double leg = of.leg, arm = of.arm;
  Landmarks at;
  at.fat = of.fat;

  at.root = {0, 8, 905};
  at.lumbar = {0, 42, 1016};
  at.thorax = {0, 46, 1172};
  at.neck = {0, 50, 1452};
  at.head = {0, 16, 1566};

  at.hip = {88, 8, 905};
  at.knee = at.hip + leg * Vec(36, 0, -410);
  at.ankle = at.knee + leg * Vec(20, 20, -409);
  at.knee_axis = Vec(1, 0, 0.07).normalized();
  const double toe_out = 8 * kRadians;
  at.foot = Eigen::AngleAxisd(toe_out, Vec::UnitZ()).toRotationMatrix();
  at.ankle_axis = at.foot.col(0);
  at.ball = at.ankle + at.foot * Vec(0, -143, -71);

  at.sternoclavicular = {25, -58, 1410};
  at.shoulder = {176, 6, 1398};
  const Vec upper_arm(std::sin(14 * kRadians), 0, -std::cos(14 * kRadians));
  at.elbow = at.shoulder + arm * 300 * upper_arm;
  // The elbow is bent forwards and a little inwards, as a hanging arm is.
  const Vec forwards = Vec(-0.5, -0.86, 0);
  at.elbow_axis = forwards.cross(upper_arm).normalized();
  if (at.elbow_axis.x() < 0) at.elbow_axis = -at.elbow_axis;
  at.elbow_flexion = 17 * kRadians;
  const Vec forearm = Eigen::AngleAxisd(-at.elbow_flexion, at.elbow_axis) * upper_arm;
  at.wrist = at.elbow + arm * 255 * forearm;
  // The palm faces the thigh.
  const Vec back_of_hand = Vec(1, -0.25, 0) - Vec(1, -0.25, 0).dot(forearm) * forearm;
  at.hand.col(0) = back_of_hand.normalized();
  at.hand.col(2) = -forearm;
  at.hand.col(1) = at.hand.col(2).cross(at.hand.col(0));
  return at;
}

}  // namespace ecorche::phantom
