// SPDX-License-Identifier: Apache-2.0
// What the I/O thread still has where there is no more memory.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <utility>

namespace ecorche::server {

/// Memory put by for the thread that makes it, in pieces. Where that thread finds none, operator new is given
/// a piece and tries again, by way of std::set_new_handler; so nothing fails there but what may (MayFail).
/// Asio needs this: an operation that finds no memory ends the process (it begins in a function that is
/// noexcept), and so does the end of a coroutine; and whoever accepts, or looks after deadlines, must not
/// end. One connection's operations take a few hundred bytes, its coroutines some KiB, both given back soon.
///
/// Other threads, which catch what they cannot have, see nothing of it.
class Reserve {
 public:
  static constexpr std::size_t pieces = 128, piece_bytes = 16 << 10;

  Reserve();
  ~Reserve();
  Reserve(const Reserve&) = delete;
  Reserve& operator=(const Reserve&) = delete;

  /// Puts by what was used; how many pieces that is, as far as there is memory again.
  std::size_t refill() noexcept;

  /// Called by operator new.
  static void make_room();

 private:
  bool give() noexcept;

  // Not so large that the C library would ask the system for each: what is let go of stays this thread's.
  using Piece = std::array<std::byte, piece_bytes>;
  std::array<std::unique_ptr<Piece>, pieces> kept_;
  std::size_t count_ = 0;
};

/// While it lives, what this thread asks for may fail, by std::bad_alloc, and somebody catches that; or, with
/// MustNotFail, may not after all.
class MayFail {
 public:
  explicit MayFail(bool may = true) : before_(std::exchange(flag(), may)) {}
  ~MayFail() { flag() = before_; }
  MayFail(const MayFail&) = delete;
  MayFail& operator=(const MayFail&) = delete;

  static bool& flag() {
    thread_local bool may = false;
    return may;
  }

 private:
  bool before_;
};

struct MustNotFail : MayFail {
  MustNotFail() : MayFail(false) {}
};

}  // namespace ecorche::server
