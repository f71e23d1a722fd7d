// SPDX-License-Identifier: Apache-2.0
// Values of the core as messages, and back.
#pragma once

#include <ecorche/v1/envelope.pb.h>
#include <ecorche/values/error.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::wire {

void to_proto(const Status& status, v1::Status& out);
Status from_proto(const v1::Status& status);

void to_proto(const Eigen::Vector3d& vector, v1::Vector3& out);
Eigen::Vector3d from_proto(const v1::Vector3& vector);

void to_proto(const ImageGrid& grid, v1::Grid& out);
/// invalid_argument: not nine direction numbers, or a size beyond 2^31.
Status from_proto(const v1::Grid& grid, ImageGrid& out);

/// All but how the centres were found: a client does not need it.
void to_proto(const Rig& rig, v1::Skeleton& out);
/// invalid_argument: parents that do not come first, an unknown kind, an axis beyond 2, a coupling to what
/// there is not.
Status from_proto(const v1::Skeleton& skeleton, Rig& out);

/// Fills root_translation, rotation and translation. Exact: doubles travel as they are.
void to_proto(const Pose& pose, v1::PoseUpdate& out);
void to_proto(const Pose& pose, v1::PoseState& out);
/// A pose of a rig of `joints` joints. invalid_argument: another number of joints, a value that is not
/// finite, a quaternion whose length is not 1 within 1e-3, a translation of no joint or beyond 1e6 mm.
Status from_proto(const v1::PoseUpdate& update, std::size_t joints, Pose& out);

}  // namespace ecorche::wire
