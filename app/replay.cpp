// SPDX-License-Identifier: Apache-2.0
#include "app/replay.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/version.hpp>
#include "core/files/atomic_file.hpp"
#include "proto/recording.hpp"

namespace ecorche::app {
namespace {

using client::Client;
using client::Clock;

constexpr std::size_t kLargest = std::size_t{1} << 30;
constexpr std::chrono::seconds kPatience{30};

// `cut`: its server was killed, or a copy broke off. What is whole of it is played.
wire::RecordedSession read(const std::filesystem::path& file, bool& cut) {
  const std::string bytes = files::read_text(file, kLargest);
  wire::RecordedSession session;
  const Status status = wire::read_recording(std::as_bytes(std::span(bytes)), session);
  cut = status.code == StatusCode::data_loss && !session.steps.empty();
  if (!status.ok() && !cut)
    throw Error(ErrorKind::data, file.string(), status.message, "give a file of ecorche serve --record-dir");
  return session;
}

class Replay {
 public:
  Replay(const Program& program, Client& client, const wire::RecordedSession& session)
      : program_(program), client_(client), session_(session) {
    for (std::size_t at = 0; at < session.steps.size(); ++at) {
      for (const v1::RecordedFrame& frame : session.steps[at].frames) last_step_[frame.subscription()] = at;
    }
  }

  // False where the server's model cannot be compared.
  bool open() {
    v1::Envelope request;
    request.mutable_open_model()->set_model(session_.head.model());
    request.mutable_open_model()->set_without_triangles(true);
    const v1::ModelOpened opened = client_.call(std::move(request)).envelope.model_opened();
    if (opened.identity() == session_.head.identity()) return true;
    program_.note("mismatch: the server's model '" + opened.model() + "' is not the one that was recorded");
    return opened.rig_digest() == session_.head.rig_digest() &&
           opened.topology_digest() == session_.head.topology_digest();
  }

  void play(std::size_t at) {
    const wire::RecordedStep& step = session_.steps[at];
    std::map<std::uint32_t, std::uint64_t> expected;
    for (const v1::RecordedFrame& frame : step.frames) {
      subscribe(frame.subscription());
      expected[frame.subscription()] = frame.digest();
    }
    v1::Envelope update;
    *update.mutable_pose_update() = step.pose;
    // As the session counted them, the first might be farther on than a server lets a pose be.
    update.mutable_pose_update()->set_sequence(at + 1);
    client_.send(update);
    const auto until = Clock::now() + kPatience;
    bool acknowledged = false;
    while (!acknowledged || !expected.empty()) {
      program_.context("replay").check_stop();
      const auto frame = client_.receive(until);
      if (!frame) {
        throw Error(ErrorKind::temporary, "replay",
                    "the frames of pose " + std::to_string(step.pose.sequence()) + " did not come",
                    "see the server's log");
      }
      const v1::Envelope& envelope = frame->envelope;
      if (envelope.has_pose_ack()) {
        if (envelope.pose_ack().status().code() != 0)
          throw client::ServerError("pose", envelope.pose_ack().status());
        acknowledged = true;
      } else if (envelope.has_mesh_frame()) {
        compare(envelope.mesh_frame(), frame->payload, at, expected);
      } else if (envelope.has_volume_frame()) {
        compare(envelope.volume_frame(), frame->payload, at, expected);
      }
    }
    unsubscribe_finished(at);
  }

  std::uint64_t frames() const { return frames_; }
  std::uint64_t mismatches() const { return mismatches_; }

 private:
  void subscribe(std::uint32_t was) {
    if (!subscribed_.insert(was).second) return;
    v1::Envelope request;
    *request.mutable_subscribe() = session_.subscriptions.at(was);
    request.mutable_subscribe()->set_max_rate(0);  // every pose
    now_[client_.call(std::move(request)).envelope.subscribed().subscription()].push_back(was);
  }

  // What has no frame after this step: a server allows so many subscriptions at a time, and a session may
  // have seen any number come and go.
  void unsubscribe_finished(std::size_t at) {
    for (auto subscription = now_.begin(); subscription != now_.end();) {
      std::erase_if(subscription->second, [&](std::uint32_t was) { return last_step_[was] <= at; });
      if (!subscription->second.empty()) {
        ++subscription;
        continue;
      }
      v1::Envelope request;
      request.mutable_unsubscribe()->set_subscription(subscription->first);
      client_.call(std::move(request));
      subscription = now_.erase(subscription);
    }
  }

  template <class Frame>
  void compare(const Frame& frame, const wire::Payload& payload, std::size_t at,
               std::map<std::uint32_t, std::uint64_t>& expected) {
    const auto subscription = now_.find(frame.subscription());
    if (frame.pose_sequence() != at + 1 || subscription == now_.end()) return;
    for (const std::uint32_t was : subscription->second) {
      const auto recorded = expected.find(was);
      if (recorded == expected.end()) continue;
      ++frames_;
      if (wire::payload_digest(payload) != recorded->second && ++mismatches_ <= 5) {
        program_.note("mismatch: pose " + std::to_string(session_.steps[at].pose.sequence()) +
                      ", subscription " + std::to_string(was));
      }
      expected.erase(recorded);
    }
  }

  const Program& program_;
  Client& client_;
  const wire::RecordedSession& session_;
  std::map<std::uint32_t, std::size_t> last_step_;  // with a frame of it, by recorded number
  std::set<std::uint32_t> subscribed_;              // recorded numbers
  // Recorded numbers by present ones: several where only the rates differed.
  std::map<std::uint32_t, std::vector<std::uint32_t>> now_;
  std::uint64_t frames_ = 0, mismatches_ = 0;
};

}  // namespace

int replay(const Program& program, const std::filesystem::path& file, const wire::Address& address,
           const client::Access& access) {
  bool cut = false;
  const wire::RecordedSession session = read(file, cut);
  Client client(address, std::string("ecorche stream ") + ECORCHE_VERSION, access);
  Replay replay(program, client, session);
  const bool comparable = replay.open();
  for (std::size_t at = 0; comparable && at < session.steps.size(); ++at) replay.play(at);
  const bool same = comparable && replay.mismatches() == 0;
  program.result(
      std::to_string(session.steps.size()) + " poses, " + std::to_string(replay.frames()) +
          " frames compared: " + std::to_string(replay.mismatches()) + " mismatches" +
          (session.full ? "; the recording was cut at the server's limit" : "") +
          (cut ? "; the recording has no end: its server was killed, or the copy is not whole" : ""),
      {{"poses", session.steps.size()},
       {"frames", replay.frames()},
       {"mismatches", comparable ? replay.mismatches() : 1},
       {"cut", session.full || cut}});
  return same ? 0 : 1;
}

}  // namespace ecorche::app
