// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/resources/reserve.hpp"

#include <new>

namespace ecorche::server {
namespace {

// Of the calling thread.
Reserve*& of_thread() {
  thread_local Reserve* reserve = nullptr;
  return reserve;
}

// Whoever was asked before; known once the first reserve is made, which no thread has before.
std::new_handler before() {
  static const std::new_handler handler = std::set_new_handler(Reserve::make_room);
  return handler;
}

}  // namespace

Reserve::Reserve() {
  before();
  refill();
  of_thread() = this;
}

Reserve::~Reserve() {
  of_thread() = nullptr;
}

void Reserve::make_room() {
  Reserve* const reserve = of_thread();
  if (reserve && !MayFail::flag() && reserve->give()) return;
  if (const std::new_handler other = before()) return other();
  throw std::bad_alloc();
}

bool Reserve::give() noexcept {
  if (count_ == 0) return false;
  kept_[--count_].reset();
  return true;
}

std::size_t Reserve::refill() noexcept {
  const MayFail may_fail;
  const std::size_t had = count_;
  while (count_ < pieces) {
    kept_[count_].reset(new (std::nothrow) Piece);
    if (!kept_[count_]) break;
    ++count_;
  }
  return count_ - had;
}

}  // namespace ecorche::server
