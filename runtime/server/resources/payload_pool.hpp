// SPDX-License-Identifier: Apache-2.0
// Memory of frames, used again: fresh one costs more than filling it.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <ecorche/wire/framing.hpp>

namespace ecorche::server {

/// Any number of threads may take and let go.
template <class T>
class SparePool : public std::enable_shared_from_this<SparePool<T>> {
 public:
  /// Keeps up to `most` that nobody holds.
  explicit SparePool(std::size_t most = 2) : most_(most) { spare_.reserve(most); }

  /// Holds whatever it held last; comes back when the last one lets go.
  std::shared_ptr<T> take() {
    std::unique_ptr<T> payload;
    {
      const std::lock_guard lock(mutex_);
      if (!spare_.empty()) {
        payload = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    if (!payload) payload = std::make_unique<T>();
    return {payload.release(), [pool = this->weak_from_this()](T* back) {
              std::unique_ptr<T> owned(back);
              if (const auto self = pool.lock()) self->put_back(std::move(owned));
            }};
  }

 private:
  void put_back(std::unique_ptr<T> payload) {
    const std::lock_guard lock(mutex_);
    if (spare_.size() < most_) spare_.push_back(std::move(payload));
  }

  std::size_t most_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> spare_;
};

/// Payloads of frames.
using PayloadPool = SparePool<wire::Payload>;
/// Positions as bodies are posed, float32, per tissue of the model, which frames send as they lie.
using Positions = std::vector<std::vector<float>>;
using PositionsPool = SparePool<Positions>;

}  // namespace ecorche::server
