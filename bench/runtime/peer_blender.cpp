// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "bench/runtime/peers.hpp"

namespace ecorche::bench {
namespace {

template <class T>
void put(std::ofstream& file, const T* values, std::size_t count) {
  file.write(reinterpret_cast<const char*>(values), static_cast<std::streamsize>(count * sizeof(T)));
}

// As peer_blender.py reads it: four counts, then arrays.
void write(const std::filesystem::path& path, const HungPoints& points,
           std::span<const std::vector<Motion>> frames) {
  std::ofstream file(path, std::ios::binary);
  const std::uint32_t counts[4] = {
      static_cast<std::uint32_t>(points.points()), static_cast<std::uint32_t>(points.weight.size()),
      static_cast<std::uint32_t>(points.segments), static_cast<std::uint32_t>(frames.size())};
  put(file, counts, 4);
  put(file, points.at.data(), points.at.size());
  put(file, points.begin.data(), points.begin.size());
  put(file, points.weight.data(), points.weight.size());
  for (const std::vector<Motion>& frame : frames) {
    for (const Motion& motion : frame) {
      put(file, motion.turn.data(), 4);
      put(file, motion.shift.data(), 3);
    }
  }
  put(file, points.segment.data(), points.segment.size());
}

}  // namespace

std::vector<std::string> armature_by_blender(const std::string& blender, const std::string& script,
                                             const HungPoints& points,
                                             std::span<const std::vector<Motion>> frames) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("bench_runtime_" + std::to_string(getpid()) + ".bin");
  write(path, points, frames);
  const std::string command =
      "'" + blender + "' -b --factory-startup --python '" + script + "' -- '" + path.string() + "' 2>&1";
  std::vector<std::string> out;
  std::string last;
  if (FILE* pipe = popen(command.c_str(), "r")) {
    char text[1024];
    while (std::fgets(text, sizeof text, pipe) != nullptr) {
      last = text;
      while (last.ends_with('\n')) last.pop_back();
      if (last.starts_with("  ")) out.push_back(last.substr(2));
    }
    pclose(pipe);
  }
  std::filesystem::remove(path);
  if (out.empty()) out.push_back("Blender: " + last);
  return out;
}

}  // namespace ecorche::bench
