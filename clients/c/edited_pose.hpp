// SPDX-License-Identifier: Apache-2.0
// A pose while it is being set, and what a skeleton tells of its joints: for both libraries.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include <ecorche/ecorche.h>
#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::c {

/// A row of ecorche_model_angle: a joint's place in the skeleton, and the angle's in its sequence.
struct AngleRow {
  std::size_t segment = 0, place = 0;
};
std::vector<AngleRow> angle_rows(const Skeleton& skeleton);

ecorche_code fill_segment(const Rig& rig, std::uint32_t row, ecorche_segment_info* out);
ecorche_code fill_angle(const Skeleton& skeleton, const std::vector<AngleRow>& rows, std::uint32_t row,
                        ecorche_angle_info* out);
/// By a segment's or a joint's name; -1 where there is none.
std::int32_t find_segment(const Skeleton& skeleton, const char* name);

/// The skeleton is that of whoever holds it, and outlives it.
class EditedPose {
 public:
  /// As scanned.
  explicit EditedPose(const Skeleton& skeleton);

  void set(Pose pose);
  ecorche_code set_angle(const char* joint, const char* angle, double radians);
  ecorche_code set_angle_at(const std::vector<AngleRow>& rows, std::uint32_t row, double radians);
  ecorche_code angle_at(const std::vector<AngleRow>& rows, std::uint32_t row, double* radians) const;
  ecorche_code set_rotation(std::uint32_t segment, const double xyzw[4]);
  ecorche_code rotation(std::uint32_t segment, double xyzw[4]) const;
  ecorche_code set_root(const double translation[3]);

  const Pose& pose() const { return pose_; }

 private:
  void read_angles(std::size_t segment);
  void turn(std::size_t segment, std::size_t place, double radians);

  const Skeleton* skeleton_;
  Pose pose_;
  /// Of each joint, in its sequence, as set: a rotation does not tell them apart beyond 90 degrees.
  std::vector<std::array<double, 3>> angles_;
};

}  // namespace ecorche::c
