// SPDX-License-Identifier: Apache-2.0
#include <ecorche/client/tls.hpp>

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <utility>

#include <ecorche/values/error.hpp>

namespace ecorche::client {
namespace {

// What SSL_write gets at once: whole records, and no more is held back than the socket takes.
constexpr std::size_t kChunk = std::size_t{64} << 10;

std::string last_reason() {
  std::array<char, 160> text{};
  const unsigned long error = ERR_get_error();
  if (error == 0) return "the connection broke";
  ERR_error_string_n(error, text.data(), text.size());
  ERR_clear_error();
  return text.data();
}

}  // namespace

struct Tls::Impl {
  struct Free {
    void operator()(SSL_CTX* it) const { SSL_CTX_free(it); }
    void operator()(SSL* it) const { SSL_free(it); }
  };
  std::unique_ptr<SSL_CTX, Free> context{SSL_CTX_new(TLS_client_method())};
  std::unique_ptr<SSL, Free> ssl;
  BIO* in = nullptr;   // what the server sent; both are the SSL's
  BIO* out = nullptr;  // what is to be sent
  std::string host;
};

Tls::Tls(const std::string& authorities, std::string host) : impl_(std::make_unique<Impl>()) {
  SSL_CTX* const context = impl_->context.get();
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
  if (SSL_CTX_load_verify_locations(context, authorities.c_str(), nullptr) != 1) {
    throw Error(ErrorKind::config, authorities, "holds no certificates: " + last_reason(),
                "give a PEM file of the authority, or of the server's own certificate");
  }
  impl_->ssl.reset(SSL_new(context));
  SSL* const ssl = impl_->ssl.get();
  impl_->in = BIO_new(BIO_s_mem());
  impl_->out = BIO_new(BIO_s_mem());
  SSL_set_bio(ssl, impl_->in, impl_->out);
  SSL_set_connect_state(ssl);
  if (X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), host.c_str()) != 1) {
    SSL_set1_host(ssl, host.c_str());
    SSL_set_tlsext_host_name(ssl, host.c_str());
  }
  ERR_clear_error();
  impl_->host = std::move(host);
}

Tls::~Tls() = default;

void Tls::handshake(const Receive& receive, const Send& send) {
  while (true) {
    const int result = SSL_do_handshake(impl_->ssl.get());
    flush(send);
    if (result == 1) return;
    if (SSL_get_error(impl_->ssl.get(), result) != SSL_ERROR_WANT_READ) fail(result);
    if (!fill(receive))
      throw Error(ErrorKind::temporary, impl_->host, "no TLS handshake in time",
                  "check that the server speaks TLS, or try again");
  }
}

std::size_t Tls::read(std::span<std::byte> out, const Receive& receive, const Send& send) {
  while (true) {
    const int size = static_cast<int>(std::min<std::size_t>(out.size(), 1U << 30));
    const int n = SSL_read(impl_->ssl.get(), out.data(), size);
    flush(send);
    if (n > 0) return static_cast<std::size_t>(n);
    if (SSL_get_error(impl_->ssl.get(), n) != SSL_ERROR_WANT_READ) fail(n);
    if (!fill(receive)) return 0;
  }
}

void Tls::write(std::span<const std::byte> bytes, const Send& send) {
  while (!bytes.empty()) {
    const auto part = bytes.first(std::min(bytes.size(), kChunk));
    const int n = SSL_write(impl_->ssl.get(), part.data(), static_cast<int>(part.size()));
    flush(send);
    if (n <= 0) fail(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

void Tls::flush(const Send& send) {
  std::array<std::byte, 16384> buffer{};
  int n = 0;
  while ((n = BIO_read(impl_->out, buffer.data(), static_cast<int>(buffer.size()))) > 0)
    send(std::span(buffer).first(static_cast<std::size_t>(n)));
}

bool Tls::fill(const Receive& receive) {
  std::array<std::byte, 16384> buffer{};
  const std::size_t n = receive(buffer);
  return n > 0 && BIO_write(impl_->in, buffer.data(), static_cast<int>(n)) == static_cast<int>(n);
}

void Tls::fail(int result) {
  SSL* const ssl = impl_->ssl.get();
  if (SSL_get_error(ssl, result) == SSL_ERROR_ZERO_RETURN)
    throw Error(ErrorKind::temporary, impl_->host, "the server hung up", "start it, or try again");
  if (const long verdict = SSL_get_verify_result(ssl); verdict != X509_V_OK) {
    throw Error(ErrorKind::refused, impl_->host,
                std::string("its certificate is not trusted: ") + X509_verify_cert_error_string(verdict),
                "give the certificate of its authority");
  }
  throw Error(ErrorKind::protocol, impl_->host, "TLS failed: " + last_reason(),
              "check that the server speaks TLS");
}

}  // namespace ecorche::client
