// SPDX-License-Identifier: Apache-2.0
#include "bench/server/crowd.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>

#include <ecorche/wire/convert.hpp>
#include "bench/server/crowd_member.hpp"
#include "bench/server/walking.hpp"

namespace ecorche::bench {
namespace {

constexpr std::size_t kScratch = 256 << 10;  // stays in the second-level cache
void append_varint(std::string& out, std::uint64_t value) {
  for (; value >= 128; value >>= 7) out.push_back(static_cast<char>(value | 128));
  out.push_back(static_cast<char>(value));
}

}  // namespace

void Arrived::add(const Arrived& other) {
  const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(ms, other.ms);
  append(posed_ms, other.posed_ms);
  append(encoded_ms, other.encoded_ms);
  append(judged_ago, other.judged_ago);
  frames += other.frames;
  sent += other.sent;
  unseen += other.unseen;
  bytes += other.bytes;
  checked += other.checked;
  wrong += other.wrong;
  unjudged += other.unjudged;
  if (!other.error.empty()) error = other.error;
}

Crowd::Crowd(const wire::Address& address, std::shared_ptr<const Model> model)
    : address_(address), scratch_(kScratch), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  prctl(PR_SET_TIMERSLACK, 1);  // ns: poses leave when they are due
  client::Client client(address, "bench");
  v1::Envelope open;
  open.mutable_open_model()->set_without_triangles(true);
  opened_ = client.call(open).envelope.model_opened();
  if (const Status status = wire::from_proto(opened_.skeleton(), rig_); !status.ok())
    throw refused(status.message);
  for (std::size_t k = 0; k < kStride; ++k) {
    v1::PoseUpdate update;
    update.set_rig_digest(opened_.rig_digest());
    wire::to_proto(walking(rig_, static_cast<double>(k) / kStride), update);
    update.clear_root_translation();
    strides_.push_back(update.SerializeAsString());
  }
  if (!model) return;
  poser_ = std::make_unique<runtime::BodyPoser>(std::move(model));
  body_ = poser_->make_frame();
}

Crowd::~Crowd() {
  for (const auto& member : members_) {
    if (member && member->fd >= 0) close(member->fd);
  }
  close(epoll_);
}

// Whole tissues, largest first, up to `vertices` together.
std::size_t Crowd::tissues_of(std::size_t vertices, v1::MeshSelection& mesh) const {
  std::vector<int> order(static_cast<std::size_t>(opened_.tissues_size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return opened_.tissues(a).vertices() > opened_.tissues(b).vertices();
  });
  std::size_t total = 0;
  for (const int row : order) {
    const auto size = static_cast<std::size_t>(opened_.tissues(row).vertices());
    if (vertices != 0 && total + size > vertices + vertices / 50) continue;
    total += size;
    mesh.add_tissues(opened_.tissues(row).name());
  }
  return total;
}

std::size_t Crowd::join(const ClientOptions& options) {
  auto member = std::make_unique<Member>();
  member->options = options;
  member->fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(address_.port);
  inet_pton(AF_INET, address_.host.c_str(), &to.sin_addr);
  if (member->fd < 0 || connect(member->fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0)
    throw refused("cannot connect (raise the limit of open files)");
  const int on = 1;
  setsockopt(member->fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);

  v1::Envelope hello, open, subscribe;
  hello.set_request_id(1);
  hello.mutable_client_hello()->set_protocol_min(1);
  hello.mutable_client_hello()->set_protocol_max(1);
  for (const v1::Encoding encoding : {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA})
    hello.mutable_client_hello()->add_encodings(encoding);
  open.set_request_id(2);
  open.mutable_open_model()->set_session(options.session);
  open.mutable_open_model()->set_without_triangles(true);
  subscribe.set_request_id(3);
  v1::MeshSelection& mesh = *subscribe.mutable_subscribe()->mutable_mesh();
  mesh.set_encoding(options.encoding);
  member->vertices = tissues_of(options.vertices, mesh);
  member->say(wire::encode(hello).head + wire::encode(open).head + wire::encode(subscribe).head);

  // Who watches knows when the session's poses were sent.
  for (const auto& other : members_) {
    if (other && !options.session.empty() && other->options.session == options.session)
      member->times = other->times;
  }
  if (!member->times) member->times = std::make_shared<PoseTimes>();
  // Clients do not all pose at the same moment.
  const auto period = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / std::max(options.rate, 1.0)));
  member->due = Clock::now() + std::chrono::milliseconds(200) +
                period * static_cast<int>(members_.size() * 31 % 97) / 97;
  const auto free = std::find(members_.begin(), members_.end(), nullptr);
  const auto number = static_cast<std::size_t>(free - members_.begin());
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u64 = number;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, member->fd, &event);
  if (free == members_.end()) members_.emplace_back();
  members_[number] = std::move(member);
  return number;
}

void Crowd::leave(std::size_t client) {
  if (members_[client]->fd >= 0) close(members_[client]->fd);
  members_[client] = nullptr;
}

std::size_t Crowd::vertices(std::size_t client) const {
  return members_[client]->vertices;
}

void Crowd::begin() {
  for (const auto& member : members_) {
    if (member) member->arrived = {};
  }
  begun_ = Clock::now();
}

const Arrived& Crowd::arrived(std::size_t client) const {
  return members_[client]->arrived;
}

double Crowd::posed() const {
  double fewest = 1e9;
  for (const auto& member : members_) {
    if (member && member->options.rate > 0)
      fewest = std::min(fewest, static_cast<double>(member->arrived.sent) / seconds());
  }
  return fewest;
}

double Crowd::seconds() const {
  return std::chrono::duration<double>(ended_ - begun_).count();
}

void Crowd::fail(Member& member, const std::string& why) {
  member.arrived.error = why;
  close(member.fd);
  member.fd = -1;
}

void Crowd::run(double seconds, const std::function<void()>& tick) {
  const auto end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  auto next_tick = Clock::now();
  std::array<epoll_event, 64> events{};
  while (true) {
    auto now = Clock::now();
    if (now >= end) {
      ended_ = now;
      return;
    }
    if (tick && now >= next_tick) {
      next_tick += std::chrono::milliseconds(100);
      tick();
    }
    auto until = tick ? std::min(end, next_tick) : end;
    for (const auto& member : members_) {
      if (!member || member->fd < 0 || member->options.rate <= 0) continue;
      if (member->due <= now) pose(*member);
      until = std::min(until, member->due);
    }
    const auto wait = std::max(std::chrono::nanoseconds(0), std::chrono::nanoseconds(until - Clock::now()));
    timespec timeout{};
    timeout.tv_sec = wait.count() / 1'000'000'000;
    timeout.tv_nsec = wait.count() % 1'000'000'000;
    const int ready = epoll_pwait2(epoll_, events.data(), static_cast<int>(events.size()), &timeout, nullptr);
    for (int i = 0; i < ready; ++i) take(*members_[events[static_cast<std::size_t>(i)].data.u64]);
  }
}

// Where the walk has come to.
Eigen::Vector3d Crowd::place_of(const ClientOptions& options, std::uint64_t sequence) const {
  Eigen::Vector3d place = walking(rig_, static_cast<double>(sequence) / kStride).root_translation;
  if (options.on_the_spot) place[1] = 0;
  return place;
}

// The whole pose: the turns as they were encoded once, then what differs, which Protobuf merges.
void Crowd::pose(Member& member) {
  const auto now = Clock::now();
  const auto period = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / member.options.rate));
  member.due += period;
  // Who is late keeps its place between the others: else all would pose at one moment after a pause.
  if (member.due < now) member.due += period * ((now - member.due) / period + 1);
  v1::PoseUpdate rest;
  rest.set_sequence(++member.sequence);
  const Eigen::Vector3d place = place_of(member.options, member.sequence);
  rest.mutable_root_translation()->set_x(place[0]);
  rest.mutable_root_translation()->set_y(place[1]);
  rest.mutable_root_translation()->set_z(place[2]);
  const std::string& turns = strides_[member.sequence % kStride];
  const std::string more = rest.SerializeAsString();
  std::string frame(8, '\0');
  append_varint(frame, v1::Envelope::kPoseUpdateFieldNumber << 3 | 2);
  append_varint(frame, turns.size() + more.size());
  frame += turns;
  frame += more;
  const auto bytes = static_cast<std::uint32_t>(frame.size() - 8);
  std::memcpy(frame.data(), &bytes, 4);
  frame.resize(wire::aligned(frame.size()), '\0');
  ++member.arrived.sent;
  member.times->note(member.sequence, now);
  member.say(frame);
}

}  // namespace ecorche::bench
