// SPDX-License-Identifier: Apache-2.0
// Posed volumes by the inverse map of each deformed tet (Sujar18 4).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

enum class Sampling : std::uint8_t { nearest, trilinear };

/// Which tet holds each voxel centre of a posed grid. Filled once per pose, used for any number of volumes on
/// that grid.
struct InverseMap {
  static constexpr std::int32_t none = -1;
  ImageGrid grid;
  std::vector<std::int32_t> tet;  ///< grid.voxels(); `none` outside the posed body
};

/// The grid of `rest` (spacing, direction and lattice kept) grown in whole voxels to hold every posed node,
/// never smaller than `rest`. `nodes`: 3 * #nodes, LPS mm. Throws Error{data} beyond 2^31 voxels, or for a
/// node that is not finite.
ImageGrid grow_to(const ImageGrid& rest, std::span<const float> nodes);

/// The piece of the same endless lattice that just holds every node. Throws as grow_to.
ImageGrid lattice_over(const ImageGrid& lattice, std::span<const float> nodes);

/// Tets and where their nodes go: 3 * #nodes coordinates each, LPS mm. Refers to all three. Posing goes from
/// rest to posed; the way back is the same with the two exchanged.
struct Deformation {
  const Tets& tets;
  std::span<const float> rest, posed;

  /// From the pose to the scan.
  Deformation back() const { return {tets, posed, rest}; }
};
/// That of `model` posed as `nodes`.
inline Deformation deformation(const Model& model, std::span<const float> nodes) {
  return {model.tets, {model.nodes.data(), static_cast<std::size_t>(model.nodes.size())}, nodes};
}

/// Every voxel whose centre lies in a posed tet gets one: tets of positive posed volume before inverted ones,
/// then the lowest index. Faces belong to both their tets, with a margin of about 1e-9 voxel that absorbs
/// rounding: no voxel is lost on a shared face. Tets flatter than that margin hold nothing (their neighbours
/// do). The result is the same for any number of threads, each of which fills slabs of the last axis.
/// Error{interrupted} on a stop.
void locate(const Deformation& body, const ImageGrid& grid, InverseMap& out, const Context& context = {});
/// Of a model, as volumes are posed: `out.tet` are drawn tets (rigid_copies.hpp), the model's own where none
/// is contested.
void locate(const Model& model, std::span<const float> nodes, const ImageGrid& grid, InverseMap& out,
            const Context& context = {});

/// `volume` carried along: each voxel of map.grid takes the sample at its rest point, or `background` where
/// no tet holds it or the rest point's sample lies beyond the image. Scalar type and components are kept;
/// integers are rounded and saturated. Labels are always sampled nearest. The volume's own grid may differ
/// from map.grid.
Image resample(const Deformation& body, const InverseMap& map, const ModelVolume& volume, Sampling sampling);
/// Of a model, with a map that locate() made of it.
Image resample(const Model& model, std::span<const float> nodes, const InverseMap& map,
               const ModelVolume& volume, Sampling sampling);

/// Posed to rest: per voxel of map.grid the vector (rest point - posed point), f32, 3 components, LPS mm,
/// zero outside; and the u8 mask of the voxels where it holds. `map`: of locate() of the same model and
/// nodes.
struct DisplacementField {
  Image vectors;
  Image mask;
};
DisplacementField inverse_displacement(const Model& model, std::span<const float> nodes,
                                       const InverseMap& map);

}  // namespace ecorche::runtime
