// SPDX-License-Identifier: Apache-2.0
// A member of a session that keeps what it hears.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/server/session/member.hpp"
#include "runtime/server/session/pose_job.hpp"

namespace ecorche::server {

struct FakeMember final : Member {
  struct ControlNews {
    v1::Role role;
    bool vacant;
    double reserved_seconds;
    bool operator==(const ControlNews&) const = default;
  };
  std::vector<ControlNews> control;   // every change that it was told
  std::vector<std::uint64_t> frames;  // numbers
  bool reads = true;                  // what it was sent
  bool has_keyframes = true;          // that frames are against
  std::uint32_t level = 0;            // that suits it, unless the body stands still
  Clock::duration gap{};              // that its way may leave between poses
  std::shared_ptr<const Pool> share = nullptr;
  std::uint64_t connection = 0;
  std::string called;
  std::vector<v1::Feature> features;  // that it hears of
  int news = 0;                       // that it was told
  int given = 0;                      // how often it was given control

  bool deliver(const PosedFrame& frame) override {
    frames.push_back(frame.number);
    return has_keyframes;
  }
  std::uint32_t ask_level(std::uint32_t, std::uint32_t finest, std::uint32_t, bool still) override {
    return still ? finest : finest + level;
  }
  Clock::duration longest_gap(std::uint32_t) const override { return gap; }
  void pose_done(const PoseOutcome&, const Skipped&) override {}
  void control_changed(v1::Role role, bool vacant, double reserved_seconds) override {
    control.push_back({role, vacant, reserved_seconds});
  }
  void model_changed(std::uint64_t) override {}
  bool may_take(std::uint32_t, std::uint64_t) override { return reads; }
  std::shared_ptr<const Pool> kept_share() const override { return share; }
  std::uint64_t number() const override { return connection; }
  std::string_view name() const override { return called; }
  bool hears_of(v1::Feature feature) const override {
    return std::find(features.begin(), features.end(), feature) != features.end();
  }
  void tell(const std::shared_ptr<const wire::EncodedFrame>&) override { ++news; }
  void control_given() override { ++given; }
};

}  // namespace ecorche::server
