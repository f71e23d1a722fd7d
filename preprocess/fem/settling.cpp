// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/settling.hpp"

#include <algorithm>
#include <memory>

#include "core/elastic/settler.hpp"

namespace ecorche::fem {
namespace {

using elastic::Settler;

std::shared_ptr<const Settler> settler_of(const Mesh& mesh, const Lame& lame, const Context& context) {
  std::vector<Settler::Tet> tets(mesh.tets());
  for (std::size_t t = 0; t < tets.size(); ++t) std::copy_n(&mesh.corner[4 * t], 4, tets[t].begin());
  std::vector<std::uint8_t> held(mesh.free.size());
  std::transform(mesh.free.begin(), mesh.free.end(), held.begin(),
                 [](std::int32_t n) { return n < 0 ? 1 : 0; });
  return std::make_shared<const Settler>(mesh.X, tets, mesh.stiffness, held, lame, context);
}

}  // namespace

std::function<int(Points& x, const Context& context)> settling(const Mesh& mesh, const Material& material) {
  const std::optional<Lame> lame = material.settles_by();
  if (mesh.element != Element::p1 || !lame) return nullptr;
  return [&mesh, lame = *lame, settler = std::shared_ptr<const Settler>()](Points& x,
                                                                           const Context& context) mutable {
    if (!settler) settler = settler_of(mesh, lame, context);
    constexpr elastic::SettleOptions options{.most_steps = 200, .enough_mm = 1e-3};
    return settler->run({x.data(), static_cast<std::size_t>(x.size())}, options, context).steps;
  };
}

}  // namespace ecorche::fem
