// SPDX-License-Identifier: Apache-2.0
// Points through the body over the wire, held against the same asked offline.
#include <cstring>

#include "proto/arrays.hpp"
#include "runtime/probe/probe.hpp"
#include "runtime/skin/body_poser.hpp"
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

// A client that poses, then probes.
class Prober {
 public:
  explicit Prober(const TestServer& server) : raw_(server) {
    raw_.send_hello();
    EXPECT_TRUE(raw_.receive());
    v1::Envelope open;
    open.mutable_open_model()->set_model("toy");
    open.mutable_open_model()->set_session("probed");
    raw_.send(open);
    EXPECT_TRUE(raw_.receive());
  }
  wire::Frame ask(const Question& question) {
    raw_.send(question.envelope, question.payload);
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

  const auto model = std::make_shared<const Model>(server.model());
  const runtime::BodyPoser offline(model);
  runtime::PosedBody body = offline.make_frame();
  ASSERT_TRUE(offline.run(poser.bent(0.6), runtime::Skinning::cor, {}, body).ok());
  const runtime::Probe probe(model);
  runtime::Probe::PosedTree tree;
  probe.follow(body.nodes, tree);

  // Few are asked on the spot, many by a worker.
  for (const std::size_t count : {std::size_t{1}, std::size_t{16}, std::size_t{17}, std::size_t{10000}}) {
    for (const auto direction : {kToRest, kToPosed}) {
      const std::vector<double> points = scattered(count);
      Question question = ask(points, direction);
      v1::ProbePoints& request = *question.envelope.mutable_probe_points();
      request.set_deformation_gradient(true);
      request.set_tissue(true);
      for (const ModelVolume& volume : model->volumes) request.add_volumes(volume.name);
      const wire::Frame answer = prober.ask(question);
      const v1::Probed& probed = answer.envelope.probed();
      EXPECT_EQ(probed.pose_sequence(), 4U);

      runtime::ProbeWants wants{.gradient = true, .tissue = true, .volumes = {{.row = 0}, {.row = 1}}};
      runtime::Probed expected;
      if (direction == kToRest)
        probe.posed_to_rest(tree, narrowed(points), wants, expected);
      else
        probe.rest_to_posed(tree, narrowed(points), wants, expected);
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
