// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/strays.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

namespace ecorche::label_surfaces {
namespace {

struct Strays {
  std::int64_t voxels = 0;
  std::array<double, 3> first{0, 0, 0};
};

Strays voxels_of(const CaseLabels& labels, const LabelSource& source) {
  Strays out;
  const auto look = [&](const Image& layer) {
    with_scalar_type(layer.type, [&](auto zero) {
      const auto voxels = layer.scalars<decltype(zero)>();
      const auto nx = static_cast<std::size_t>(layer.grid.size[0]),
                 ny = static_cast<std::size_t>(layer.grid.size[1]);
      for (std::size_t v = 0; v < voxels.size(); ++v) {
        const auto id = static_cast<std::int64_t>(voxels[v]);
        if (std::find(source.ids.begin(), source.ids.end(), id) == source.ids.end()) continue;
        if (out.voxels++ > 0) continue;
        out.first = layer.grid.point(static_cast<double>(v % nx), static_cast<double>(v / nx % ny),
                                     static_cast<double>(v / (nx * ny)));
      }
    });
  };
  look(labels.image);
  for (const Image& layer : labels.overlaps) look(layer);
  return out;
}

std::string describe(const Strays& strays) {
  std::array<char, 160> text{};
  if (strays.voxels == 1) {
    std::snprintf(text.data(), text.size(), "its only voxel, at [%.1f, %.1f, %.1f], lies off the body",
                  strays.first[0], strays.first[1], strays.first[2]);
  } else {
    std::snprintf(text.data(), text.size(),
                  "all of its %lld voxels lie off the body, the first at [%.1f, %.1f, %.1f]",
                  static_cast<long long>(strays.voxels), strays.first[0], strays.first[1], strays.first[2]);
  }
  return text.data();
}

bool gave_nothing(const std::optional<LabelSource>& source, const SurfaceMesh& surface) {
  return source && surface.F.rows() == 0;
}

[[noreturn]] void refuse(const LabelSource& source, const std::string& name, const Strays& strays) {
  if (strays.voxels == 0 || source.side != Side::both || source.within)
    throw Error(ErrorKind::config, source.where, "its labels have no voxel there",
                "check its ids, side and within");
  throw Error(ErrorKind::config, source.where, "'" + name + "': " + describe(strays),
              "mend the label map, leave the label out, or join it to the body by the skin's close_mm");
}

}  // namespace

void drop_strays(Case& patient, const Context& context) {
  const auto need = [&](const std::optional<LabelSource>& source, const SurfaceMesh& surface,
                        const std::string& name) {
    if (gave_nothing(source, surface)) refuse(*source, name, voxels_of(*patient.labels, *source));
  };
  need(patient.skin_source, patient.skin, patient.skin_name);
  for (const CaseBone& bone : patient.bones) need(bone.source, bone.surface, bone.name);
  std::erase_if(patient.tissues, [&](const CaseTissue& tissue) {
    if (!gave_nothing(tissue.source, tissue.surface)) return false;
    const Strays strays = voxels_of(*patient.labels, *tissue.source);
    const bool limited = tissue.source->side != Side::both || tissue.source->within;
    if (strays.voxels == 0 || strays.voxels > kStray || limited) refuse(*tissue.source, tissue.name, strays);
    context.warn(tissue.source->where + ": '" + tissue.name + "': " + describe(strays) +
                 "; it is left out (take the label out of the image, or say except: in the entry)");
    return true;
  });
}

}  // namespace ecorche::label_surfaces
