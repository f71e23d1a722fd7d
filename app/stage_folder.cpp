// SPDX-License-Identifier: Apache-2.0
#include "app/stage_folder.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <vector>

#include <ecorche/values/error.hpp>
#include <ecorche/version.hpp>
#include "core/files/atomic_file.hpp"
#include "core/files/stale_parts.hpp"
#include "core/model_file/digest.hpp"
#include "core/platform/process.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "ECSTAGE1";
constexpr std::string_view kEnding = ".stage";
constexpr std::size_t kHeader = kMagic.size() + sizeof(std::uint64_t);

std::uint64_t digest_of(std::string_view bytes) {
  return model_file::Digest().bytes(std::as_bytes(std::span(bytes))).value();
}

// XXH64 of this very program: what another build made is not taken for ours.
std::uint64_t own_digest() {
  std::ifstream self(platform::own_program(), std::ios::binary);
  model_file::Digest digest;
  digest.text(ECORCHE_VERSION);
  std::vector<char> block(1 << 20);
  while (self.read(block.data(), static_cast<std::streamsize>(block.size())) || self.gcount() > 0) {
    digest.bytes(std::as_bytes(std::span(block.data(), static_cast<std::size_t>(self.gcount()))));
  }
  return digest.value();
}

}  // namespace

StageFolder::StageFolder(fs::path folder, double limit_gib)
    : folder_(std::move(folder)),
      limit_(static_cast<std::uint64_t>(limit_gib * (1U << 30))),
      program_(own_digest()) {
  files::make_folder(folder_);
  files::remove_stale_parts_ending(folder_, ".stage");
}

fs::path StageFolder::path_of(std::string_view name) const {
  return folder_ / (std::string(name) + std::string(kEnding));
}

std::optional<std::string> StageFolder::find(std::string_view name) {
  const fs::path path = path_of(name);
  std::ifstream file(path, std::ios::binary);
  std::string bytes;
  if (!file.seekg(0, std::ios::end)) return std::nullopt;
  const auto size = static_cast<std::size_t>(file.tellg());
  if (size < kHeader) return std::nullopt;
  std::array<char, kHeader> header{};
  file.seekg(0).read(header.data(), header.size());
  bytes.resize(size - kHeader);
  if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) return std::nullopt;
  std::uint64_t digest = 0;
  std::memcpy(&digest, header.data() + kMagic.size(), sizeof digest);
  if (std::string_view(header.data(), kMagic.size()) != kMagic || digest != digest_of(bytes))
    return std::nullopt;
  std::error_code ignored;  // a folder that is only read keeps no order of use
  fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);
  return bytes;
}

void StageFolder::keep(std::string_view name, std::string_view bytes) {
  make_room(kHeader + bytes.size());
  files::AtomicFile file(path_of(name));
  const std::uint64_t digest = digest_of(bytes);
  {
    std::ofstream out(file.temporary(), std::ios::binary);
    out.write(kMagic.data(), kMagic.size());
    out.write(reinterpret_cast<const char*>(&digest), sizeof digest);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out)
      throw Error(ErrorKind::io, path_of(name).string(), "the stage was cut short while it was written",
                  "check the disk's free space");
  }
  file.commit();
}

void StageFolder::make_room(std::uint64_t bytes) {
  struct Held {
    fs::file_time_type used;
    std::uint64_t bytes;
    fs::path path;
  };
  std::vector<Held> held;
  std::uint64_t all = bytes;
  std::error_code gone;  // another run may clear away beside us
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, gone)) {
    if (entry.path().extension() != kEnding) continue;
    const Held file{entry.last_write_time(gone), gone ? 0 : entry.file_size(gone), entry.path()};
    if (gone) continue;
    all += file.bytes;
    held.push_back(file);
  }
  std::sort(held.begin(), held.end(), [](const Held& a, const Held& b) {
    return a.used != b.used ? a.used < b.used : a.path < b.path;
  });
  for (auto oldest = held.begin(); oldest != held.end() && all > limit_; ++oldest) {
    fs::remove(oldest->path, gone);
    all -= oldest->bytes;
  }
}

}  // namespace ecorche::app
