// SPDX-License-Identifier: Apache-2.0
// One client of a crowd: its socket, and what has come of the present frame.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <utility>

#include <ecorche/values/error.hpp>
#include "bench/server/crowd.hpp"

namespace ecorche::bench {

constexpr std::size_t kStride = 90;  ///< poses of the stride, one a 90th of a second

inline Error refused(const std::string& what) {
  return Error(ErrorKind::temporary, "bench", what, "see the server");
}

/// When the last poses of a session were sent.
class PoseTimes {
 public:
  void note(std::uint64_t sequence, Clock::time_point now) { at_[sequence % kRemembered] = {sequence, now}; }
  const Clock::time_point* find(std::uint64_t sequence) const {
    const auto& entry = at_[sequence % kRemembered];
    return entry.first == sequence && sequence > 0 ? &entry.second : nullptr;
  }

 private:
  static constexpr std::size_t kRemembered = 1024;
  std::array<std::pair<std::uint64_t, Clock::time_point>, kRemembered> at_{};
};

struct Crowd::Held {
  v1::MeshFrame frame;
  wire::Payload payload;
};

struct Crowd::Member {
  ClientOptions options;
  int fd = -1;
  std::size_t vertices = 0;
  std::uint64_t sequence = 0;
  Clock::time_point due{};
  std::shared_ptr<PoseTimes> times;
  std::string head;            // of the present frame, as far as it came
  std::size_t head_bytes = 0;  // 0: not known yet
  std::uint32_t envelope_bytes = 0;
  std::size_t payload_left = 0, payload_bytes = 0;
  bool keeps = false;  // the present frame's payload
  wire::Payload payload;
  v1::Envelope envelope;
  std::vector<Held> held;  // to be checked
  wire::MeshDecoder decoder;
  std::vector<wire::DecodedTissue> decoded;
  std::uint64_t seen = 0;
  std::uint64_t last = 0;  // pose of the last frame
  Arrived arrived;

  void say(const std::string& bytes) const {
    // Small and rare beside what the socket's buffer holds.
    if (send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(bytes.size()) &&
        errno != EPIPE && errno != ECONNRESET)
      throw refused("the server does not read");
  }
};

}  // namespace ecorche::bench
