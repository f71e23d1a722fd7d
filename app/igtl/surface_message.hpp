// SPDX-License-Identifier: Apache-2.0
// A tissue as POLYDATA: its triangles, written once, and its points and normals, written for every pose.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <ecorche/values/mesh.hpp>
#include "app/igtl/message.hpp"

namespace ecorche::app::igtl {

class SurfaceMessage {
 public:
  SurfaceMessage(std::string device, const Triangles& F, std::size_t vertices);

  /// `points`: 3 * #V, LPS mm; `normals`: 3 * #V, unit vectors in 32767ths. Both go out in RAS.
  SharedBytes posed(std::span<const float> points, std::span<const std::int16_t> normals,
                    std::uint64_t time) const;

  const std::string& device() const { return device_; }

 private:
  std::string device_;
  Bytes frame_;  // a whole message, its points and normals still zero
  std::size_t points_at_ = 0, normals_at_ = 0;
};

}  // namespace ecorche::app::igtl
