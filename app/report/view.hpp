// SPDX-License-Identifier: Apache-2.0
// Looking at a body along one of its axes, and drawing surfaces so.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "app/report/picture.hpp"

namespace ecorche::app::report {

/// An orthographic view, LPS mm to pixels: `across` runs to the right of the picture, `up` to its top, and
/// what has the larger `toward` is nearer.
struct View {
  Eigen::Vector3d across, up, toward;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double pixel_mm = 1;
  int width = 1, height = 1;

  /// From the front: the patient's left is on the right.
  static View coronal() { return {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}; }
  /// From the patient's left: the back is on the right.
  static View sagittal() { return {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}; }
  /// From the feet, as radiologists look: the front on top, the patient's left on the right.
  static View axial() { return {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}; }

  /// The same view of the box `low`..`high` with a margin of 4 %, its longer side `pixels` long.
  View of(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int pixels) const;

  double x(const Eigen::Vector3d& p) const { return (p - centre).dot(across) / pixel_mm + 0.5 * (width - 1); }
  double y(const Eigen::Vector3d& p) const { return 0.5 * (height - 1) - (p - centre).dot(up) / pixel_mm; }
  /// The point of a pixel's centre on the plane through `centre`.
  Eigen::Vector3d point(double column, double row) const {
    return centre + pixel_mm * ((column - 0.5 * (width - 1)) * across + (0.5 * (height - 1) - row) * up);
  }
};

/// Draws surfaces of one view into a picture, nearer ones over farther ones; twice as fine inside, so that
/// edges are soft.
class Scene {
 public:
  Scene(const View& view, const Colour& ground);

  /// Flat, as seen through: a share of `colour` over what is there, no depth.
  void shadow(const PointsF& V, const Triangles& F, const Colour& colour, double share);
  /// Lit from the viewer.
  void surface(const PointsF& V, const Triangles& F, const Colour& colour);
  /// A ring about a point, over everything.
  void mark(const Eigen::Vector3d& p, double radius_px, const Colour& colour);

  /// What was drawn, in the view's size.
  Picture picture() const;

 private:
  template <class Pixel>
  void triangles(const PointsF& V, const Triangles& F, Pixel&& pixel);

  View view_;  // twice as fine as the one that was asked for
  Picture picture_;
  std::vector<float> depth_;
};

}  // namespace ecorche::app::report
