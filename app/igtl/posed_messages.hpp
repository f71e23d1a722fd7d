// SPDX-License-Identifier: Apache-2.0
// A posed body as the messages that every client is sent.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/probe.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include <ecorche/values/context.hpp>
#include "app/igtl/bodies.hpp"
#include "app/igtl/surface_message.hpp"

namespace ecorche::app::igtl {

/// What a message is about: a newer one of the same key takes its place. In the order in which a new client
/// gets them: motions, surfaces, images.
struct Key {
  int rank = 0;
  std::string type, device;
  bool operator<(const Key& other) const {
    return std::tie(rank, type, device) < std::tie(other.rank, other.type, other.device);
  }
};
using Messages = std::map<Key, SharedBytes>;

/// What goes out.
struct Choice {
  std::vector<std::uint32_t> tissues, volumes;  ///< rows of the model, ascending
  runtime::Skinning skinning = runtime::Skinning::cor;
  runtime::Sampling sampling = runtime::Sampling::trilinear;
};

class PosedMessages {
 public:
  PosedMessages(const std::shared_ptr<const Model>& model, Choice choice);

  /// A TRANSFORM for each segment (its motion from the scan), the TDATA `joints` (where each joint's centre
  /// is, turned as its segment), a POLYDATA for each tissue. Images stay as they are, and are out of date.
  /// Throws Error{data} for a pose that cannot be.
  void pose(const Pose& pose);
  /// Whether an image goes out, or any where the name is empty.
  bool makes_image(const std::string& device) const;
  /// Whether an image is not of this pose yet.
  bool images_left() const { return next_image_ < choice_.volumes.size(); }
  /// The next of them, on its lattice grown to the posed body.
  Key pose_image(const Context& context);

  const Messages& messages() const { return messages_; }
  /// Every points' place on the other side of the pose, with the tissue that is there as its group. Points
  /// outside the body stay, in the group `outside`.
  std::vector<NamedPoint> probed(std::vector<NamedPoint> points, bool to_scan);

  /// Names that were too long for OpenIGTLink, and what became of them.
  const std::vector<std::pair<std::string, std::string>>& shortened() const { return shortened_; }

 private:
  std::vector<std::string> fitting(std::vector<std::string> names);

  Choice choice_;
  runtime::BodyPoser poser_;
  runtime::VolumePoser volume_poser_;
  runtime::Probe probe_;
  runtime::PosedBody body_;
  std::vector<std::string> segments_, volumes_;  // names that fit
  std::vector<SurfaceMessage> surfaces_;         // of the chosen tissues
  std::vector<std::pair<std::string, std::string>> shortened_;
  Messages messages_;
  std::size_t next_image_ = 0;
  runtime::VolumePoser::Scratch scratch_;
  runtime::Probe::PosedTree tree_;
  bool tree_follows_ = false;
};

}  // namespace ecorche::app::igtl
