// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/client_output.hpp"

#include <algorithm>
#include <utility>

#include "runtime/server/resources/shares.hpp"

namespace ecorche::server {
namespace {

// Answers that may wait before the client has to read some.
constexpr std::size_t kMaxAnswers = 64;
constexpr std::uint64_t kMaxAnswerBytes = 64 << 20;
// Frames of one write.
constexpr std::size_t kMaxTogether = 16;

}  // namespace

ClientOutput::ClientOutput(const net::any_io_executor& executor, const Limits& limits,
                           const MemoryBudget& memory, Metrics& metrics)
    : memory_(memory),
      metrics_(metrics),
      share_(portion(memory.limit(), limits.connection_share)),
      outbox_(limits.frames_in_flight),
      wake_(executor) {}

void ClientOutput::answer(const v1::Envelope& envelope, std::shared_ptr<const wire::Payload> payload) {
  // What only this client reads is its frames' like: so long as it does not, it counts.
  const bool shared = payload.use_count() != 1;
  wire::EncodedFrame frame = wire::encode(envelope, std::move(payload));
  answer(shared ? std::make_shared<const wire::EncodedFrame>(std::move(frame))
                : memory_.hold(std::move(frame)));
}

void ClientOutput::answer(SharedFrame frame) {
  outbox_.answer(std::move(frame));
  wake_.cancel();
}

bool ClientOutput::deliver(const PosedFrame& frame) {
  const bool taken =
      outbox_.enqueue(frame.subscription, frame.level, frame.number, frame.keyframe, frame.bytes);
  wake_.cancel();
  return taken;
}

bool ClientOutput::may_take(std::uint32_t subscription, std::uint64_t more) const {
  const std::uint64_t waits = bytes();
  if (waits == 0) return true;
  if (!memory_.small(more) && memory_.full(more)) return false;
  if (waits + more <= share_) return true;
  return waits <= more && outbox_.arrives(subscription);
}

void ClientOutput::acknowledge(std::uint32_t subscription, std::uint64_t frame) {
  outbox_.acknowledge(subscription, frame, Clock::now());
}

bool ClientOutput::takes_answers() const {
  return outbox_.answers() <= kMaxAnswers && outbox_.answer_bytes() <= kMaxAnswerBytes;
}

const ClientOutput::Write* ClientOutput::next(Clock::time_point now, bool join) {
  write_.frames.clear();
  write_.buffers.clear();
  write_.posed = false;
  while (write_.frames.size() < kMaxTogether && !write_.posed) {
    if (finished_by_ && outbox_.answers() == 0) break;
    SharedFrame frame = outbox_.next(now);
    if (!frame) break;
    write_.posed = outbox_.last_was_posed();
    write_.buffers.push_back(net::buffer(frame->head));
    if (frame->payload) write_.buffers.push_back(net::buffer(*frame->payload));
    for (const auto& piece : frame->pieces.parts)
      write_.buffers.push_back(net::buffer(piece.data(), piece.size()));
    write_.frames.push_back(std::move(frame));
    if (!join) break;
  }
  if (write_.frames.empty()) return nullptr;
  writing_ = Writing{.since = now, .bytes = net::buffer_size(write_.buffers)};
  return &write_;
}

void ClientOutput::written(Clock::time_point now) {
  const Clock::time_point began = std::exchange(writing_, std::nullopt)->since;
  outbox_.written(now);
  for (const SharedFrame& frame : write_.frames)
    metrics_.wrote(frame->bytes(), write_.posed && frame == write_.frames.back());
  if (write_.posed) metrics_.took(Metrics::Stage::written, seconds(now - began));
  write_.buffers.clear();
  write_.frames.clear();
}

std::shared_ptr<const void> ClientOutput::failed() {
  writing_.reset();
  return std::make_shared<const Write>(std::exchange(write_, {}));
}

std::optional<Clock::time_point> ClientOutput::stalls_at(std::optional<Clock::time_point> moved,
                                                         Clock::duration patience, bool strict) const {
  std::optional<Clock::time_point> at;
  if (writing_) at = stalled_at(*writing_, moved, patience, strict);
  if (const auto since = strict ? outbox_.oldest_in_flight() : outbox_.oldest_written())
    at = std::min(at.value_or(Clock::time_point::max()), *since + patience);
  return at;
}

std::uint64_t ClientOutput::unread(Clock::time_point now, std::optional<Clock::time_point> moved,
                                   Clock::duration patience) const {
  const std::optional<Clock::time_point> since =
      writing_ ? std::max(writing_->since, moved.value_or(writing_->since)) : outbox_.oldest_written();
  return !since || now - *since < patience ? 0 : bytes();
}

}  // namespace ecorche::server
