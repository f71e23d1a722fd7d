// SPDX-License-Identifier: Apache-2.0
// What a session showed, as a file of frames (proto/ecorche/v1/record.proto).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "runtime/server/session/clip.hpp"
#include "runtime/server/session/pose_job.hpp"
#include "runtime/server/session/recording_file.hpp"

namespace ecorche::server {

/// Grows up to its limit. What cannot change any more is taken out of it, for its file, every now and then,
/// so that it holds little, and a server that is killed leaves all but the last second. Not for two threads
/// at once.
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
  /// All frames of the last pose came.
  void settle() { mark_.reset(); }
  /// Takes nothing more, as if its limit had come.
  void stop_growing() { full_ = true; }

  bool full() const { return full_; }
  std::uint64_t poses() const { return poses_; }

  /// The bytes of the file, from the first that were not taken yet, but for those of a pose whose frames may
  /// still come; all of them after finish(). None before the first pose.
  std::string take();
  /// Ends it.
  void finish();

  /// Where they go, and whose recording it is: the address of who began it.
  struct Place {
    std::shared_ptr<RecordingFile> file;
    std::string owner;
  };
  void put(Place place) { place_ = std::move(place); }
  const Place& place() const { return place_; }

 private:
  bool append(const v1::Envelope& envelope);

  // Before the last pose.
  struct Mark {
    std::size_t bytes;  // of bytes_
    std::uint64_t frames, sequence;
    std::vector<std::uint32_t> subscriptions;  // that came with it
  };

  std::string name_, bytes_;
  std::size_t taken_ = 0;  ///< before bytes_
  std::size_t limit_;
  bool full_ = false;
  std::uint64_t poses_ = 0, frames_ = 0;
  std::uint64_t last_sequence_ = 0;
  std::uint64_t rig_digest_;
  std::set<std::uint32_t> subscriptions_;
  std::optional<Mark> mark_;
  Place place_;
  Clock::time_point start_ = Clock::now();
};

/// What a whole recording's file showed, to be played; `rig` has so many segments. Nothing where it cannot be
/// read. Throws bad_alloc.
Clip clip_of(std::span<const std::byte> file, const std::string& name, std::size_t segments);

/// XXH64 of the payload.
std::uint64_t digest_of(const wire::EncodedFrame& frame);

}  // namespace ecorche::server
