// SPDX-License-Identifier: Apache-2.0
// Frames of a server held against offline posing of the same model.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include <ecorche/wire/framing.hpp>
#include <ecorche/wire/mesh_decoder.hpp>

namespace ecorche::app {

/// Poses every frame again, on a thread of its own beside the stream, and compares: float32 and volumes byte
/// for byte, u16 within half a step and the rounding of float32, normals within a degree. A short queue:
/// where checking is slower than the stream, add() waits, the frame before is acknowledged late, and the
/// server skips.
class StreamCheck {
 public:
  /// `say` gets a line for each of the first mismatches, from the checking thread.
  StreamCheck(std::shared_ptr<const Model> model, runtime::Skinning skinning, runtime::Sampling sampling,
              std::function<void(std::string_view)> say);
  ~StreamCheck();
  StreamCheck(const StreamCheck&) = delete;
  StreamCheck& operator=(const StreamCheck&) = delete;

  /// A MeshFrame, decoded, or a VolumeFrame, and the pose it should show.
  void add(wire::Frame frame, std::vector<wire::DecodedTissue> tissues, const Pose& pose);

  struct Result {
    std::uint64_t checked = 0, mismatches = 0;
  };
  /// Finishes what was added.
  Result finish();

 private:
  struct Item {
    wire::Frame frame;
    std::vector<wire::DecodedTissue> tissues;
    Pose pose;
  };
  void work();
  std::string compare(const Item& item);
  std::string compare_mesh(const v1::MeshFrame& frame, const std::vector<wire::DecodedTissue>& tissues,
                           const Pose& pose);
  std::string compare_volume(const v1::VolumeFrame& frame, const wire::Payload& payload, const Pose& pose);

  runtime::BodyPoser poser_;
  runtime::PosedBody body_;
  runtime::Skinning skinning_;
  runtime::Sampling sampling_;
  std::function<void(std::string_view)> say_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item> items_;
  bool finished_ = false;
  Result result_;
  std::thread thread_;
};

}  // namespace ecorche::app
