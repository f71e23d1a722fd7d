// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/mesher.hpp"

namespace ecorche::tet {

std::vector<std::string_view> mesher_names() {
#ifdef ECORCHE_GPL
  return {"lattice", "lattice_graded", "lattice_cut", "cgal", "tetgen"};
#else
  return {"lattice", "lattice_graded", "lattice_cut"};
#endif
}

std::unique_ptr<Mesher> make_mesher(std::string_view name) {
#ifdef ECORCHE_GPL
  if (name == "cgal") return make_cgal_mesher();
  if (name == "tetgen") return make_tetgen_mesher();
#endif
  if (name == "lattice") return make_lattice_mesher();
  if (name == "lattice_graded") return make_lattice_graded_mesher();
  if (name == "lattice_cut") return make_lattice_cut_mesher();
  std::string known;
  for (const std::string_view each : mesher_names()) known.append(known.empty() ? "" : ", ").append(each);
  throw Error(ErrorKind::usage, "--mesher", "there is no mesher \"" + std::string(name) + "\" in this build",
              "choose one of " + known);
}

}  // namespace ecorche::tet
