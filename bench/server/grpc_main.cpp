// SPDX-License-Identifier: Apache-2.0
// The whole body in float32 through gRPC, as Protobuf over plain TCP, and as it lies in memory over plain
// TCP: bench_grpc MODEL.hdf SECONDS RATE. No server that poses first and then sends over TCP is quicker than
// the last.
//
// Server and client are threads of this program. All pose, and send as the bench does with ours: a pose goes
// out at RATE, a latency ends when the client holds the parsed message. Prints `name p50 p99 bytes cpu`, a
// line each: ms, and ms of processor a frame.
#include <arpa/inet.h>
#include <grpcpp/grpcpp.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/error.hpp>
#include "bench/server/walking.hpp"
#include "grpc_frame.grpc.pb.h"

namespace ecorche::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kWarmUp = 4;  // as the bench that starts this

Error broken(const char* what) {
  return Error(ErrorKind::temporary, "bench", what, "run it again");
}

// Poses as the server does for a client that asks for everything in float32.
class Bodies {
 public:
  explicit Bodies(const std::string& path)
      : model_(std::make_shared<const Model>(model_file::read(path, Context{}))),
        poser_(model_),
        body_(poser_.make_frame()) {}

  const std::vector<std::vector<float>>& pose(const Ask& ask) {
    const Pose pose = walking(model_->rig, ask.seconds());
    if (!poser_.run(pose, runtime::Skinning::cor, poser_.all_tissues(), body_, runtime::NodesOf::tissues)
             .ok())
      throw broken("no pose");
    return body_.tissues;
  }

  void fill(const Ask& ask, Body& out) {
    out.set_sequence(ask.sequence());
    out.clear_positions();
    for (const std::vector<float>& tissue : pose(ask))
      out.add_positions(tissue.data(), tissue.size() * sizeof(float));
  }

  // Of all tissues.
  std::size_t bytes() const {
    std::size_t out = 0;
    for (const std::vector<float>& tissue : body_.tissues) out += tissue.size() * sizeof(float);
    return out;
  }

 private:
  std::shared_ptr<const Model> model_;
  runtime::BodyPoser poser_;
  runtime::PosedBody body_;
};

// Asks at `rate`, one at a time; `round` sends it and waits for the answer.
void measure(const char* name, double seconds, double rate,
             const std::function<std::size_t(const Ask&)>& round) {
  std::vector<double> ms;
  Ask ask;
  std::size_t bytes = 0;
  double cpu = 0;
  const auto start = Clock::now();
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  for (std::uint64_t i = 1; since() < kWarmUp + seconds; ++i) {
    std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(static_cast<double>(i) / rate)));
    if (ms.empty()) cpu = cpu_seconds();
    ask.set_sequence(i);
    ask.set_seconds(static_cast<double>(i) / rate);
    const auto sent = Clock::now();
    bytes = round(ask);
    if (since() > kWarmUp)
      ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - sent).count());
  }
  cpu = 1e3 * (cpu_seconds() - cpu) / static_cast<double>(ms.size());
  std::printf("%s %.3f %.3f %zu %.3f\n", name, quantile(ms, 0.5), quantile(ms, 0.99), bytes, cpu);
  std::fflush(stdout);
}

std::size_t size_of(const Body& body, const Ask& ask) {
  if (body.sequence() != ask.sequence()) throw broken("another pose came");
  std::size_t bytes = 0;
  for (const std::string& tissue : body.positions()) bytes += tissue.size();
  return bytes;
}

class Service final : public Poser::Service {
 public:
  explicit Service(Bodies& bodies) : bodies_(bodies) {}
  grpc::Status Stream(grpc::ServerContext*, grpc::ServerReaderWriter<Body, Ask>* stream) override {
    Ask ask;
    Body body;
    while (stream->Read(&ask)) {
      bodies_.fill(ask, body);
      if (!stream->Write(body)) break;
    }
    return grpc::Status::OK;
  }

 private:
  Bodies& bodies_;
};

void through_grpc(Bodies& bodies, double seconds, double rate) {
  Service service(bodies);
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.SetMaxReceiveMessageSize(-1);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  const auto stub = Poser::NewStub(grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(port),
                                                             grpc::InsecureChannelCredentials(), arguments));
  grpc::ClientContext context;
  const auto stream = stub->Stream(&context);
  Body body;
  measure("grpc", seconds, rate, [&](const Ask& ask) {
    if (!stream->Write(ask) || !stream->Read(&body)) throw broken("gRPC ended");
    return size_of(body, ask);
  });
  stream->WritesDone();
  stream->Finish();
  server->Shutdown();
}

void send_all(int fd, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = send(fd, data, size, MSG_NOSIGNAL);
    if (n <= 0) throw broken("cannot send");
    data += n;
    size -= static_cast<std::size_t>(n);
  }
}

bool receive_all(int fd, char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = recv(fd, data, size, 0);
    if (n <= 0) return false;
    data += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

template <class Message>
void say(int fd, const Message& message, std::string& bytes) {
  bytes.assign(4, '\0');
  message.AppendToString(&bytes);
  const auto size = static_cast<std::uint32_t>(bytes.size() - 4);
  std::copy_n(reinterpret_cast<const char*>(&size), 4, bytes.begin());
  send_all(fd, bytes.data(), bytes.size());
}

template <class Message>
bool hear(int fd, Message& message, std::string& bytes) {
  std::uint32_t size = 0;
  if (!receive_all(fd, reinterpret_cast<char*>(&size), 4)) return false;
  bytes.resize(size);
  return receive_all(fd, bytes.data(), size) && message.ParseFromString(bytes);
}

// Two ends of one connection over loopback.
class Loopback {
 public:
  Loopback() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (bind(door_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || listen(door_, 1) != 0 ||
        getsockname(door_, reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
        connect(client_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
      throw broken("no loopback");
    server_ = accept(door_, nullptr, nullptr);
    const int on = 1;
    for (const int fd : {client_, server_}) setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  Loopback(const Loopback&) = delete;
  Loopback& operator=(const Loopback&) = delete;
  ~Loopback() {
    for (const int fd : {door_, client_, server_}) close(fd);
  }

  int client() const { return client_; }

  // `answer(server's end, what was asked)` on a thread of its own while `asking` runs.
  template <class Answer>
  void serve(const Answer& answer, const std::function<void()>& asking) const {
    std::thread serving([&] {
      Ask ask;
      std::string bytes;
      while (hear(server_, ask, bytes)) answer(server_, ask);
    });
    asking();
    shutdown(client_, SHUT_RDWR);
    serving.join();
  }

 private:
  int door_ = socket(AF_INET, SOCK_STREAM, 0), client_ = socket(AF_INET, SOCK_STREAM, 0), server_ = -1;
};

void through_tcp(Bodies& bodies, double seconds, double rate) {
  const Loopback loopback;
  Body sent, body;
  std::string bytes, sent_bytes;
  const auto answer = [&](int fd, const Ask& ask) {
    bodies.fill(ask, sent);
    say(fd, sent, sent_bytes);
  };
  loopback.serve(answer, [&] {
    measure("bytes", seconds, rate, [&](const Ask& ask) {
      say(loopback.client(), ask, bytes);
      if (!hear(loopback.client(), body, bytes)) throw broken("the server ended");
      return size_of(body, ask);
    });
  });
}

void as_it_lies(Bodies& bodies, double seconds, double rate) {
  const Loopback loopback;
  std::vector<char> held(bodies.bytes());
  std::string bytes;
  const auto answer = [&](int fd, const Ask& ask) {
    for (const std::vector<float>& tissue : bodies.pose(ask))
      send_all(fd, reinterpret_cast<const char*>(tissue.data()), tissue.size() * sizeof(float));
  };
  loopback.serve(answer, [&] {
    measure("raw", seconds, rate, [&](const Ask& ask) {
      say(loopback.client(), ask, bytes);
      if (!receive_all(loopback.client(), held.data(), held.size())) throw broken("the server ended");
      return held.size();
    });
  });
}

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: bench_grpc MODEL.hdf SECONDS RATE\n");
    return 64;
  }
  try {
    ecorche::bench::Bodies bodies(argv[1]);
    const double seconds = std::atof(argv[2]), rate = std::atof(argv[3]);
    ecorche::bench::through_grpc(bodies, seconds, rate);
    ecorche::bench::through_tcp(bodies, seconds, rate);
    ecorche::bench::as_it_lies(bodies, seconds, rate);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
