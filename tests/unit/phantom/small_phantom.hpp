// SPDX-License-Identifier: Apache-2.0
// The small phantom, made once for all tests of this executable.
#pragma once

#include "phantom/body.hpp"
#include "phantom/phantom.hpp"

namespace ecorche::phantom {

inline const Phantom& small_phantom() {
  static const Phantom phantom = make(Size::small, 1, Context{});
  return phantom;
}

inline const Body& body() {
  static const Body made = make_body(1);
  return made;
}

}  // namespace ecorche::phantom
