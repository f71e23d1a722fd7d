// SPDX-License-Identifier: Apache-2.0
// Posed bodies that no job uses just now.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>

namespace ecorche::server {

/// There are as many as jobs run at one time, however many sessions: a session that only waits holds none,
/// and the one used last, which is taken first, still stands in the caches. Any number of threads may take
/// and let go. Nothing of a body outlives its job: each writes all that it reads.
class BodyPool {
 public:
  explicit BodyPool(const runtime::BodyPoser& poser) : poser_(poser) {}

  class PutBack {
   public:
    explicit PutBack(BodyPool* pool = nullptr) : pool_(pool) {}
    void operator()(runtime::PosedBody* body) const {
      pool_->put_back(std::unique_ptr<runtime::PosedBody>(body));
    }

   private:
    BodyPool* pool_;
  };
  using Lease = std::unique_ptr<runtime::PosedBody, PutBack>;

  /// Whatever arrays its last job left; the pool must outlive it. Throws bad_alloc.
  Lease take() {
    {
      const std::lock_guard lock(mutex_);
      if (!spare_.empty()) {
        Lease lease(spare_.back().release(), PutBack(this));
        spare_.pop_back();
        return lease;
      }
      // So that put_back never allocates.
      spare_.reserve(++made_);
    }
    return Lease(new runtime::PosedBody(poser_.make_frame({.positions = false})), PutBack(this));
  }

 private:
  void put_back(std::unique_ptr<runtime::PosedBody> body) {
    const std::lock_guard lock(mutex_);
    spare_.push_back(std::move(body));
  }

  const runtime::BodyPoser& poser_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<runtime::PosedBody>> spare_;
  std::size_t made_ = 0;
};

}  // namespace ecorche::server
