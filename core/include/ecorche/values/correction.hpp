// SPDX-License-Identifier: Apache-2.0
// What finite elements say that skinning about centres of rotation misses, and how far a joint may be
// believed.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace ecorche {

/// One joint's displacement fields, added to skinning about centres of rotation (pose space deformation:
/// Lewis00; of finite elements, compressed and local to a joint: Kry02). At a turn of the joint that is
/// sample s, node[n] is moved by sum over modes m of mix(s, m) scale[m] field[m][n], in the frame that
/// skinning turns with the node. At rest every field is zero.
///
/// Each joint was sampled with the others at rest: where several move the same flesh far, as both hips do the
/// groin's, it would make room twice. So their sum is taken (m + o / (1 + (o / room_mm)^4)) / (m + o) times,
/// m being the longest of their displacements of the node and o the lengths of the others together.
struct JointCorrection {
  static constexpr float room_mm = 8;  ///< little of what lies well below is lost

  /// A rotation vector a row.
  using Turns = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  /// A sample a row, a mode a column.
  using Mix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  std::int32_t joint = 0;  ///< row of the skeleton
  /// #samples by 3, rotation vectors of the joint from rest, radians, in its frame; of a hinge all along one
  /// line. Rest itself is none of them.
  Turns turn;
  Mix mix;                          ///< #samples by #modes
  std::vector<float> scale;         ///< #modes, mm
  std::vector<std::uint32_t> node;  ///< rows of the nodes that it moves, ascending
  std::vector<std::int16_t> field;  ///< #modes * #node * 3
};

/// What JointCorrection leaves of one whole pose, at one place of the body: joints that bend together make
/// other room than each alone. At a pose whose turns of `joint` are d radians away (the root of the sum of
/// squares of the angles between), node[n] is moved by (1 - (d / reach)^2)^2 scale field[n], in the frame
/// that skinning turns with the node; nothing from `reach` on.
struct PoseCorrection {
  std::string pose;  ///< what the pose is called
  std::vector<std::int32_t>
      joint;                    ///< rows of the skeleton that decide: those that move the place, ascending
  JointCorrection::Turns turn;  ///< #joint by 3, rotation vectors from rest, radians: of the pose
  double reach = 0;             ///< radians; rest and the other poses are no nearer
  float scale = 0;              ///< mm
  std::vector<std::uint32_t> node;  ///< as of JointCorrection
  std::vector<std::int16_t> field;  ///< #node * 3
};

/// How far one angle of a joint may be turned from rest, the others at rest, before the body stops being one.
/// Radians, positive; infinite where nothing was met up to `looked`.
struct SafeRange {
  static constexpr double none = std::numeric_limits<double>::infinity();
  static constexpr double not_looked = std::numeric_limits<double>::quiet_NaN();  ///< of an older model
  /// Where each of these was met first.
  struct Ends {
    double inverted = none;  ///< the first free tet is turned inside out
    double volume = none;    ///< a tissue's volume has changed by a tenth
    double contact = none;   ///< flesh runs into other flesh of the body; not_looked in older models
  };

  std::int32_t joint = 0;  ///< row of the skeleton
  std::int32_t angle = 0;  ///< row of the joint's sequence
  std::int32_t way = 1;    ///< 1: towards larger anatomical angles, -1: towards smaller ones
  double looked = 0;       ///< how far: the joint's own limit, or where looking ended
  Ends skinned;            ///< by centres of rotation alone
  Ends corrected;          ///< with the correction
  double bones = none;     ///< bones of the joint's two sides run into each other by a voxel
};

}  // namespace ecorche
