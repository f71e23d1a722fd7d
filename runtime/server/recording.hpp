// SPDX-License-Identifier: Apache-2.0
// What a session showed, as a file of frames (proto/ecorche/v1/record.proto).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "runtime/server/clip.hpp"
#include "runtime/server/pose_job.hpp"

namespace ecorche::server {

/// Grows in memory, up to its limit, and reaches the disk whole at its end. Not for two threads at once.
class Recording {
 public:
  /// `limit`: bytes of the file; what comes after is left out.
  Recording(std::string name, const ServedModel& model, const std::string& server, std::size_t limit);

  const std::string& name() const { return name_; }

  void add(const PoseRequest& pose);
  /// A frame of the last pose. One without a digest is left out; one beyond the limit takes its pose with it.
  void add(const PosedFrame& frame, const v1::Subscribe& request);
  /// Not all frames of the last pose came: it never was.
  void take_back();

  bool full() const { return full_; }

  /// Ends it. What it showed, to be played.
  Clip finish();
  /// After finish(): writes the file, atomically. already_exists where there is one; else what writing said.
  Status write(const std::filesystem::path& path) const;

 private:
  bool append(const v1::Envelope& envelope);

  // Before the last pose.
  struct Mark {
    std::size_t bytes;
    std::uint64_t frames, sequence;
    std::vector<std::uint32_t> subscriptions;  // that came with it
  };

  std::string name_, bytes_;
  std::size_t limit_;
  bool full_ = false;
  std::uint64_t poses_ = 0, frames_ = 0;
  std::uint64_t last_sequence_ = 0;
  std::uint64_t rig_digest_;
  std::set<std::uint32_t> subscriptions_;
  std::optional<Mark> mark_;
  Clip clip_;
  double first_seconds_ = 0;  ///< a clip begins with its first pose
  Clock::time_point start_ = Clock::now();
};

/// XXH64 of the payload.
std::uint64_t digest_of(const wire::EncodedFrame& frame);

}  // namespace ecorche::server
