// SPDX-License-Identifier: Apache-2.0
// Frames of one posed volume.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <ecorche/ecorche_client.h>
#include <ecorche/wire/volume_decoder.hpp>

namespace ecorche::c {

/// What was asked for, and what came.
struct VolumeStream {
  std::uint32_t number = 0;  ///< the caller's: stays after coming back
  std::uint32_t volume = 0;  ///< row of ModelOpened.volumes
  v1::Subscribe wanted;
  std::vector<ecorche_grid> slices;
  std::optional<std::uint32_t> subscription;  ///< the server's

  wire::VolumeDecoder decoder;
  Image shown;
  std::optional<std::uint64_t> sequence;  ///< of the pose that is shown; none yet
};

}  // namespace ecorche::c
