// SPDX-License-Identifier: Apache-2.0
// Outside libraries that do a part of what posing does. Each is its own unit, built where CMake finds it;
// plain values only, since they bring their own versions of Eigen and their own instruction sets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

// Peers with a library of their own show this and nothing else of it.
#define ECORCHE_PEER_API [[gnu::visibility("default")]]

namespace ecorche::bench {

/// Points hung on segments: what a skinning library is given.
struct HungPoints {
  std::vector<float> at;               ///< 3 * #P, mm
  std::vector<std::uint32_t> begin;    ///< #P + 1, rows of the two below
  std::vector<std::uint16_t> segment;  ///< of a point, heaviest first
  std::vector<float> weight;           ///< above 1e-4; those of a point sum to 1
  std::size_t segments = 0;

  std::size_t points() const { return at.size() / 3; }
};

/// A rigid motion: unit quaternion w, x, y, z, its sign fixed down the tree; translation, mm.
struct Motion {
  std::array<double, 4> turn;
  std::array<double, 3> shift;
};

class ECORCHE_PEER_API SkinningPeer {
 public:
  virtual ~SkinningPeer() = default;
  /// One frame; `motions`: #segments, from rest.
  virtual void pose(std::span<const Motion> motions) = 0;
  /// Where it put a point in the last frame.
  virtual std::array<double, 3> at(std::size_t point) const = 0;

  std::string name;         ///< library, version, class, and what it leaves out
  bool dqs = false;         ///< else LBS
  std::size_t threads = 1;  ///< that it takes
};
using Peers = std::vector<std::unique_ptr<SkinningPeer>>;

/// SkinningJob of ozz-animation: float, the four heaviest weights. `copies` of the data, posed in turn.
/// Compiled as its own build does, and for this processor.
ECORCHE_PEER_API void add_ozz(const HungPoints& points, std::size_t copies, Peers& out);
ECORCHE_PEER_API void add_ozz_native(const HungPoints& points, std::size_t copies, Peers& out);
/// igl::lbs_matrix and igl::dqs: double, dense weights; dqs on one thread and on all.
ECORCHE_PEER_API void add_igl(const HungPoints& points, Peers& out);
/// vtkWeightedTransformFilter: float, all weights.
ECORCHE_PEER_API void add_vtk(const HungPoints& points, Peers& out);

/// A volume of bytes on a grid whose axes are those of space, and a body posed in it.
struct PosedGrid {
  std::array<int, 3> size;
  std::array<double, 3> spacing, origin;
  std::span<const std::uint8_t> volume;  ///< on the same grid, at rest
  std::span<const float> rest, posed;    ///< 3 * #nodes
  std::span<const std::int32_t> tets;    ///< 4 * #tets
  std::span<const float> field;          ///< 3 a voxel: from its posed to its rest place; zero outside
};

struct VtkProbed {
  std::string name;
  double ms = 0;
  std::vector<float> rest;         ///< 3 a voxel: where it was at rest
  std::vector<std::uint8_t> held;  ///< a voxel: not 0 where a tet holds it
};
/// vtkProbeFilter over the posed tets, whose points carry their rest places.
VtkProbed probe_by_vtk(const PosedGrid& grid);

struct ItkWarped {
  std::string name;
  double ms = 0;
  std::vector<std::uint8_t> values;
};
/// itk::WarpImageFilter, linear, handed the field.
ItkWarped warp_by_itk(const PosedGrid& grid);

/// Lines that Blender's armature printed for the same points, through a file and `script`; what went wrong
/// else.
std::vector<std::string> armature_by_blender(const std::string& blender, const std::string& script,
                                             const HungPoints& points,
                                             std::span<const std::vector<Motion>> frames);

}  // namespace ecorche::bench
