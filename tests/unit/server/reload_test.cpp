// SPDX-License-Identifier: Apache-2.0
// Models read again, while they and others are shown.
#include <atomic>

#include "tests/support/toy_model.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

v1::Envelope reload(const std::string& name) {
  v1::Envelope envelope;
  envelope.mutable_reload_model()->set_model(name);
  return envelope;
}

TEST(Reload, AnotherFileIsServedAndTheOldSessionsGoOn) {
  TestServer server;
  TestClient client(server, "shared"), twin(server);
  client.subscribe_mesh();
  client.next_mesh(0);
  client.client().call(reload("toy"));  // the same file: nobody is told
  EXPECT_FALSE(client.client().receive(client::Clock::now() + std::chrono::milliseconds(100)));

  auto changed = std::make_shared<Model>(test::toy_model());
  changed->tissues[0].V.array() += 1e-3;
  changed->rig.skeleton.segments[1].joint.center.x() += 1;
  server.reads([changed] { return ModelParts{changed}; });
  twin.client().call(reload("toy"));
  const std::uint64_t identity = client.next([](const v1::Envelope& e) { return e.has_model_changed(); })
                                     .envelope.model_changed()
                                     .identity();
  EXPECT_NE(identity, client.opened().identity());
  client.send(1, client.bent(0.3));  // the old one, still
  client.next_mesh(1);

  v1::Envelope open;
  open.mutable_open_model()->set_model("toy");
  open.mutable_open_model()->set_session("shared");
  const v1::ModelOpened opened = client.client().call(open).envelope.model_opened();
  EXPECT_EQ(opened.identity(), identity);
  EXPECT_EQ(opened.role(), v1::ROLE_CONTROLLER);
  EXPECT_EQ(error_of_call(client.client(), open), ErrorKind::protocol);  // once
}

TEST(Reload, WhatCannotBeReadChangesNothing) {
  TestServer server;
  TestClient client(server);
  EXPECT_EQ(error_of_call(client.client(), reload("nobody")), ErrorKind::usage);
  EXPECT_EQ(error_of_call(client.client(), reload("twin")), ErrorKind::protocol);
  server.reads([]() -> ModelParts { throw Error(ErrorKind::data, "toy.hdf", "is cut", "copy it again"); });
  EXPECT_NE(error_of_call(client.client(), reload("toy")), ErrorKind::internal);
  client.subscribe_mesh();
  client.send(1, client.bent(0.3));
  client.next_mesh(1);
}

// The toy, a little different each time.
std::shared_ptr<const Model> another(int which) {
  auto model = std::make_shared<Model>(test::toy_model());
  model->tissues[0].V.array() += 1e-3F * static_cast<float>(which);
  model->rig.skeleton.segments[1].joint.center.x() += which;
  return model;
}

bool changed(const v1::Envelope& envelope) {
  return envelope.has_model_changed();
}

v1::Envelope open_model(const std::string& model) {
  v1::Envelope envelope;
  envelope.mutable_open_model()->set_model(model);
  return envelope;
}

// What is being read when the second wish comes may be older than it: all is read once more.
TEST(Reload, AWishThatComesMeanwhileIsKept) {
  TestServer server;
  std::atomic<int> reads = 0;
  std::atomic<bool> go_on = false;
  server.reads([&reads, &go_on] {
    const int which = ++reads;
    while (which == 1 && !go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return ModelParts{another(which)};
  });
  std::atomic<int> first_after = 0, others_after = 0, others = 0;
  server.reload([&] { first_after = reads.load(); });
  while (reads == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (int i = 0; i < 2; ++i) {
    server.reload([&] {
      others_after = reads.load();
      ++others;
    });
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(others, 0) << "nothing was read since";
  go_on = true;
  for (int i = 0; i < 5000 && others < 2; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(first_after, 1);
  EXPECT_EQ(others, 2);
  EXPECT_EQ(others_after, 2) << "once for both";
}

// While one model is read, however long that takes, frames of all go on, nobody is dropped, and only those
// who have it open are told.
TEST(Reload, OthersStreamOnAndAreNotTold) {
  TestServer server;
  client::Client twin(server.address(), "test"), asks(server.address(), "test");
  const v1::ModelOpened opened = twin.call(open_model("twin")).envelope.model_opened();
  asks.call(open_model("twin"));
  v1::Envelope mesh;
  mesh.mutable_subscribe()->mutable_mesh();
  twin.call(mesh);
  TestClient toy(server), idle(server, "idle");
  toy.subscribe_mesh();
  std::atomic<bool> reading = false, go_on = false;
  server.reads([&] {
    reading = true;
    while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return ModelParts{another(1)};
  });
  v1::Envelope request = reload("toy");
  request.set_request_id(900);
  asks.send(request);
  while (!reading) std::this_thread::sleep_for(std::chrono::milliseconds(1));

  std::uint64_t sequence = 0;
  const auto both_move = [&](int poses) {
    for (int i = 0; i < poses; ++i) {
      ++sequence;
      const Pose pose = toy.bent(0.01 * static_cast<double>(sequence));
      v1::Envelope update = toy.update(sequence, pose);
      update.mutable_pose_update()->set_rig_digest(opened.rig_digest());
      twin.send(update);
      toy.send(sequence, pose);
      const wire::Frame shown = toy.next_mesh(sequence);
      const auto until = client::Clock::now() + std::chrono::seconds(20);
      while (const auto frame = twin.receive(until)) {
        EXPECT_FALSE(changed(frame->envelope)) << "not its model";
        if (frame->envelope.mesh_frame().pose_sequence() != sequence) continue;
        EXPECT_EQ(frame->payload, shown.payload);  // the same body, the same pose
        break;
      }
    }
  };
  both_move(20);
  EXPECT_EQ(error_of_call(twin, reload("toy")), ErrorKind::temporary) << "one at a time";
  go_on = true;
  idle.next(changed);
  both_move(20);  // the old one, still
  // Who opens now gets the new one; twin is what it was.
  TestClient late(server);
  EXPECT_NE(late.opened().identity(), toy.opened().identity());
  client::Client later(server.address(), "test");
  EXPECT_EQ(later.call(open_model("twin")).envelope.model_opened().identity(), opened.identity());
}

// Again and again: each model goes with the last who looks at it, or memory would fill.
TEST(Reload, AModelGoesWithItsLastSession) {
  TestServer server;
  client::Client asks(server.address(), "test");
  asks.call(open_model("twin"));
  std::vector<std::weak_ptr<const Model>> models;
  std::vector<std::unique_ptr<TestClient>> clients;
  for (int which = 1; which <= 4; ++which) {
    std::shared_ptr<const Model> model = another(which);
    models.push_back(model);
    server.reads([model = std::move(model)] { return ModelParts{model}; });
    asks.call(reload("toy"));
    clients.push_back(std::make_unique<TestClient>(server));
    clients.back()->subscribe_mesh();
    clients.back()->next_mesh(0);
  }
  server.reads([] { return ModelParts{another(9)}; });
  asks.call(reload("toy"));
  const auto gone = [&](std::size_t which) {
    for (int i = 0; i < 1000 && !models[which].expired(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return models[which].expired();
  };
  for (const auto& model : models) EXPECT_FALSE(model.expired());
  clients[1].reset();
  EXPECT_TRUE(gone(1));
  clients[0]->client().call(open_model("toy"));  // goes on with the newest
  EXPECT_TRUE(gone(0));
  // The others have seen nothing of it.
  for (const int which : {2, 3}) {
    TestClient& client = *clients[static_cast<std::size_t>(which)];
    EXPECT_FALSE(models[static_cast<std::size_t>(which)].expired());
    client.send(1, client.bent(0.2));
    client.next_mesh(1);
  }
}

// A place that is waited for ends with its model: who comes back opens anew.
TEST(Reload, APlaceOfTheModelThatWasIsNotComeBackTo) {
  TestServer server;
  client::Access access;
  {
    TestClient client(server, "shared");
    client.subscribe_mesh();
    client.next_mesh(0);
    access.resume_token = client.client().server().resume_token();
  }
  server.reads([] { return ModelParts{another(1)}; });
  client::Client asks(server.address(), "test");
  asks.call(open_model("twin"));
  asks.call(reload("toy"));
  client::Client back(server.address(), "test", access);
  EXPECT_FALSE(back.server().has_resumed());
  v1::Envelope again = open_model("toy");
  again.mutable_open_model()->set_session("shared");
  EXPECT_EQ(back.call(again).envelope.model_opened().role(), v1::ROLE_CONTROLLER);
}

// Who may, and what is told of the file.
TEST(Reload, IsForWhoControlsASession) {
  TestServer server;
  client::Client stranger(server.address(), "test");
  EXPECT_EQ(error_of_call(stranger, reload("toy")), ErrorKind::protocol);  // FAILED_PRECONDITION
  TestClient holder(server, "shared"), observer(server, "shared");
  EXPECT_EQ(error_of_call(observer.client(), reload("toy")), ErrorKind::refused);
  server.reads([]() -> ModelParts {
    throw Error(ErrorKind::data, "/home/somebody/toy.hdf", "is cut", "copy it again");
  });
  v1::Envelope request = reload("toy");
  request.set_request_id(900);
  holder.client().send(request);
  const v1::Status told =
      holder.next([](const v1::Envelope& e) { return e.request_id() == 900; }).envelope.status();
  EXPECT_EQ(told.code(), static_cast<std::uint32_t>(StatusCode::invalid_argument));
  EXPECT_EQ(told.message(), "reload: cannot read model 'toy' (ask who runs the server: its log says why)");
}

// Clips are read with their model, also where that is what it was.
TEST(Reload, NewMotionOfTheSameModelIsTakenUp) {
  TestServer server;
  TestClient client(server);
  v1::Envelope list;
  list.mutable_list_clips();
  EXPECT_EQ(client.client().call(list).envelope.clip_list().clips_size(), 1);
  Clip bow = turning_clip(server.model());
  bow.name = "bow";
  server.reads([&] {
    return ModelParts{std::make_shared<const Model>(server.model()), {turning_clip(server.model()), bow}};
  });
  client.client().call(reload("toy"));
  const v1::ClipList clips = client.client().call(list).envelope.clip_list();
  ASSERT_EQ(clips.clips_size(), 2);
  EXPECT_EQ(clips.clips(1).name(), "bow");
}

// Giving back what a model holds takes longer than a frame.
TEST(Reload, ModelsDoNotGoOnTheThreadThatServes) {
  std::atomic<std::thread::id> serves{};
  std::atomic<int> gone = 0, gone_there = 0;  // the last model goes with the server
  TestServer server(Options{}, {.transport = {}, .timer_fails = {}, .handling = [&](bool) {
                                  if (serves.load() == std::thread::id{}) serves = std::this_thread::get_id();
                                }});
  client::Client asks(server.address(), "test");
  asks.call(open_model("twin"));
  const auto watched = [&](std::shared_ptr<const Model> model) {
    const Model* const body = model.get();
    return std::shared_ptr<const Model>(body, [&, model = std::move(model)](const Model*) mutable {
      ++gone;
      if (std::this_thread::get_id() == serves.load()) ++gone_there;
    });
  };
  const auto read = [&](const std::shared_ptr<const Model>& model) {
    server.reads([&, model] { return ModelParts{watched(model)}; });
    asks.call(reload("toy"));
  };
  const auto wait_for = [&](int count) {
    for (int i = 0; i < 2000 && gone < count; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ(gone, count);
  };
  read(another(1));
  read(another(1));  // what it was: not needed
  wait_for(1);
  read(another(2));  // in place of the first
  wait_for(2);
  {
    TestClient client(server);
    client.subscribe_mesh();
    client.next_mesh(0);
    read(another(3));  // the client has the one before
  }
  wait_for(3);
  EXPECT_EQ(gone_there, 0);
}

}  // namespace
}  // namespace ecorche::server
