// SPDX-License-Identifier: Apache-2.0
// How tissues look in files that carry materials: the colours of scripts/renderer, as glTF wants them.
#pragma once

#include <tiny_gltf.h>

#include <string_view>

#include <ecorche/values/case.hpp>

namespace ecorche::io::gltf {

/// A metallic-roughness material for a tissue: the colour that anatomists' atlases give its name (a vein is
/// blue), else that of its group. Skin is translucent (alpha 0.25), since it would hide everything else.
/// Colours are linear, both sides are drawn. Named `skin`, `bone`, `muscle`, ... or by the word that chose
/// it.
tinygltf::Material tissue_material(std::string_view name, Group group);

/// The number of that material in `gltf`, which is added where it is not there yet.
int add_material(tinygltf::Model& gltf, std::string_view name, Group group);

}  // namespace ecorche::io::gltf
