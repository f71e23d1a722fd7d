// SPDX-License-Identifier: Apache-2.0
// Accessors of a glTF: tinygltf parses them and believes them; here their bytes are held against their
// buffers.
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <string>
#include <vector>

#include <ecorche/files/budget.hpp>

namespace ecorche::io::gltf {

/// Row-major values of accessor `number`, `components` a row, as reals: normalized integers are mapped to
/// [-1, 1] or [0, 1]. They are taken out of the file's budget: nodes may share an accessor. Throws
/// Error{data} for what lies outside its buffer or has another shape.
std::vector<double> reals(const tinygltf::Model& model, int number, int components, files::Budget& budget);

/// The values of a scalar accessor of whole numbers.
std::vector<std::int64_t> wholes(const tinygltf::Model& model, int number, files::Budget& budget);

}  // namespace ecorche::io::gltf
