// SPDX-License-Identifier: Apache-2.0
// The frames of one volume subscription, one after another.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/wire/framing.hpp>
#include "runtime/server/resources/memory_budget.hpp"
#include "runtime/server/resources/payload_pool.hpp"
#include "runtime/server/session/hung_spheres.hpp"
#include "runtime/server/session/served_model.hpp"
#include "runtime/server/session/subscription.hpp"
#include "runtime/spheres/refilled_volume.hpp"

namespace ecorche::server {

/// Keeps the posed volume from frame to frame, so that only what moved is made again, and what changed since
/// the keyframe. One job of the session at a time uses it, on a worker.
class VolumeStream {
 public:
  /// Frames from one keyframe to the next.
  static constexpr std::uint64_t keyframe_interval = 128;

  /// `voxels`: as rest_voxels() has them, which whoever makes it counts as kept. `pool`: what it grows beyond
  /// them is counted there; null: it is not.
  VolumeStream(VolumeSpec spec, std::uint64_t voxels, std::shared_ptr<const Pool> pool = nullptr)
      : spec_(std::move(spec)),
        at_rest_(voxels),
        pool_(std::move(pool)),
        payloads_(spec_.slices.empty() ? std::make_shared<PayloadPool>() : std::make_shared<PayloadPool>(0)) {
  }

  const VolumeSpec& spec() const { return spec_; }
  /// To write() into.
  std::shared_ptr<wire::Payload> payload() const { return payloads_->take(); }

  /// What a frame shows.
  struct Shown {
    const ServedModel& model;
    const HungSpheres& hung;
    const runtime::PosedBody& body;
  };
  /// Fills grid, voxels, bricks, content and keyframe of `frame`, whose number is set. `keyframe`: somebody
  /// needs one. resource_exhausted beyond `most_voxels`, and where the lattice has grown since the rest pose
  /// and its pool lets no more be kept. Error{interrupted} on a stop. Whatever it throws, the next frame
  /// holds everything.
  Status write(const Shown& shown, std::uint64_t most_voxels, bool keyframe, v1::VolumeFrame& frame,
               wire::Payload& payload, const Context& context = {});

 private:
  struct Bounds {
    std::uint64_t most_voxels;
    const Context& context;
  };
  // The whole posed volume, or its region, into posed_.
  Status by_tets(const Shown& shown, const Bounds& bounds);
  Status by_spheres(const Shown& shown, const Bounds& bounds);
  Status reserve(const Model& model, const ImageGrid& grid, const Bounds& bounds);
  void write_slices(const Shown& shown, v1::VolumeFrame& frame, wire::Payload& payload,
                    const Context& context);
  void write_bricks(bool keyframe, std::uint64_t last_keyframe, v1::VolumeFrame& frame,
                    wire::Payload& payload);
  void put(std::span<const std::byte> voxels, const Image& like, v1::VolumeFrame& frame,
           wire::Payload& payload) const;

  VolumeSpec spec_;
  std::uint64_t at_rest_;  // voxels
  std::shared_ptr<const Pool> pool_;
  // Planes, which may hold far more than a volume, leave nothing behind that is not counted.
  std::shared_ptr<PayloadPool> payloads_;
  // Where the last frame lies, of one deformer or the other.
  struct Posed {
    const Image* image = nullptr;
    const runtime::Bricks* bricks = nullptr;
    const std::vector<std::uint8_t>* moved = nullptr;
  } posed_;
  runtime::PosedVolume kept_;
  runtime::RefilledVolume refilled_;
  std::vector<std::uint8_t> changed_;  // a brick each: since the keyframe
  ImageGrid keyframe_grid_;
  std::uint64_t keyframe_ = 0;      // number of its frame; 0: none yet
  std::uint64_t beyond_ = 0;        // bytes of the kept volume beyond those at rest
  MemoryBudget::Reservation held_;  // for those
};

}  // namespace ecorche::server
