// SPDX-License-Identifier: Apache-2.0
// Messages on memory that stays, for who makes one after another.
#pragma once

#include <google/protobuf/arena.h>

#include <optional>
#include <vector>

#include <ecorche/v1/envelope.pb.h>

namespace ecorche::wire {

/// Nothing is allocated once the largest message was made, but for strings of more than 15 bytes.
class MessageArena {
 public:
  /// An empty envelope; the one before is gone.
  v1::Envelope& make();

 private:
  std::vector<char> block_;
  std::optional<google::protobuf::Arena> arena_;  ///< on `block_`, and beyond where that is too small
};

}  // namespace ecorche::wire
