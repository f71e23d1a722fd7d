// SPDX-License-Identifier: Apache-2.0
// Changes inputs of the targets that read frames so that they stay frames: byte by byte, most changes break a
// length, and what lies behind it is never reached.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace ecorche::fuzz {

/// Changes `bytes` anyhow, to at most `most` of them: libFuzzer's own.
using ChangeBytes = std::function<std::string(std::string bytes, std::size_t most)>;

/// How an input of a target is made of frames.
enum class Form : std::uint8_t {
  frames,      ///< one after another
  led_frames,  ///< the same behind one byte (`framing`, `requests`)
  message,     ///< a byte, an envelope, and so many times 16 bytes of payload as the byte says (`messages`)
  none
};
Form form_of(std::string_view target);

/// Parses `input`, changes fields of an envelope, its payload, or which frames there are, and writes it
/// again; one in eight times, and where no frame can be read, any bytes change. At most `most` bytes come
/// out.
std::string mutate_frames(Form form, const std::string& input, std::size_t most, unsigned seed,
                          const ChangeBytes& change);

/// Parts of both: where there are frames, a frame of `b` among those of `a`.
std::string cross_frames(Form form, const std::string& a, const std::string& b, std::size_t most,
                         unsigned seed);

}  // namespace ecorche::fuzz
