// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/message_reader.hpp"

#include <algorithm>

namespace ecorche::server {

std::span<std::byte> MessageReader::buffer() {
  const std::span<std::byte> wanted = frames_.prepare();
  direct_ = wanted.size() >= inbox_.size();
  return direct_ ? wanted : std::span<std::byte>(inbox_);
}

void MessageReader::on_read(std::size_t n, Clock::time_point now, std::optional<bool> message_ended) {
  filled_ = direct_ ? n : 0;
  unparsed_ = direct_ ? std::span<const std::byte>() : std::span<const std::byte>(inbox_).first(n);
  read_at_ = now;
  message_ended_ = message_ended;
  pending_ = true;
}

Status MessageReader::next(std::optional<wire::Frame>& out) {
  out.reset();
  while (pending_ && !out) {
    if (frames_.between_frames()) unfinished_since_ = read_at_;
    if (Status status = advance(); !status.ok()) return status;
    pending_ = !unparsed_.empty();
    if (message_ended_ && (!pending_ && *message_ended_) != frames_.complete()) {
      return {StatusCode::invalid_argument,
              "message: it holds more or less than one frame (send one frame a message)"};
    }
    if (!frames_.complete()) continue;
    unfinished_since_.reset();
    out = frames_.release();
  }
  return {};
}

Status MessageReader::advance() {
  if (direct_) return frames_.commit(filled_);
  const std::span<std::byte> wanted = frames_.prepare();
  const std::size_t n = std::min(wanted.size(), unparsed_.size());
  std::copy_n(unparsed_.begin(), n, wanted.begin());
  unparsed_ = unparsed_.subspan(n);
  return frames_.commit(n);
}

}  // namespace ecorche::server
