// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/packed_triangles.hpp"

#include <meshoptimizer.h>

#include <cstdint>
#include <span>
#include <utility>

#include "proto/arrays.hpp"

namespace ecorche::server {

PackedTriangles pack_triangles(const Model& model) {
  PackedTriangles packed;
  auto payload = std::make_shared<wire::Payload>();
  for (const Tissue& tissue : model.tissues) {
    const std::vector<std::uint32_t> corners(tissue.F.data(), tissue.F.data() + tissue.F.size());
    std::vector<std::uint8_t> bytes(
        meshopt_encodeIndexBufferBound(corners.size(), static_cast<std::size_t>(tissue.V.rows())));
    bytes.resize(meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), corners.data(), corners.size()));
    packed.arrays.push_back(wire::append(*payload, std::span<const std::uint8_t>(bytes), 1));
  }
  packed.payload = std::move(payload);
  return packed;
}

}  // namespace ecorche::server
