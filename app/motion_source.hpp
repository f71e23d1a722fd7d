// SPDX-License-Identifier: Apache-2.0
// A motion file of any kind as poses of a rig, frame by frame from the disk.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include "app/cli_fwd.hpp"
#include "app/program.hpp"
#include "core/kinematics/retarget.hpp"
#include "io/motion/clip_file.hpp"

namespace ecorche::app {

/// As the command line says it.
struct MotionChoice {
  std::filesystem::path file, map, asf;
  std::string unit, frame;    ///< empty: the file's own, or its format's
  files::ReadLimits limits;   ///< of what a file may take
  std::string rest = "auto";  ///< zero, clip, a frame's number, 1.5s, CLIP:FRAME, or auto
};

/// --motion (unless `with_file` is false) and what belongs to it, with --read-budget.
void add_motion_options(CLI::App& command, MotionChoice& choice, bool with_file = true);

/// Frame and unit as the command line says them. Throws Error{usage} for words that are none.
io::MotionSpace motion_space(const MotionChoice& choice);

/// Poses that are read as they are asked for; one thread at a time.
class MotionSource {
 public:
  virtual ~MotionSource() = default;
  virtual std::size_t frames() const = 0;
  virtual double frame_seconds() const = 0;
  /// Not clamped. `frame` < frames().
  virtual Pose at(std::size_t frame) = 0;
  /// How its joints are matched, where it has joints.
  virtual const kinematics::Retarget* retarget() const { return nullptr; }
  /// Of which pose the alignment was made: `the zero pose`, `frame 12`, `the clip, ...`.
  std::string reference;
};

/// Opens `.bvh .amc .gltf .glb .mot .sto .trc` motions and `.yaml` pose sequences; notes what moves nothing
/// and where the zero pose was aligned. Throws Error{usage} for options that do not fit, Error{data} for a
/// figure more than 20 times longer or shorter than the patient, and what the readers throw.
std::unique_ptr<MotionSource> open_motion(const Program& program, const MotionChoice& choice, const Rig& rig);

}  // namespace ecorche::app
