// SPDX-License-Identifier: Apache-2.0
// What OpenIGTLink's messages hold, to and from ecorche's values: RAS mm on the wire, LPS mm here, turned
// about z by half a turn and nothing else, so that triangles keep their winding.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/values/image.hpp>
#include <ecorche/values/transform.hpp>
#include "app/igtl/message.hpp"

namespace ecorche::app::igtl {

/// Of STATUS messages.
enum class StatusOf : std::uint16_t {
  ok = 1,
  not_found = 4,
  overflow = 8,
  checksum_error = 9,
  config_error = 10,
  unknown_instruction = 12,
};

/// A motion or a place, and whose.
struct NamedTransform {
  std::string name;
  RigidTransform at;  ///< LPS mm
};

/// Of POINT messages.
struct NamedPoint {
  std::string name;                              ///< 64 bytes are kept
  std::string group;                             ///< 32 bytes are kept
  Eigen::Vector3f at = Eigen::Vector3f::Zero();  ///< LPS mm
};

/// The columns of a TRANSFORM: x, y, z axes and origin, RAS mm.
using Columns = std::array<float, 12>;
Columns columns_of(const RigidTransform& lps);
/// Nothing where they are no rotation to 1 % and a place within a kilometre: trackers that lost their tool
/// send such.
std::optional<RigidTransform> transform_of(const Columns& columns);

SharedBytes transform_message(const NamedTransform& transform);
SharedBytes tracking_message(std::string_view device, const std::vector<NamedTransform>& tools);
SharedBytes points_message(std::string_view device, const std::vector<NamedPoint>& points);
SharedBytes status_message(std::string_view device, StatusOf code, std::string_view text);
SharedBytes capability_message(std::string_view device, std::span<const std::string_view> types);
/// RTS_TDATA: a stream of TDATA begins or ends.
SharedBytes tracking_answer(std::string_view device);
/// Error{data} where an axis has more than 65535 voxels, which IMAGE cannot say.
SharedBytes image_message(std::string_view device, const Image& image);

// Of a content, as content_of() cuts it; nothing where it is of another size than it says, or holds what is
// no transform or point.
std::optional<RigidTransform> read_transform(std::span<const std::byte> content);
/// Those of TDATA that are rigid transforms: one lost tool does not stop the others.
std::optional<std::vector<NamedTransform>> read_tracking(std::span<const std::byte> content);
/// Milliseconds between two TDATA at least, as STT_TDATA asks.
std::optional<std::int32_t> read_tracking_request(std::span<const std::byte> content);
std::optional<std::vector<NamedPoint>> read_points(std::span<const std::byte> content);
std::optional<std::string> read_string(std::span<const std::byte> content);

}  // namespace ecorche::app::igtl
