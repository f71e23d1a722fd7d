// SPDX-License-Identifier: Apache-2.0
// Large frames on one I/O thread, part by part.
#pragma once

#include <algorithm>
#include <deque>

#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// One large frame's place among those that its thread writes. Between two parts of any of them the thread
/// comes to everything else that is ready, so that nothing small waits for more than a part, however many are
/// written at once. Used on one thread.
class WriteTurn {
 public:
  explicit WriteTurn(const net::any_io_executor& executor) : executor_(executor), woken_(executor) {}
  /// Whoever comes next is not kept.
  ~WriteTurn() {
    std::erase(line().waiting, this);
    if (mine_) pass_on();
  }
  WriteTurn(const WriteTurn&) = delete;
  WriteTurn& operator=(const WriteTurn&) = delete;

  /// Bytes that may leave now, in one go: a tenth of a millisecond or two where nobody else waits.
  static std::size_t allowance() {
    const Line& all = line();
    return std::max(least, most / (1 + (all.taken ? 1 : 0) + all.waiting.size()));
  }

  /// Until it is this frame's turn again.
  net::awaitable<void> next() {
    if (line().taken) {
      line().waiting.push_back(this);
      woken_.expires_at(Clock::time_point::max());
      boost::system::error_code ec;
      co_await woken_.async_wait(quietly(ec));
    } else {
      line().taken = mine_ = true;
      co_await net::post(executor_, net::use_awaitable);
    }
    pass_on();
  }

 private:
  static constexpr std::size_t most = 512 << 10, least = 64 << 10;

  struct Line {
    bool taken = false;  ///< somebody's turn comes, behind all that is ready
    std::deque<WriteTurn*> waiting;
  };
  static Line& line() {
    thread_local Line line;
    return line;
  }

  // The next one comes behind all that is ready by now.
  void pass_on() {
    mine_ = false;
    Line& all = line();
    all.taken = !all.waiting.empty();
    if (!all.taken) return;
    WriteTurn* const next = all.waiting.front();
    all.waiting.pop_front();
    next->mine_ = true;
    boost::system::error_code ec;
    next->woken_.cancel(ec);
  }

  net::any_io_executor executor_;
  net::steady_timer woken_;
  bool mine_ = false;  ///< the turn that comes
};

}  // namespace ecorche::server
