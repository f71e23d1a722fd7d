// SPDX-License-Identifier: Apache-2.0
// Motion clips that stay on the disk.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/pose.hpp>

namespace ecorche::io {

/// How a file's frame and unit become LPS mm.
struct MotionSpace {
  /// Signed permutation, column i is the file's axis i in LPS; default LSA: x Left, y Superior, z Anterior.
  Eigen::Matrix3d axes{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}};
  /// Of one unit of the file, mm. Default: what the file says (glTF, ASF, TRC, OpenSim), cm for BVH.
  std::optional<double> unit_mm;
  files::ReadLimits limits = {};  ///< of what a clip may take that lies in memory whole (glTF)

  Eigen::Vector3d direction(const Eigen::Vector3d& v) const { return axes * v; }
  /// A mirrored frame turns the other way round.
  Eigen::Quaterniond turn(const Eigen::Quaterniond& q) const {
    const Eigen::Vector3d v = axes.determinant() * (axes * q.vec());
    return {q.w(), v.x(), v.y(), v.z()};
  }
};

/// A clip whose frames are read as they are asked for; one thread at a time.
class ClipFile {
 public:
  virtual ~ClipFile() = default;

  /// Name, frame time and joints, parents first; no frames.
  const Clip& head() const { return head_; }
  std::size_t frames() const { return frames_; }
  /// Frame number `frame` < frames(): the root's position, LPS mm, and #joints local rotations, as in Clip.
  virtual void read(std::size_t frame, Eigen::Vector3d& root, std::span<Eigen::Quaterniond> rotation) = 0;

 protected:
  Clip head_;
  std::size_t frames_ = 0;
};

/// Opens `.bvh`, `.amc` (with its skeleton `asf`; default: the file of the same name, else that of its name
/// up to the first '_', else the only one in its folder) and the first animation of `.gltf` and `.glb`.
/// Throws Error{usage} for another ending or a unit that is none, Error{missing_input}, and Error{data} for
/// whatever is wrong in the file.
std::unique_ptr<ClipFile> open_clip(const std::filesystem::path& path, const MotionSpace& space = {},
                                    const std::filesystem::path& asf = {});

/// Every frame, in memory. Throws Error{data} for more than 2^26 rotations.
Clip read_whole(ClipFile& file);

/// Throws Error{usage} for a length that is none.
void check_unit(double unit_mm);

}  // namespace ecorche::io
