// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/tls.hpp"

#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <optional>
#include <random>
#include <utility>

#include <ecorche/values/error.hpp>

namespace ecorche::server {
namespace {

class TlsTransport final : public Transport {
 public:
  TlsTransport(tcp::socket socket, net::ssl::context& context) : stream_(std::move(socket), context) {
    prepare(stream_.next_layer());
  }

  net::any_io_executor executor() override { return stream_.get_executor(); }

  net::awaitable<void> open(boost::system::error_code& ec) override {
    co_await stream_.async_handshake(net::ssl::stream_base::server, quietly(ec));
  }

  net::awaitable<std::size_t> read_some(std::span<std::byte> out, boost::system::error_code& ec) override {
    co_return co_await stream_.async_read_some(net::buffer(out.data(), out.size()), quietly(ec));
  }

  // Buffer by buffer: of several at once Asio would encrypt copies of 8 KiB. In parts as its async_write
  // would send, so that it is known when the last one left.
  net::awaitable<void> write(std::span<const net::const_buffer> frame,
                             boost::system::error_code& ec) override {
    ec = {};
    for (net::const_buffer left : frame) {
      while (left.size() > 0) {
        left += co_await stream_.async_write_some(net::buffer(left, kPart), quietly(ec));
        if (ec) co_return;
        moved_ = Clock::now();
      }
    }
  }

  // Says that the end is one, and waits for the client to say so too: the owner's deadline ends the wait.
  net::awaitable<void> finish(boost::system::error_code& ec) override {
    co_await stream_.async_shutdown(quietly(ec));
  }

  void close() override {
    boost::system::error_code ec;
    stream_.next_layer().close(ec);
  }

  std::optional<Clock::time_point> moved() const override { return moved_; }
  bool hung_up() override { return server::hung_up(stream_.next_layer()); }

 private:
  static constexpr std::size_t kPart = 64 << 10;

  net::ssl::stream<tcp::socket> stream_;
  std::optional<Clock::time_point> moved_;
};

}  // namespace

struct Carrier::Context {
  net::ssl::context tls{net::ssl::context::tls_server};
};

Carrier::Carrier(const std::string& certificate, const std::string& key) {
  if (certificate.empty()) return;
  context_ = std::make_unique<Context>();
  using net::ssl::context;
  boost::system::error_code ec;
  const auto check = [&](const std::string& file) {
    if (!ec) return;
    throw Error(ErrorKind::config, file, "is of no use for TLS: " + ec.message(),
                "give a certificate chain and its unencrypted key, both PEM");
  };
  context_->tls.set_options(context::default_workarounds | context::no_sslv2 | context::no_sslv3 |
                            context::no_tlsv1 | context::no_tlsv1_1 | context::no_compression);
  context_->tls.set_password_callback([](std::size_t, net::ssl::context_base::password_purpose) {
    return std::string();  // or OpenSSL would ask on the terminal
  });
  context_->tls.use_certificate_chain_file(certificate, ec);
  check(certificate);
  context_->tls.use_private_key_file(key, context::pem, ec);
  check(key);
}

Carrier::~Carrier() = default;

std::unique_ptr<Transport> Carrier::carry(tcp::socket socket) const {
  if (!context_) return tcp_transport(std::move(socket));
  return std::make_unique<TlsTransport>(std::move(socket), context_->tls);
}

std::string random_token() {
  std::random_device random;  // the kernel's, not a sequence
  constexpr std::string_view digits = "0123456789abcdef";
  std::string out;
  while (out.size() < 32) out += digits[random() & 15];
  return out;
}

}  // namespace ecorche::server
