// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/quality_job.hpp"

#include <time.h>

#include <algorithm>
#include <new>
#include <utility>

#include <ecorche/runtime/verdict.hpp>
#include <ecorche/wire/convert.hpp>
#include "runtime/server/schedule/serially.hpp"

namespace ecorche::server {
namespace {

// Of the calling thread.
Clock::duration processor_time() {
  timespec spent{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &spent);
  return std::chrono::seconds(spent.tv_sec) + std::chrono::nanoseconds(spent.tv_nsec);
}

}  // namespace

bool judged_by(const v1::PoseQuality& quality, const runtime::QualityThresholds& thresholds) {
  return quality.max_inverted_share() == thresholds.max_inverted_share &&
         quality.max_volume_change() == thresholds.max_volume_change &&
         quality.max_bone_rigidity() == thresholds.max_bone_rigidity_mm &&
         quality.tissue_factor() == thresholds.tissue_factor &&
         quality.max_bone_overlap() == thresholds.max_bone_overlap_mm;
}

runtime::QualityThresholds thresholds_of(const v1::PoseQuality& quality) {
  runtime::QualityThresholds out;
  out.max_inverted_share = quality.max_inverted_share();
  out.max_volume_change = quality.max_volume_change();
  out.max_bone_rigidity_mm = quality.max_bone_rigidity();
  out.tissue_factor = quality.tissue_factor();
  out.max_bone_overlap_mm = quality.max_bone_overlap();
  return out;
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
    change.set_max_share(quality.tissues[i].max_share);
  }
  out.set_bone_rigidity(quality.bone_rigidity_mm);
  out.set_max_inverted_share(quality.thresholds.max_inverted_share);
  out.set_max_volume_change(quality.thresholds.max_volume_change);
  out.set_max_bone_rigidity(quality.thresholds.max_bone_rigidity_mm);
  out.set_tissue_factor(quality.thresholds.tissue_factor);
  out.set_unsigned_volume_change(quality.unsigned_volume_change);
  const std::size_t worst = worst_tissue(quality);
  if (worst < tissues.size()) out.set_worst_tissue(tissues[worst]);
  for (const runtime::DoubtfulJoint& joint : quality.doubtful) {
    v1::DoubtfulJoint& doubtful = *out.add_doubtful();
    doubtful.set_joint(static_cast<std::uint32_t>(joint.joint));
    doubtful.set_turned(joint.turned);
    doubtful.set_confidence(joint.confidence);
  }
  if (quality.overlap.mm > 0) {
    v1::BoneOverlap& overlap = *out.mutable_overlap();
    overlap.set_bone(static_cast<std::uint32_t>(quality.overlap.bone));
    overlap.set_into(static_cast<std::uint32_t>(quality.overlap.into));
    overlap.set_mm(quality.overlap.mm);
    wire::to_proto(quality.overlap.at, *overlap.mutable_at());
  }
  out.set_overlap_pending(quality.overlap_pending);
  out.set_max_bone_overlap(quality.thresholds.max_bone_overlap_mm);
  out.set_pose_sequence(pose);
  return out;
}

BodyPool::Lease pose_still(const ServedModel& model, const PoseRequest& request,
                           const std::vector<std::uint32_t>& tissues) {
  BodyPool::Lease body = model.background_bodies.take();
  for (std::uint32_t t = 0; t < body->tissues.size(); ++t) {
    const bool shown = std::binary_search(tissues.begin(), tissues.end(), t);
    body->tissues[t].resize(shown ? static_cast<std::size_t>(model.model().tissues[t].V.size()) : 0);
    body->quantised[t].clear();
    body->normals[t].clear();
  }
  const Status status = model.poser().run(request.pose, request.skinning, tissues, *body,
                                          runtime::NodesOf::body, runtime::Root::still);
  return status.ok() ? std::move(body) : BodyPool::Lease();
}

void run(QualityJob& job) {
  const Clock::duration start = processor_time();
  Clock::duration once{};  // what no later pose costs again
  const auto judge = [&job, &once] {
    std::vector<std::uint32_t> tissues;
    for (const QualityJob::Row& row : job.rows)
      tissues.insert(tissues.end(), row.tissues.begin(), row.tissues.end());
    std::sort(tissues.begin(), tissues.end());
    tissues.erase(std::unique(tissues.begin(), tissues.end()), tissues.end());
    const BodyPool::Lease body = pose_still(*job.model, job.request, tissues);
    if (!body) return;
    const Clock::duration before = processor_time();
    job.model->meter().prepare(*body);
    once = processor_time() - before;
    for (QualityJob::Row& row : job.rows) {
      row.quality = std::make_shared<const v1::PoseQuality>(describe(
          job.model->meter().measure(*body, row.tissues, job.thresholds), row.tissues, job.request.sequence));
    }
  };
  try {
    serially(judge);
  } catch (const std::bad_alloc&) {  // not judged
  }
  job.cost = processor_time() - start - once;
}

}  // namespace ecorche::server
