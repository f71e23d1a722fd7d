// SPDX-License-Identifier: Apache-2.0
// A session with volumes that finds no memory.
#include <algorithm>
#include <cstdio>
#include <initializer_list>
#include <new>
#include <utility>
#include <vector>

#include "tests/unit/server/failing_new.hpp"
#include "tests/unit/server/session_stage.hpp"

namespace ecorche::server {
namespace {

// On the I/O thread, from a pose to the last of its frames: whatever was lost, the next pose is shown by all,
// and the volumes show this one in the end.
TEST(MemoryTest, TheNthAllocationBesideVolumes) {
  int n = 0;
  for (bool struck = true; struck && n < 2000; ++n) {
    SCOPED_TRACE(n);
    Stage stage;
    stage.watcher.looking = [before = false](bool begins) mutable {
      if (begins) before = handling;
      handling = !begins && before;
    };
    const std::uint32_t mesh = 1, volume = stage.subscribe_volume(stage.watcher),
                        plane = stage.subscribe_volume(stage.watcher, true);
    const auto shown = [&](std::uint32_t subscription, std::uint64_t pose) {
      const std::vector<std::uint64_t> poses = stage.watcher.poses(subscription);
      return !poses.empty() && poses.back() == pose;
    };
    const auto wait_for = [&](std::uint64_t pose, std::initializer_list<std::uint32_t> all) {
      stage.run_until([&] {
        stage.session->catch_up();  // as the server does ten times a second
        return std::all_of(all.begin(), all.end(), [&](std::uint32_t one) { return shown(one, pose); });
      });
      for (const std::uint32_t one : all) ASSERT_TRUE(shown(one, pose)) << one;
    };
    wait_for(0, {mesh, volume, plane});
    allocations.set(n);
    const auto until = Clock::now() + milliseconds(30);
    for (bool told = false; Clock::now() < until;) {
      handling = true;
      try {
        if (!std::exchange(told, true)) stage.pose(1);
        stage.io.restart();
        stage.io.run_for(milliseconds(2));
      } catch (const std::bad_alloc&) {  // as the server does
      }
      handling = false;
    }
    struck = allocations.spent();
    allocations.off();
    if (stage.session->poses().present().sequence == 1) wait_for(1, {volume, plane});
    stage.pose(2);
    wait_for(2, {mesh, volume, plane});
    if (HasFatalFailure()) return;
  }
  std::printf("%d allocations failed, one by one\n", n - 1);
  EXPECT_GT(n, 20);
}

}  // namespace
}  // namespace ecorche::server
