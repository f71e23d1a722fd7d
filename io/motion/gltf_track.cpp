// SPDX-License-Identifier: Apache-2.0
#include "io/motion/gltf_track.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <ecorche/values/error.hpp>
#include "io/surface/gltf_accessor.hpp"

namespace ecorche::io {
namespace {

using Eigen::Quaterniond;
using Row = std::array<double, 4>;

[[noreturn]] void refuse_track(const std::string& where, const std::string& what) {
  throw Error(ErrorKind::data, where, what, "export the motion again");
}

Quaterniond quaternion(const Row& v) {
  return Quaterniond(v[3], v[0], v[1], v[2]).normalized();
}

Row row(const Quaterniond& q) {
  return {q.x(), q.y(), q.z(), q.w()};
}

}  // namespace

std::array<double, 4> GltfTrack::at(double seconds) const {
  const bool turn = width == 4;
  const auto value = [&](std::size_t key, std::size_t part) {
    Row out{0, 0, 0, 0};
    const bool spline = interpolation == Interpolation::cubic;
    const std::size_t begin = (spline ? 3 * key + part : key) * width;
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(begin), width, out.begin());
    return out;
  };
  const auto unit = [&](const Row& v) { return turn ? row(quaternion(v)) : v; };
  const auto after = std::upper_bound(time.begin(), time.end(), seconds);
  if (after == time.begin()) return unit(value(0, 1));
  const auto k = static_cast<std::size_t>(after - time.begin()) - 1;
  if (after == time.end() || interpolation == Interpolation::step) return unit(value(k, 1));
  const double span = time[k + 1] - time[k], t = (seconds - time[k]) / span;
  const Row a = value(k, 1), b = value(k + 1, 1);
  if (interpolation == Interpolation::linear && turn) return row(quaternion(a).slerp(t, quaternion(b)));
  Row out{0, 0, 0, 0};
  for (std::size_t i = 0; i < width; ++i) {
    out[i] = a[i] + t * (b[i] - a[i]);
    if (interpolation != Interpolation::cubic) continue;
    // glTF 2.0, appendix C: the Hermite spline of values and tangents.
    const double t2 = t * t, t3 = t2 * t;
    out[i] = (2 * t3 - 3 * t2 + 1) * a[i] + span * (t3 - 2 * t2 + t) * value(k, 2)[i] +
             (-2 * t3 + 3 * t2) * b[i] + span * (t3 - t2) * value(k + 1, 0)[i];
  }
  if (turn && quaternion(out).coeffs().allFinite()) return unit(out);
  return turn ? unit(a) : out;
}

GltfTrack read_track(const tinygltf::Model& model, const tinygltf::AnimationSampler& sampler,
                     std::size_t width, files::Budget& budget) {
  const std::string& where = budget.where();
  GltfTrack track;
  track.width = width;
  if (sampler.interpolation == "STEP") {
    track.interpolation = Interpolation::step;
  } else if (sampler.interpolation == "CUBICSPLINE") {
    track.interpolation = Interpolation::cubic;
  } else if (sampler.interpolation != "LINEAR" && !sampler.interpolation.empty()) {
    refuse_track(where, "an animation is interpolated by '" + sampler.interpolation.substr(0, 40) + "'");
  }
  track.time = gltf::reals(model, sampler.input, 1, budget);
  track.values = gltf::reals(model, sampler.output, static_cast<int>(width), budget);
  const std::size_t parts = track.interpolation == Interpolation::cubic ? 3 : 1;
  if (track.time.empty() || track.values.size() != parts * width * track.time.size())
    refuse_track(where, "an animation has " + std::to_string(track.time.size()) + " times and " +
                            std::to_string(track.values.size() / (parts * width)) + " values");
  for (std::size_t i = 0; i < track.time.size(); ++i) {
    if (!(track.time[i] >= 0 && track.time[i] < 1e6) || (i > 0 && !(track.time[i] > track.time[i - 1])))
      refuse_track(where, "the times of an animation are not ascending");
  }
  for (const double value : track.values) {
    if (!(std::abs(value) <= 1e9))
      refuse_track(where, "an animation holds a value that is not finite or far too large");
  }
  for (std::size_t i = parts == 3 ? 1 : 0; width == 4 && i < parts * track.time.size(); i += parts) {
    double square = 0;
    for (std::size_t c = 0; c < 4; ++c) square += track.values[4 * i + c] * track.values[4 * i + c];
    if (!(std::abs(square - 1) < 0.1))
      refuse_track(where, "a rotation of an animation is no unit quaternion");
  }
  return track;
}

}  // namespace ecorche::io
