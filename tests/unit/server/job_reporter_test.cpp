// SPDX-License-Identifier: Apache-2.0
// What a job on a worker tells, and when, without a session.
#include "runtime/server/session/job_reporter.hpp"

#include <gtest/gtest.h>

#include <string>

namespace ecorche::server {
namespace {

struct JobEar final : JobListener {
  std::string heard;
  void pose_made(const PoseOutcome& outcome, const Skipped& skipped, const ShownPose& shown) override {
    heard += "pose" + std::to_string(outcome.sequence) + "/" + std::to_string(skipped.count) + "/" +
             std::to_string(shown.number) + " ";
  }
  void probe_made(const std::shared_ptr<ProbeFrame>& frame) override { heard += frame ? "probe " : ""; }
  void frame_made(const PosedFrame& frame) override {
    heard += "frame" + std::to_string(frame.subscription) + " ";
  }
  void volumes_made(const Status&) override {}
};

struct Reporting {
  // `meshes`: the job makes some. `again`: it shows the present pose.
  explicit Reporting(bool meshes, bool again = false) {
    PoseJob job;
    job.number = 9;
    if (meshes) job.subscriptions.emplace_back().streams.push_back(nullptr);
    auto skipped = std::make_shared<Skipped>();
    skipped->add(3);
    if (again) skipped = nullptr;
    reporter = std::make_unique<JobReporter>(io, listener, std::move(skipped), job);
  }
  PoseOutcome outcome(StatusCode code = StatusCode::ok) const {
    return {.sequence = 4, .status = {code, {}}, .clamped = {}, .timings = {}};
  }
  void frame(std::uint32_t subscription) {
    PosedFrame frame;
    frame.subscription = subscription;
    reporter->frame(std::move(frame));
  }
  // What is heard by now, and in how many handlers.
  std::string hear(std::size_t handlers) {
    io.restart();
    EXPECT_EQ(io.run(), handlers);
    return std::exchange(listener->heard, {});
  }
  net::io_context io;
  std::shared_ptr<JobEar> listener = std::make_shared<JobEar>();
  std::unique_ptr<JobReporter> reporter;
};

TEST(JobReporterTest, TheOutcomeGoesWithTheFirstMesh) {
  Reporting job(true);
  job.reporter->outcome(job.outcome());
  EXPECT_EQ(job.hear(0), "");
  job.frame(1);
  job.frame(2);
  EXPECT_EQ(job.hear(2), "pose4/1/9 frame1 frame2 ");
  job.reporter->end({StatusCode::resource_exhausted, "full"});
  EXPECT_EQ(job.hear(0), "");
  EXPECT_EQ(job.reporter->status().code, StatusCode::resource_exhausted);
}

TEST(JobReporterTest, WhereNoMeshComesItGoesAtOnce) {
  Reporting none(false), bad(true), probes(true), fails(true);
  none.reporter->outcome(none.outcome());
  EXPECT_EQ(none.hear(1), "pose4/1/9 ");
  bad.reporter->outcome(bad.outcome(StatusCode::invalid_argument));
  EXPECT_EQ(bad.hear(1), "pose4/1/9 ");
  probes.reporter->outcome(probes.outcome());
  probes.reporter->probe(std::make_shared<ProbeFrame>());
  EXPECT_EQ(probes.hear(2), "pose4/1/9 probe ");
  fails.reporter->outcome(fails.outcome());
  fails.reporter->end({});
  EXPECT_EQ(fails.hear(1), "pose4/1/9 ");
}

TEST(JobReporterTest, ThePresentPosesOutcomeIsKnown) {
  Reporting job(true, true);
  job.reporter->outcome(job.outcome());
  job.frame(1);
  job.reporter->end({});
  EXPECT_EQ(job.hear(1), "frame1 ");
}

}  // namespace
}  // namespace ecorche::server
