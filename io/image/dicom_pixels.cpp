// SPDX-License-Identifier: Apache-2.0
// https://dicom.nema.org/medical/dicom/current/output/chtml/part05/sect_A.4.html (packed pixels)
#include "io/image/dicom_pixels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "io/image/header_fields.hpp"

namespace ecorche::io::dicom {
namespace {

using fields::refuse;

constexpr std::uint32_t kItemBytes = 0xe000fffe, kEndBytes = 0xe0ddfffe;  // as they are read, little endian

static_assert(std::endian::native == std::endian::little, "numbers are read as they are stored");

template <class T>
void swap_each(std::span<std::byte> bytes) {
  for (std::size_t i = 0; i + sizeof(T) <= bytes.size(); i += sizeof(T))
    std::reverse(bytes.data() + i, bytes.data() + i + sizeof(T));
}

}  // namespace

PixelFile::PixelFile(const std::filesystem::path& path, std::uint64_t bytes, const StoredPixels& pixels)
    : path_(path), file_bytes_(bytes), pixels_(pixels), file_(path, std::ios::binary) {
  if (!file_) throw Error(ErrorKind::io, path.string(), "cannot be opened any more", "read it again");
  const std::uint64_t bits =
      std::uint64_t{pixels.rows} * pixels.columns * static_cast<std::uint64_t>(pixels.allocated);
  frame_bytes_ = static_cast<std::size_t>((bits + 7) / 8);
  if (pixels.syntax.packing != Packing::none) {
    find_fragments();
  } else if ((bits * pixels.frames + 7) / 8 > pixels.bytes) {
    refuse(path,
           "holds " + std::to_string(pixels.bytes) + " of the " +
               std::to_string((bits * pixels.frames + 7) / 8) + " bytes of its pixels",
           "copy it from the archive again");
  }
}

void PixelFile::read_at(std::uint64_t at, std::span<std::byte> out) {
  if (out.size() > file_bytes_ || at > file_bytes_ - out.size())
    refuse(path_, "ends within its pixels", "copy it from the archive again");
  file_.seekg(static_cast<std::streamoff>(at));
  file_.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
  if (!file_) throw Error(ErrorKind::io, path_.string(), "cannot be read", "check the disk");
}

void PixelFile::read_raw(std::uint64_t from, std::span<std::byte> out) {
  read_at(pixels_.at + from, out);
}

void PixelFile::find_fragments() {
  std::vector<Fragment> fragments;
  std::vector<std::uint32_t> offsets;
  std::uint64_t at = pixels_.at;
  for (bool table = true;; table = false) {
    std::array<std::uint32_t, 2> head{};
    read_at(at, std::as_writable_bytes(std::span(head)));
    at += 8;
    if (head[0] == kEndBytes) break;
    if (head[0] != kItemBytes || head[1] > file_bytes_ - at)
      refuse(path_, "its packed pixels are damaged at byte " + std::to_string(at - 8),
             "copy it from the archive again");
    if (table) {
      offsets.resize(head[1] / 4);
      read_at(at, std::as_writable_bytes(std::span(offsets)));
    } else {
      fragments.push_back({at, head[1]});
    }
    at += head[1];
  }
  share_out(offsets, fragments);
  fragments_ = std::move(fragments);
}

// Frames are told by the table, else each has one fragment, else one alone has all.
void PixelFile::share_out(const std::vector<std::uint32_t>& offsets, const std::vector<Fragment>& fragments) {
  const std::size_t frames = pixels_.frames;
  if (frames == 1) {
    first_ = {0, fragments.size()};
  } else if (fragments.size() == frames) {
    for (std::size_t f = 0; f <= frames; ++f) first_.push_back(f);
  } else if (offsets.size() == frames && !fragments.empty()) {
    const std::uint64_t base = fragments.front().at - 8;
    for (const std::uint32_t offset : offsets) {
      const auto found =
          std::lower_bound(fragments.begin(), fragments.end(), base + offset + 8,
                           [](const Fragment& one, std::uint64_t where) { return one.at < where; });
      first_.push_back(static_cast<std::size_t>(found - fragments.begin()));
    }
    first_.push_back(fragments.size());
  }
  if (first_.size() != frames + 1 || !std::is_sorted(first_.begin(), first_.end()) ||
      std::adjacent_find(first_.begin(), first_.end()) != first_.end()) {
    refuse(path_,
           "does not tell which of its " + std::to_string(fragments.size()) +
               " fragments are of which of its " + std::to_string(frames) + " frames",
           "unpack it: gdcmconv --raw IN OUT");
  }
}

std::string PixelFile::packed(std::uint32_t frame) {
  std::string out;
  for (std::size_t i = first_[frame]; i < first_[frame + 1]; ++i) {
    const Fragment& fragment = fragments_[i];
    const std::size_t had = out.size();
    out.resize(had + static_cast<std::size_t>(fragment.bytes));
    read_at(fragment.at, std::as_writable_bytes(std::span(out).subspan(had)));
  }
  return out;
}

void PixelFile::read(std::uint32_t frame, std::span<std::byte> out) {
  if (pixels_.syntax.packing != Packing::none) return unpack(packed(frame), pixels_, out, path_);
  read_at(pixels_.at + std::uint64_t{frame} * frame_bytes_, out);
  if (pixels_.syntax.big_endian && pixels_.allocated == 16) swap_each<std::uint16_t>(out);
  if (pixels_.syntax.big_endian && pixels_.allocated == 32) swap_each<std::uint32_t>(out);
}

}  // namespace ecorche::io::dicom
