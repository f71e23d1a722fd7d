// SPDX-License-Identifier: AGPL-3.0-or-later
#include "preprocess/tet/mesher.hpp"

namespace ecorche::tet {
namespace {

class TetgenMesher : public Mesher {
 public:
  std::string_view name() const override { return "tetgen"; }
  TetMesh mesh(const Input&, const Options&, const Context&) const override {
    throw Error(ErrorKind::data, "tetgen", "the surfaces cannot be meshed", "use --mesher cgal");
  }
};

}  // namespace

std::unique_ptr<Mesher> make_tetgen_mesher() { return std::make_unique<TetgenMesher>(); }

}  // namespace ecorche::tet
