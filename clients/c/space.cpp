// SPDX-License-Identifier: Apache-2.0
#include "clients/c/space.hpp"

#include <Eigen/Geometry>

namespace ecorche::c {
namespace {

// `matrix` by every point.
ecorche_code multiply(const std::array<float, 9>& m, std::size_t count, const float* in,
                      std::size_t in_stride, float* out, std::size_t out_stride) {
  if (count > 0 && (in == nullptr || out == nullptr))
    return fail(ECORCHE_INVALID_ARGUMENT, "in, out: is null");
  constexpr std::size_t point = 3 * sizeof(float);
  if (in_stride == 0) in_stride = point;
  if (out_stride == 0) out_stride = point;
  if (in_stride < point || out_stride < point)
    return fail(ECORCHE_INVALID_ARGUMENT, "stride: is less than three floats (12 bytes, or 0 for that)");
  const auto* from = reinterpret_cast<const char*>(in);
  auto* to = reinterpret_cast<char*>(out);
  // In place: where points move apart the last one goes first, before the one below it is written over it.
  const bool backwards = out_stride > in_stride;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = backwards ? count - 1 - i : i;
    std::array<float, 3> p{}, q{};
    std::memcpy(p.data(), from + at * in_stride, point);
    for (std::size_t r = 0; r < 3; ++r) q[r] = m[3 * r] * p[0] + m[3 * r + 1] * p[1] + m[3 * r + 2] * p[2];
    std::memcpy(to + at * out_stride, q.data(), point);
  }
  return ECORCHE_OK;
}

ecorche_code unknown_space() {
  return fail(ECORCHE_INVALID_ARGUMENT, "space: there is no such space (see ecorche_space)");
}

}  // namespace
}  // namespace ecorche::c

using ecorche::c::Space;

int ecorche_space_matrix(ecorche_space space, double matrix[9]) {
  const Space* const found = ecorche::c::find_space(space);
  if (found == nullptr || matrix == nullptr) return -1;
  for (std::size_t i = 0; i < 9; ++i) matrix[i] = found->scale * found->turn[i];
  return found->mirrors ? 1 : 0;
}

ecorche_code ecorche_space_points(ecorche_space space, size_t count, const float* in, size_t in_stride,
                                  float* out, size_t out_stride) {
  const Space* const found = ecorche::c::find_space(space);
  if (found == nullptr) return ecorche::c::unknown_space();
  return ecorche::c::multiply(found->scaled(), count, in, in_stride, out, out_stride);
}

ecorche_code ecorche_space_points_back(ecorche_space space, size_t count, const float* in, size_t in_stride,
                                       float* out, size_t out_stride) {
  const Space* const found = ecorche::c::find_space(space);
  if (found == nullptr) return ecorche::c::unknown_space();
  std::array<float, 9> back{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c)
      back[3 * r + c] = static_cast<float>(found->turn[3 * c + r] / found->scale);
  }
  return ecorche::c::multiply(back, count, in, in_stride, out, out_stride);
}

ecorche_code ecorche_space_rotation(ecorche_space space, int back, const double in[4], double out[4]) {
  const Space* const found = ecorche::c::find_space(space);
  if (found == nullptr) return ecorche::c::unknown_space();
  if (in == nullptr || out == nullptr) return ecorche::c::fail(ECORCHE_INVALID_ARGUMENT, "in, out: is null");
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Matrix turn = Eigen::Map<const Matrix>(found->turn.data());
  if (back != 0) turn.transposeInPlace();
  // The axis is turned as points are; seen in a mirror, it turns the other way.
  const double sense = found->mirrors ? -1 : 1;
  const Eigen::Vector3d axis(in[0], in[1], in[2]);
  const Eigen::Vector3d turned = sense * (turn * axis);
  const double w = in[3];
  std::copy_n(turned.data(), 3, out);
  out[3] = w;
  return ECORCHE_OK;
}
