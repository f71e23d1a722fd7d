// SPDX-License-Identifier: Apache-2.0
// An OpenIGTLink message: 58 bytes of header, then its body. Written here and not by the project's library,
// whose readers take the counts inside a body on trust (POLYDATA, CAPABILITY, NDARRAY) and make room for
// whatever size a header claims; that library is the other side in tests/e2e/igtl.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/igtl/big_endian.hpp"

namespace ecorche::app::igtl {

inline constexpr std::size_t kHeaderBytes = 58, kTypeBytes = 12, kDeviceBytes = 20;

struct Header {
  std::uint16_t version = 1;  ///< 1; or 2, whose bodies have an extended header and metadata (protocol 3)
  std::string type;           ///< `TRANSFORM`, `GET_IMAGE`, ...
  std::string device;         ///< who speaks, or is spoken of
  std::uint64_t time = 0;     ///< seconds since 1970 in 32.32 fixed point
  std::uint64_t body_bytes = 0;
  std::uint64_t crc = 0;  ///< of the body
};

/// Of `kHeaderBytes` bytes. Any bytes are some header: whether it can be one, and whether its body may be
/// read, is for the caller to say.
Header read_header(std::span<const std::byte, kHeaderBytes> bytes);

/// What a body holds besides the extended header and the metadata of version 2; nothing where those reach
/// beyond it.
std::optional<std::span<const std::byte>> content_of(const Header& header, std::span<const std::byte> body);

/// What stands before the first zero byte.
std::string text_of(std::span<const std::byte> field);

/// Now, as headers have it.
std::uint64_t time_now();

using Bytes = std::vector<std::byte>;
using SharedBytes = std::shared_ptr<const Bytes>;

/// A message in the making: its body, behind room for its header, which is of version 1: every receiver reads
/// that.
class Writer {
 public:
  Writer() : bytes_(kHeaderBytes) {}

  template <class T>
  Writer& number(T value) {
    store_big(value, room(sizeof value));
    return *this;
  }
  /// `width` bytes: what does not fit is cut off, what is left is zero.
  Writer& text(std::string_view text, std::size_t width);
  Writer& raw(std::span<const std::byte> bytes);
  /// The next `bytes` of the body, zero until written; until anything more is added.
  std::byte* room(std::size_t bytes);

  /// The whole message.
  SharedBytes sealed(std::string_view type, std::string_view device, std::uint64_t time) &&;

 private:
  Bytes bytes_;
};

/// Fills in the header of a message whose body is written.
SharedBytes seal(Bytes&& message, std::string_view type, std::string_view device, std::uint64_t time);

}  // namespace ecorche::app::igtl
