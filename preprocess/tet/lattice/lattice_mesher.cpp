// SPDX-License-Identifier: Apache-2.0
// The meshers without a library: a body-centred cubic lattice, clipped to the body, graded or not, or cut.
#include <algorithm>
#include <cmath>
#include <string>

#include "preprocess/tet/lattice/clipper.hpp"
#include "preprocess/tet/lattice/cut_lattice.hpp"
#include "preprocess/tet/lattice/fit_points.hpp"
#include "preprocess/tet/lattice/float_places.hpp"
#include "preprocess/tet/lattice/octree.hpp"
#include "preprocess/tet/mesher.hpp"

namespace ecorche::tet {
namespace {

/// Finer than this many voxels a cube shows the image's steps and nothing else.
constexpr double kFinestInVoxels = 1.5;
constexpr int kCutMargin = 6;           // empty cubes around the body
constexpr double kReachInVoxels = 0.2;  // that a bone's border may leave it where the skin is near
constexpr double kTetsPower =
    2.4;  // tets of a graded lattice go by this power of 1 / side, between surface and volume

enum class Kind { uniform, graded, cut };

class LatticeMesher : public Mesher {
 public:
  explicit LatticeMesher(Kind kind) : kind_(kind) {}

  std::string_view name() const override {
    return kind_ == Kind::cut ? "lattice_cut" : kind_ == Kind::graded ? "lattice_graded" : "lattice";
  }

  TetMesh mesh(const Input& input, const Options& options, const Context& context) const override {
    const Clipper clipper(input.labels, context);
    if (clipper.body_volume() == 0)
      throw Error(ErrorKind::data, "tets", "the label image is empty", "check the skin of the case");
    // Twelve tets a cube; about 5 tets a node where there is much boundary (6 without any), both a little on
    // the safe side.
    const double tets =
        std::min(static_cast<double>(options.max_tets), 5.0 * static_cast<double>(options.max_nodes));
    check_budget(tets);
    const double finest = kFinestInVoxels * clipper.voxel();
    double side = std::max(finest, std::cbrt(12 * 1.03 * clipper.body_volume() / tets));
    const auto share_of = [&](const TetMesh& mesh) {
      return std::max(static_cast<double>(mesh.T.rows()) / static_cast<double>(options.max_tets),
                      static_cast<double>(mesh.V.rows()) / static_cast<double>(options.max_nodes));
    };
    const auto make = [&] {
      switch (kind_) {
        case Kind::cut:
          return cut(clipper.lay(side, kCutMargin, true), input, context);
        case Kind::graded:
          return grade(on_float_places(clipper.clip(side)), context);
        case Kind::uniform:
          break;
      }
      return gather(on_float_places(clipper.clip(side)));
    };
    const bool graded = kind_ != Kind::uniform;
    TetMesh mesh = make();
    if (const double used = share_of(mesh); graded && used < 0.8 && side > finest) {  // large tets made room
      side = std::max(finest, side * std::pow(used / 0.95, 1 / kTetsPower));
      mesh = make();
    }
    for (double excess = share_of(mesh); excess > 1; excess = share_of(mesh)) {
      side *= 1.01 * std::pow(excess, 1 / (graded ? kTetsPower : 3));
      context.warn("the lattice has " + std::to_string(mesh.T.rows()) + " tets and " +
                   std::to_string(mesh.V.rows()) + " nodes, more than allowed: cubes of " +
                   std::to_string(side) + " mm are tried");
      mesh = make();
    }
    if (kind_ == Kind::cut) {
      const FitReport fit = fit_points(mesh, input.patient, kReachInVoxels * clipper.voxel(), context);
      context.info(std::to_string(fit.moved) + " of " + std::to_string(fit.points) +
                   " points between materials moved to the surfaces");
    }
    context.report(1);
    return mesh;
  }

 private:
  static TetMesh cut(const BccLattice& lattice, const Input& input, const Context& context) {
    CutMesh made = cut_lattice(lattice, input, context);
    const CutReport& r = made.report;
    context.info("lattice of " + std::to_string(lattice.side()) + " mm: " + std::to_string(r.warped) +
                 " nodes moved to surfaces, " + std::to_string(r.cut) + " edges cut, " +
                 std::to_string(r.stars) + " tets where three materials meet, " + std::to_string(r.large) +
                 " larger tets, " + std::to_string(r.lent) +
                 " nodes lent to parts thinner than the lattice, " + std::to_string(r.relabelled) +
                 " tets relabelled for the sake of manifold boundaries");
    return std::move(made.mesh);
  }

  static TetMesh grade(const Clipped& clipped, const Context& context) {
    const Octree octree(clipped);
    TetMesh mesh = gather(clipped, octree);
    std::string line = "lattice of " + std::to_string(clipped.lattice.side()) + " mm:";
    const std::vector<std::int64_t> cubes = octree.cubes_by_level();
    for (std::size_t level = 1; level < cubes.size() && cubes[level] > 0; ++level)
      line += (level == 1 ? " " : ", ") + std::to_string(cubes[level] >> (3 * level)) + " cubes " +
              std::to_string(1 << level) + " times as wide";
    context.info(line);
    return mesh;
  }

  Kind kind_;
};

}  // namespace

std::unique_ptr<Mesher> make_lattice_mesher() {
  return std::make_unique<LatticeMesher>(Kind::uniform);
}
std::unique_ptr<Mesher> make_lattice_graded_mesher() {
  return std::make_unique<LatticeMesher>(Kind::graded);
}
std::unique_ptr<Mesher> make_lattice_cut_mesher() {
  return std::make_unique<LatticeMesher>(Kind::cut);
}

}  // namespace ecorche::tet
