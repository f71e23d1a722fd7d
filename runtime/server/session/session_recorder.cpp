// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/session_recorder.hpp"

#include <utility>

namespace ecorche::server {

void SessionRecorder::stop(std::function<void()> ended) {
  const std::shared_ptr<Recording> recording = std::exchange(recording_, nullptr);
  if (!recording || current_.recording != recording) return ended();
  current_.ended = std::move(ended);
}

void SessionRecorder::begin_pose(std::map<std::uint32_t, v1::Subscribe> requests) {
  current_.requests = std::move(requests);
  current_.recording = recording_;
}

void SessionRecorder::add_pose(const PoseRequest& pose, std::uint64_t number) {
  if (!current_.recording) return;
  current_.recording->add(pose);
  current_.number = number;
}

void SessionRecorder::add_frame(const PosedFrame& frame) {
  if (frame.number != current_.number || frame.keyframe != 0) return;
  const auto request = current_.requests.find(frame.subscription);
  if (request != current_.requests.end()) current_.recording->add(frame, request->second);
}

void SessionRecorder::end_pose(bool whole) {
  const Current done = std::exchange(current_, {});
  if (done.number != 0 && whole) done.recording->settle();
  if (done.number != 0 && !whole) done.recording->take_back();
  if (done.ended) done.ended();
}

}  // namespace ecorche::server
