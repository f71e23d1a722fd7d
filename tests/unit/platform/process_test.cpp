// SPDX-License-Identifier: Apache-2.0
#include "core/platform/process.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/platform/child_process.hpp"
#include "core/platform/other_program.hpp"

namespace ecorche::platform {
namespace {

TEST(Process, ExistsUntilItHasEnded) {
  EXPECT_TRUE(process_exists(process_id()));
  EXPECT_TRUE(process_exists(1));  // somebody else's
  const pid_t child = fork();
  if (child == 0) _exit(0);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  EXPECT_FALSE(process_exists(child));
}

TEST(Process, HasHeldWhatItWrote) {
  EXPECT_GT(peak_memory_bytes(), std::uint64_t{1} << 20);
  constexpr std::uint64_t some = std::uint64_t{64} << 20;
  const std::vector<char> written(peak_memory_bytes() + some, 1);
  EXPECT_GE(peak_memory_bytes(), written.size());
}

TEST(Process, CanReadItsOwnProgram) {
  std::ifstream program(own_program(), std::ios::binary);
  std::array<char, 4> magic{};
  program.read(magic.data(), magic.size());
  EXPECT_EQ(std::string_view(magic.data(), magic.size()),
            "\x7f"
            "ELF");
}

TEST(Random, DiffersEveryTime) {
  std::array<std::byte, 16> one{}, other{};
  EXPECT_FALSE(fill_random(one));
  EXPECT_FALSE(fill_random(other));
  EXPECT_NE(one, other);
}

TEST(ChildProcess, HandsBackWhatItsWorkReturns) {
  const ChildResult result =
      run_in_child([] { return std::vector<std::byte>(100000, std::byte{7}); }, {}, Context{});
  EXPECT_EQ(result.end, ChildResult::End::done);
  EXPECT_EQ(result.bytes, std::vector<std::byte>(100000, std::byte{7}));
}

TEST(ChildProcess, SaysHowItFailed) {
  const auto exits = []() -> std::vector<std::byte> {
    std::puts("first\nthe reason\n");
    std::exit(3);
  };
  ChildResult result = run_in_child(exits, {}, Context{});
  EXPECT_EQ(result.end, ChildResult::End::failed);
  EXPECT_EQ(result.said, "the reason");
  result = run_in_child([]() -> std::vector<std::byte> { throw 1; }, {}, Context{});
  EXPECT_EQ(result.end, ChildResult::End::failed);
  result = run_in_child([]() -> std::vector<std::byte> { _exit(0 * std::raise(SIGKILL)); }, {}, Context{});
  EXPECT_EQ(result.end, ChildResult::End::failed);
  EXPECT_EQ(result.said, "Killed");
}

TEST(ChildProcess, EndsWhenItsTimeIsOver) {
  const auto forever = []() -> std::vector<std::byte> {
    for (;;) pause();
  };
  EXPECT_EQ(run_in_child(forever, {.seconds = 0.05}, Context{}).end, ChildResult::End::timed_out);
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  try {
    run_in_child(forever, {}, context);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::interrupted);
  }
}

TEST(OtherProgram, IsFoundByPathAsAShellWould) {
  const auto shell = find_program("sh");
  ASSERT_TRUE(shell);
  EXPECT_EQ(shell->filename(), "sh");
  EXPECT_FALSE(find_program("no such program"));
  EXPECT_FALSE(find_program("bin")) << "a folder is none";
}

TEST(OtherProgram, HandsBackItsCodeOrItsSignal) {
  const auto shell = [](const std::string& line) {
    return run_program(*find_program("sh"), {"-c", line}, {});
  };
  EXPECT_EQ(shell("exit 7"), 7);
  EXPECT_EQ(shell("exit 0"), 0);
  EXPECT_EQ(shell("kill -9 $$"), 137);
  EXPECT_EQ(run_program("/no/such/program", {}, {}), 127);
}

TEST(OtherProgram, IsToldOnceToStopAndSoIsWhatItStarted) {
  // Both would sleep for a minute; the shell counts what it is told. It is told only once both wait: a
  // shell that had set its trap, but had not yet started the other, would start it afterwards.
  const std::filesystem::path waits =
      std::filesystem::path(testing::TempDir()) / ("waits_" + std::to_string(process_id()));
  std::stop_source stop;
  const std::jthread teller([&](const std::stop_token& ended) {
    while (!std::filesystem::exists(waits) && !ended.stop_requested())
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    stop.request_stop();
  });
  const auto start = std::chrono::steady_clock::now();
  const int code =
      run_program(*find_program("sh"),
                  {"-c",
                   "n=0; trap 'n=$((n+1))' INT; sh -c ': > \"$1\"; exec sleep 60' - \"$1\"; sleep 0.3; "
                   "exit $((40 + n))",
                   "-", waits.string()},
                  stop.get_token());
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  EXPECT_EQ(code, 41);
  std::filesystem::remove(waits);
}

}  // namespace
}  // namespace ecorche::platform
