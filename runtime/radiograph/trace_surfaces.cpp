// SPDX-License-Identifier: Apache-2.0
// Millimetres between front and back faces, of every pixel's ray: each face that a ray meets adds the way to
// it where the ray leaves a tissue, and takes it away where it enters. Triangles are drawn onto the detector
// with corners at whole parts of a pixel, so that neighbours share their edges exactly: a ray between two of
// them meets one.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/radiograph.hpp>
#include <ecorche/values/error.hpp>

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

constexpr std::int64_t kParts = 256;   // of a pixel
constexpr double kFarthest = 1 << 20;  // pixels from the detector: whole numbers stay below 2^63
constexpr std::int32_t kBand = 8;      // rows of pixels that one thread draws

// A corner on the detector's plane.
struct Corner {
  std::int64_t x = 0, y = 0;  // parts of a pixel
  double nearness = 0;        // source to detector over source to corner, both along the normal: linear there
};

// On which side of a -> b, of pixels whose centre lies exactly on it those of one of two neighbours.
struct Edge {
  std::int64_t step_x, step_y, start;
  Edge(const Corner& a, const Corner& b) : step_x(a.y - b.y), step_y(b.x - a.x), start(0) {
    const bool mine = step_x > 0 || (step_x == 0 && step_y > 0);
    start = -(step_x * a.x + step_y * a.y) - (mine ? 0 : 1);
  }
  std::int64_t at(std::int64_t x, std::int64_t y) const { return step_x * x + step_y * y + start; }
};

class Drawing {
 public:
  explicit Drawing(const XRaySetup& setup) : setup_(setup) {
    const Detector& detector = setup.detector;
    normal_ = detector.right.cross(detector.down);
    distance_ = normal_.dot(detector.centre - setup.source);
    // One that is hung as seen from the detector is mirrored: what turns left turns right in it.
    mirrored_ = distance_ < 0;
    if (mirrored_) {
      normal_ = -normal_;
      distance_ = -distance_;
    }
    ways_.resize(detector.count());
  }

  // Every corner of a tissue onto the detector. Throws Error{usage} where one lies behind the source.
  std::vector<Corner> project(std::span<const float> points, const std::string& name) const {
    const Detector& detector = setup_.detector;
    const auto [width, height] = detector.pixel_mm();
    std::vector<Corner> out(points.size() / 3);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const Vector3d way = Eigen::Map<const Eigen::Vector3f>(&points[3 * i]).cast<double>() - setup_.source;
      const double depth = normal_.dot(way);
      if (!(depth > 1)) behind(name);
      const double nearness = distance_ / depth;
      const Vector3d on = setup_.source + nearness * way - detector.centre;
      const double x = (detector.right.dot(on) + detector.size_mm[0] / 2) / width;
      const double y = (detector.down.dot(on) + detector.size_mm[1] / 2) / height;
      if (!(std::abs(x) < kFarthest && std::abs(y) < kFarthest)) behind(name);
      out[i] = {std::llround(x * kParts), std::llround(y * kParts), nearness};
    }
    return out;
  }

  // Ways through a tissue times `attenuation`, on the rows of one band.
  void draw(const Triangles& F, std::span<const Corner> corners, double attenuation, std::int32_t band) {
    const std::int64_t first = std::int64_t{band} * kBand;
    const std::int64_t last = std::min<std::int64_t>(first + kBand, setup_.detector.pixels[1]) - 1;
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
      const auto corner = [&](int c) { return corners[static_cast<std::size_t>(F(f, c))]; };
      draw(corner(0), corner(1), corner(2), attenuation, first, last);
    }
  }

  // Millimetres along the ray a unit of depth.
  std::vector<float> integrals() const {
    const Detector& detector = setup_.detector;
    std::vector<float> out(ways_.size());
    tbb::parallel_for(0, detector.pixels[1], [&](std::int32_t row) {
      for (std::int32_t column = 0; column < detector.pixels[0]; ++column) {
        const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(detector.pixels[0]) +
                              static_cast<std::size_t>(column);
        const double slant = (detector.point(column, row) - setup_.source).norm() / distance_;
        out[i] = static_cast<float>(std::max(0.0, ways_[i] * slant));
      }
    });
    return out;
  }

 private:
  [[noreturn]] static void behind(const std::string& name) {
    throw Error(ErrorKind::usage, "source", "'" + name + "' reaches beside or behind it",
                "move the source away from the body");
  }

  void draw(const Corner& a, Corner b, Corner c, double attenuation, std::int64_t first, std::int64_t last) {
    const auto inside = [](std::int64_t part) { return (part + kParts / 2) / kParts; };
    const auto [least_y, most_y] = std::minmax({a.y, b.y, c.y});
    first = std::max(first, (least_y < 0 ? 0 : inside(least_y) - 1));
    last = std::min(last, (most_y < 0 ? -1 : inside(most_y)));
    if (first > last) return;
    const auto [least_x, most_x] = std::minmax({a.x, b.x, c.x});
    const std::int64_t left = std::max<std::int64_t>(0, least_x < 0 ? 0 : inside(least_x) - 1);
    const std::int64_t right =
        std::min<std::int64_t>(setup_.detector.pixels[0] - 1, most_x < 0 ? -1 : inside(most_x));
    std::int64_t area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area == 0) return;
    // Outward triangles turn one way where the ray enters, the other where it leaves.
    double sign = (area > 0) == mirrored_ ? -attenuation : attenuation;
    if (area < 0) {
      std::swap(b, c);
      area = -area;
    }
    const Edge ab(a, b), bc(b, c), ca(c, a);
    const double whole = static_cast<double>(area);
    for (std::int64_t row = first; row <= last; ++row) {
      const std::int64_t y = row * kParts + kParts / 2;
      double* ways =
          &ways_[static_cast<std::size_t>(row) * static_cast<std::size_t>(setup_.detector.pixels[0])];
      for (std::int64_t column = left; column <= right; ++column) {
        const std::int64_t x = column * kParts + kParts / 2;
        const std::int64_t of_c = ab.at(x, y), of_a = bc.at(x, y), of_b = ca.at(x, y);
        if ((of_a | of_b | of_c) < 0) continue;
        const double u = static_cast<double>(of_b) / whole, v = static_cast<double>(of_c) / whole;
        const double nearness = a.nearness + u * (b.nearness - a.nearness) + v * (c.nearness - a.nearness);
        // What lies behind the detector is not seen.
        ways[column] += sign * distance_ / std::max(1.0, nearness);
      }
    }
  }

  const XRaySetup& setup_;
  Vector3d normal_;
  double distance_ = 0;
  bool mirrored_ = false;
  std::vector<double> ways_;  // attenuation times depth
};

}  // namespace

std::vector<float> line_integrals(const Model& model, const PosedBody& body, const Attenuation& attenuation,
                                  const XRaySetup& setup, const Context& context) {
  check(setup);
  const std::vector<std::uint8_t> closed = closed_surfaces(model);
  const double soft = attenuation.of_hu(nominal_hu(Group::skin, {}));
  struct Drawn {
    const Triangles* F;
    std::vector<Corner> corners;
    double attenuation;
  };
  std::vector<Drawn> all;
  Drawing drawing(setup);
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    const Tissue& tissue = model.tissues[t];
    const bool skin = tissue.group == Group::skin;
    const double own = attenuation.of_hu(nominal_hu(tissue.group, tissue.name));
    const double beyond = skin ? soft : own - soft;
    if (beyond == 0) continue;
    if (closed[t] == 0) {
      if (skin)
        throw Error(ErrorKind::config, "radiograph", "the surface '" + tissue.name + "' is not closed",
                    "close it with ecorche repair, or name a volume of Hounsfield units");
      context.warn("the surface '" + tissue.name + "' is not closed: it is left out of the radiograph");
      continue;
    }
    all.push_back({&tissue.F, drawing.project(body.tissues[t], tissue.name), beyond});
  }
  tbb::parallel_for(0, (setup.detector.pixels[1] + kBand - 1) / kBand, [&](std::int32_t band) {
    for (const Drawn& one : all) {
      if (context.stop.stop_requested()) return;
      drawing.draw(*one.F, one.corners, one.attenuation, band);
    }
  });
  context.check_stop();
  return drawing.integrals();
}

}  // namespace ecorche::runtime
