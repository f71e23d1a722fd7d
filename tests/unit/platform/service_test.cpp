// SPDX-License-Identifier: Apache-2.0
// Sockets that are passed, and what a service manager is told.
#include "core/platform/service.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <ecorche/values/error.hpp>

namespace ecorche::platform {
namespace {

// A variable of the environment, for as long as it lives.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) { setenv(name, value.c_str(), 1); }
  ~Variable() { unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

std::string own_pid() {
  return std::to_string(getpid());
}

// A socket with the number 3, which is put back where it was taken.
class Third {
 public:
  explicit Third(int made) : kept_(fcntl(3, F_DUPFD, 10)) {
    dup2(made, 3);
    if (made != 3) close(made);
  }
  ~Third() {
    if (kept_ < 0) {
      close(3);
      return;
    }
    dup2(kept_, 3);
    close(kept_);
  }
  Third(const Third&) = delete;
  Third& operator=(const Third&) = delete;

 private:
  int kept_;
};

int listening(int family) {
  const int made = socket(family, SOCK_STREAM, 0);
  sockaddr_in v4{};
  v4.sin_family = AF_INET;
  v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  sockaddr_in6 v6{};
  v6.sin6_family = AF_INET6;
  v6.sin6_addr = in6addr_loopback;
  const int bound = family == AF_INET ? bind(made, reinterpret_cast<sockaddr*>(&v4), sizeof v4)
                                      : bind(made, reinterpret_cast<sockaddr*>(&v6), sizeof v6);
  if (bound != 0 || listen(made, 1) != 0) return -1;
  return made;
}

std::string refusal() {
  try {
    passed_sockets();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::config);
    return error.problem();
  }
  return {};
}

TEST(PassedSockets, AreThoseThatListen) {
  const Third socket(listening(AF_INET));
  const Variable pid("LISTEN_PID", own_pid()), count("LISTEN_FDS", "1"), names("LISTEN_FDNAMES", "http");
  const auto sockets = passed_sockets();
  ASSERT_EQ(sockets.size(), 1U);
  EXPECT_EQ(sockets[0].handle, 3);
  EXPECT_EQ(sockets[0].name, "http");
  EXPECT_EQ(sockets[0].host, "127.0.0.1");
  EXPECT_GT(sockets[0].port, 1023);
  EXPECT_TRUE(fcntl(3, F_GETFD) & FD_CLOEXEC) << "children must not have it";
}

TEST(PassedSockets, MayBeOfTheNewerInternet) {
  const int made = listening(AF_INET6);
  if (made < 0) GTEST_SKIP() << "no IPv6 here";
  const Third socket(made);
  const Variable pid("LISTEN_PID", own_pid()), count("LISTEN_FDS", "1");
  const auto sockets = passed_sockets();
  ASSERT_EQ(sockets.size(), 1U);
  EXPECT_EQ(sockets[0].name, "");
  EXPECT_EQ(sockets[0].host, "::1");
}

TEST(PassedSockets, AreNoneWhereNobodyPassesAny) {
  EXPECT_TRUE(passed_sockets().empty());
  const Variable count("LISTEN_FDS", "1");
  EXPECT_TRUE(passed_sockets().empty());
  const Variable pid("LISTEN_PID", std::to_string(getpid() + 1));
  EXPECT_TRUE(passed_sockets().empty()) << "they are another process's";
}

TEST(PassedSockets, OfAnotherKindAreRefused) {
  const Variable pid("LISTEN_PID", own_pid());
  for (const char* odd : {"-1", "one", "3x", "257", "99999999999999999999"}) {
    const Variable count("LISTEN_FDS", odd);
    EXPECT_EQ(refusal(), "'" + std::string(odd) + "' is no number of sockets");
  }
  const Variable count("LISTEN_FDS", "1");
  {
    const Third mute(socket(AF_INET, SOCK_STREAM, 0));
    EXPECT_EQ(refusal(), "socket 3 does not listen");
  }
  {
    const Third letters(socket(AF_INET, SOCK_DGRAM, 0));
    EXPECT_EQ(refusal(), "socket 3 does not listen");
  }
  {
    const Third file(open("/dev/null", O_RDONLY));
    EXPECT_EQ(refusal(), "socket 3 does not listen");
  }
  {
    const int made = socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un local{};
    local.sun_family = AF_UNIX;
    ASSERT_EQ(bind(made, reinterpret_cast<sockaddr*>(&local), sizeof(sa_family_t)), 0);  // any free name
    ASSERT_EQ(listen(made, 1), 0);
    const Third unix_socket(made);
    EXPECT_EQ(refusal(), "socket 3 is not of TCP");
  }
  const Variable more("LISTEN_FDS", "256");
  EXPECT_NE(refusal(), "");
}

// Receives what a process tells at `name`; one that begins with @ is in no folder.
std::string told(const std::string& name, const std::string& lines) {
  const int receiver = socket(AF_UNIX, SOCK_DGRAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, name.data(), name.size());
  if (name[0] == '@') address.sun_path[0] = '\0';
  EXPECT_EQ(bind(receiver, reinterpret_cast<sockaddr*>(&address),
                 static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size())),
            0);
  const Variable where("NOTIFY_SOCKET", name);
  EXPECT_FALSE(tell_service_manager(lines));
  std::array<char, 256> out{};
  const ssize_t got = recv(receiver, out.data(), out.size(), MSG_DONTWAIT);
  close(receiver);
  if (name[0] == '/') std::filesystem::remove(name);
  return {out.data(), static_cast<std::size_t>(got < 0 ? 0 : got)};
}

TEST(ServiceManager, IsToldWhereItListens) {
  const std::string name = "ecorche_service_test_" + own_pid();
  EXPECT_EQ(told("@" + name, "READY=1\nSTATUS=well"), "READY=1\nSTATUS=well");
  EXPECT_EQ(told((std::filesystem::temp_directory_path() / name).string(), "STOPPING=1"), "STOPPING=1");
}

TEST(ServiceManager, ThatIsNoneIsToldNothing) {
  EXPECT_FALSE(tell_service_manager("READY=1"));
  for (const std::string& odd :
       {std::string("notify"), "/" + std::string(200, 'x'), std::string("/nowhere/at/all")}) {
    const Variable where("NOTIFY_SOCKET", odd);
    EXPECT_TRUE(tell_service_manager("READY=1")) << odd;
  }
}

TEST(ServiceManager, LearnsWhenReadingAgainBegan) {
  const std::string first = reloading_since_now(), then = reloading_since_now();
  ASSERT_EQ(first.rfind("RELOADING=1\nMONOTONIC_USEC=", 0), 0U);
  const auto at = [](const std::string& line) { return std::stoull(line.substr(line.rfind('=') + 1)); };
  EXPECT_GT(at(first), 0U);
  EXPECT_GE(at(then), at(first));
}

}  // namespace
}  // namespace ecorche::platform
