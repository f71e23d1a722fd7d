// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/bones_rigid.hpp"

#include <tbb/parallel_for.h>

namespace ecorche::runtime {
namespace {

constexpr std::size_t kVerticesPerTask = 4096;

}  // namespace

std::string_view BonesRigid::check() const {
  if (rest.size() % 3 != 0) return "rest is not three coordinates a vertex";
  if (posed.size() != rest.size()) return "posed has not the size of rest";
  return {};
}

void BonesRigid::run() const {
  const RootMotion carried = make_motions({&motion, 1}, origin, {});
  const Vec3f nowhere{0, 0, 0};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, rest.size() / 3, kVerticesPerTask),
                    [&](const auto& vertices) {
                      for (std::size_t v = vertices.begin(); v < vertices.end(); ++v) {
                        carry_with_root(carried, &rest[3 * v], nowhere, &posed[3 * v]);
                      }
                    });
}

}  // namespace ecorche::runtime
