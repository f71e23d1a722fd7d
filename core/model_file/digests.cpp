// SPDX-License-Identifier: Apache-2.0
// Three questions that two bodies can be asked: the same model, the same rig, the same surfaces? Each answer
// is an XXH64 (seed 0) over canonical bytes: numbers little-endian, text as its length (u64) and its bytes.
#include <ecorche/model_file/model_file.hpp>
#include "core/model_file/digest.hpp"
#include "core/model_file/layout.hpp"

namespace ecorche::model_file {

// Per dataset, in the order of the layout: path, type name, rank, extents, then the bytes as stored.
std::uint64_t identity(const Model& model) {
  const Layout layout = lay_out(model);
  Digest digest;
  for (const Entry& entry : layout.entries()) {
    if (entry.path.starts_with("/ecorche/provenance/")) continue;
    digest.text(entry.path).text(element_name(entry.type)).number(std::uint64_t{entry.shape.size()});
    for (const std::uint64_t extent : entry.shape) digest.number(extent);
    digest.bytes(entry.bytes);
  }
  return digest.value();
}

std::uint64_t rig_digest(const Rig& rig) {
  Digest digest;
  digest.number(std::uint64_t{rig.skeleton.segments.size()});
  for (const Segment& segment : rig.skeleton.segments) {
    const Joint& joint = segment.joint;
    digest.text(segment.name).number(std::int32_t{segment.parent});
    digest.text(joint.name).number(static_cast<std::uint8_t>(joint.kind));
    for (int r = 0; r < 3; ++r) digest.number(double{joint.center[r]});
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) digest.number(double{joint.axes(r, c)});
    }
    digest.number(std::uint64_t{joint.sequence.size()});
    for (const AngleAxis& angle : joint.sequence) {
      digest.text(angle.name).number(std::int32_t{angle.axis}).number(angle.sign).number(angle.rest);
    }
  }
  return digest.value();
}

std::uint64_t topology_digest(const Model& model) {
  Digest digest;
  digest.number(std::uint64_t{model.tissues.size()});
  for (const Tissue& tissue : model.tissues) {
    digest.text(tissue.name).number(static_cast<std::uint64_t>(tissue.V.rows()));
    digest.number(static_cast<std::uint64_t>(tissue.F.rows()));
    digest.bytes(std::as_bytes(std::span(tissue.F.data(), static_cast<std::size_t>(tissue.F.size()))));
  }
  return digest.value();
}

}  // namespace ecorche::model_file
