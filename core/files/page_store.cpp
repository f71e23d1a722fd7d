// SPDX-License-Identifier: Apache-2.0
#include "core/files/page_store.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <ecorche/values/error.hpp>
#include "core/files/hidden_beside.hpp"
#include "core/values/text.hpp"

namespace ecorche::files {
namespace {

namespace fs = std::filesystem;
using platform::PageFile;

constexpr std::string_view kEnding = ".pages";
constexpr int kTries = 8;  // each time another process was faster
constexpr std::size_t kPiece = std::size_t{1} << 20;

std::error_code again() {
  return std::make_error_code(std::errc::resource_unavailable_try_again);
}

// How many bytes an array begins before its first whole page.
std::size_t skipped(const std::byte* array) {
  const std::size_t page = platform::page_bytes();
  return (page - reinterpret_cast<std::uintptr_t>(array) % page) % page;
}

// Those that are worth it; of too many the largest, in the order of their sizes.
PageStore::Arrays chosen(PageStore::Arrays arrays) {
  std::erase_if(arrays, [](const auto& array) { return array.size() < PageStore::least_bytes; });
  std::stable_sort(arrays.begin(), arrays.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  if (arrays.size() > PageStore::most_arrays) arrays.resize(PageStore::most_arrays);
  return arrays;
}

std::string name_of(const PageStore::Arrays& arrays) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(),
                                                                              XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  for (const auto& array : arrays) {
    const std::uint64_t size = array.size();
    XXH3_128bits_update(state.get(), &size, sizeof size);
    XXH3_128bits_update(state.get(), array.data(), array.size());
  }
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  return text::hex(hash.high64) + text::hex(hash.low64) + std::string(kEnding);
}

// What a file holds: a page that says of each array how much of its beginning is left out, then the whole
// pages of each from there on. That depends on where the array lay in the memory of who made the file. Who
// has it at another place of a page keeps his own, and shares the others.
class Plan {
 public:
  using Skips = std::array<std::uint16_t, PageStore::most_arrays>;
  static constexpr std::size_t head_bytes = sizeof(Skips);

  explicit Plan(const PageStore::Arrays& arrays) : arrays_(arrays) {
    std::uint64_t at = (head_bytes + page_ - 1) / page_ * page_;
    for (const auto& array : arrays) {
      at_.push_back(at);
      at += array.size() / page_ * page_;
    }
    bytes_ = at;
  }

  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t at(std::size_t i) const { return at_[i]; }
  /// Of array `i`, where so many of its first bytes are left out.
  std::span<const std::byte> pages(std::size_t i, std::size_t skip) const {
    return arrays_[i].subspan(skip, (arrays_[i].size() - skip) / page_ * page_);
  }
  bool fits(std::size_t i, std::size_t skip) const { return skipped(arrays_[i].data()) == skip; }
  /// Arrays of their own mapping begin right behind their allocator's word or two, those on cache lines at
  /// the next: where another process will have them, too, unless they came from its heap.
  Skips skips() const {
    Skips out{};
    for (std::size_t i = 0; i < arrays_.size(); ++i) {
      const std::size_t own = skipped(arrays_[i].data());
      const std::size_t usual = page_ - 2 * sizeof(std::size_t);
      out[i] = static_cast<std::uint16_t>(own == page_ - kLine ? own : usual);
    }
    return out;
  }

 private:
  static constexpr std::size_t kLine = 64;
  const PageStore::Arrays& arrays_;
  std::size_t page_ = platform::page_bytes();
  std::vector<std::uint64_t> at_;
  std::uint64_t bytes_ = 0;
};

// Read, not mapped: of a file that somebody cuts meanwhile that is an error, and no signal.
bool same(const PageFile& file, std::uint64_t at, std::span<const std::byte> pages,
          std::vector<std::byte>& piece) {
  while (!pages.empty()) {
    const std::span<std::byte> some(piece.data(), std::min(piece.size(), pages.size()));
    if (file.read_at(at, some) || std::memcmp(some.data(), pages.data(), some.size()) != 0) return false;
    at += some.size();
    pages = pages.subspan(some.size());
  }
  return true;
}

// How much of each array is left out; nothing where the file is not of these arrays, byte for byte.
std::optional<Plan::Skips> skips_of(const PageFile& file, const Plan& plan, std::size_t arrays) {
  Plan::Skips skips{};
  if (file.size() != plan.bytes() || file.read_at(0, std::as_writable_bytes(std::span(skips))))
    return std::nullopt;
  std::vector<std::byte> piece(kPiece);
  for (std::size_t i = 0; i < arrays; ++i) {
    if (skips[i] >= platform::page_bytes() || !same(file, plan.at(i), plan.pages(i, skips[i]), piece))
      return std::nullopt;
  }
  return skips;
}

void remove_file(const fs::path& path) noexcept {
  std::error_code ignored;
  fs::remove(path, ignored);
}

struct RemoveAtEnd {
  fs::path path;
  ~RemoveAtEnd() { remove_file(path); }
};

}  // namespace

PageStore::PageStore(fs::path folder) : folder_(std::move(folder)) {
  if (const std::error_code error = platform::make_own_folder(folder_))
    throw Error(ErrorKind::cannot_create, folder_.string(), "cannot be made: " + error.message(),
                "name a folder within one in memory that is there, as /dev/shm/ecorche");
  const std::error_code error = platform::cannot_keep_pages_in(folder_);
  if (error == std::errc::not_supported)
    throw Error(ErrorKind::refused, folder_.string(), "is on a disk",
                "name a folder in memory (tmpfs), as /dev/shm/ecorche");
  if (error == std::errc::permission_denied)
    throw Error(ErrorKind::refused, folder_.string(), "is another user's, or others may write into it",
                "name a folder of your own, or chmod 700");
  if (error)
    throw Error(ErrorKind::cannot_create, folder_.string(), "cannot be used: " + error.message(),
                "name a folder, not a link or a file");
}

PageStore::Copy::~Copy() {
  // Who opened it just now finds it without a name, and makes another.
  if (file_.is_open() && file_.take_alone() && file_.is_at(path_)) remove_file(path_);
}

PageStore::Copy& PageStore::Copy::operator=(Copy&& other) noexcept {
  std::swap(bytes, other.bytes);
  std::swap(made, other.made);
  std::swap(error, other.error);
  std::swap(file_, other.file_);
  path_.swap(other.path_);
  return *this;
}

PageStore::Copy PageStore::share(const Arrays& all) const {
  const Arrays arrays = chosen(all);
  Copy copy;
  if (arrays.empty()) return copy;
  copy.path_ = folder_ / name_of(arrays);
  for (int tries = 0; tries < kTries && !copy.file_.is_open(); ++tries) {
    copy.made = false;
    copy.error = take(arrays, copy);
    if (copy.error == std::errc::no_such_file_or_directory) copy.error = make(arrays, copy);
    if (copy.error && copy.error != std::errc::file_exists && copy.error != again()) break;
  }
  sweep();
  return copy;
}

// no_such_file_or_directory: nothing that can be used, and nothing in the way.
std::error_code PageStore::take(const Arrays& arrays, Copy& copy) const {
  std::error_code error;
  PageFile file = PageFile::open(copy.path_, error);
  if (error == std::errc::no_such_file_or_directory) return error;
  if (!error && (!file.hold() || !file.has_name())) return again();  // its last user is removing it
  const Plan plan(arrays);
  std::optional<Plan::Skips> skips;
  if (!error && file.is_sealed()) skips = skips_of(file, plan, arrays.size());
  if (!skips) {
    // Whoever has it keeps what has no name any more.
    error.clear();
    fs::remove(copy.path_, error);
    return error ? error : std::make_error_code(std::errc::no_such_file_or_directory);
  }
  copy.bytes = 0;
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    if (!plan.fits(i, (*skips)[i])) continue;
    const auto pages = plan.pages(i, (*skips)[i]);
    if (const std::error_code failed = file.stand_at(plan.at(i), pages)) return failed;
    copy.bytes += pages.size();
  }
  copy.file_ = std::move(file);
  return {};
}

std::error_code PageStore::make(const Arrays& arrays, Copy& copy) const {
  std::error_code error;
  const fs::path beside = hidden_beside(copy.path_, error);
  if (error) return error;
  PageFile file = PageFile::make(beside, error);
  if (error) return error;
  const RemoveAtEnd remove_beside{beside};
  if (!file.hold() || !file.has_name()) return again();  // somebody's sweep took it for left behind
  const Plan plan(arrays);
  const Plan::Skips skips = plan.skips();
  error = file.write_at(0, std::as_bytes(std::span(skips)));
  if (!error) error = file.resize(plan.bytes());
  // Each stands in its array's place before the next is written: there is never twice as much.
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < arrays.size() && !error; ++i) {
    const auto pages = plan.pages(i, skips[i]);
    error = file.write_at(plan.at(i), pages);
    if (error || !plan.fits(i, skips[i])) continue;
    error = file.stand_at(plan.at(i), pages);
    bytes += pages.size();
  }
  if (!error) error = file.seal();
  if (!error)
    error = platform::rename_to_new(beside, copy.path_);  // never over another's, which is taken then
  if (error) return error;
  copy.made = true;
  copy.bytes = bytes;
  copy.file_ = std::move(file);
  return {};
}

// What killed processes left: nobody holds it.
void PageStore::sweep() const {
  std::error_code error;
  for (fs::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    if (!at->path().native().ends_with(kEnding)) continue;
    std::error_code ignored;
    PageFile file = PageFile::open(at->path(), ignored);
    if (file.is_open() && file.take_alone() && file.is_at(at->path())) remove_file(at->path());
  }
}

}  // namespace ecorche::files
