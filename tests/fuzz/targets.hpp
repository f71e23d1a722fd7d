// SPDX-License-Identifier: Apache-2.0
// What reads bytes of others, one function each: libFuzzer calls them (scripts/fuzz), and unit_fuzz with the
// kept corpora. They return where the bytes are refused, and abort where a promise is broken.
#pragma once

#include <cstddef>
#include <span>

namespace ecorche::fuzz {

using Bytes = std::span<const std::byte>;

/// framing: FrameReader; the first byte says in pieces of which size the rest arrives. What was read is
///   written again.
/// messages: an Envelope, its arrays against a payload, and everything that is converted to a value of ours.
/// meshes, volumes: frames one after another, as a client's decoders see them.
/// recording: wire::read_recording.
/// model: model_file::read of a good model of which bytes were changed: u24 offset, u8 value, again and
/// again. bvh, acclaim, gltf_clip, angle_table, marker_table: motion; `acclaim` is an `.asf`, a zero byte and
/// its
///   `.amc`. Frames over their length are read too.
/// stl to gltf_mesh: surfaces and tets; nrrd, mha, nifti: images; *_yaml: our own files as people write them.
///   These are held to a budget, reader_targets.cpp.
#define ECORCHE_TARGET(name) void name(Bytes bytes);
#include "tests/fuzz/targets.def"
#undef ECORCHE_TARGET

struct Target {
  const char* name;
  void (*run)(Bytes);
};
inline constexpr Target targets[] = {
#define ECORCHE_TARGET(name) {#name, name},
#include "tests/fuzz/targets.def"
#undef ECORCHE_TARGET
};

}  // namespace ecorche::fuzz
