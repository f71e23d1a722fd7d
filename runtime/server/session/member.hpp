// SPDX-License-Identifier: Apache-2.0
// A connection, as its session sees it.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include <ecorche/v1/envelope.pb.h>
#include <ecorche/wire/framing.hpp>
#include "runtime/server/net/asio.hpp"
#include "runtime/server/resources/memory_budget.hpp"

namespace ecorche::server {

struct PosedFrame;
struct PoseOutcome;
struct Skipped;

/// Called on the I/O thread. Nothing here throws, nor joins or leaves a session before it has returned.
class Member {
 public:
  virtual ~Member() = default;
  /// False where the member has not got the keyframe that the frame is against, and so not the frame either.
  virtual bool deliver(const PosedFrame& frame) = 0;
  /// The level of detail that suits the member's way for its next frame; `still`: nothing newer waits.
  virtual std::uint32_t ask_level(std::uint32_t subscription, std::uint32_t finest, std::uint32_t coarsest,
                                  bool still) = 0;
  /// For so long a packet that is lost keeps those behind it from coming, on the member's way: poses that
  /// stay away no longer have not ended.
  virtual Clock::duration longest_gap(std::uint32_t subscription) const {
    static_cast<void>(subscription);
    return {};
  }
  /// Only to the member that holds control.
  virtual void pose_done(const PoseOutcome& outcome, const Skipped& skipped) = 0;
  /// `vacant`: control is free; else, for so many seconds above 0, only its last holder may have it.
  virtual void control_changed(v1::Role role, bool vacant, double reserved_seconds) = 0;
  /// The model of this name is another one now; the session goes on with the old one.
  virtual void model_changed(std::uint64_t identity) = 0;
  /// Whether a frame of so many bytes of the subscription is worth making: false while what it was sent
  /// before waits for the member to read, and fills its share.
  virtual bool may_take(std::uint32_t subscription, std::uint64_t bytes) {
    static_cast<void>(subscription), static_cast<void>(bytes);
    return true;
  }
  /// Of its connection, and what others call it.
  virtual std::uint64_t number() const { return 0; }
  virtual std::string_view name() const { return {}; }
  /// Its hello names the feature, of those that a client must name to be told of it.
  virtual bool hears_of(v1::Feature feature) const {
    static_cast<void>(feature);
    return false;
  }
  /// Control may be given to it; and it takes what it finds free when it comes.
  virtual bool may_control() const { return true; }
  virtual bool seeks_control() const { return true; }
  /// What all hear who hear of its feature.
  virtual void tell(const std::shared_ptr<const wire::EncodedFrame>& news) { static_cast<void>(news); }
  /// Who held control gave it to this one, which has heard of the change.
  virtual void control_given() {}
  /// Its part of what all keep; null: it has no share of its own.
  virtual std::shared_ptr<const Pool> kept_share() const { return nullptr; }
};

}  // namespace ecorche::server
