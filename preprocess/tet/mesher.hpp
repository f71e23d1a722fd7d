// SPDX-License-Identifier: Apache-2.0
// Tetrahedral meshers behind one interface, chosen by name (Sujar18 3.2).
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::tet {

struct Options {
  std::int64_t max_tets = 3'500'000;
  std::int64_t max_nodes = 800'000;
  double seconds = 600;  ///< a mesher that takes longer is stopped (TetGen: in a child process)
};

/// What a mesher works from; it may use either.
struct Input {
  const Case& patient;
  const Image& labels;  ///< of voxel::voxelize
};

class Mesher {
 public:
  virtual ~Mesher() = default;
  virtual std::string_view name() const = 0;
  /// Tets of the whole body, labelled as TetMesh says, with positive volume, no duplicate or unused node.
  /// Never more than options.max_tets and max_nodes: sizes are coarsened, with a warning, until they hold.
  /// Throws Error{data} when no mesh can be made, naming what stood in the way and another mesher to try.
  virtual TetMesh mesh(const Input& input, const Options& options, const Context& context) const = 0;
};

std::unique_ptr<Mesher> make_lattice_mesher();  ///< tet/lattice, Apache-2.0; uncut
std::unique_ptr<Mesher>
make_lattice_graded_mesher();  ///< tet/lattice, Apache-2.0; uncut, larger away from borders
std::unique_ptr<Mesher> make_lattice_cut_mesher();  ///< tet/lattice, Apache-2.0; cut at the surfaces
std::unique_ptr<Mesher> make_cgal_mesher();         ///< tet/cgal, GPL
std::unique_ptr<Mesher> make_tetgen_mesher();       ///< tet/tetgen, AGPL

/// Names of the meshers in this build; the first is the default. It is `lattice`: it keeps every
/// weight within its bounds without repair, as of the others only `lattice_graded` does, folds no more than
/// cgal when posed, and takes a hundredth of its time.
std::vector<std::string_view> mesher_names();

/// Throws Error{usage} for a name that this build does not have.
std::unique_ptr<Mesher> make_mesher(std::string_view name);

/// Throws Error{usage} where nothing like a body can be made of so few tets.
void check_budget(double tets);

/// What every mesh passes before the next stage: nodes narrowed to float32 (the run-time precision; all later
/// stages see exactly those coordinates), merged where equal, dropped where unused and renumbered along a
/// Morton curve; tets sorted along it, each with its lowest node first. The result depends on the geometry
/// alone, not on the order it came in. Throws Error{internal} for a tet that single precision makes flat or
/// inverted, naming its place.
void canonicalize(TetMesh& mesh);

}  // namespace ecorche::tet
