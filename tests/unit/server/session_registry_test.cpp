// SPDX-License-Identifier: Apache-2.0
// What clients that come and go leave behind, without a server.
#include "runtime/server/registry/session_registry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <set>
#include <thread>
#include <utility>

#include "runtime/server/net/tls.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::server {
namespace {

class GuestMember final : public Member {
 public:
  std::set<std::uint32_t> shown;  // subscriptions

 private:
  bool deliver(const PosedFrame& frame) override {
    shown.insert(frame.subscription);
    return true;
  }
  std::uint32_t ask_level(std::uint32_t, std::uint32_t finest, std::uint32_t, bool) override {
    return finest;
  }
  void pose_done(const PoseOutcome&, const Skipped&) override {}
  void control_changed(v1::Role, bool, double) override {}
  void model_changed(std::uint64_t) override {}
};

struct Open {
  explicit Open(const Limits& limits, int threads = 1, const std::filesystem::path& records = {})
      : workers(threads, [](const Job& job) { job(); }),
        registry(io, workers, options(limits, records),
                 {{"toy", std::make_shared<const Model>(test::toy_model())}}, {}) {}
  ~Open() { registry.stop(); }

  static Options options(const Limits& limits, const std::filesystem::path& records) {
    Options out;
    out.limits = limits;
    out.record_folder = records;
    return out;
  }
  // Null where there is no room.
  std::shared_ptr<Session> open(const std::string& name = {}) {
    v1::OpenModel request;
    request.set_session(name);
    std::shared_ptr<Session> session;
    const Status status = registry.open(request, {}, session);
    EXPECT_TRUE(status.ok() || status.code == StatusCode::resource_exhausted) << status.message;
    return session;
  }
  // Opened and left again; may be come back to.
  std::weak_ptr<Session> leave(const std::string& name = {}) {
    GuestMember guest;
    const auto session = open(name);
    if (!session) return {};
    session->join(guest);
    session->leave(guest, true);
    return session;
  }

  net::io_context io;
  Workers workers;
  SessionRegistry registry;
};

// As many as there may be connections; the oldest make way.
TEST(SessionRegistry, KeepsFewPlacesOfThoseWhoComeAndGo) {
  Limits limits;
  limits.connections = 3;
  Open open(limits);
  GuestMember guest;
  const auto session = open.open("shared");
  session->join(guest);
  for (const char* token : {"z", "y", "a", "b", "c"}) {
    open.registry.left(token, SavedPlace{.session = session, .subscriptions = {}, .controlled = false});
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_FALSE(open.registry.find_place("z"));
  EXPECT_FALSE(open.registry.find_place("y"));
  for (const char* token : {"a", "b", "c"}) EXPECT_TRUE(open.registry.find_place(token)) << token;
  open.registry.forget("c");
  EXPECT_FALSE(open.registry.find_place("c"));
  session->leave(guest, false);
}

// Sessions that only wait for somebody to come back make way for who is there: those without a name first,
// the oldest first.
TEST(SessionRegistry, WhoLeavesSessionsBehindKeepsNobodyOut) {
  Limits limits;
  limits.sessions = 4;
  Open open(limits);
  GuestMember guest;
  const auto used = open.open("used");
  used->join(guest);
  const auto wait = [] { std::this_thread::sleep_for(std::chrono::milliseconds(2)); };
  const auto named = open.leave("older");
  wait();
  const auto later = open.leave("newer");
  wait();
  const auto unnamed = open.leave();
  EXPECT_FALSE(named.expired() || later.expired() || unnamed.expired());
  std::vector<std::shared_ptr<Session>> others;
  const auto come = [&] {
    others.push_back(open.open());
    if (others.back()) others.back()->join(guest);
    return others.back() != nullptr;
  };
  EXPECT_TRUE(come());
  EXPECT_TRUE(unnamed.expired());
  EXPECT_FALSE(named.expired() || later.expired());
  EXPECT_TRUE(come());
  EXPECT_TRUE(named.expired());
  EXPECT_FALSE(later.expired());
  EXPECT_TRUE(come());
  EXPECT_TRUE(later.expired());
  EXPECT_FALSE(come()) << "all are in use";
  for (const auto& session : others) {
    if (session) session->leave(guest, false);
  }
  used->leave(guest, false);
}

// The end of the server is that of every session's volumes.
TEST(SessionRegistry, WhoStopsMakesNoVolumes) {
  Open open(Limits{});
  GuestMember guest;
  const auto session = open.open("body");
  session->join(guest);
  const auto see = [&](const StreamSpec& spec) {
    return session->subscribe(guest, {.id = 0, .spec = spec, .request = {}})->id;
  };
  const auto run_until = [&](auto&& done) {
    for (int i = 0; i < 2000 && !done(); ++i) {
      open.io.restart();
      open.io.run_for(std::chrono::milliseconds(5));
    }
  };
  const std::uint32_t first = see(VolumeSpec{});
  run_until([&] { return guest.shown.contains(first); });
  EXPECT_TRUE(guest.shown.contains(first));
  open.registry.stop();
  VolumeSpec another;
  another.compressed = true;
  MeshSpec mesh;
  mesh.tissues = {0};
  const std::uint32_t second = see(another), third = see(mesh);
  run_until([&] { return guest.shown.contains(third); });
  for (int i = 0; i < 20; ++i) run_until([count = 0]() mutable { return ++count > 1; });
  EXPECT_EQ(guest.shown, (std::set{first, third})) << second;
  session->leave(guest, false);
}

// A recording that has ended has its name until it is written: the next one of that name could not be ended.
TEST(SessionRegistry, ARecordingsNameIsTakenUntilItIsWritten) {
  const auto folder = std::filesystem::temp_directory_path() / ("ecorche_ends_" + random_token());
  std::filesystem::create_directories(folder);
  {
    Open open({}, 1, folder);
    const auto session = open.open("body");
    const auto other = open.open("other");
    Recordings& recordings = open.registry.recordings();
    EXPECT_TRUE(recordings.begin(*session, "bow", {}).ok());
    PoseRequest pose;
    pose.sequence = 1;
    pose.pose = Pose::rest(session->model()->model().segment_count());
    session->recorder().recording()->add(pose);
    bool written = false;
    recordings.finish(*session, [&](const Status& status) { written = status.ok(); });
    EXPECT_EQ(recordings.begin(*other, "bow", {}).code, StatusCode::already_exists);
    EXPECT_TRUE(recordings.begin(*other, "nod", {}).ok());
    for (int i = 0; i < 2000 && !written; ++i) open.io.run_for(std::chrono::milliseconds(5));
    EXPECT_TRUE(written);
    EXPECT_EQ(recordings.begin(*session, "bow", {}).code, StatusCode::already_exists) << "a file has it now";
    EXPECT_TRUE(recordings.begin(*session, "sway", {}).ok());
  }
  std::filesystem::remove_all(folder);
}

// However much is asked beside the poses, and however long it takes, a worker is left for them.
TEST(SessionRegistry, WhatIsAskedBesideLeavesAWorkerToPoses) {
  for (const int threads : {1, 2, 3}) {
    SCOPED_TRACE(threads);
    Open open({}, threads);
    open.workers.drain();
    std::atomic<bool> go_on = false, posed = false;
    std::atomic<int> begun = 0;
    int done = 0;
    constexpr int kAsked = 7;
    for (int i = 0; i < kAsked; ++i) {
      open.registry.executor().run_request(
          [&] {
            ++begun;
            while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
          },
          [&] { ++done; });
    }
    const auto wait_for = [](auto&& what) {
      for (int i = 0; i < 5000 && !what(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return what();
    };
    const int most = std::max(threads - 1, 1);
    EXPECT_TRUE(wait_for([&] { return begun == most; }));
    open.workers.submit([&] { posed = true; });
    if (threads > 1) {
      EXPECT_TRUE(wait_for([&] { return posed.load(); }));
    }
    EXPECT_EQ(begun, most);
    go_on = true;
    open.io.run_for(std::chrono::seconds(5));  // until nothing is under way
    EXPECT_EQ(done, kAsked);
    EXPECT_TRUE(wait_for([&] { return posed.load(); }));
  }
}

}  // namespace
}  // namespace ecorche::server
