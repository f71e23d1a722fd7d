// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/message.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>

#include "app/igtl/crc64.hpp"

namespace ecorche::app::igtl {
namespace {

constexpr std::size_t kTypeAt = 2, kDeviceAt = kTypeAt + kTypeBytes, kTimeAt = kDeviceAt + kDeviceBytes,
                      kSizeAt = kTimeAt + 8, kCrcAt = kSizeAt + 8;
constexpr std::size_t kExtendedBytes = 12;

void store_text(std::string_view text, std::byte* to, std::size_t width) {
  std::memcpy(to, text.data(), std::min(text.size(), width));
}

}  // namespace

std::string text_of(std::span<const std::byte> field) {
  const auto end = std::find(field.begin(), field.end(), std::byte{0});
  std::string out;
  for (auto at = field.begin(); at != end; ++at) out.push_back(static_cast<char>(*at));
  return out;
}

Header read_header(std::span<const std::byte, kHeaderBytes> bytes) {
  const std::byte* const at = bytes.data();
  return {.version = load_big<std::uint16_t>(at),
          .type = text_of(bytes.subspan(kTypeAt, kTypeBytes)),
          .device = text_of(bytes.subspan(kDeviceAt, kDeviceBytes)),
          .time = load_big<std::uint64_t>(at + kTimeAt),
          .body_bytes = load_big<std::uint64_t>(at + kSizeAt),
          .crc = load_big<std::uint64_t>(at + kCrcAt)};
}

std::optional<std::span<const std::byte>> content_of(const Header& header, std::span<const std::byte> body) {
  if (header.version < 2) return body;
  if (body.size() < kExtendedBytes) return std::nullopt;
  const std::size_t before = load_big<std::uint16_t>(body.data());
  const std::uint64_t after =
      std::uint64_t{load_big<std::uint16_t>(body.data() + 2)} + load_big<std::uint32_t>(body.data() + 4);
  if (before < kExtendedBytes || before > body.size() || after > body.size() - before) return std::nullopt;
  return body.subspan(before, body.size() - before - static_cast<std::size_t>(after));
}

std::uint64_t time_now() {
  using namespace std::chrono;
  const std::uint64_t nanoseconds_now =
      static_cast<std::uint64_t>(duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count());
  constexpr std::uint64_t second = 1'000'000'000;
  return (nanoseconds_now / second << 32) | ((nanoseconds_now % second) << 32) / second;
}

std::byte* Writer::room(std::size_t bytes) {
  const std::size_t at = bytes_.size();
  bytes_.resize(at + bytes);
  return bytes_.data() + at;
}

Writer& Writer::text(std::string_view text, std::size_t width) {
  store_text(text, room(width), width);
  return *this;
}

Writer& Writer::raw(std::span<const std::byte> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return *this;
}

SharedBytes Writer::sealed(std::string_view type, std::string_view device, std::uint64_t time) && {
  return seal(std::move(bytes_), type, device, time);
}

SharedBytes seal(Bytes&& message, std::string_view type, std::string_view device, std::uint64_t time) {
  std::byte* const at = message.data();
  store_big(std::uint16_t{1}, at);
  store_text(type, at + kTypeAt, kTypeBytes);
  store_text(device, at + kDeviceAt, kDeviceBytes);
  store_big(time, at + kTimeAt);
  store_big(std::uint64_t{message.size() - kHeaderBytes}, at + kSizeAt);
  store_big(crc64(std::span<const std::byte>(message).subspan(kHeaderBytes)), at + kCrcAt);
  return std::make_shared<const Bytes>(std::move(message));
}

}  // namespace ecorche::app::igtl
