// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/link_server.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include <ecorche/io/pose_library.hpp>
#include "runtime/server/listen.hpp"
#include "runtime/server/net/transport.hpp"

namespace ecorche::app::igtl {

namespace net = server::net;
using server::Clock;
using server::quietly;

namespace {

constexpr std::array<std::string_view, 15> kTypes{"TRANSFORM",    "TDATA",     "POLYDATA",   "IMAGE",
                                                  "POINT",        "STRING",    "STATUS",     "CAPABILITY",
                                                  "STT_TDATA",    "STP_TDATA", "GET_TRANS",  "GET_TDATA",
                                                  "GET_POLYDATA", "GET_IMAGE", "GET_CAPABIL"};
const Key kJoints{0, "TDATA", "joints"};
constexpr std::string_view kPosedPoints = "posed_points", kScanPoints = "scan_points";

}  // namespace

LinkServer::LinkServer(const Program& program, const LinkSettings& settings, const Rig& rig,
                       PosedMessages& body, TrackedPose pose)
    : program_(program), settings_(settings), rig_(rig), body_(body), pose_(std::move(pose)) {
  server::start_listening(acceptor_, settings_.listen);
}

std::uint16_t LinkServer::port() const {
  return acceptor_.local_endpoint().port();
}

void LinkServer::run() {
  const std::stop_callback on_stop(program_.stop, [this] { io_.stop(); });
  net::co_spawn(
      io_, [this] { return accept(); }, net::detached);
  io_.run();
  // What is left of their coroutines ends with io_; peers are told nothing more.
}

net::awaitable<void> LinkServer::accept() {
  for (;;) {
    boost::system::error_code ec;
    server::tcp::socket socket = co_await acceptor_.async_accept(quietly(ec));
    if (!ec && clients_.size() < settings_.connections) {
      welcome(std::move(socket));
    } else if (ec) {
      // Out of handles, most likely: some go with the clients that have them.
      accept_timer_.expires_after(std::chrono::milliseconds(100));
      co_await accept_timer_.async_wait(quietly(ec));
    } else {
      program_.note("note: " + server::peer_of(socket) + " was turned away: --max-connections are there");
    }
  }
}

void LinkServer::welcome(server::tcp::socket socket) {
  const auto peer = std::make_shared<Peer>(std::move(socket), settings_.limits);
  const auto client = std::make_shared<Client>(Client{peer, net::steady_timer(io_), std::nullopt});
  clients_.emplace(peer.get(), client);
  program_.note("note: " + peer->name() + " is there");
  peer->start(
      {.heard = [this, client](const Header& header,
                               std::span<const std::byte> content) { heard(client, header, content); },
       .gone =
           [this, key = peer.get()](const std::string& why) {
             program_.note("note: " + key->name() + " is gone: " + why);
             clients_.erase(key);
           }});
  if (!stale_) peer->offer(body_.messages());
  pose_when_due();
}

void LinkServer::heard(const std::shared_ptr<Client>& client, const Header& header,
                       std::span<const std::byte> content) {
  Peer& peer = *client->peer;
  const std::string& type = header.type;
  if (type == "TRANSFORM") {
    heard_transform(peer, header, content);
  } else if (type == "TDATA") {
    heard_tracking(peer, content);
  } else if (type == "POINT") {
    heard_points(peer, header, content);
  } else if (type == "STRING") {
    heard_string(peer, header, content);
  } else if (type == "STT_TDATA") {
    asked_to_track(client, content);
  } else if (type == "STP_TDATA") {
    client->tracking.reset();
    client->tracking_timer.cancel();
    peer.offer({0, "RTS_TDATA", "joints"}, tracking_answer("joints"));
  } else if (type == "GET_CAPABIL") {
    peer.offer({0, "CAPABILITY", "ecorche"}, capability_message("ecorche", kTypes));
  } else if (type == "GET_STATUS") {
    peer.tell(StatusOf::ok, "");
  } else if (type.starts_with("GET_")) {
    // Twelve bytes do not hold GET_TRANSFORM.
    asked_for(peer, type == "GET_TRANS" ? "TRANSFORM" : type.substr(4), header.device);
  } else if (type != "STATUS") {
    peer.tell(StatusOf::unknown_instruction, type + " is not taken");
  }
}

void LinkServer::heard_transform(Peer& peer, const Header& header, std::span<const std::byte> content) {
  const auto at = read_transform(content);
  if (!at)
    peer.tell(StatusOf::config_error, header.device + " is no rigid transform");
  else if (pose_.hear(header.device, *at))
    changed();
  else
    peer.tell(StatusOf::not_found, header.device + " moves nothing: bind it by --joint or --goal");
}

void LinkServer::heard_tracking(Peer& peer, std::span<const std::byte> content) {
  const auto tools = read_tracking(content);
  if (!tools) return peer.tell(StatusOf::config_error, "TDATA is of another size than it says");
  bool moves = false;
  for (const NamedTransform& tool : *tools) moves = pose_.hear(tool.name, tool.at) || moves;
  if (moves)
    changed();
  else
    peer.tell(StatusOf::not_found, "none of the tools moves anything: bind them by --joint or --goal");
}

void LinkServer::heard_points(Peer& peer, const Header& header, std::span<const std::byte> content) {
  const bool to_scan = header.device == kPosedPoints;
  auto points = read_points(content);
  if (!points) return peer.tell(StatusOf::config_error, "POINT is of another size than it says");
  if (!to_scan && header.device != kScanPoints)
    return peer.tell(StatusOf::not_found, "points are taken as posed_points and scan_points");
  // Under other names: a client that shares what it shows would send the answer back.
  const std::string answer = to_scan ? "points_in_scan" : "points_in_pose";
  if (stale_) pose_now();
  peer.offer({0, "POINT", answer}, points_message(answer, body_.probed(std::move(*points), to_scan)));
}

void LinkServer::heard_string(Peer& peer, const Header& header, std::span<const std::byte> content) {
  const auto text = read_string(content);
  if (!text) return peer.tell(StatusOf::config_error, "STRING is of another size than it says");
  if (header.device != "pose") return peer.tell(StatusOf::not_found, "only the STRING pose is taken");
  std::string_view name = *text;
  if (name.starts_with(io::library_prefix)) name.remove_prefix(io::library_prefix.size());
  try {
    pose_.set(name == "rest" ? Pose::rest(rig_.skeleton.segments.size()) : io::library_pose(name, rig_).pose);
  } catch (const Error& error) {
    return peer.tell(StatusOf::not_found, error.what());
  }
  changed();
  peer.tell(StatusOf::ok, "posed as " + std::string(name));
}

void LinkServer::asked_to_track(const std::shared_ptr<Client>& client, std::span<const std::byte> content) {
  const auto resolution = read_tracking_request(content);
  if (!resolution)
    return client->peer->tell(StatusOf::config_error, "STT_TDATA is of another size than it says");
  client->peer->offer({0, "RTS_TDATA", "joints"}, tracking_answer("joints"));
  client->tracking = std::chrono::milliseconds(std::max(*resolution, 0));
  track(client);
}

void LinkServer::asked_for(Peer& peer, const std::string& type, const std::string& device) {
  const bool known = type == "TRANSFORM" || type == "TDATA" || type == "POLYDATA" || type == "IMAGE";
  bool there = false;
  for (const auto& [key, message] : body_.messages()) {
    if (key.type != type || (!device.empty() && key.device != device)) continue;
    peer.offer(key, message);
    there = true;
  }
  there = there || (type == "IMAGE" && body_.makes_image(device));  // it comes by itself
  if (!known)
    peer.tell(StatusOf::unknown_instruction, "GET_" + type + " is not taken");
  else if (!there)
    peer.tell(StatusOf::not_found, "there is no " + type + " " + device);
}

void LinkServer::changed() {
  stale_ = true;
  pose_when_due();
}

void LinkServer::pose_when_due() {
  if (!stale_ || posing_ || clients_.empty()) return;
  posing_ = true;
  pose_timer_.expires_at(posed_ + server::duration(1 / settings_.rate));
  pose_timer_.async_wait([this](const boost::system::error_code& ec) {
    posing_ = false;
    if (!ec && stale_) pose_now();
  });
}

void LinkServer::pose_now() {
  stale_ = false;
  posed_ = Clock::now();
  body_.pose(pose_.pose());
  for (const auto& [_, client] : clients_) {
    for (const auto& [what, message] : body_.messages()) {
      if (what.type == "TRANSFORM" || what.type == "POLYDATA") client->peer->offer(what, message);
    }
    track(client);
  }
  images_when_still();
}

void LinkServer::images_when_still() {
  if (!body_.images_left()) return;
  image_timer_.expires_at(posed_ + server::duration(settings_.rest_seconds));
  image_timer_.async_wait([this](const boost::system::error_code& ec) {
    if (ec || stale_ || !body_.images_left()) return;
    const Key key = body_.pose_image({});
    for (const auto& [_, client] : clients_) client->peer->offer(key, body_.messages().at(key));
    images_when_still();
  });
}

void LinkServer::track(const std::shared_ptr<Client>& client) {
  if (!client->tracking || stale_) return;
  client->tracking_timer.expires_at(client->tracked + *client->tracking);
  client->tracking_timer.async_wait([this, one = std::weak_ptr(client)](const boost::system::error_code& ec) {
    const auto held = one.lock();
    if (ec || !held) return;
    held->tracked = Clock::now();
    held->peer->offer(kJoints, body_.messages().at(kJoints));
  });
}

}  // namespace ecorche::app::igtl
