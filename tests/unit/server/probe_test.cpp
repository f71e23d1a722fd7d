// SPDX-License-Identifier: Apache-2.0
// Points through the body over the wire, held against the same asked offline.
#include <algorithm>
#include <cmath>
#include <numeric>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/probe.hpp>
#include "proto/arrays.hpp"
#include "tests/unit/server/session_stage.hpp"
#include "tests/unit/server/test_server.hpp"

namespace ecorche::server {
namespace {

constexpr auto kToRest = v1::ProbePoints::DIRECTION_POSED_TO_REST;
constexpr auto kToPosed = v1::ProbePoints::DIRECTION_REST_TO_POSED;

struct Question {
  v1::Envelope envelope;
  std::shared_ptr<const wire::Payload> payload;
};

Question ask(const std::vector<double>& points, v1::ProbePoints::Direction direction) {
  Question question;
  question.envelope.set_request_id(77);
  auto payload = std::make_shared<wire::Payload>();
  v1::ProbePoints& probe = *question.envelope.mutable_probe_points();
  probe.set_direction(direction);
  *probe.mutable_points() = wire::append(*payload, std::span<const double>(points), 3);
  question.payload = std::move(payload);
  return question;
}

// Points in and about the toy's beam.
std::vector<double> scattered(std::size_t count) {
  std::vector<double> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<double>(i);
    points.insert(points.end(), {25 * std::sin(k), 25 * std::cos(1.7 * k), std::fmod(17 * k, 310)});
  }
  return points;
}

template <class T>
std::vector<T> rows(const v1::Array& array, const wire::Payload& payload, std::uint32_t components) {
  std::span<const T> found;
  EXPECT_TRUE(wire::find(array, payload, components, found));
  return {found.begin(), found.end()};
}

// Bytes, so that what is no number equals itself.
std::vector<float> narrowed(const std::vector<double>& wide) {
  return {wide.begin(), wide.end()};
}
void expect_same(const std::vector<float>& a, const std::vector<float>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_TRUE(a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]))) << i;
}

// The toy body with all of its tets so often that the tree about them has several blocks, each fitted when
// first a point comes to it.
Model layered() {
  constexpr int kTimes = 60;
  Model model = test::toy_model();
  model.tets = Tets(model.tets.replicate(kTimes, 1));
  const std::vector<std::uint16_t> once = model.tet_label;
  for (int i = 1; i < kTimes; ++i) model.tet_label.insert(model.tet_label.end(), once.begin(), once.end());
  return model;
}

// Points in the beam, from one end to the other.
std::vector<double> along(std::size_t count) {
  std::vector<double> points;
  for (std::size_t i = 0; i < count; ++i) {
    const auto k = static_cast<double>(i);
    points.insert(points.end(),
                  {15 * std::sin(k), 15 * std::cos(1.7 * k), 300 * k / static_cast<double>(count)});
  }
  return points;
}

Pose turned(std::size_t pose) {
  Pose out = Pose::rest(3);
  out.rotation[2] = Eigen::AngleAxisd(0.2 * static_cast<double>(pose), Eigen::Vector3d::UnitX());
  return out;
}

// The same asked of a pose offline.
class OfflineProbe {
 public:
  explicit OfflineProbe(const Model& model)
      : model_(std::make_shared<const Model>(model)), poser_(model_), probe_(model_) {}

  void pose(const Pose& pose) {
    runtime::PosedBody body = poser_.make_frame();
    ASSERT_TRUE(poser_.run(pose, runtime::Skinning::cor, {}, body).ok());
    probe_.follow(body.nodes, tree_);
  }
  runtime::Probed ask(const std::vector<double>& points, v1::ProbePoints::Direction direction) const {
    const runtime::ProbeOptions wants{.gradient = true, .tissue = true, .volumes = {{.row = 0}, {.row = 1}}};
    runtime::Probed found;
    if (direction == kToRest)
      probe_.posed_to_rest(tree_, narrowed(points), wants, found);
    else
      probe_.rest_to_posed(tree_, narrowed(points), wants, found);
    return found;
  }

 private:
  std::shared_ptr<const Model> model_;
  runtime::BodyPoser poser_;
  runtime::Probe probe_;
  runtime::Probe::PosedTree tree_;
};

// A client that probes what another one poses.
class Prober {
 public:
  explicit Prober(const TestServer& server, const std::string& session = "probed") : raw_(server) {
    raw_.send_hello();
    EXPECT_TRUE(raw_.receive());
    v1::Envelope open;
    open.mutable_open_model()->set_model("toy");
    open.mutable_open_model()->set_session(session);
    raw_.send(open);
    EXPECT_TRUE(raw_.receive());
  }
  wire::Frame ask(const Question& question) {
    raw_.send(question.envelope, question.payload);
    return answer();
  }
  wire::Frame answer() {
    while (auto frame = raw_.receive()) {
      if (frame->envelope.request_id() == 77) return std::move(*frame);
    }
    ADD_FAILURE() << "no answer";
    return {};
  }
  RawClient& raw() { return raw_; }

 private:
  RawClient raw_;
};

TEST(ProbeTest, BothWaysAsOffline) {
  const TestServer server;
  TestClient poser(server, "probed");
  poser.send(4, poser.bent(0.6));
  poser.next_ack();
  Prober prober(server);
  OfflineProbe offline(server.model());
  offline.pose(poser.bent(0.6));

  // Few are asked on the spot, many by a worker.
  for (const std::size_t count : {std::size_t{1}, std::size_t{16}, std::size_t{17}, std::size_t{10000}}) {
    for (const auto direction : {kToRest, kToPosed}) {
      const std::vector<double> points = scattered(count);
      Question question = ask(points, direction);
      v1::ProbePoints& request = *question.envelope.mutable_probe_points();
      request.set_deformation_gradient(true);
      request.set_tissue(true);
      for (const ModelVolume& volume : server.model().volumes) request.add_volumes(volume.name);
      const wire::Frame answer = prober.ask(question);
      const v1::Probed& probed = answer.envelope.probed();
      EXPECT_EQ(probed.pose_sequence(), 4U);

      const runtime::Probed expected = offline.ask(points, direction);
      expect_same(narrowed(rows<double>(probed.points(), answer.payload, 3)), expected.points);
      expect_same(narrowed(rows<double>(probed.deformation_gradient(), answer.payload, 9)),
                  expected.gradient);
      EXPECT_EQ(rows<std::int32_t>(probed.tissue(), answer.payload, 1), expected.tissue);
      const std::vector<double> values = rows<double>(probed.values(), answer.payload, 2);
      for (std::size_t i = 0; i < count; ++i) {
        EXPECT_EQ(values[2 * i], expected.values[0][i]);
        EXPECT_EQ(values[2 * i + 1], expected.values[1][i]);
      }
    }
  }
}

// Where many points are asked, every pose is made ready for them as a whole, for a second.
TEST(ProbeTest, WhoAsksManyPointsFindsTheTreeFitted) {
  const auto fitted = [](Stage& stage, bool many) {
    std::shared_ptr<const ProbeFrame> got;
    stage.session->probe([&](const auto& frame, const Status&) { got = frame; }, many);
    stage.run_until([&] { return got != nullptr; });
    const auto& blocks = got->tree.boxes.blocks;
    EXPECT_GT(blocks.size(), 2U);
    return std::count_if(blocks.begin(), blocks.end(), [](const auto& state) {
             return state.load() == runtime::BoxTree::State::fitted;
           }) == std::ssize(blocks);
  };
  const Model model = layered();
  for (int trial = 0; trial < kTrials; ++trial) {
    Stage many(v1::ENCODING_F32, std::uint64_t{1} << 30, model);
    const auto start = Clock::now();
    EXPECT_TRUE(fitted(many, true));
    many.pose(1);
    many.run_until([&] { return many.watcher.frame().pose_sequence() == 1; });
    const bool again = fitted(many, false);
    const bool in_time = Clock::now() - start < std::chrono::seconds(1);
    EXPECT_TRUE(again || !in_time);
    Stage few(v1::ENCODING_F32, std::uint64_t{1} << 30, model);
    EXPECT_FALSE(fitted(few, false));
    few.pose(1);
    few.run_until([&] { return few.watcher.frame().pose_sequence() == 1; });
    EXPECT_FALSE(fitted(few, false));
    if (in_time) return;
  }
  ADD_FAILURE() << "the machine was too busy each time";
}

// As workers and the I/O thread may. Here, where ThreadSanitizer looks, and below TBB, into which it does not
// see.
TEST(ProbeTest, ManyThreadsAskOneFreshTree) {
  const Model model = layered();
  const runtime::TetRuns runs(model.tets, model.nodes);
  const std::span<const float> nodes(model.nodes.data(), static_cast<std::size_t>(model.nodes.size()));
  const std::vector<float> points = narrowed(along(300));
  std::vector<std::uint32_t> which(300);
  std::iota(which.begin(), which.end(), 0U);
  runtime::PaddedNodes padded;
  runtime::BoxTree tree;
  const auto ask = [&] {
    std::vector<runtime::TetPlace> places(which.size());
    runtime::kernels::find_tets({runs, padded, tree}, points, which, places);
    std::vector<std::int32_t> tets;
    tets.reserve(places.size());
    for (const runtime::TetPlace& place : places) tets.push_back(place.tet);
    return tets;
  };
  runtime::follow(runs, nodes, padded, tree);
  ASSERT_GT(tree.blocks.size(), 4U);
  const std::vector<std::int32_t> expected = ask();
  for (int turn = 0; turn < 20; ++turn) {
    runtime::follow(runs, nodes, padded, tree);
    std::vector<std::vector<std::int32_t>> found(3);
    std::vector<std::thread> threads;
    threads.reserve(found.size());
    for (auto& mine : found) threads.emplace_back([&] { mine = ask(); });
    for (std::thread& thread : threads) thread.join();
    for (const auto& one : found) EXPECT_EQ(one, expected);
  }
}

// A fresh tree is fitted by the I/O thread from one end of the body while a worker does from the other;
// later ones are fitted before.
TEST(ProbeTest, FewAndManyAtOnceWhilePosesCome) {
  constexpr std::size_t kPoses = 2, kCount = 2000, kFew = 16;
  const TestServer server({}, layered());
  const std::vector<double> points = along(kCount);
  std::vector<std::vector<float>> expected;  // by pose
  OfflineProbe offline(server.model());
  for (std::size_t pose = 0; pose < kPoses; ++pose) {
    offline.pose(turned(pose));
    expected.push_back(offline.ask(points, kToRest).points);
  }
  const auto expect_right = [&](const wire::Frame& answer, std::size_t first, std::size_t count) {
    const v1::Probed& probed = answer.envelope.probed();
    ASSERT_LT(probed.pose_sequence(), kPoses);
    const auto from = expected[probed.pose_sequence()].begin() + static_cast<std::ptrdiff_t>(3 * first);
    expect_same(narrowed(rows<double>(probed.points(), answer.payload, 3)),
                {from, from + static_cast<std::ptrdiff_t>(3 * count)});
  };
  for (int trial = 0; trial < 8; ++trial) {
    const std::string session = "s" + std::to_string(trial);
    TestClient poser(server, session);
    Prober few(server, session), many(server, session);
    few.ask(ask({0, 0, 10}, kToRest));  // a tree, of which next to nothing is fitted
    for (std::size_t pose = 0; pose < kPoses; ++pose) {
      if (pose > 0) {
        poser.send(pose, turned(pose));
        poser.next_ack();
      }
      const Question all = ask(points, kToRest);
      many.raw().send(all.envelope, all.payload);
      for (std::size_t i = kCount - kFew; i > 29; i -= 29) {
        const auto at = points.begin() + static_cast<std::ptrdiff_t>(3 * i);
        expect_right(few.ask(ask({at, at + static_cast<std::ptrdiff_t>(3 * kFew)}, kToRest)), i, kFew);
      }
      expect_right(many.answer(), 0, kCount);
    }
  }
}

TEST(ProbeTest, FollowsThePoseThatIsShown) {
  const TestServer server;
  TestClient poser(server, "probed");
  Prober prober(server);
  const Question question = ask({0, 0, 290}, kToPosed);
  std::uint64_t last = 0;
  for (std::uint64_t sequence = 1; sequence <= 50; ++sequence) {
    poser.send(sequence, poser.bent(0.02 * static_cast<double>(sequence)));
    if (sequence % 3 == 0) poser.next_ack();
    const wire::Frame answer = prober.ask(question);
    EXPECT_GE(answer.envelope.probed().pose_sequence(), last);
    last = answer.envelope.probed().pose_sequence();
  }
  EXPECT_GT(last, 0U);
}

TEST(ProbeTest, WhatCannotBeAskedIsRefused) {
  const TestServer server;
  Prober prober(server);
  const auto code = [&](const auto& spoil) {
    Question question = ask({0, 0, 10}, kToRest);
    spoil(*question.envelope.mutable_probe_points());
    return prober.ask(question).envelope.status().code();
  };
  const auto invalid = static_cast<std::uint32_t>(StatusCode::invalid_argument);
  EXPECT_EQ(code([](v1::ProbePoints&) {}), 0U);
  EXPECT_EQ(code([](v1::ProbePoints& p) { p.clear_direction(); }), invalid);
  EXPECT_EQ(code([](v1::ProbePoints& p) { p.mutable_points()->set_count(3); }), invalid);
  EXPECT_EQ(code([](v1::ProbePoints& p) { p.mutable_points()->set_count(0); }), invalid);
  EXPECT_EQ(code([](v1::ProbePoints& p) { p.mutable_points()->set_type(v1::SCALAR_TYPE_F32); }), invalid);
  EXPECT_EQ(code([](v1::ProbePoints& p) { p.add_volumes("mri"); }),
            static_cast<std::uint32_t>(StatusCode::not_found));
  EXPECT_EQ(code([&](v1::ProbePoints& p) {
              for (int i = 0; i < 3; ++i) p.add_volumes(server.model().volumes[0].name);
            }),
            invalid);
  EXPECT_EQ(prober.ask(ask(scattered(10001), kToRest)).envelope.status().code(), invalid);
  // No number lies nowhere.
  const wire::Frame lost = prober.ask(ask({NAN, INFINITY, 1e300}, kToRest));
  EXPECT_TRUE(std::isnan(rows<double>(lost.envelope.probed().points(), lost.payload, 3)[0]));
}

}  // namespace
}  // namespace ecorche::server
