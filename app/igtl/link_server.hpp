// SPDX-License-Identifier: Apache-2.0
// A body behind OpenIGTLink: what tools say becomes a pose, and every client is sent what it looks like.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "app/igtl/peer.hpp"
#include "app/igtl/posed_messages.hpp"
#include "app/igtl/tracked_pose.hpp"
#include "app/program.hpp"

namespace ecorche::app::igtl {

struct LinkSettings {
  server::tcp::endpoint listen;
  double rate = 30;           ///< poses a second at most
  double rest_seconds = 0.2;  ///< without a new pose until images are made
  std::uint32_t connections = 16;
  PeerLimits limits;
};

/// One thread does all: while a body is posed, what clients say waits, and then its newest counts.
class LinkServer {
 public:
  /// Listens. All that is referred to must live as long. Throws as server::start_listening.
  LinkServer(const Program& program, const LinkSettings& settings, const Rig& rig, PosedMessages& body,
             TrackedPose pose);

  std::uint16_t port() const;
  /// Until the program is stopped.
  void run();

 private:
  struct Client {
    std::shared_ptr<Peer> peer;
    server::net::steady_timer tracking_timer;
    std::optional<server::Clock::duration> tracking;  // between two TDATA; none: it did not ask
    server::Clock::time_point tracked{};
  };

  server::net::awaitable<void> accept();
  void welcome(server::tcp::socket socket);
  void heard(const std::shared_ptr<Client>& client, const Header& header, std::span<const std::byte> content);
  void heard_transform(Peer& peer, const Header& header, std::span<const std::byte> content);
  void heard_tracking(Peer& peer, std::span<const std::byte> content);
  void heard_points(Peer& peer, const Header& header, std::span<const std::byte> content);
  void heard_string(Peer& peer, const Header& header, std::span<const std::byte> content);
  void asked_to_track(const std::shared_ptr<Client>& client, std::span<const std::byte> content);
  void asked_for(Peer& peer, const std::string& type, const std::string& device);

  void changed();
  void pose_now();
  void pose_when_due();
  void images_when_still();
  void track(const std::shared_ptr<Client>& client);

  const Program& program_;
  LinkSettings settings_;
  const Rig& rig_;
  PosedMessages& body_;
  TrackedPose pose_;
  server::net::io_context io_{1};
  server::tcp::acceptor acceptor_{io_};
  server::net::steady_timer pose_timer_{io_}, image_timer_{io_}, accept_timer_{io_};
  std::map<const Peer*, std::shared_ptr<Client>> clients_;
  bool stale_ = true, posing_ = false;
  server::Clock::time_point posed_{};
};

}  // namespace ecorche::app::igtl
