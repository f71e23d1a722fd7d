// SPDX-License-Identifier: Apache-2.0
// How many bytes of frames wait for clients, and how many the server keeps for them, all together.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "proto/framing.hpp"

namespace ecorche::server {

/// A frame counts from the start of its job until the last connection lets go of it, once however many share
/// it. Above the limit no subscription gets its first frame; from half of it on, who keeps frames without
/// acknowledging them has a quarter of the usual time to do so (docs/protocol.md, "Limits").
///
/// What streams and probes keep from frame to frame is counted for itself: it never makes way, so that beyond
/// its limit there are no new ones. From any thread.
class FrameMemory {
 public:
  FrameMemory(std::uint64_t limit, std::uint64_t kept_limit) : limit_(limit), kept_limit_(kept_limit) {}

  std::uint64_t bytes() const { return sum_->load(std::memory_order_relaxed); }
  /// `more`: beside what is counted.
  bool full(std::uint64_t more = 0) const { return bytes() + more > limit_; }
  bool half_full() const { return bytes() > limit_ / 2; }

  /// So many bytes more, for as long as it lives: as here, of frames that a job is going to make.
  class Room {
   public:
    Room() = default;
    Room(const FrameMemory& memory, std::uint64_t bytes) : Room(memory.sum_, bytes) {}
    ~Room() {
      if (sum_) sum_->fetch_sub(bytes_, std::memory_order_relaxed);
    }
    Room(Room&& other) noexcept : bytes_(other.bytes_), sum_(std::move(other.sum_)) {}
    Room& operator=(Room&& other) noexcept {
      std::swap(bytes_, other.bytes_);
      std::swap(sum_, other.sum_);
      return *this;
    }

   private:
    friend FrameMemory;
    Room(std::shared_ptr<std::atomic<std::uint64_t>> sum, std::uint64_t bytes)
        : bytes_(bytes), sum_(std::move(sum)) {
      sum_->fetch_add(bytes_, std::memory_order_relaxed);
    }
    std::uint64_t bytes_ = 0;
    std::shared_ptr<std::atomic<std::uint64_t>> sum_;
  };

  std::uint64_t kept() const { return kept_->load(std::memory_order_relaxed); }
  /// Whether so much more may not be kept.
  bool kept_full(std::uint64_t more) const { return more > 0 && kept() + more > kept_limit_; }
  Room keep(std::uint64_t bytes) const { return Room(kept_, bytes); }

  /// The frame, shared and counted.
  std::shared_ptr<const wire::EncodedFrame> hold(wire::EncodedFrame frame) const {
    return std::make_shared<const Counted>(std::move(frame), sum_);
  }

 private:
  using Sum = std::atomic<std::uint64_t>;
  struct Counted : wire::EncodedFrame {
    Counted(wire::EncodedFrame frame, std::shared_ptr<Sum> into)
        : wire::EncodedFrame(std::move(frame)), size(bytes()), sum(std::move(into)) {
      sum->fetch_add(size, std::memory_order_relaxed);
    }
    ~Counted() { sum->fetch_sub(size, std::memory_order_relaxed); }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;
    std::uint64_t size;
    std::shared_ptr<Sum> sum;
  };

  std::uint64_t limit_, kept_limit_;
  std::shared_ptr<Sum> sum_ = std::make_shared<Sum>(0);
  std::shared_ptr<Sum> kept_ = std::make_shared<Sum>(0);
};

}  // namespace ecorche::server
