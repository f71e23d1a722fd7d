// SPDX-License-Identifier: Apache-2.0
// A model made ready for clients: its poser, its digests, and its description encoded once.
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/probe.hpp>
#include <ecorche/runtime/quality_meter.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/wire/framing.hpp>
#include "runtime/server/resources/payload_pool.hpp"
#include "runtime/server/session/body_pool.hpp"
#include "runtime/server/session/clip.hpp"
#include "runtime/server/session/mesh_rows.hpp"
#include "runtime/server/session/packed_triangles.hpp"
#include "runtime/server/session/rest_pose.hpp"
#include "runtime/server/session/shared_arrays.hpp"
#include "runtime/server/session/skinning_data.hpp"
#include "runtime/settle/settle_flesh.hpp"
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::server {

/// What posing a volume, or a plane of one, writes on the way, from pose to pose.
struct VolumeScratch {
  runtime::VolumePoser::Scratch tets;
  Image slice;
};

/// Shared by every thread. Does not change after construction, but for what takes long to make and not every
/// client wants, which is made when it is first asked for.
struct ServedModel {
  /// `name` is what OpenModel asks for; `clips` are of the model's rig, and so are `poses`, by which the
  /// skinning of clients is measured; `pages`, where there are any, keep what does not change.
  ServedModel(std::string name, const std::shared_ptr<const Model>& model, std::vector<Clip> clips = {},
              std::vector<NamedPose> poses = {}, std::shared_ptr<const files::PageStore> pages = {});

  const runtime::BodyPoser& poser() const { return *poser_; }
  const Model& model() const { return poser_->model(); }
  /// Whether the levels of detail of these tissues are at hand.
  bool has_levels(const std::vector<std::uint32_t>& tissues) const;
  /// Makes them, on the calling thread alone; throws bad_alloc.
  void make_levels(const std::vector<std::uint32_t>& tissues) const;
  /// Of a tissue whose levels are at hand; `level`: 1 to `coarsest_level`.
  const MeshRows& level(std::uint32_t level, std::uint32_t tissue) const {
    return levels_[tissue].levels[level - 1];
  }
  /// All levels of detail are at hand, and so are the packed triangles: they, too, are kept by the pages.
  void share_details() const;
  /// Packs the triangles, on the calling thread; throws bad_alloc.
  void pack_triangles() const;
  /// Null where they are not packed yet. From any thread.
  const PackedTriangles* packed_triangles() const { return triangles_packed_ ? &packed_triangles_ : nullptr; }
  /// On a worker, as those below; they throw bad_alloc.
  const runtime::QualityMeter& meter() const;
  const runtime::VolumePoser& volumes() const;
  const runtime::Probe& probe() const;
  /// Factors, which takes seconds; throws Error{data} where no soft tet hangs on a bone.
  const runtime::FleshSettler& settler() const;
  /// What a client skins these tissues by at this level of detail. Appends to `payload`.
  void describe_skinning(const std::vector<std::uint32_t>& tissues, std::uint32_t level,
                         v1::SkinningData& out, wire::Payload& payload) const;
  /// Of a row of Model::volumes, bridged; throws as VolumeBalls, too.
  const runtime::VolumeBalls& balls(std::size_t volume) const;

  v1::ModelSummary summary;
  v1::ModelOpened opened;                                  ///< without session, role and triangles
  std::vector<v1::Array> triangles;                        ///< one per tissue, within `topology`
  std::shared_ptr<const wire::Payload> topology;           ///< the triangles of every tissue
  float step = 0;                                          ///< mm, of the u16 encodings
  mutable std::vector<std::shared_ptr<const Clip>> clips;  ///< for the I/O thread: the file may be read again

 private:
  struct Made;
  ServedModel(Made made, std::vector<NamedPose> poses, std::shared_ptr<const files::PageStore> pages);
  std::unique_ptr<const runtime::BodyPoser> poser_;

 public:
  mutable BodyPool bodies;  ///< for jobs to pose into
  mutable BodyPool
      background_bodies;  ///< for those beside streams, which then never wait for a body to be made
  mutable RestPose rest_pose;
  /// For the frames of meshes.
  std::shared_ptr<PayloadPool> payloads = std::make_shared<PayloadPool>(4);
  std::shared_ptr<PositionsPool> positions = std::make_shared<PositionsPool>(4);
  /// For the jobs of volumes and planes; two are kept.
  std::shared_ptr<SparePool<VolumeScratch>> volume_scratch = std::make_shared<SparePool<VolumeScratch>>();

 private:
  struct Balls {
    std::once_flag made;
    std::unique_ptr<const runtime::VolumeBalls> balls;
  };

  struct Levels {
    std::once_flag once;
    std::atomic<bool> made = false;
    MeshLevels levels;
  };

  mutable std::once_flag packing_;
  mutable std::atomic<bool> triangles_packed_ = false;
  mutable PackedTriangles packed_triangles_;
  mutable std::deque<Levels> levels_;  // of every tissue
  mutable std::deque<Balls> balls_;    // of every volume
  mutable std::once_flag meter_made_, volumes_made_;
  mutable std::unique_ptr<const runtime::QualityMeter> meter_;
  mutable std::unique_ptr<const runtime::VolumePoser> volumes_;
  mutable SkinningTables skinning_;
  mutable std::once_flag probe_made_;
  mutable std::unique_ptr<const runtime::Probe> probe_;
  mutable std::once_flag settler_made_;
  mutable std::unique_ptr<const runtime::FleshSettler> settler_;
  mutable SharedArrays shared_;
};

}  // namespace ecorche::server
