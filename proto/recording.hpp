// SPDX-License-Identifier: Apache-2.0
// Reads what a server recorded (proto/ecorche/v1/record.proto).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include <ecorche/v1/envelope.pb.h>
#include <ecorche/values/error.hpp>

namespace ecorche::wire {

/// A pose, and the frames that were made of it.
struct RecordedStep {
  double seconds = 0;  ///< since the recording began
  v1::PoseUpdate pose;
  std::vector<v1::RecordedFrame> frames;
};

struct RecordedSession {
  v1::RecordingHead head;
  std::map<std::uint32_t, v1::Subscribe> subscriptions;  ///< by their numbers then
  std::vector<RecordedStep> steps;                       ///< sequences grow
  bool full = false;                                     ///< cut at the server's limit
};

/// The whole file, trusting nothing. invalid_argument for what is no recording or breaks its order, names a
/// subscription or pose that was not told, or counts wrong; data_loss for one that was cut, of which `out`
/// then holds what is whole; unimplemented for a newer version.
Status read_recording(std::span<const std::byte> file, RecordedSession& out);

/// XXH64, as in RecordedFrame.
std::uint64_t payload_digest(std::span<const std::byte> payload);

}  // namespace ecorche::wire
