// SPDX-License-Identifier: Apache-2.0
// What of a session goes into its recording: poses with all of their frames.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <utility>

#include "runtime/server/session/recording.hpp"

namespace ecorche::server {

/// Poses whose jobs begin while a recording runs go into it; one whose frames were not all made, never was.
/// On the I/O thread.
class SessionRecorder {
 public:
  void start(std::shared_ptr<Recording> recording) { recording_ = std::move(recording); }
  /// Takes it away; `ended` is called once the pose that is being made has all its frames in it. It may
  /// throw.
  void stop(std::function<void()> ended);
  /// Null: none runs.
  const std::shared_ptr<Recording>& recording() const { return recording_; }
  bool running() const { return recording_ != nullptr; }

  /// A job of a new pose begins, of frames that were asked for so, by subscription: who asked may have left
  /// once they come.
  void begin_pose(std::map<std::uint32_t, v1::Subscribe> requests);
  /// The job has posed the body; `number`: of its frames.
  void add_pose(const PoseRequest& pose, std::uint64_t number);
  void add_frame(const PosedFrame& frame);
  /// The job is over. `whole`: every frame was made. Throws what stop()'s `ended` does.
  void end_pose(bool whole);

 private:
  // The pose under way, where it is recorded.
  struct Current {
    std::shared_ptr<Recording> recording;             // null: it is not
    std::map<std::uint32_t, v1::Subscribe> requests;  // of its frames, by subscription
    std::uint64_t number = 0;                         // of its frames, once the pose is in the recording
    std::function<void()> ended;                      // the recording ends with this pose
  };
  std::shared_ptr<Recording> recording_;
  Current current_;
};

}  // namespace ecorche::server
