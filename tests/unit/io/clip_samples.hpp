// SPDX-License-Identifier: Apache-2.0
// Small motion files of every format but BVH, and what their tests turn them with.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "io/motion/text_stream.hpp"
#include "tests/unit/io/base64.hpp"

namespace ecorche::io {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

inline constexpr double kDegree = std::numbers::pi / 180;

inline TextStream stream(const std::string& text, const std::string& name) {
  return {std::make_unique<std::istringstream>(text), name};
}

inline Matrix3d about(int axis, double degrees) {
  return AngleAxisd(degrees * kDegree, Vector3d::Unit(axis)).toRotationMatrix();
}

inline Matrix3d lsa_to_lps() {
  Matrix3d m;
  m << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return m;
}

inline const std::string kAsf = R"(# a leg
:version 1.10
:name VICON
:units
  mass 1.0
  length 0.45
  angle deg
:documentation
  anything at all
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name thigh
    direction 0.34202 -0.939693 0
    length 7.5
    axis 10 20 30 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
    id 2
    name shank
    direction 0 -2 0
    length 7
    axis 0 0 20 XYZ
    dof rx
    limits (-10.0 170.0)
  end
:hierarchy
  begin
    root thigh
    thigh shank
  end
)";
inline const std::string kAmc =
    "#!OML:ASF x\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 10 20 30\nthigh 40 50 60\nshank 70\n"
    "2\nroot 1 2 3 0 0 0\nshank 0\nthigh 0 0 0\n";

// A still node, a hip below it that moves and turns, a knee that turns; both with axes of their own at rest.
// Keys at 0, 0.5, 1 s: the knee by a quarter turn about its own x from key to key.
inline std::string gltf(const std::string& interpolation = "LINEAR") {
  const auto h = static_cast<float>(std::numbers::sqrt2 / 2);
  const std::vector<float> buffer{0, 0.5F, 1,                              // times
                                  0, 1,    0, 0, 1, 1, 0, 1, 2,            // ways of the hip
                                  0, 0,    h, h, h, 0, 0, h, 0, 0, 0, 1};  // turns of the knee
  const auto view = [](int begin, int size) {
    return "{\"buffer\":0,\"byteOffset\":" + std::to_string(4 * begin) +
           ",\"byteLength\":" + std::to_string(4 * size) + "}";
  };
  const auto accessor = [](int number, const char* type, int count) {
    return "{\"bufferView\":" + std::to_string(number) +
           ",\"componentType\":5126,\"count\":" + std::to_string(count) + ",\"type\":\"" + type + "\"}";
  };
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[
    {"name":"scene","translation":[5,0,0],"children":[1]},
    {"name":"hip","translation":[0,1,0],"rotation":[0,0.7071067811865476,0,0.7071067811865476],"children":[2]},
    {"name":"knee","translation":[0,-0.4,0.1],"rotation":[0,0,0.7071067811865476,0.7071067811865476]}],
    "animations":[{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}},
    {"sampler":1,"target":{"node":2,"path":"rotation"}}],
    "samplers":[{"input":0,"output":1},{"input":0,"output":2,"interpolation":")" +
         interpolation + R"("}]}],"accessors":[)" + accessor(0, "SCALAR", 3) + "," + accessor(1, "VEC3", 3) +
         "," + accessor(2, "VEC4", 3) + R"(],"bufferViews":[)" + view(0, 3) + "," + view(3, 9) + "," +
         view(12, 12) + R"(],"buffers":[{"byteLength":96,"uri":"data:application/octet-stream;base64,)" +
         base64(buffer) + "\"}]}";
}

inline const std::string kMot =
    "walk\nversion=1\nnRows=3\nnColumns=3\ninDegrees=yes\nendheader\ntime knee_angle_r pelvis_tx\n"
    "0 10 0.1\n0.01 20 0.2\n0.02\t30\t0.3\n";

inline const std::string kTrc =
    "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\t"
    "OrigDataStartFrame\tOrigNumFrames\n100\t100\t2\t2\tm\t100\t1\t2\nFrame#\tTime\tknee\t\t\tankle\t\t\n"
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n1\t0\t0.1\t0.2\t0.3\t1\t2\t3\n2\t0.01\t\t\t\t4\t5\t6\n";

}  // namespace ecorche::io
