// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string_view>

#include <ecorche/io/case_file.hpp>
#include <ecorche/io/pose_library.hpp>
#include "clients/c/guard.hpp"
#include "clients/c/objects.hpp"

using namespace ecorche;

namespace {

ecorche_code is_null() {
  return c::fail(ECORCHE_INVALID_ARGUMENT, "model, pose, name: is null");
}

}  // namespace

ecorche_code ecorche_pose_create(const ecorche_model* model, ecorche_pose** out) {
  if (model == nullptr || out == nullptr) return is_null();
  return c::guarded([&] {
    *out = new ecorche_pose{model->open, c::EditedPose(model->open->skeleton())};
    return ECORCHE_OK;
  });
}

void ecorche_pose_destroy(ecorche_pose* pose) {
  delete pose;
}

ecorche_code ecorche_pose_reset(ecorche_pose* pose) {
  if (pose == nullptr) return is_null();
  return c::guarded([&] {
    pose->edited.set(Pose::rest(pose->open->skeleton().segments.size()));
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_pose_load(ecorche_pose* pose, const char* name) {
  if (pose == nullptr || name == nullptr) return is_null();
  return c::guarded([&] {
    const std::string_view words = name;
    const Rig& rig = pose->open->model->rig;
    pose->edited.set(words.starts_with(io::library_prefix)
                         ? io::library_pose(words.substr(io::library_prefix.size()), rig).pose
                         : io::read_pose(name, rig));
    return ECORCHE_OK;
  });
}

ecorche_code ecorche_pose_set_angle(ecorche_pose* pose, const char* joint, const char* angle,
                                    double radians) {
  if (pose == nullptr) return is_null();
  return c::guarded([&] { return pose->edited.set_angle(joint, angle, radians); });
}

ecorche_code ecorche_pose_set_angle_at(ecorche_pose* pose, uint32_t angle, double radians) {
  if (pose == nullptr) return is_null();
  return c::guarded([&] { return pose->edited.set_angle_at(pose->open->angles, angle, radians); });
}

ecorche_code ecorche_pose_angle(const ecorche_pose* pose, uint32_t angle, double* radians) {
  if (pose == nullptr) return is_null();
  return c::guarded([&] { return pose->edited.angle_at(pose->open->angles, angle, radians); });
}

ecorche_code ecorche_pose_set_rotation(ecorche_pose* pose, uint32_t segment, const double xyzw[4]) {
  if (pose == nullptr) return is_null();
  return c::guarded([&] { return pose->edited.set_rotation(segment, xyzw); });
}

ecorche_code ecorche_pose_rotation(const ecorche_pose* pose, uint32_t segment, double xyzw[4]) {
  if (pose == nullptr) return is_null();
  return c::guarded([&] { return pose->edited.rotation(segment, xyzw); });
}

ecorche_code ecorche_pose_set_root(ecorche_pose* pose, const double translation[3]) {
  if (pose == nullptr) return is_null();
  return c::guarded([&] { return pose->edited.set_root(translation); });
}
