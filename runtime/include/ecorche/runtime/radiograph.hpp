// SPDX-License-Identifier: Apache-2.0
// A picture as an X-ray source and a flat detector would make it of the posed body: Beer and Lambert's law
// along the ray to every pixel. One energy, a point source, no scatter, no noise.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <ecorche/runtime/attenuation.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::runtime {

/// A flat rectangle of pixels, each as wide and high as the next. Either handedness: `right` and `down` say
/// how the picture is hung.
struct Detector {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the rectangle, LPS mm
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();  ///< unit vector along a row of pixels
  Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();  ///< unit vector along a column, at right angles to it
  std::array<double, 2> size_mm{430, 430};           ///< width and height; a cassette of 17 by 17 inches
  std::array<std::int32_t, 2> pixels{512, 512};      ///< columns and rows

  /// Width and height of one, mm.
  std::array<double, 2> pixel_mm() const { return {size_mm[0] / pixels[0], size_mm[1] / pixels[1]}; }
  /// The centre of the pixel in that column and row, LPS mm.
  Eigen::Vector3d point(double column, double row) const;
  /// How many there are.
  std::size_t count() const {
    return static_cast<std::size_t>(pixels[0]) * static_cast<std::size_t>(pixels[1]);
  }
};

/// Source and detector in the same space.
struct XRaySetup {
  Eigen::Vector3d source = Eigen::Vector3d::Zero();  ///< LPS mm
  Detector detector;

  /// Source to detector along the detector's normal (SID), mm.
  double source_to_detector() const;
  /// The same setup carried along.
  XRaySetup moved(const RigidTransform& motion) const;
};

/// Throws Error{usage} for what cannot be traced: numbers that are not finite, pixels or a size of none, more
/// than 8192 pixels a side, axes that are no unit vectors at right angles, a source nearer than 1 mm to the
/// detector's plane.
void check(const XRaySetup& setup);

/// A posed scan as attenuation, made once and traced from any side: a crop around all that attenuates, with
/// empty voxels about it, in 16 bits. 65535 steps to its densest voxel round a ray of 500 voxels by less than
/// 1e-4 of that voxel's millimetres.
struct AttenuationMap {
  ImageGrid grid;                          ///< of `steps`: border included
  double step = 0;                         ///< attenuation of one step, 1/mm
  std::unique_ptr<std::uint16_t[]> steps;  ///< grid.voxels(), and two more to be loaded for nothing
  std::size_t room = 0;                    ///< numbers that `steps` has room for
  /// A byte for every block of so many voxels a side, i fastest, the last ones cut short by the grid: 0 where
  /// nothing of it attenuates. Rays pass it by.
  static constexpr std::int32_t block = 16;
  std::array<std::int32_t, 3> blocks{};
  std::vector<std::uint8_t> occupied;
};

/// That of `hu`: one component, Hounsfield units, any scalar type; what is no number is air. `out` keeps its
/// memory from pose to pose. O(voxels). Throws Error{usage} for several components, and where what attenuates
/// fills more than 2^30 voxels.
void attenuation_map(const Image& hu, const Attenuation& attenuation, AttenuationMap& out,
                     const Context& context = {});
/// The same for one call.
AttenuationMap attenuation_map(const Image& hu, const Attenuation& attenuation, const Context& context = {});

/// The integral of attenuation from the source to every pixel, row by row from the top: no unit; the share of
/// photons that comes through is exp(-it). By Joseph82: a ray is sampled where it crosses the planes of voxel
/// centres across the axis along which it runs fastest, between four voxels of each. Exact where attenuation
/// is linear between voxels along that axis. Same bytes for any number of threads. Throws as check() and
/// Error{interrupted}.
std::vector<float> line_integrals(const AttenuationMap& map, const XRaySetup& setup,
                                  const Context& context = {});

/// The same of a body that has no scan, from closed surfaces: for each, the millimetres between its front and
/// back faces along the ray, times what it attenuates beyond the soft tissue that it lies in; of the skin,
/// times soft tissue. What a tissue attenuates says nominal_hu(). Surfaces that are not closed are left out
/// and told of in `context`. All tissues of `body` must be posed. Throws as above, Error{config} where the
/// skin is not closed, and Error{usage} where the body reaches behind the source.
std::vector<float> line_integrals(const Model& model, const PosedBody& body, const Attenuation& attenuation,
                                  const XRaySetup& setup, const Context& context = {});

/// How integrals become grey values of 16 bits, dense is bright.
struct Exposure {
  /// Of brightness.
  enum class Scale : std::uint8_t {
    log,     ///< grey grows with the integral, as processed detectors show it
    linear,  ///< grey falls with the share of photons that comes through, as on film
  };
  Scale scale = Scale::log;
  double low = 0;   ///< integral that is black
  double high = 0;  ///< integral that is white; at most `low`: the largest of the picture
};

/// With `high` as it is used.
Exposure fitted(const Exposure& exposure, std::span<const float> integrals);

/// One grey value an integral.
std::vector<std::uint16_t> expose(std::span<const float> integrals, const Exposure& exposure);

}  // namespace ecorche::runtime
