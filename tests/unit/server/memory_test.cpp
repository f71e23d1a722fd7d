// SPDX-License-Identifier: Apache-2.0
// The Nth allocation while messages are handled fails, for every N of a whole conversation; and while a pose
// is shown, judged or levels are made, on a worker.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <new>
#include <utility>
#include <variant>
#include <vector>

#include <ecorche/wire/mesh_decoder.hpp>
#include <ecorche/wire/volume_decoder.hpp>
#include "runtime/server/session/mesh_streams.hpp"
#include "runtime/server/session/pose_job.hpp"
#include "runtime/server/session/quality_job.hpp"
#include "runtime/server/session/volume_stream.hpp"
#include "tests/support/toy_model.hpp"
#include "tests/unit/server/conversation.hpp"
#include "tests/unit/server/failing_new.hpp"

namespace ecorche::server {
namespace {

TEST(MemoryTest, TheNthAllocation) {
  Options options;
  options.limits.linger_seconds = 0;
  const TestServer server(options, {.transport = {}, .timer_fails = {}, .handling = [](bool begins) {
                                      thread_local int depth = 0;  // one may begin within another
                                      handling = (depth += begins ? 1 : -1) > 0;
                                    }});
  ASSERT_TRUE(converse(server, 10));
  int n = 0;
  bool struck = true;
  for (; struck && n < 20000; ++n) {
    // What is struck may never be answered, so it is not waited for; on a busy machine neither the Nth nor
    // the end has come by then.
    for (const double patience : {0.05, 0.5, 5.0}) {
      allocations.set(n);
      const bool whole = converse(server, patience);
      struck = allocations.spent();
      allocations.off();
      if (whole || struck) break;
    }
    ASSERT_TRUE(converse(server, 10)) << n;
  }
  std::printf("%d allocations failed, one by one\n", n - 1);
  EXPECT_GT(n, 100);
}

// The token of a client that had such a level of detail, and is gone.
std::string left_place(const TestServer& server, std::uint32_t level) {
  RawClient client(server);
  client.send_hello();
  const auto hello = client.receive();
  v1::Envelope open, subscribe;
  open.mutable_open_model()->set_without_triangles(true);
  subscribe.mutable_subscribe()->mutable_mesh()->set_level(level);
  for (v1::Envelope* request : {&open, &subscribe}) {
    request->set_request_id(1);
    client.send(*request);
    client.receive();
  }
  return hello ? hello->envelope.server_hello().resume_token() : "";
}

// To streams that are made aside, or to what is at hand.
class ComingBack : public testing::TestWithParam<std::uint32_t> {};

TEST_P(ComingBack, TheNthAllocation) {
  const TestServer server(Options{}, {.transport = {}, .timer_fails = {}, .handling = [](bool begins) {
                                        thread_local int depth = 0;
                                        handling = (depth += begins ? 1 : -1) > 0;
                                      }});
  bool struck = true, resumed = false;
  int n = 0, aside = 0;
  for (; struck && n < 2000; ++n) {
    v1::Envelope hello = greeting();
    hello.mutable_client_hello()->set_resume_token(left_place(server, GetParam()));
    const auto come_back = [&](RawClient& client) {
      client.send(hello);
      const auto answer = client.receive();  // or it is hung up
      if (!answer) return false;
      const std::string& why = answer->envelope.status().message();
      if (why.find("hello: the server is out of memory for your place") != std::string::npos) ++aside;
      const v1::Resumed& place = answer->envelope.server_hello().resumed();
      return place.subscriptions_size() == 1 && place.role() == v1::ROLE_CONTROLLER;
    };
    RawClient back(server);
    allocations.set(n);
    resumed = come_back(back);
    struck = allocations.spent();
    allocations.off();
    EXPECT_TRUE(struck || resumed) << n;
    if (!resumed) {
      RawClient again(server);
      EXPECT_TRUE(come_back(again)) << n << ": the place is lost";
    }
    ASSERT_TRUE(converse(server, 10)) << n;
  }
  EXPECT_TRUE(resumed);
  EXPECT_EQ(aside > 2, GetParam() > 0) << "of those that make the streams: " << aside;
  std::printf("%d allocations failed, one by one, %d of them aside\n", n - 1, aside);
  EXPECT_GT(n, 20);
}

INSTANTIATE_TEST_SUITE_P(MemoryTest, ComingBack, testing::Values(0, 1));

// A client of one subscription: it knows what it has, and that every frame that it can read is right.
struct Reader {
  Subscription subscription;
  wire::MeshDecoder meshes;
  wire::VolumeDecoder volumes;
  std::vector<wire::DecodedTissue> tissues;
  Image image;
  bool bricks = false;
  std::uint64_t keyframe = 0, shown = 0;  // number of the last keyframe; pose of the last frame

  void read(const PosedFrame& frame, const v1::Envelope& envelope, const wire::Payload& payload) {
    if (frame.keyframe != 0 && frame.keyframe != frame.number && frame.keyframe != keyframe) {
      subscription.keyframes = ~0U;  // as its connection asks for one
      return;
    }
    if (frame.keyframe == frame.number) keyframe = frame.number;
    if (envelope.has_mesh_frame()) {
      const Status status = meshes.decode(envelope.mesh_frame(), payload, tissues);
      ASSERT_TRUE(status.ok()) << status.message;
      shown = envelope.mesh_frame().pose_sequence();
      return;
    }
    if (envelope.volume_frame().status().code() != 0) {
      EXPECT_TRUE(payload.empty());
      EXPECT_EQ(frame.keyframe, 0U);
      return;
    }
    bricks = bricks || envelope.volume_frame().has_bricks();
    const Status status = volumes.decode(envelope.volume_frame(), payload, image);
    ASSERT_TRUE(status.ok()) << status.message;
    shown = envelope.volume_frame().pose_sequence();
  }
};

class Posing {
 public:
  explicit Posing(const std::vector<StreamSpec>& wants) {
    for (const StreamSpec& spec : wants) {
      Reader& reader = readers_.emplace_back();
      reader.subscription.id = static_cast<std::uint32_t>(readers_.size());
      reader.subscription.spec = spec;
      reader.subscription.keyframes = ~0U;
      if (const auto* mesh = std::get_if<MeshSpec>(&spec))
        reader.subscription.streams = open_streams(model(), *mesh);
      else
        reader.subscription.volume = std::make_shared<VolumeStream>(std::get<VolumeSpec>(spec), 0);
    }
  }

  static const ServedModel& model() {
    static const auto served = made();
    return *served;
  }

  /// Poses, with memory failing the `fails`th time; -1: never. Whether all went well.
  bool pose(double angle, int fails) {
    PoseJob job;
    job.model = made();
    job.number = ++number_;
    job.request.sequence = number_;
    job.request.pose = posed(angle);
    job.volume_voxels = 1U << 28;
    job.memory = &memory_;
    for (Reader& reader : readers_) {
      job.subscriptions.push_back(reader.subscription);
      reader.subscription.keyframes = 0;
    }
    bool posed = false;
    job.on_outcome = [&](const PoseOutcome& outcome) { posed = outcome.status.ok(); };
    job.on_frame = [&](PosedFrame frame) {
      const bool before = std::exchange(handling, false);
      frames_.push_back(std::move(frame));
      handling = before;
    };
    allocations.set(fails);
    handling = true;
    const Status status = run(job);
    handling = false;
    struck_ = fails >= 0 && allocations.spent();
    allocations.off();
    bool good = posed && status.ok() && frames_.size() == readers_.size();
    for (const PosedFrame& frame : std::exchange(frames_, {})) {
      wire::Frame got = parsed(*frame.bytes);
      good = good && got.envelope.volume_frame().status().code() == 0;
      readers_[frame.subscription - 1].read(frame, got.envelope, got.payload);
    }
    for (const Reader& reader : readers_) {
      if (reader.shown == number_) expect_right(reader, job.request.pose);
    }
    return good;
  }
  bool struck() const { return struck_; }
  /// Somebody had no more than the bricks that changed.
  bool bricks() const {
    return std::any_of(readers_.begin(), readers_.end(), [](const Reader& r) { return r.bricks; });
  }
  /// Everybody sees the last pose.
  bool complete() const {
    return std::all_of(readers_.begin(), readers_.end(), [&](const Reader& r) { return r.shown == number_; });
  }

 private:
  static std::shared_ptr<const ServedModel> made() {
    static const auto served =
        std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(test::fine_toy_model(5)));
    return served;
  }
  static Pose posed(double angle) {
    Pose pose = Pose::rest(model().model().segment_count());
    pose.rotation[2] = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX());
    return pose;
  }
  static wire::Frame parsed(const wire::EncodedFrame& frame) {
    std::string bytes = frame.head;
    if (frame.payload)
      bytes.append(reinterpret_cast<const char*>(frame.payload->data()), frame.payload->size());
    for (const auto& part : frame.pieces.parts)
      bytes.append(reinterpret_cast<const char*>(part.data()), part.size());
    wire::FrameReader reader({.envelope_bytes = 1 << 20, .payload_bytes = 1 << 26});
    std::size_t at = 0;
    while (!reader.complete()) {
      const auto into = reader.prepare();
      std::memcpy(into.data(), bytes.data() + at, into.size());
      at += into.size();
      EXPECT_TRUE(reader.commit(into.size()).ok());
    }
    EXPECT_EQ(at, bytes.size());
    return reader.release();
  }
  static void expect_right(const Reader& reader, const Pose& pose) {
    const runtime::BodyPoser& poser = model().poser();
    runtime::PosedBody body = poser.make_frame();
    ASSERT_TRUE(poser.run(pose, runtime::Skinning::cor, poser.all_tissues(), body).ok());
    for (const wire::DecodedTissue& tissue : reader.tissues) {
      const auto& expected = body.tissues[tissue.tissue];
      ASSERT_EQ(tissue.positions.size(), expected.size());
      const float bound = tissue.numbers.empty() ? 0 : model().step;
      for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(tissue.positions[i], expected[i], bound);
    }
    const auto* spec = std::get_if<VolumeSpec>(&reader.subscription.spec);
    if (!spec) return;
    static std::map<std::pair<bool, double>, Image> made;
    Image& expected = made[{spec->by_spheres, pose.rotation[2].x()}];
    if (expected.bytes.empty()) {
      const ModelVolume& volume = model().model().volumes[spec->volume];
      expected =
          spec->by_spheres
              ? runtime::pose_volume(model().model(), body.segments, volume, std::nullopt, spec->sampling)
              : runtime::pose_volume(poser.shared_model(), body.nodes, volume, spec->sampling,
                                     runtime::grow_to(volume.image.grid, body.nodes));
    }
    ASSERT_EQ(reader.image.bytes, expected.bytes);
  }

  MemoryBudget memory_{std::uint64_t{1} << 30, std::uint64_t{1} << 30};
  std::vector<Reader> readers_;
  std::vector<PosedFrame> frames_;
  std::uint64_t number_ = 0;
  bool struck_ = false;
};

MeshSpec mesh_want(v1::Encoding encoding, std::vector<std::uint32_t> tissues, bool normals = false) {
  MeshSpec spec;
  spec.tissues = std::move(tissues);
  spec.encoding = encoding;
  spec.normals = normals;
  return spec;
}

VolumeSpec volume_want(bool by_spheres) {
  VolumeSpec spec;
  spec.by_spheres = by_spheres;
  spec.changed_bricks = spec.compressed = true;
  return spec;
}

// Whichever it is, no frame is wrong, and those of the next pose but one are there.
TEST(MemoryTest, TheNthAllocationOfAPose) {
  Posing::model().meter();
  Posing::model().volumes();
  Posing::model().balls(0);
  const std::vector<std::vector<StreamSpec>> cases{
      {mesh_want(v1::ENCODING_F32, {0, 1})},  // sent as it lies
      {mesh_want(v1::ENCODING_F32, {0}), mesh_want(v1::ENCODING_U16, {0, 1}, true)},
      {mesh_want(v1::ENCODING_U16_DELTA, {0, 1}), mesh_want(v1::ENCODING_U16_DELTA, {1}, true)},
      {volume_want(false)},
      {volume_want(true)},
  };
  for (std::size_t c = 0; c < cases.size(); ++c) {
    // The first frame, a keyframe; one after it; one after it that comes on another lattice than those about
    // it.
    for (const int at : {0, 1, 2}) {
      int n = 0;
      bool bricks = false;
      for (bool struck = true; struck; ++n) {
        SCOPED_TRACE("case " + std::to_string(c) + ", pose " + std::to_string(at) + ", allocation " +
                     std::to_string(n));
        Posing posing(cases[c]);
        if (at > 0) {
          ASSERT_TRUE(posing.pose(0.002, -1));
        }
        const bool good = posing.pose(at == 2 ? 0.5 : 0.006, n);
        struck = posing.struck();
        ASSERT_TRUE(good || struck);
        posing.pose(0.002, -1);  // some may have to ask for a keyframe
        ASSERT_TRUE(posing.pose(0.008, -1));
        ASSERT_TRUE(posing.complete());
        bricks = bricks || posing.bricks();
        if (HasFatalFailure()) return;
      }
      std::printf("case %zu, pose %d: %d allocations failed, one by one\n", c, at, n - 1);
      EXPECT_GT(n, 5);
      EXPECT_TRUE(bricks || c < 3);
    }
  }
}

TEST(MemoryTest, TheNthAllocationOfAJudgement) {
  const auto model =
      std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(test::toy_model()));
  bool struck = true, judged = false;
  int n = 0;
  for (; struck; ++n) {
    QualityJob job;
    job.model = model;
    job.request.sequence = 7;
    job.request.pose = Pose::rest(model->model().segment_count());
    job.rows = {{1, {0}, nullptr}, {2, {0, 1}, nullptr}};
    allocations.set(n);
    handling = true;
    run(job);
    handling = false;
    struck = allocations.spent();
    allocations.off();
    judged = job.rows[0].quality && job.rows[1].quality;
    for (const QualityJob::Row& row : job.rows) {
      if (row.quality) {
        EXPECT_EQ(row.quality->tissues_size(), static_cast<int>(row.tissues.size()));
      }
    }
  }
  EXPECT_TRUE(judged);
  EXPECT_GT(n, 10);
}

TEST(MemoryTest, TheNthAllocationOfLevels) {
  const auto model =
      std::make_shared<const ServedModel>("toy", std::make_shared<const Model>(test::toy_model()));
  const ServedModel other("toy", std::make_shared<const Model>(test::toy_model()));
  other.make_levels({0});
  int n = 0;
  for (; !model->has_levels({0}) && n < 1000; ++n) {
    allocations.set(n);
    handling = true;
    try {
      model->make_levels({0});
    } catch (const std::bad_alloc&) {
    }
    handling = false;
    allocations.off();
  }
  EXPECT_GT(n, 5);
  ASSERT_TRUE(model->has_levels({0}));
  for (std::uint32_t level = 1; level <= coarsest_level; ++level)
    EXPECT_EQ(model->level(level, 0).vertices, other.level(level, 0).vertices);
}

}  // namespace
}  // namespace ecorche::server
