// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/frame_planner.hpp"

#include <algorithm>
#include <utility>

#include "runtime/server/session/mesh_stream.hpp"
#include "runtime/server/session/pose_slot.hpp"
#include "runtime/server/session/retained_bytes.hpp"

namespace ecorche::server {
namespace {

// What is shown first takes turns of so many bytes, so that who asks for little never waits for long behind
// who asks for much: of the paper phantom a whole body in float32.
constexpr std::uint64_t kTurn = std::uint64_t{16} << 20;

// What each member's way takes; whoever got less detail gets all once the body stands still.
void ask_levels(SubscriptionRow& row, const FramePlan& plan) {
  row.refresh_at.reset();
  Subscription& subscription = row.subscription;
  if (subscription.streams.empty()) return;
  const std::uint32_t finest = subscription.streams.front()->level(),
                      coarsest = subscription.streams.back()->level();
  subscription.levels = 0;
  Clock::time_point sure = plan.now + PoseSlot::still_after;
  for (Member* member : row.members) {
    const Clock::duration gap = member->longest_gap(subscription.id);
    const bool still = plan.still && plan.now - plan.moved >= gap;
    subscription.levels |= 1U << (member->ask_level(subscription.id, finest, coarsest, still) - finest);
    sure = std::max(sure, (plan.still ? plan.moved : plan.now) + PoseSlot::still_after + gap);
  }
  if (subscription.levels > 1) row.refresh_at = sure;
}

}  // namespace

FramePlanner::FramePlanner(SubscriptionTable& table, std::shared_ptr<const ServedModel> model,
                           const MemoryBudget& memory, StreamActivity& activity, std::uint64_t most_voxels)
    : table_(table),
      model_(std::move(model)),
      memory_(memory),
      activity_(activity),
      most_voxels_(most_voxels) {}

std::uint64_t FramePlanner::frame_bytes(const StreamSpec& spec) const {
  const Model& model = model_->model();
  if (const auto* volume = std::get_if<VolumeSpec>(&spec)) {
    const Image& scan = model.volumes[volume->volume].image;
    if (volume->slices.empty()) {
      const std::uint64_t voxels = volume->region ? rest_voxels(model, *volume) : scan.grid.voxels();
      if (voxels > most_voxels_) return 0;
      return voxels * scalar_bytes(scan.type) * static_cast<std::uint64_t>(scan.components);
    }
    std::uint64_t pixels = 0;
    for (const ImageGrid& plane : volume->slices) pixels += plane.voxels();
    return pixels * scalar_bytes(scan.type) * static_cast<std::uint64_t>(scan.components);
  }
  const MeshSpec& mesh = std::get<MeshSpec>(spec);
  if (mesh.motions) return model.segment_count() * 7 * sizeof(double);
  std::uint64_t vertices = 0;
  for (const std::uint32_t t : mesh.tissues)
    vertices += static_cast<std::uint64_t>(model.tissues[t].V.rows());
  return vertices * (mesh.encoding == v1::ENCODING_F32 ? 3 * sizeof(float) : 3 * sizeof(std::uint16_t));
}

// Somebody would read the frame, beside `before` bytes of the same job; else it is made once somebody has
// read.
bool FramePlanner::anybody_reads(const SubscriptionRow& row, std::uint64_t before) {
  const std::uint64_t bytes = before + frame_bytes(row.subscription.spec);
  for (Member* member : row.members) {
    if (member->may_take(row.subscription.id, bytes)) return true;
  }
  unread_ = true;
  return false;
}

// Whether there is memory for a first frame of the row, beside `before` bytes of the same job, and somebody
// who reads it; else who waits for it goes on waiting.
bool FramePlanner::fits(const SubscriptionRow& row, std::uint64_t before, Clock::time_point now) {
  const std::uint64_t bytes = frame_bytes(row.subscription.spec);
  if (before > 0 && before + bytes > kTurn) return false;
  if (!anybody_reads(row, before)) return false;
  if (!memory_.must_wait(bytes, before)) return true;
  activity_.wait_for_memory(now, memory_.large(bytes));
  return false;
}

bool FramePlanner::selects(const FramePlan& plan, SubscriptionRow& row, std::uint64_t before) {
  if ((row.kind() & plan.kinds) == 0) return false;
  switch (plan.shows) {
    case FramePlan::Shows::present:
      return row.waiting_since && fits(row, before, plan.now);
    case FramePlan::Shows::newest:
      return row.waiting_since && (row.shown ? anybody_reads(row, before) : fits(row, before, plan.now));
    case FramePlan::Shows::next:
      break;
  }
  if (!row.waiting_since && row.held_back(plan.now)) return false;
  if (row.waiting_since && !row.shown) return fits(row, before, plan.now);
  if (!row.shown || anybody_reads(row, before)) return true;
  row.wait(plan.now);
  return false;
}

bool FramePlanner::anything(const FramePlan& plan) {
  auto& rows = table_.rows();
  return std::any_of(rows.begin(), rows.end(), [&](SubscriptionRow& row) { return selects(plan, row, 0); });
}

std::uint64_t FramePlanner::fill(const FramePlan& plan, PoseJob& job) {
  std::uint64_t bytes = 0;
  for (SubscriptionRow& row : table_.rows()) {
    if (!selects(plan, row, bytes)) continue;
    if (plan.shows == FramePlan::Shows::newest)
      job.request.arrived = std::min(job.request.arrived, *row.waiting_since);
    add(plan, row, job);
    bytes += frame_bytes(row.subscription.spec);
  }
  job.reservation = MemoryBudget::Reservation(memory_, bytes);
  return bytes;
}

// A row that finds no memory is what it was.
void FramePlanner::add(const FramePlan& plan, SubscriptionRow& row, PoseJob& job) const {
  Subscription& shown = job.subscriptions.emplace_back(row.subscription);
  ask_levels(row, plan);
  const MeshSpec* mesh = row.mesh();
  if (mesh && !row.subscription.quality) row.subscription.quality = known_quality(*mesh, plan, job);
  row.begin_frame(plan.now);
  shown.levels = row.subscription.levels;
  shown.quality = row.subscription.quality;
  shown.keyframes = row.take_keyframes(plan.now, plan.keyframes_at_once);
  const auto& streams = shown.streams;
  if (plan.shows == FramePlan::Shows::present && plan.present == 0 && !job.digests && streams.size() == 1 &&
      streams[0]->plain())
    shown.rest = model_->rest_pose.positions(mesh->tissues);
}

// Of these tissues, what was wholly measured before: of the present pose where that is shown again, else of
// another one, which will do within a stream.
std::shared_ptr<const v1::PoseQuality> FramePlanner::known_quality(const MeshSpec& spec,
                                                                   const FramePlan& plan,
                                                                   const PoseJob& job) const {
  const bool again = plan.shows == FramePlan::Shows::present;
  for (const SubscriptionRow& row : std::as_const(table_).rows()) {
    const MeshSpec* mesh = row.mesh();
    const auto& quality = row.subscription.quality;
    if (mesh && quality && !quality->overlap_pending() && mesh->tissues == spec.tissues &&
        (!again || quality->pose_sequence() == plan.present))
      return quality;
  }
  if (again && plan.present != 0) return nullptr;
  return model_->rest_pose.quality(spec.tissues, job.thresholds);
}

}  // namespace ecorche::server
