// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/judging.hpp"

#include <time.h>

#include <algorithm>
#include <new>
#include <utility>

#include "runtime/server/serially.hpp"
#include "runtime/server/session.hpp"

namespace ecorche::server {
namespace {

// Of the calling thread.
Clock::duration processor_time() {
  timespec spent{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &spent);
  return std::chrono::seconds(spent.tv_sec) + std::chrono::nanoseconds(spent.tv_nsec);
}

}  // namespace

Judging::Judging(net::io_context& io) : timer_(io), aside_(1, last_of_all) {}

void Judging::ask(const std::shared_ptr<Session>& session) {
  waiting_.push_back(session);  // before its session takes it for done: there may be no memory
  if (session->await_judgement()) waiting_.pop_back();
  next();
}

void Judging::next() {
  while (!busy_ && !resting_ && !stopped_ && !waiting_.empty()) {
    const std::shared_ptr<Session> session = waiting_.front().lock();
    waiting_.pop_front();
    busy_ = session && session->judge();
  }
}

void Judging::stop() {
  stopped_ = true;
  timer_.cancel();
}

void Judging::done(Clock::duration cost) {
  busy_ = false;
  if (stopped_) return;
  resting_ = true;
  timer_.expires_after(pause * cost);
  timer_.async_wait([this](const boost::system::error_code& ec) {
    if (ec) return;
    resting_ = false;
    next();
  });
}

bool judged_by(const v1::PoseQuality& quality, const runtime::QualityThresholds& thresholds) {
  return quality.max_inverted_share() == thresholds.max_inverted_share &&
         quality.max_volume_change() == thresholds.max_volume_change &&
         quality.max_bone_rigidity() == thresholds.max_bone_rigidity_mm;
}

v1::PoseQuality describe(const runtime::PoseQuality& quality, const std::vector<std::uint32_t>& tissues,
                         std::uint64_t pose) {
  v1::PoseQuality out;
  out.set_verdict(quality.pass ? v1::PoseQuality::VERDICT_PASS : v1::PoseQuality::VERDICT_WARN);
  out.set_inverted_tets(quality.inverted_tets);
  out.set_inverted_share(quality.inverted_share);
  out.set_min_det_f(quality.min_det_f);
  out.set_volume_change(quality.volume_change);
  for (std::size_t i = 0; i < quality.tissues.size(); ++i) {
    v1::TissueChange& change = *out.add_tissues();
    change.set_tissue(tissues[i]);
    if (!quality.tissues[i].closed) continue;
    change.set_share(quality.tissues[i].share);
    change.set_share_error(quality.tissues[i].share_error);
  }
  out.set_bone_rigidity(quality.bone_rigidity_mm);
  out.set_max_inverted_share(quality.thresholds.max_inverted_share);
  out.set_max_volume_change(quality.thresholds.max_volume_change);
  out.set_max_bone_rigidity(quality.thresholds.max_bone_rigidity_mm);
  out.set_pose_sequence(pose);
  return out;
}

void run(JudgeJob& job) {
  const Clock::duration start = processor_time();
  const auto judge = [&job] {
    const runtime::BodyPoser& poser = job.model->poser();
    const BodyPool::Lease body = job.model->bodies_aside.take();
    std::vector<std::uint32_t> tissues;
    for (std::size_t t = 0; t < body->tissues.size(); ++t) {
      const bool shown = std::any_of(job.rows.begin(), job.rows.end(), [&](const JudgeJob::Row& row) {
        return std::binary_search(row.tissues.begin(), row.tissues.end(), static_cast<std::uint32_t>(t));
      });
      if (shown) tissues.push_back(static_cast<std::uint32_t>(t));
      body->tissues[t].resize(shown ? static_cast<std::size_t>(job.model->model().tissues[t].V.size()) : 0);
      body->quantised[t].clear();
      body->normals[t].clear();
    }
    if (!poser.run(job.request.pose, job.request.skinning, tissues, *body, runtime::NodesOf::body).ok())
      return;
    for (JudgeJob::Row& row : job.rows) {
      row.quality = std::make_shared<const v1::PoseQuality>(describe(
          job.model->meter().measure(*body, row.tissues, job.thresholds), row.tissues, job.request.sequence));
    }
  };
  try {
    serially(judge);
  } catch (const std::bad_alloc&) {  // not judged
  }
  job.cost = processor_time() - start;
}

}  // namespace ecorche::server
