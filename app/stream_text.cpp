// SPDX-License-Identifier: Apache-2.0
#include "app/stream_text.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace ecorche::app {
namespace {

std::string latency(const char* what, const nlohmann::json& ms) {
  if (ms.is_null()) return std::string(what) + ": no frame came\n";
  char line[160];
  std::snprintf(line, sizeof line, "%s: p50 %.2f ms, p90 %.2f ms, p99 %.2f ms, max %.2f ms\n", what,
                ms["p50"].get<double>(), ms["p90"].get<double>(), ms["p99"].get<double>(),
                ms["max"].get<double>());
  return line;
}

}  // namespace

std::string stream_text(const nlohmann::json& report, const std::string& model) {
  const auto count = [&](const char* what) { return report[what].get<unsigned long long>(); };
  char line[256];
  std::snprintf(line, sizeof line,
                "%llu poses, %llu mesh frames, %.1f per second, %.1f MB; %llu poses skipped, %llu clamped\n",
                count("poses"), count("frames"), report["frames_per_second"].get<double>(),
                report["bytes"].get<double>() / 1e6, count("skipped"), count("clamped_poses"));
  std::string text = line + latency("pose to mesh", report["latency_ms"]);
  if (report.contains("volume_latency_ms")) {
    text += report["volume_frames"].dump() + " volumes; " +
            latency("pose to volume", report["volume_latency_ms"]);
  }
  if (report.contains("frames_with_warning"))
    text += "quality: " + report["frames_with_warning"].dump() + " frames with a warning\n";
  if (report.contains("checked")) {
    text += "checked " + report["checked"].dump() + " frames against " + model + ": " +
            report["mismatches"].dump() + " mismatches\n";
  }
  return text;
}

}  // namespace ecorche::app
