// SPDX-License-Identifier: Apache-2.0
// From a worker to the I/O thread, also where there is no memory.
#pragma once

#include <memory>
#include <new>
#include <thread>
#include <type_traits>
#include <utility>

#include "runtime/server/net/asio.hpp"

namespace ecorche::server {

/// Again and again, until there is memory for it: a worker that has something to tell can do nothing else.
template <class Attempt>
void until_memory(Attempt&& attempt) {
  while (true) {
    try {
      return attempt();
    } catch (const std::bad_alloc&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
}

/// Has `work` run on the I/O thread, and what it holds ended there. Throws nothing, and loses nothing: what
/// is not told would keep a session busy for good.
template <class Work>
void post_back(net::io_context& io, Work work) {
  static_assert(std::is_nothrow_move_constructible_v<Work>, "half of it would be gone at the next try");
  std::shared_ptr<Work> held;
  until_memory([&] { held = std::make_shared<Work>(std::move(work)); });
  until_memory([&] {
    net::post(io, [held] {
      Work here = std::move(*held);
      here();
    });
  });
}

}  // namespace ecorche::server
