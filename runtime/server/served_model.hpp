// SPDX-License-Identifier: Apache-2.0
// A model made ready for clients: its poser, its digests, and its description encoded once.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "core/values/model.hpp"
#include "proto/framing.hpp"
#include "runtime/probe/probe.hpp"
#include "runtime/quality/quality_meter.hpp"
#include "runtime/server/body_pool.hpp"
#include "runtime/server/clip.hpp"
#include "runtime/server/mesh_rows.hpp"
#include "runtime/server/payload_pool.hpp"
#include "runtime/skin/body_poser.hpp"
#include "runtime/spheres/pose_volume.hpp"
#include "runtime/volume/volume_poser.hpp"

namespace ecorche::server {

/// Does not change after construction; shared by every thread.
struct ServedModel {
  /// `name` is what OpenModel asks for; `clips` are of the model's rig.
  ServedModel(std::string name, const std::shared_ptr<const Model>& model, std::vector<Clip> clips = {});

  const Model& model() const { return poser.model(); }
  /// Made when somebody first probes, on a worker.
  const runtime::Probe& probe() const;
  /// Of a row of Model::volumes, bridged. Made when somebody first asks, on a worker; throws as VolumeBalls.
  const runtime::VolumeBalls& balls(std::size_t volume) const;

  runtime::BodyPoser poser;
  /// For the frames of meshes.
  std::shared_ptr<PayloadPool> payloads = std::make_shared<PayloadPool>(4);
  mutable BodyPool bodies{poser};  ///< for jobs to pose into
  runtime::VolumePoser volumes;
  runtime::QualityMeter meter;
  std::vector<MeshParts> levels;  ///< of detail, from 1 on
  float step = 0;                 ///< mm, of the u16 encodings
  std::vector<std::shared_ptr<const Clip>> clips;
  v1::ModelSummary summary;
  v1::ModelOpened opened;                         ///< without session, role and triangles
  std::vector<v1::Array> triangles;               ///< one per tissue, within `topology`
  std::shared_ptr<const wire::Payload> topology;  ///< the triangles of every tissue

 private:
  struct Balls {
    std::once_flag made;
    std::unique_ptr<const runtime::VolumeBalls> balls;
  };

  mutable std::deque<Balls> balls_;  // of every volume
  mutable std::once_flag probe_made_;
  mutable std::unique_ptr<const runtime::Probe> probe_;
};

}  // namespace ecorche::server
