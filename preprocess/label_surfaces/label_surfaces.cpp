// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/label_surfaces.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <mutex>

#include "preprocess/label_surfaces/hold_apart.hpp"
#include "preprocess/label_surfaces/mask.hpp"
#include "preprocess/label_surfaces/strays.hpp"
#include "preprocess/label_surfaces/surface_net.hpp"

namespace ecorche::label_surfaces {
namespace {

SurfaceMesh surface_of(Mask mask, const ImageGrid& grid, const Context& context) {
  if (mask.inside.empty()) return {};
  SurfaceNet net = make_net(mask, context);
  mask.inside = {};
  smooth(net, context);
  restore_volume(net);
  SurfaceMesh mesh = triangulate(net);
  Eigen::Matrix3d to_lps =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(grid.direction.data()) *
      Eigen::Vector3d(grid.spacing[0], grid.spacing[1], grid.spacing[2]).asDiagonal();
  const Eigen::RowVector3d origin(grid.origin[0], grid.origin[1], grid.origin[2]);
  const Eigen::RowVector3d low(mask.low[0], mask.low[1], mask.low[2]);
  mesh.V = (((mesh.V.rowwise() + low) * to_lps.transpose()).rowwise() + origin).eval();
  if (to_lps.determinant() < 0) mesh.F.col(1).swap(mesh.F.col(2));
  return mesh;
}

struct Job {
  const LabelSource* source;
  SurfaceMesh* surface;
  std::size_t work;
};

}  // namespace

SurfaceMesh extract(const CaseLabels& labels, const LabelSource& source, const Context& context) {
  return surface_of(LabelBlocks(labels, context).mask(source, context), labels.image.grid, context);
}

void resolve(Case& patient, const Context& context) {
  std::vector<Job> jobs;
  const auto add = [&](const std::optional<LabelSource>& source, SurfaceMesh& surface) {
    if (source) jobs.push_back({&*source, &surface, 0});
  };
  add(patient.skin_source, patient.skin);
  for (CaseBone& bone : patient.bones) add(bone.source, bone.surface);
  for (CaseTissue& tissue : patient.tissues) add(tissue.source, tissue.surface);
  if (jobs.empty()) return;
  if (!patient.labels) {
    throw Error(ErrorKind::config, jobs.front().source->where, "the case has no labels",
                "name them under labels");
  }
  if (patient.labels->apart && !patient.labels->apart->limbs.empty()) hold_apart(patient, context);
  LabelBlocks blocks(*patient.labels, context);
  std::optional<Mask> body;
  if (patient.skin_source && patient.skin_source->ids.empty()) {
    body = blocks.mask(*patient.skin_source, context);
    blocks.keep_within(*body);
  }
  for (Job& job : jobs) job.work = blocks.work(*job.source);
  // The largest first, so that no thread is left alone with it; each job is one thread's.
  std::stable_sort(jobs.begin(), jobs.end(), [](const Job& a, const Job& b) { return a.work > b.work; });

  const Context quiet = context.quiet();
  std::atomic<std::size_t> next{0};
  std::size_t done = 0;
  std::mutex mutex;
  tbb::parallel_for(0, tbb::this_task_arena::max_concurrency(), [&](int) {
    for (std::size_t j = next++; j < jobs.size(); j = next++) {
      const bool whole = body && jobs[j].surface == &patient.skin;
      Mask mask = whole ? std::move(*body) : blocks.mask(*jobs[j].source, quiet);
      *jobs[j].surface = surface_of(std::move(mask), patient.labels->image.grid, quiet);
      const std::lock_guard lock(mutex);
      context.report(static_cast<double>(++done) / static_cast<double>(jobs.size()));
    }
  });
  context.check_stop();
  drop_strays(patient, context);
  if (patient.labels->apart) patient.labels->apart->limbs.clear();
  patient.skin_source.reset();
  for (CaseBone& bone : patient.bones) bone.source.reset();
  for (CaseTissue& tissue : patient.tissues) tissue.source.reset();
}

}  // namespace ecorche::label_surfaces
