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
/// requests: frames of a client to a server of the toy body; the first byte says what goes before them.
/// web: a client of the HTTP port, in pieces as the first byte says.
/// model: model_file::read of a good model of which bytes were changed: u24 offset, u8 value, again and
///   again. model_parts: one of which datasets were rewritten, so that HDF5 and the digests are in order.
/// bvh, acclaim, gltf_clip, angle_table, marker_table: motion; `acclaim` is an `.asf`, a zero byte and its
///   `.amc`. Frames over their length are read too.
/// All others are files as people and programs write them, held to a budget: reader_targets.cpp.
#define ECORCHE_TARGET(name, sources) void name(Bytes bytes);
#include "tests/fuzz/targets.def"
#undef ECORCHE_TARGET

struct Target {
  const char* name;
  void (*run)(Bytes);
};
inline constexpr Target targets[] = {
#define ECORCHE_TARGET(name, sources) {#name, name},
#include "tests/fuzz/targets.def"
#undef ECORCHE_TARGET
};

}  // namespace ecorche::fuzz
