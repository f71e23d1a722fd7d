// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/message_arena.hpp>

#include <algorithm>
#include <cstddef>

namespace ecorche::wire {

v1::Envelope& MessageArena::make() {
  constexpr std::size_t first = 16U << 10U;
  const std::size_t used = arena_ ? static_cast<std::size_t>(arena_->SpaceAllocated()) : 0;
  if (!arena_ || used > block_.size()) {
    arena_.reset();
    block_.resize(std::max(first, 2 * used));
    google::protobuf::ArenaOptions options;
    options.initial_block = block_.data();
    options.initial_block_size = block_.size();
    arena_.emplace(options);
  } else {
    arena_->Reset();
  }
  return *google::protobuf::Arena::CreateMessage<v1::Envelope>(&*arena_);
}

}  // namespace ecorche::wire
