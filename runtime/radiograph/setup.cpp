// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cmath>

#include <ecorche/runtime/radiograph.hpp>
#include <ecorche/values/error.hpp>

namespace ecorche::runtime {
namespace {

constexpr std::int32_t kMostPixels = 8192;

[[noreturn]] void refuse(const char* where, std::string what, std::string mend) {
  throw Error(ErrorKind::usage, where, std::move(what), std::move(mend));
}

}  // namespace

Eigen::Vector3d Detector::point(double column, double row) const {
  const auto [width, height] = pixel_mm();
  return centre + right * ((column + 0.5) * width - size_mm[0] / 2) +
         down * ((row + 0.5) * height - size_mm[1] / 2);
}

double XRaySetup::source_to_detector() const {
  return std::abs(detector.right.cross(detector.down).dot(detector.centre - source));
}

XRaySetup XRaySetup::moved(const RigidTransform& motion) const {
  XRaySetup out = *this;
  out.source = motion * source;
  out.detector.centre = motion * detector.centre;
  out.detector.right = motion.q * detector.right;
  out.detector.down = motion.q * detector.down;
  return out;
}

void check(const XRaySetup& setup) {
  const Detector& detector = setup.detector;
  if (!setup.source.allFinite()) refuse("source", "its place is no number", "give x, y, z in mm");
  if (!detector.centre.allFinite() || !detector.right.allFinite() || !detector.down.allFinite())
    refuse("detector", "its place is no number", "give x, y, z in mm");
  for (const std::int32_t count : detector.pixels) {
    if (count < 1 || count > kMostPixels)
      refuse("detector", std::to_string(count) + " pixels along a side",
             "from 1 to " + std::to_string(kMostPixels));
  }
  for (const double size : detector.size_mm) {
    if (!(size > 0 && size <= 1e5)) refuse("detector", "a side of no length", "more than 0, at most 1e5 mm");
  }
  constexpr double rounding = 1e-6;
  if (std::abs(detector.right.norm() - 1) > rounding || std::abs(detector.down.norm() - 1) > rounding ||
      std::abs(detector.right.dot(detector.down)) > rounding)
    refuse("detector", "its rows and columns are not at right angles",
           "give two directions at right angles to each other");
  if (setup.source_to_detector() < 1)
    refuse("source", "it lies in the detector's plane", "move it at least 1 mm away from there");
}

}  // namespace ecorche::runtime
