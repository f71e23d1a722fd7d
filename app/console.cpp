// SPDX-License-Identifier: Apache-2.0
// Progress and messages on stderr; the result on stdout.
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>

#include "app/abandonable.hpp"
#include "app/program.hpp"
#include "core/platform/terminal.hpp"

namespace ecorche::app {
namespace {

using Clock = std::chrono::steady_clock;

// Draws one stage. On a terminal a bar in place, at most ten times a second; otherwise a line each 10 s.
class Bar {
 public:
  explicit Bar(std::string label) : label_(std::move(label)), terminal_(platform::stderr_is_terminal()) {}
  ~Bar() {
    if (drawn_ && terminal_) std::fputs("\r\x1b[K", stderr);
  }

  void draw(double fraction) {
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    const double wait = terminal_ ? 0.1 : 10.0;
    if (std::chrono::duration<double>(now - last_).count() < wait) return;
    last_ = now;
    const double spent = std::chrono::duration<double>(now - start_).count();
    const double left = fraction > 0 ? spent * (1 - fraction) / fraction : 0;
    if (terminal_) {
      const int filled = static_cast<int>(fraction * 30);
      std::fprintf(stderr, "\r\x1b[K%-12s [%.*s%*s] %3.0f %%  ETA %.0f s", label_.c_str(), filled,
                   "##############################", 30 - filled, "", fraction * 100, left);
      std::fflush(stderr);
      drawn_ = true;
    } else {
      std::fprintf(stderr, "%s: %.0f %%, ETA %.0f s\n", label_.c_str(), fraction * 100, left);
    }
  }

  void line(std::string_view kind, std::string_view text) {
    const std::lock_guard lock(mutex_);
    if (drawn_ && terminal_) std::fputs("\r\x1b[K", stderr);
    std::fprintf(stderr, "%.*s%.*s\n", static_cast<int>(kind.size()), kind.data(),
                 static_cast<int>(text.size()), text.data());
  }

 private:
  std::string label_;
  bool terminal_, drawn_ = false;
  Clock::time_point start_ = Clock::now(), last_ = start_;
  std::mutex mutex_;
};

}  // namespace

Context Program::context(std::string label) const {
  auto bar = std::make_shared<Bar>(std::move(label));
  Context context;
  context.stop = stop;
  context.run_apart = [stop = stop](std::function<void()> work) { run_abandonable(std::move(work), stop); };
  context.progress = [bar](double fraction) { bar->draw(fraction); };
  context.log = [bar, warned = warned_](LogLevel level, std::string_view text) {
    if (level == LogLevel::warning) *warned = true;
    bar->line(level == LogLevel::warning ? "warning: " : "", text);
  };
  return context;
}

void Program::note(std::string_view line) const {
  if (line.starts_with("warning: ")) warn();
  std::fprintf(stderr, "%.*s\n", static_cast<int>(line.size()), line.data());
}

void Program::result(const std::string& text, const nlohmann::json& object) const {
  std::string out = text;
  if (json) {
    nlohmann::json whole{{"ok", true}};
    whole.update(object);
    // Text of files may be anything, but JSON is UTF-8.
    out = whole.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  std::fwrite(out.data(), 1, out.size(), stdout);
  if (out.empty() || out.back() != '\n') std::fputc('\n', stdout);
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
    throw Error(ErrorKind::io, "stdout", "the result cannot be written", "check the disk's free space");
}

}  // namespace ecorche::app
