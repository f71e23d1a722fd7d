// SPDX-License-Identifier: Apache-2.0
#include "core/files/stale_parts.hpp"

#include <charconv>
#include <string>
#include <system_error>
#include <vector>

#include "core/platform/process.hpp"

namespace ecorche::files {
namespace {

namespace fs = std::filesystem;

/// Whether `file` is `.PID.RANDOM.part.NAME` (or, as written before, `.PID.part.NAME`), of a NAME that is
/// meant, and no process has that number.
template <class Matches>
bool is_stale(std::string_view file, const Matches& matches) {
  constexpr std::string_view mark = ".part.";
  if (!file.starts_with('.')) return false;
  int process = 0;
  const char* const end = file.data() + file.size();
  const auto [rest, error] = std::from_chars(file.data() + 1, end, process);
  if (error != std::errc() || process <= 0) return false;
  std::string_view own(rest, static_cast<std::size_t>(end - rest));
  constexpr std::size_t digits = 16;
  if (own.size() > digits + 1 && own.front() == '.' &&
      own.substr(1, digits).find_first_not_of("0123456789abcdef") == own.npos)
    own.remove_prefix(digits + 1);
  if (!own.starts_with(mark)) return false;
  own.remove_prefix(mark.size());
  return matches(own) && !platform::process_exists(process);
}

template <class Matches>
void remove(const fs::path& folder, fs::file_type type, const Matches& matches) {
  std::error_code error;
  std::vector<fs::path> stale;
  fs::directory_iterator at(folder, error);
  for (; !error && at != fs::directory_iterator(); at.increment(error)) {
    if (is_stale(at->path().filename().string(), matches) && at->symlink_status(error).type() == type)
      stale.push_back(at->path());
    error.clear();
  }
  for (const fs::path& path : stale) fs::remove_all(path, error);
}

}  // namespace

void remove_stale_parts(const fs::path& folder, std::string_view name) {
  remove(folder, fs::file_type::regular, [&](std::string_view own) { return own == name; });
}

void remove_stale_parts_ending(const fs::path& folder, std::string_view ending) {
  remove(folder, fs::file_type::regular, [&](std::string_view own) { return own.ends_with(ending); });
}

void remove_stale_folders(const fs::path& folder, std::string_view name) {
  remove(folder, fs::file_type::directory, [&](std::string_view own) { return own == name; });
}

}  // namespace ecorche::files
