// SPDX-License-Identifier: Apache-2.0
// HTTP and WebSocket by hand (RFC 6455), slow and obvious.
#pragma once

#include <array>
#include <cstring>
#include <optional>
#include <string>

#include <ecorche/client/socket.hpp>
#include <ecorche/wire/framing.hpp>

namespace ecorche::server {

class WebClient {
 public:
  WebClient(const wire::Address& address, const std::string& authorities = {})
      : socket_(address, later(5), authorities) {}

  void send(const std::string& bytes) { socket_.write(std::as_bytes(std::span(bytes)), later(10)); }

  /// A request without a body; returns the whole answer.
  std::string get(const std::string& target, const std::string& headers = {}) {
    send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
    return rest();
  }

  /// What comes until the server hangs up, or says nothing for some seconds.
  std::string rest(double seconds = 60) {
    try {
      while (read(seconds)) {
      }
    } catch (const Error&) {  // hung up
    }
    return std::exchange(bytes_, {});
  }

  /// The answer to a handshake, up to its empty line.
  std::string upgrade(const std::string& headers = "Sec-WebSocket-Protocol: ecorche.v1\r\n",
                      const std::string& host = "localhost") {
    send("GET /v1 HTTP/1.1\r\nHost: " + host +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n" +
         headers + "\r\n");
    std::size_t end = std::string::npos;
    try {
      while ((end = bytes_.find("\r\n\r\n")) == std::string::npos && read(10)) {
      }
    } catch (const Error&) {  // hung up
    }
    if (end == std::string::npos) return std::exchange(bytes_, {});
    const std::string head = bytes_.substr(0, end + 4);
    bytes_.erase(0, end + 4);
    return head;
  }

  /// One WebSocket frame to the server, masked as clients must; opcode 2 is binary, 1 text, 0 goes on.
  void send_message(const std::string& data, int opcode = 2, bool last = true) {
    const std::array<char, 4> mask{0x12, 0x34, 0x56, 0x78};
    std::string out(1, static_cast<char>((last ? 0x80 : 0) | opcode));
    if (data.size() < 126) {
      out += static_cast<char>(0x80 | data.size());
    } else {
      const bool small = data.size() < 65536;  // the shortest way to say it is a must
      out += static_cast<char>(0x80 | (small ? 126 : 127));
      for (int shift = small ? 8 : 56; shift >= 0; shift -= 8)
        out += static_cast<char>(data.size() >> shift & 0xff);
    }
    out.append(mask.data(), mask.size());
    for (std::size_t i = 0; i < data.size(); ++i) out += static_cast<char>(data[i] ^ mask[i % 4]);
    send(out);
  }
  void send_frame(const v1::Envelope& envelope) { send_message(wire::encode(envelope).head); }

  /// The next data message of the server, whole; nothing when it hung up, closed or said nothing.
  std::optional<std::string> message(double seconds = 60) {
    std::string data;
    while (true) {
      if (!spec(2, seconds)) return std::nullopt;
      const auto at = [&](std::size_t i) { return static_cast<std::uint8_t>(bytes_[i]); };
      const int opcode = at(0) & 15;
      const bool last = (at(0) & 0x80) != 0;
      std::uint64_t size = at(1) & 127;
      std::size_t head = 2;
      if (size >= 126) {
        const std::size_t more = size == 126 ? 2 : 8;
        if (!spec(2 + more, seconds)) return std::nullopt;
        size = 0;
        for (std::size_t i = 0; i < more; ++i) size = size << 8 | at(2 + i);
        head += more;
      }
      if (!spec(head + size, seconds)) return std::nullopt;
      if (opcode < 8) data += bytes_.substr(head, size);
      if (opcode == 8 && size >= 2) close_code_ = at(head) << 8 | at(head + 1);
      bytes_.erase(0, head + size);
      if (opcode == 8) return std::nullopt;
      if (opcode < 8 && last) return data;
    }
  }

  /// Of the server's close frame, once message() has met it.
  std::optional<int> close_code() const { return close_code_; }

  /// The next message as the frame that it must be.
  std::optional<wire::Frame> frame() {
    const auto data = message();
    if (!data) return std::nullopt;
    wire::FrameReader reader({.envelope_bytes = 1 << 20, .payload_bytes = 1 << 26});
    std::size_t at = 0;
    while (at < data->size() && !reader.complete()) {
      const auto into = reader.prepare();
      const std::size_t n = std::min(into.size(), data->size() - at);
      std::memcpy(into.data(), data->data() + at, n);
      at += n;
      if (!reader.commit(n).ok()) return std::nullopt;
    }
    if (!reader.complete() || at != data->size()) return std::nullopt;  // not one frame
    return reader.release();
  }

 private:
  static client::Clock::time_point later(double seconds) {
    return client::Clock::now() +
           std::chrono::duration_cast<client::Clock::duration>(std::chrono::duration<double>(seconds));
  }
  bool read(double seconds) {
    std::array<std::byte, 65536> buffer{};
    const std::size_t n = socket_.read(buffer, later(seconds));
    bytes_.append(reinterpret_cast<const char*>(buffer.data()), n);
    return n > 0;
  }
  bool spec(std::size_t size, double seconds) {
    try {
      while (bytes_.size() < size) {
        if (!read(seconds)) return false;
      }
    } catch (const Error&) {  // hung up
      return false;
    }
    return true;
  }

  client::Socket socket_;
  std::string bytes_;
  std::optional<int> close_code_;
};

}  // namespace ecorche::server
