// SPDX-License-Identifier: Apache-2.0
// What of a session goes into its recording: poses with all of their frames.
#include <utility>

#include "runtime/server/session/session.hpp"

namespace ecorche::server {

void Session::end_recording(std::function<void()> ended) {
  const std::shared_ptr<Recording> recording = std::exchange(recording_, nullptr);
  if (!recording || recorded_.recording != recording) return ended();
  recorded_.ended = std::move(ended);
}

// The job shows a new pose. Who asked for a frame of it may have left once it comes.
void Session::begin_recorded() {
  if (!recording_) return;
  for (const Row& row : rows_) recorded_.requests.emplace(row.subscription.id, row.request);
  recorded_.recording = recording_;
}

void Session::record_pose(const PoseJob& job) {
  if (!recorded_.recording) return;
  recorded_.recording->add(job.request);
  recorded_.job = job.number;
}

void Session::record_frame(const PosedFrame& frame) {
  if (frame.number != recorded_.job || frame.keyframe != 0) return;
  const auto request = recorded_.requests.find(frame.subscription);
  if (request != recorded_.requests.end()) recorded_.recording->add(frame, request->second);
}

// The job is over. `whole`: every frame was made.
void Session::end_recorded(bool whole) {
  const Recorded done = std::exchange(recorded_, {});
  if (done.job != 0 && whole) done.recording->settle();
  if (done.job != 0 && !whole) done.recording->take_back();
  if (!done.ended) return;
  try {
    done.ended();
  } catch (const std::exception& error) {
    complain("its recording is lost: " + std::string(error.what()));
  }
}

std::optional<Clock::time_point> Session::abandoned() const {
  if (!recording_ || controller_) return std::nullopt;
  return uncontrolled_;
}

}  // namespace ecorche::server
