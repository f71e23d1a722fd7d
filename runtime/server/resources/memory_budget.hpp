// SPDX-License-Identifier: Apache-2.0
// How many bytes of frames wait for clients, and how many the server keeps for them, all together.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include <ecorche/wire/framing.hpp>

namespace ecorche::server {

/// So many bytes, of so many that there may be, and of those that a larger pool has, if it is a part of one.
/// From any thread.
class Pool {
 public:
  explicit Pool(std::uint64_t limit, std::shared_ptr<const Pool> of = nullptr)
      : limit_(limit), of_(std::move(of)) {}

  std::uint64_t bytes() const { return sum_.load(std::memory_order_relaxed); }
  std::uint64_t limit() const { return limit_; }
  /// Whether so much more has no room here, or where this is a part of.
  bool full(std::uint64_t more) const { return bytes() + more > limit_ || (of_ && of_->full(more)); }

  void add(std::uint64_t bytes) const {
    for (const Pool* pool = this; pool; pool = pool->of_.get())
      pool->sum_.fetch_add(bytes, std::memory_order_relaxed);
  }
  void give_back(std::uint64_t bytes) const {
    for (const Pool* pool = this; pool; pool = pool->of_.get())
      pool->sum_.fetch_sub(bytes, std::memory_order_relaxed);
  }

 private:
  std::uint64_t limit_;
  std::shared_ptr<const Pool> of_;
  mutable std::atomic<std::uint64_t> sum_ = 0;
};

/// A frame counts from the start of its job until the last connection lets go of it, once however many share
/// it. A subscription's first frame waits where it has no room: a large one leaves a quarter of the memory to
/// others, and of the rest an eighth is for small ones, of which every connection may have one. From half of
/// the limit on, who keeps frames without acknowledging them has a quarter of the usual time to do so
/// (docs/reference/protocol.md, "Limits").
///
/// What streams and probes keep from frame to frame is counted for itself: it never makes way, so that beyond
/// its limit there are no new ones. From any thread.
class MemoryBudget {
 public:
  MemoryBudget(std::uint64_t limit, std::uint64_t kept_limit)
      : queued_(std::make_shared<const Pool>(limit)), kept_(std::make_shared<const Pool>(kept_limit)) {}

  std::uint64_t bytes() const { return queued_->bytes(); }
  std::uint64_t limit() const { return queued_->limit(); }
  /// `more`: beside what is counted.
  bool full(std::uint64_t more = 0) const { return queued_->full(more); }
  bool half_full() const { return bytes() > limit() / 2; }
  /// Whether a first frame of so many bytes has to wait, beside what is counted and `before`. Where there is
  /// nothing else, however large, it has room.
  bool must_wait(std::uint64_t frame, std::uint64_t before) const {
    const std::uint64_t others = bytes() + before;
    if (others == 0) return false;
    return others + frame > limit() - (large(frame) ? limit() / 4 : small(frame) ? 0 : limit() / 8);
  }
  /// From 16 MiB on, of 512: a whole body of the largest is less.
  bool large(std::uint64_t frame) const { return frame > limit() / 32; }
  /// Up to 256 KiB, of 512 MiB: as many as there may be connections are an eighth.
  bool small(std::uint64_t frame) const { return frame <= limit() / 2048; }

  /// So many bytes more, for as long as it lives: as here, of frames that a job is going to make.
  class Reservation {
   public:
    Reservation() = default;
    Reservation(const MemoryBudget& memory, std::uint64_t bytes) : Reservation(memory.queued_, bytes) {}
    Reservation(std::shared_ptr<const Pool> pool, std::uint64_t bytes)
        : bytes_(bytes), pool_(std::move(pool)) {
      pool_->add(bytes_);
    }
    ~Reservation() {
      if (pool_) pool_->give_back(bytes_);
    }
    Reservation(Reservation&& other) noexcept : bytes_(other.bytes_), pool_(std::move(other.pool_)) {}
    Reservation& operator=(Reservation&& other) noexcept {
      std::swap(bytes_, other.bytes_);
      std::swap(pool_, other.pool_);
      return *this;
    }

   private:
    std::uint64_t bytes_ = 0;
    std::shared_ptr<const Pool> pool_;
  };

  std::uint64_t kept() const { return kept_->bytes(); }
  /// Of what all keep; parts of it are for who has a share.
  const std::shared_ptr<const Pool>& kept_pool() const { return kept_; }

  /// The frame, shared and counted.
  std::shared_ptr<const wire::EncodedFrame> hold(wire::EncodedFrame frame) const {
    return std::make_shared<const Counted>(std::move(frame), queued_);
  }

 private:
  struct Counted : wire::EncodedFrame {
    Counted(wire::EncodedFrame frame, std::shared_ptr<const Pool> into)
        : wire::EncodedFrame(std::move(frame)), counted(std::move(into), bytes()) {}
    Reservation counted;
  };

  std::shared_ptr<const Pool> queued_, kept_;
};

}  // namespace ecorche::server
