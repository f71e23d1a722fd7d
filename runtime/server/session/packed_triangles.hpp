// SPDX-License-Identifier: Apache-2.0
// The triangles of a model for clients on thin lines.
#pragma once

#include <memory>
#include <vector>

#include <ecorche/v1/model.pb.h>
#include <ecorche/values/model.hpp>
#include <ecorche/wire/framing.hpp>

namespace ecorche::server {

/// By meshoptimizer's index codec, about a byte a triangle in place of twelve. The order of triangles and the
/// way they face are kept, the corner that each begins with is not.
struct PackedTriangles {
  std::vector<v1::Array> arrays;  ///< one per tissue, within `payload`
  std::shared_ptr<const wire::Payload> payload;
};

/// Throws bad_alloc.
PackedTriangles pack_triangles(const Model& model);

}  // namespace ecorche::server
