// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/schedule/executor.hpp"

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

#include "runtime/server/schedule/post_back.hpp"

namespace ecorche::server {
namespace {

constexpr auto kBelow = tbb::task_arena::priority::low;

}  // namespace

Executor::Executor(net::io_context& io, Workers& frames, Around around)
    : io_(io),
      frames_(frames),
      around_(std::move(around)),
      volume_arena_(static_cast<int>(frames.threads()), 1, kBelow),
      plane_arena_(static_cast<int>(frames.threads()), 1, kBelow),
      quality_(1, last_of_all),
      first_frames_(1, giving_way),
      files_(1, giving_way),
      background_(1, giving_way),
      disposal_(1, giving_way),
      levels_(1, giving_way),
      volumes_(static_cast<int>(frames.threads()),
               [this](const Job& job) { giving_way([&] { volume_arena_.execute(job); }); }),
      planes_(static_cast<int>(frames.threads()),
              [this](const Job& job) { giving_way([&] { plane_arena_.execute(job); }); }) {}

Workers& Executor::workers(Service service) {
  switch (service) {
    case Service::frames:
      return frames_;
    case Service::volumes:
      return volumes_;
    case Service::planes:
      return planes_;
    case Service::first_frames:
      return first_frames_;
    case Service::quality:
      return quality_;
    case Service::background:
      return background_;
    case Service::levels:
      return levels_;
    case Service::disposal:
      return disposal_;
    case Service::files:
      return files_;
  }
  std::terminate();
}

void Executor::submit(Service service, Job work, std::shared_ptr<Account> by) {
  if (around_) work = [this, service, work = std::move(work)] { around_(service, work); };
  workers(service).submit(std::move(work), std::move(by));
}

void Executor::run(Service service, std::function<void()> work, std::function<void()> then,
                   std::shared_ptr<Account> by) {
  Job job = [&io = io_, work = std::move(work), then = std::move(then),
             guard = net::make_work_guard(io_)]() mutable {
    work();
    // What both hold ends on the I/O thread.
    post_back(io, [work = std::move(work), then = std::move(then), guard = std::move(guard)] { then(); });
  };
  submit(service, std::move(job), std::move(by));
}

void Executor::run_request(std::function<void()> work, std::function<void()> then,
                           std::shared_ptr<Account> by) {
  requests_.push_back({std::move(work), std::move(then), std::move(by)});
  start_requests();
}

// Without memory nothing is lost: what could not be submitted waits for the next time.
void Executor::start_requests() {
  const std::size_t most = std::max<std::size_t>(frames_.threads(), 2) - 1;
  while (running_requests_ < most && !requests_.empty()) {
    const auto first =
        std::min_element(requests_.begin(), requests_.end(), [](const Request& a, const Request& b) {
          if (!a.by || !b.by) return !a.by && b.by;
          return a.by->used() < b.by->used();
        });
    const auto charged = [work = first->work, by = first->by] {
      const auto begun = Clock::now();
      work();
      if (by) by->use(seconds(Clock::now() - begun));
    };
    run(Service::frames, charged, [this, then = first->then] {
      --running_requests_;
      try {
        start_requests();
      } catch (const std::bad_alloc&) {
      }
      then();
    });
    ++running_requests_;
    requests_.erase(first);
  }
}

void Executor::destroy_later(std::shared_ptr<const void> what) noexcept {
  try {
    submit(Service::disposal, [what = std::move(what)]() mutable { what = nullptr; });
  } catch (const std::exception&) {  // no memory to say so: it goes here
  }
}

}  // namespace ecorche::server
