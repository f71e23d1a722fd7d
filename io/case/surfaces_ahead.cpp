// SPDX-License-Identifier: Apache-2.0
#include "io/case/surfaces_ahead.hpp"

#include <tbb/parallel_for.h>

#include <optional>
#include <set>
#include <system_error>
#include <vector>

#include <ecorche/values/error.hpp>

namespace ecorche::io {
namespace {

namespace fs = std::filesystem;
using yaml::Kind;
using yaml::Value;

// The file of an entry that is a surface's path, or names one under `file`.
std::optional<fs::path> file_of(const Value& entry, const fs::path& folder, const fs::path& data) {
  const bool is_map = entry.kind() == Kind::map;
  const auto file = is_map ? entry.find("file") : std::optional(entry);
  const fs::path& base = is_map && entry.find("root") ? data : folder;
  if (!file || file->kind() != Kind::scalar || base.empty()) return std::nullopt;
  fs::path path = base / file->text();
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) ? std::optional(std::move(path)) : std::nullopt;
}

std::set<fs::path> files_of(const Value& root, const fs::path& folder, const fs::path& data) {
  std::set<fs::path> out;
  const auto add = [&](const Value& entry) {
    try {
      if (const auto file = file_of(entry, folder, data)) out.insert(*file);
    } catch (const Error&) {  // told where the entry is read
    }
  };
  if (const auto skin = root.find("skin")) add(*skin);
  for (const char* list : {"bones", "tissues"}) {
    const auto entries = root.find(list);
    if (!entries || entries->kind() != Kind::list) continue;
    for (const Value& entry : entries->items()) add(entry);
  }
  return out;
}

}  // namespace

void SurfacesAhead::read(const Value& root, const fs::path& folder, const fs::path& data) {
  const std::set<fs::path> named = files_of(root, folder, data);
  const std::vector<fs::path> paths(named.begin(), named.end());
  std::vector<std::optional<TaggedSurface>> surfaces(paths.size());
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    context_.check_stop();
    try {
      surfaces[i] = read_tagged_surface(paths[i], limits_);
    } catch (const Error&) {  // take() reads it again, and says so
    }
  });
  for (std::size_t i = 0; i < paths.size(); ++i)
    if (surfaces[i]) read_.emplace(paths[i], std::move(*surfaces[i]));
}

TaggedSurface SurfacesAhead::take(const fs::path& path) {
  const auto found = read_.find(path);
  if (found == read_.end()) return read_tagged_surface(path, limits_);
  TaggedSurface out = std::move(found->second);
  read_.erase(found);
  return out;
}

}  // namespace ecorche::io
