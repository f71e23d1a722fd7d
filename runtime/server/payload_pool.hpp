// SPDX-License-Identifier: Apache-2.0
// Payloads of frames, used again: fresh ones cost more than filling them.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "proto/framing.hpp"

namespace ecorche::server {

/// Any number of threads may take and let go.
class PayloadPool : public std::enable_shared_from_this<PayloadPool> {
 public:
  /// Keeps up to `most` that nobody holds.
  explicit PayloadPool(std::size_t most = 2) : most_(most) { spare_.reserve(most); }

  /// Holds whatever it held last; comes back when the last one lets go.
  std::shared_ptr<wire::Payload> take() {
    std::unique_ptr<wire::Payload> payload;
    {
      const std::lock_guard lock(mutex_);
      if (!spare_.empty()) {
        payload = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    if (!payload) payload = std::make_unique<wire::Payload>();
    return {payload.release(), [pool = weak_from_this()](wire::Payload* back) {
              std::unique_ptr<wire::Payload> owned(back);
              if (const auto self = pool.lock()) self->put_back(std::move(owned));
            }};
  }

 private:
  void put_back(std::unique_ptr<wire::Payload> payload) {
    const std::lock_guard lock(mutex_);
    if (spare_.size() < most_) spare_.push_back(std::move(payload));
  }

  std::size_t most_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<wire::Payload>> spare_;
};

}  // namespace ecorche::server
