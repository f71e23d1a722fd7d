// SPDX-License-Identifier: Apache-2.0
// Boost.Asio 1.74 with coroutines, for gcc 12 and clang 14.
#pragma once

#include <utility>  // Asio 1.74 uses std::exchange without it

// clang 14 has the coroutines of C++20; Asio 1.74 looks only for its experimental ones.
#if defined(__clang__) && defined(__cpp_impl_coroutine) && !defined(BOOST_ASIO_HAS_CO_AWAIT)
#define BOOST_ASIO_HAS_CO_AWAIT 1
#define BOOST_ASIO_HAS_STD_COROUTINE 1
#endif

#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <chrono>

namespace ecorche::server {

namespace net = boost::asio;
using net::ip::tcp;
using Clock = std::chrono::steady_clock;

/// Waits without throwing: `ec` tells how it ended.
inline auto quietly(boost::system::error_code& ec) {
  return net::redirect_error(net::use_awaitable, ec);
}

/// `seconds` as a duration of the clock.
inline Clock::duration duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// `time` in seconds.
inline double seconds(Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace ecorche::server
