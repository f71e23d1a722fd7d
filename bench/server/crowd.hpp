// SPDX-License-Identifier: Apache-2.0
// Many clients on one thread, as light as clients can be: they share the processor with the server.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <ecorche/client/client.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/wire/mesh_decoder.hpp>

namespace ecorche::bench {

using client::Clock;

struct ClientOptions {
  std::size_t vertices = 0;  ///< about so many, of whole tissues; 0: all
  v1::Encoding encoding = v1::ENCODING_U16_DELTA;
  std::string session;       ///< empty: one's own
  double rate = 90;          ///< poses per second; 0: only watches
  bool on_the_spot = false;  ///< walks without getting anywhere: volumes stay within their scan
  /// Every so many frames one is held against offline posing, and every keyframe; 0: none. They are kept
  /// until check(): the client of a user does nothing of the kind.
  std::uint64_t check_each = 0;
};

struct Arrived {
  std::vector<double> ms;  ///< from the pose's sending to the whole frame's arrival, one per frame
  std::vector<double> posed_ms, encoded_ms;  ///< as the server says
  std::vector<double> judged_ago;            ///< poses between a frame's and the one whose quality it tells
  std::uint64_t frames = 0, bytes = 0;
  std::uint64_t sent = 0;    ///< poses
  std::uint64_t unseen = 0;  ///< poses between those of two frames that came one after the other
  std::uint64_t checked = 0, wrong = 0;
  std::uint64_t unjudged = 0;  ///< frames that told no quality
  std::string error;           ///< empty: none

  void add(const Arrived& other);
};

/// Clients that pose, or watch, and note when frames come: one epoll, every frame read to its last byte into
/// memory that stays in the cache, few of them decoded.
class Crowd {
 public:
  /// `model`: what frames are checked against; may be null where none is.
  Crowd(const wire::Address& address, std::shared_ptr<const Model> model);
  ~Crowd();

  /// Joins; returns its number. Throws Error{temporary} where it cannot connect.
  std::size_t join(const ClientOptions& options);
  /// Hangs up, wherever its stream is, and is forgotten.
  void leave(std::size_t client);
  std::size_t vertices(std::size_t client) const;  ///< of a frame

  /// Lives on for so long. `tick` is called ten times a second.
  void run(double seconds, const std::function<void()>& tick = {});
  /// Holds what was kept against offline posing.
  void check();
  /// Forgets what arrived: the figures count from here.
  void begin();
  const Arrived& arrived(std::size_t client) const;
  double posed() const;    ///< poses a second, of who sent fewest
  double seconds() const;  ///< from begin() to the end of the last run()

 private:
  struct Member;
  void take(Member& member);
  void pose(Member& member);
  Eigen::Vector3d place_of(const ClientOptions& options, std::uint64_t sequence) const;
  void finish_head(Member& member);
  void arrive(Member& member);
  struct Held;
  void check(Member& member, const Held& held);
  void fail(Member& member, const std::string& why);
  std::size_t tissues_of(std::size_t vertices, v1::MeshSelection& mesh) const;

  wire::Address address_;
  v1::ModelOpened opened_;
  Rig rig_;
  std::vector<std::string> strides_;  // encoded turns of the joints, of one second at 90 Hz
  std::unique_ptr<runtime::BodyPoser> poser_;
  runtime::PosedBody body_;
  std::vector<std::unique_ptr<Member>> members_;
  std::vector<std::byte> scratch_;
  int epoll_ = -1;
  Clock::time_point begun_ = Clock::now(), ended_ = begun_;
};

}  // namespace ecorche::bench
