// SPDX-License-Identifier: Apache-2.0
#include "app/json_log.hpp"

#include <spdlog/details/os.h>
#include <spdlog/formatter.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

namespace ecorche::app {
namespace {

// What the line that this thread writes is about; null: of nothing that the server knows.
thread_local const server::LogLine* about = nullptr;

std::string utc(spdlog::log_clock::time_point time) {
  const auto since = time.time_since_epoch();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(since).count();
  const auto seconds = static_cast<std::time_t>(ms / 1000);
  const std::tm parts = spdlog::details::os::gmtime(seconds);
  char text[32];
  const std::size_t size = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  const std::string fraction = std::to_string(1000 + ms % 1000);
  return std::string(text, size) + "." + fraction.substr(1) + "Z";
}

class JsonFormatter final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const auto level = spdlog::level::to_string_view(message.level);
    nlohmann::ordered_json line{{"time", utc(message.time)},
                                {"level", std::string(level.data(), level.size())}};
    const auto add = [&](const char* key, const std::string& value) {
      if (!value.empty()) line[key] = value;
    };
    if (about) {
      if (about->connection != 0) line["connection"] = about->connection;
      add("peer", about->peer);
      add("token", about->pass);
      add("session", about->session);
    }
    line["message"] = std::string(message.payload.data(), message.payload.size());
    // A client's name may hold any bytes.
    const std::string text = line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    out.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<JsonFormatter>(); }
};

}  // namespace

void log_as_json() {
  spdlog::set_formatter(std::make_unique<JsonFormatter>());
}

server::Journal::Write json_lines() {
  return [](server::Journal::Level level, const server::LogLine& line) {
    about = &line;
    spdlog::log(level, "{}", line.text);
    about = nullptr;
  };
}

}  // namespace ecorche::app
