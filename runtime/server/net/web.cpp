// SPDX-License-Identifier: Apache-2.0
// The one unit that sees Beast: slow to compile, and only its own templates.
#include "runtime/server/net/web.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <exception>
#include <string_view>
#include <utility>

namespace ecorche::server {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;

// A message of a WebSocket is one frame of this protocol.
constexpr std::string_view kSubprotocol = "ecorche.v1";
constexpr std::size_t kMostHead = 14;  // bytes before the content of a frame (RFC 6455, 5.2)

constexpr const char* kOtherHost =
    "this server was not started for the name that you asked by (ask by its address, or start it with "
    "--host-name NAME)\n";
constexpr const char* kNoViewer =
    "There is no viewer in this ecorche: it was built without one.\n\n"
    "To get it, run ./scripts/viewer in the repository (it needs npm), and build ecorche again;\n"
    "or name a folder that ./scripts/viewer made: ecorche serve --viewer-dir build/viewer ...\n\n"
    "All else is served: see /healthz, /readyz, /metrics and /v1.\n";

// A transport as Beast wants its streams, so that its templates are made once for all of them.
class Stream {
 public:
  using executor_type = net::any_io_executor;

  /// Of what is read and not claimed, the smallest frames may come `rate` times a second; the next ones wait.
  Stream(std::unique_ptr<Transport> transport, double rate)
      : transport_(std::move(transport)), a_byte_(1 / (kSmallest * rate)), pause_(transport_->executor()) {}
  executor_type get_executor() { return transport_->executor(); }
  Transport& transport() { return *transport_; }

  /// So many of the bytes that were read are a client's message, or its head: those are counted elsewhere.
  /// The others are pings, and pieces of nothing, which Beast answers and drops before anybody hears of them.
  void claim(std::size_t bytes) { paid_until_ -= duration(a_byte_ * static_cast<double>(bytes)); }

  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return net::async_initiate<Token, void(error_code, std::size_t)>(
        [this](auto&& handler, net::mutable_buffer into) {
          spawn(read(into), std::forward<decltype(handler)>(handler));
        },
        token, first_of(buffers));
  }

  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return net::async_initiate<Token, void(error_code, std::size_t)>(
        [this](auto&& handler, std::vector<net::const_buffer> parts) {
          spawn(write(std::move(parts)), std::forward<decltype(handler)>(handler));
        },
        token,
        std::vector<net::const_buffer>(net::buffer_sequence_begin(buffers),
                                       net::buffer_sequence_end(buffers)));
  }

  // Beast ends its streams by these, found by their argument.
  friend void beast_close_socket(Stream& stream) { stream.transport().close(); }
  template <class Handler>
  friend void async_teardown(beast::role_type, Stream& stream, Handler&& handler) {
    stream.spawn(stream.finish(), [handler = std::forward<Handler>(handler)](
                                      error_code ec, std::size_t) mutable { std::move(handler)(ec); });
  }

 private:
  struct Done {
    error_code ec;
    std::size_t bytes = 0;
  };

  template <class Buffers>
  static net::mutable_buffer first_of(const Buffers& buffers) {
    for (auto it = net::buffer_sequence_begin(buffers); it != net::buffer_sequence_end(buffers); ++it) {
      if (net::mutable_buffer(*it).size() > 0) return *it;
    }
    return {};
  }

  net::awaitable<Done> read(net::mutable_buffer into) {
    Done done;
    if (into.size() == 0) co_return done;
    if (paid_until_ > Clock::now() + kCredit) {
      pause_.expires_at(paid_until_);
      error_code ignored;
      co_await pause_.async_wait(quietly(ignored));
    }
    done.bytes = co_await transport_->read_some({static_cast<std::byte*>(into.data()), into.size()}, done.ec);
    paid_until_ = std::max(paid_until_, Clock::now()) + duration(a_byte_ * static_cast<double>(done.bytes));
    co_return done;
  }
  net::awaitable<Done> write(std::vector<net::const_buffer> parts) {
    Done done;
    co_await transport_->write(parts, done.ec);
    if (!done.ec) done.bytes = net::buffer_size(parts);
    co_return done;
  }
  net::awaitable<Done> finish() {
    Done done;
    co_await transport_->finish(done.ec);
    co_return done;
  }

  template <class Handler>
  void spawn(net::awaitable<Done> work, Handler&& handler) {
    net::co_spawn(get_executor(), std::move(work),
                  [handler = std::forward<Handler>(handler)](const std::exception_ptr& failed,
                                                             const Done& done) mutable {
                    // Out of memory, most likely: to the stream's user an error like any other.
                    const error_code ec = failed ? net::error::no_memory : done.ec;
                    std::move(handler)(ec, failed ? 0 : done.bytes);
                  });
  }

  static constexpr double kSmallest = 6;  // bytes of a client's frame
  static constexpr std::chrono::milliseconds kCredit{100};

  std::unique_ptr<Transport> transport_;
  double a_byte_;  // seconds
  net::steady_timer pause_;
  Clock::time_point paid_until_{};
};

using Socket = websocket::stream<Stream, false>;  // without compression: payloads are dense

class WebSocketTransport final : public Transport {
 public:
  explicit WebSocketTransport(std::unique_ptr<Socket> socket) : socket_(std::move(socket)) {}

  net::any_io_executor executor() override { return socket_->get_executor(); }

  net::awaitable<void> open(error_code& ec) override {
    ec = {};
    co_return;
  }

  net::awaitable<std::size_t> read_some(std::span<std::byte> out, error_code& ec) override {
    const std::size_t n = co_await socket_->async_read_some(net::buffer(out.data(), out.size()), quietly(ec));
    socket_->next_layer().claim(n + kMostHead);
    wrong_kind_ = !ec && !socket_->got_binary();
    co_return n;
  }

  net::awaitable<void> write(std::span<const net::const_buffer> frame, error_code& ec) override {
    co_await socket_->async_write(frame, quietly(ec));
  }

  net::awaitable<void> finish(error_code& ec) override {
    co_await socket_->async_close(static_cast<websocket::close_code>(farewell_), quietly(ec));
  }
  bool wrong_kind() const override { return wrong_kind_; }
  void ends_by(CloseReason why) override { farewell_ = why; }

  void close() override { socket_->next_layer().transport().close(); }

  std::optional<bool> message_ended() const override { return socket_->is_message_done(); }

  std::optional<Clock::time_point> moved() const override {
    return socket_->next_layer().transport().moved();
  }
  bool hung_up() override { return socket_->next_layer().transport().hung_up(); }

 private:
  std::unique_ptr<Socket> socket_;
  bool wrong_kind_ = false;
  CloseReason farewell_ = CloseReason::normal;
};

// Of `Bearer TOKEN`, the scheme's name in any case (RFC 7235); empty where it says something else.
std::string_view borne_token(std::string_view header) {
  constexpr std::string_view scheme = "bearer ";
  if (header.size() < scheme.size() ||
      !beast::iequals({header.data(), scheme.size()}, {scheme.data(), scheme.size()}))
    return {};
  return header.substr(scheme.size());
}

class Request final : public WebRequest {
 public:
  Request(std::unique_ptr<Transport> transport, std::string peer, const WebContext& context)
      : context_(context),
        peer_(std::move(peer)),
        stream_(std::make_unique<Stream>(std::move(transport), context.messages_per_second)) {
    parser_.header_limit(static_cast<std::uint32_t>(context.header_bytes));
    parser_.body_limit(0);
  }

  void start() override {
    net::co_spawn(stream_->get_executor(), serve(),
                  [self = shared_from_this()](const std::exception_ptr&) { self->close(); });
  }

  void close() override {
    if (std::exchange(over_, true)) return;
    if (stream_) stream_->transport().close();
    if (socket_) socket_->next_layer().transport().close();
  }

  bool over() const override { return over_; }

 private:
  net::awaitable<void> serve() {
    const auto self = shared_from_this();
    error_code ec;
    co_await stream_->transport().open(ec);
    if (ec) co_return;
    co_await http::async_read_header(*stream_, buffer_, parser_, quietly(ec));
    if (ec == http::error::header_limit || ec == http::error::buffer_overflow)
      co_return co_await answer(http::status::request_header_fields_too_large, "the header is too long\n");
    if (ec.category() == make_error_code(http::error::bad_method).category() &&
        ec != http::error::end_of_stream && ec != http::error::partial_message)
      co_return co_await answer(http::status::bad_request, "this is no HTTP\n");
    if (ec) co_return;
    const auto& request = parser_.get();
    const std::string_view target(request.target().data(), request.target().size());
    const bool reads = request.method() == http::verb::get || request.method() == http::verb::head;
    const bool health = reads && (target == "/healthz" || target == "/readyz");
    if (!health && !context_.admit(kind(target), peer_))
      co_return co_await answer(http::status::too_many_requests, "try again in a second\n");
    if (is_socket_target(target)) co_return co_await upgrade();
    if (!reads) co_return co_await answer(http::status::method_not_allowed, "GET and HEAD only\n");
    if (target == "/healthz") co_return co_await answer(http::status::ok, "alive\n");
    if (target == "/readyz") {
      const bool ready = context_.ready();
      co_return co_await answer(ready ? http::status::ok : http::status::service_unavailable,
                                ready ? "ready\n" : "stopping\n");
    }
    if (target == "/metrics") {
      if (!shown_pass()) co_return co_await deny();
      if (context_.passes->open() && !names_this_machine(header(http::field::host)))
        co_return co_await answer(http::status::forbidden, "without a token, ask by address or localhost\n");
      co_return co_await answer(http::status::ok, context_.metrics());
    }
    co_await show(target);
  }

  std::string_view header(http::field field) const {
    const auto value = parser_.get()[field];
    return {value.data(), value.size()};
  }

  // A file of the viewer.
  net::awaitable<void> show(std::string_view target) {
    if (!context_.hosts.has(header(http::field::host)))
      co_return co_await answer(http::status::misdirected_request, kOtherHost);
    if (!context_.viewer && target == "/") co_return co_await answer(http::status::not_found, kNoViewer);
    FileAnswer file;
    if (context_.viewer) {
      file = answer_file(*context_.viewer, {.target = target,
                                            .accept_encoding = header(http::field::accept_encoding),
                                            .if_none_match = header(http::field::if_none_match)});
    }
    if (file.status == 404)
      co_return co_await answer(http::status::not_found, "see /, /healthz, /readyz, /metrics and /v1\n");
    co_await send(std::move(file));
  }

  net::awaitable<void> send(FileAnswer file) {
    http::response<http::string_body> response(static_cast<http::status>(file.status), 11);
    response.set(http::field::server, "ecorche");
    for (const auto& [name, value] : page_rules()) response.set(name, value);
    response.set(http::field::etag, file.etag);
    response.set(http::field::cache_control, file.caching);
    response.set(http::field::vary, "Accept-Encoding");
    if (file.body) {
      response.set(http::field::content_type, file.type);
      if (file.gzip) response.set(http::field::content_encoding, "gzip");
      response.content_length(file.bytes);
    }
    response.keep_alive(false);
    has_moved();
    error_code ec;
    co_await http::async_write(*stream_, response, quietly(ec));
    const bool whole = file.body && parser_.get().method() != http::verb::head;
    for (std::uint64_t left = whole ? file.bytes : 0; left > 0 && !ec && !over_; has_moved()) {
      const auto piece = file.body->next();
      if (piece.empty() || piece.size() > left) co_return stream_->transport().close();  // it has changed
      left -= piece.size();
      const net::const_buffer buffer(piece.data(), piece.size());
      co_await stream_->transport().write(std::span(&buffer, 1), ec);
    }
    if (!ec) co_await linger();
  }

  // Who has shown the token is not kept out by those who have none, nor a viewer by who asks for pages.
  WebKind kind(std::string_view target) const {
    if (!context_.passes->open() && shown_pass()) return WebKind::proven;
    return is_socket_target(target) && websocket::is_upgrade(parser_.get()) ? WebKind::handshake
                                                                            : WebKind::page;
  }

  // Null for another token than those of the server, or none; whoever needs none has one.
  std::shared_ptr<const Pass> shown_pass() const {
    return context_.passes->find(borne_token(header(http::field::authorization)));
  }

  net::awaitable<void> deny() {
    context_.denied();
    co_await answer(http::status::unauthorized, "Authorization: Bearer TOKEN is missing or wrong\n");
  }

  net::awaitable<void> upgrade() {
    const auto& request = parser_.get();
    // Browsers name the page that asks; other clients name none, and could claim any.
    const std::string_view origin = header(http::field::origin), host = header(http::field::host);
    const bool invited = !origin.empty() && std::find(context_.origins.begin(), context_.origins.end(),
                                                      origin) != context_.origins.end();
    if (!invited && !context_.hosts.has(host)) {
      context_.denied();
      co_return co_await answer(http::status::misdirected_request, kOtherHost);
    }
    if (!websocket::is_upgrade(request))
      co_return co_await answer(http::status::upgrade_required, "/v1 speaks WebSocket\n");
    if (!invited && !origin.empty() && !same_origin(origin, host, context_.tls)) {
      context_.denied();
      co_return co_await answer(http::status::forbidden, "pages of this origin may not connect\n");
    }
    const std::shared_ptr<const Pass> pass = shown_pass();
    if (!header(http::field::authorization).empty() && !pass) co_return co_await deny();
    if (!http::token_list(request[http::field::sec_websocket_protocol])
             .exists({kSubprotocol.data(), kSubprotocol.size()}))
      co_return co_await answer(http::status::bad_request, "the subprotocol is ecorche.v1\n");

    socket_ = std::make_unique<Socket>(std::move(*stream_));
    stream_.reset();
    // The owner has the deadlines.
    socket_->set_option(websocket::stream_base::timeout{websocket::stream_base::none(),
                                                        websocket::stream_base::none(), false});
    socket_->set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
      response.set(http::field::sec_websocket_protocol, {kSubprotocol.data(), kSubprotocol.size()});
    }));
    socket_->binary(true);
    socket_->auto_fragment(false);
    // A message is a frame, and its reader has the limits, the same as over TCP; Beast's own is 16 MiB.
    socket_->read_message_max(0);
    error_code ec;
    co_await socket_->async_accept(request, quietly(ec));
    // What the request brought beyond its header would be lost: no client may speak before the answer.
    if (ec || over_ || buffer_.size() > 0) co_return;
    over_ = true;
    context_.welcome(std::make_unique<WebSocketTransport>(std::move(socket_)), peer_, pass);
  }

  net::awaitable<void> answer(http::status status, std::string body) {
    http::response<http::string_body> response(status, 11);
    response.set(http::field::server, "ecorche");
    response.set(http::field::content_type, "text/plain; version=0.0.4; charset=utf-8");
    response.set(http::field::cache_control, "no-store");
    response.set("X-Content-Type-Options", "nosniff");
    if (status == http::status::unauthorized) response.set(http::field::www_authenticate, "Bearer");
    response.keep_alive(false);
    response.content_length(body.size());
    if (parser_.get().method() != http::verb::head) response.body() = std::move(body);
    error_code ec;
    co_await http::async_write(*stream_, response, quietly(ec));
    if (!ec) co_await linger();
  }

  // Until the client has read its answer.
  net::awaitable<void> linger() {
    error_code ec;
    co_await stream_->transport().finish(ec);
    // Unread bytes would reset the connection before the answer is read.
    std::array<std::byte, 1024> rest{};
    while (!ec && !over_) co_await stream_->transport().read_some(rest, ec);
  }

  const WebContext& context_;
  std::string peer_;
  std::unique_ptr<Stream> stream_;
  std::unique_ptr<Socket> socket_;
  beast::flat_buffer buffer_{16 << 10};
  http::request_parser<http::empty_body> parser_;
  bool over_ = false;
};

}  // namespace

std::shared_ptr<WebRequest> web_request(std::unique_ptr<Transport> transport, std::string peer,
                                        const WebContext& context) {
  return std::make_shared<Request>(std::move(transport), std::move(peer), context);
}

}  // namespace ecorche::server
