// SPDX-License-Identifier: Apache-2.0
// What reads bytes of others, one function each: libFuzzer calls them (scripts/fuzz), and unit_fuzz with the
// kept corpora. They return where the bytes are refused, and abort where a promise is broken.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace ecorche::fuzz {

using Bytes = std::span<const std::byte>;

/// FrameReader: the first byte says in pieces of which size the rest arrives. What was read is written again.
void framing(Bytes bytes);
/// An Envelope, its arrays against a payload, and everything that is converted to a value of ours.
void messages(Bytes bytes);
/// Frames one after another, as a client's decoders see them: MeshDecoder, VolumeDecoder.
void meshes(Bytes bytes);
void volumes(Bytes bytes);
/// wire::read_recording.
void recording(Bytes bytes);
/// model_file::read of a good model of which bytes were changed: u24 offset, u8 value, again and again.
void model(Bytes bytes);
/// Motion: a `.bvh`; an `.asf`, a zero byte and its `.amc`; a `.gltf` or `.glb`; a `.mot`; a `.trc`. Frames
/// over their length are read too.
void bvh(Bytes bytes);
void acclaim(Bytes bytes);
void gltf_clip(Bytes bytes);
void angle_table(Bytes bytes);
void marker_table(Bytes bytes);

struct Target {
  const char* name;
  void (*run)(Bytes);
};
inline constexpr std::array<Target, 11> targets{{{"framing", framing},
                                                 {"messages", messages},
                                                 {"meshes", meshes},
                                                 {"volumes", volumes},
                                                 {"recording", recording},
                                                 {"model", model},
                                                 {"bvh", bvh},
                                                 {"acclaim", acclaim},
                                                 {"gltf_clip", gltf_clip},
                                                 {"angle_table", angle_table},
                                                 {"marker_table", marker_table}}};

}  // namespace ecorche::fuzz
