// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/mesher.hpp"

namespace ecorche::tet {

void check_budget(double tets) {
  if (tets < 100)
    throw Error(ErrorKind::usage, "--max-tets", "fewer than 100 tets", "allow more tets and nodes");
}

}  // namespace ecorche::tet
