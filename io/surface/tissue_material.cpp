// SPDX-License-Identifier: Apache-2.0
#include "io/surface/tissue_material.hpp"

#include <array>
#include <cmath>
#include <string>

namespace ecorche::io::gltf {
namespace {

using Colour = std::array<double, 3>;  // sRGB, 0 to 1

struct Named {
  std::string_view word;
  Colour colour;
};

constexpr Named kWords[] = {
    {"lung", {0.88, 0.60, 0.60}},     {"heart", {0.72, 0.14, 0.18}},   {"liver", {0.50, 0.22, 0.16}},
    {"stomach", {0.86, 0.62, 0.48}},  {"kidney", {0.55, 0.20, 0.18}},  {"spleen", {0.48, 0.15, 0.26}},
    {"brain", {0.88, 0.72, 0.70}},    {"bladder", {0.88, 0.80, 0.45}}, {"intestin", {0.85, 0.60, 0.50}},
    {"bowel", {0.85, 0.60, 0.50}},    {"vein", {0.20, 0.25, 0.60}},    {"cava", {0.20, 0.25, 0.60}},
    {"pancreas", {0.88, 0.72, 0.42}}, {"aorta", {0.80, 0.12, 0.12}},
};

Colour colour_of(Group group) {
  switch (group) {
    case Group::skin:
      return {0.93, 0.76, 0.65};
    case Group::bone:
      return {0.93, 0.89, 0.78};
    case Group::muscle:
      return {0.70, 0.25, 0.22};
    case Group::organ:
      return {0.62, 0.42, 0.55};
    case Group::vessel:
      return {0.80, 0.12, 0.12};
    case Group::nerve:
      return {0.90, 0.85, 0.35};
    case Group::cartilage:
      return {0.70, 0.80, 0.85};
    case Group::ligament:
      return {0.85, 0.82, 0.72};
    case Group::fat:
      return {0.95, 0.88, 0.55};
    case Group::other:
      break;
  }
  return {0.60, 0.60, 0.65};
}

// glTF's factors are linear (IEC 61966-2-1).
double linear(double s) {
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

}  // namespace

tinygltf::Material tissue_material(std::string_view name, Group group) {
  tinygltf::Material material;
  material.name = std::string(group_name(group));
  Colour colour = colour_of(group);
  for (const Named& named : kWords) {
    if (group == Group::skin || group == Group::bone || name.find(named.word) == name.npos) continue;
    material.name = std::string(named.word);
    colour = named.colour;
    break;
  }
  const bool skin = group == Group::skin;
  material.pbrMetallicRoughness.baseColorFactor = {linear(colour[0]), linear(colour[1]), linear(colour[2]),
                                                   skin ? 0.25 : 1.0};
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 0.6;
  material.alphaMode = skin ? "BLEND" : "OPAQUE";
  material.doubleSided = true;
  return material;
}

int add_material(tinygltf::Model& gltf, std::string_view name, Group group) {
  tinygltf::Material material = tissue_material(name, group);
  for (std::size_t i = 0; i < gltf.materials.size(); ++i) {
    if (gltf.materials[i].name == material.name) return static_cast<int>(i);
  }
  gltf.materials.push_back(std::move(material));
  return static_cast<int>(gltf.materials.size()) - 1;
}

}  // namespace ecorche::io::gltf
