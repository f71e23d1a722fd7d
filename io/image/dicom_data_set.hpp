// SPDX-License-Identifier: Apache-2.0
// The elements of a DICOM file up to its pixels, read by ourselves: DCMTK follows nested sequences until the
// stack is gone, and Debian's GDCM has open holes. Memory is some 16 times the bytes before the pixels.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/files/read_options.hpp"

namespace ecorche::io::dicom {

/// `0xGGGGEEEE`.
using Tag = std::uint32_t;

/// How pixels lie in the file.
enum class Packing : std::uint8_t { none, rle, jpeg, jpeg_lossless, jpeg_ls, jpeg_2000 };

struct Syntax {
  bool is_explicit = true, big_endian = false;
  Packing packing = Packing::none;
};

struct Item;

struct Element {
  Tag tag = 0;
  std::string_view value;   ///< as stored; of the file's head
  std::vector<Item> items;  ///< of a sequence
};

/// A data set, of the file or of a sequence.
struct Item {
  std::vector<Element> elements;  ///< in the file's order
  const Syntax* syntax = nullptr;
  const std::string* text_set = nullptr;  ///< Specific Character Set

  const Element* find(Tag tag) const;
  /// The item that a sequence holds, where it holds one at least.
  const Item* only(Tag sequence) const;
  /// Without what fills it up, as UTF-8; empty where it is absent.
  std::string text(Tag tag) const;
  /// One of several values, from 0.
  std::string text(Tag tag, std::size_t which) const;
  /// Numbers written as text; nothing where one of them is no number.
  std::vector<double> numbers(Tag tag) const;
  template <std::size_t N>
  std::optional<std::array<double, N>> numbers(Tag tag) const {
    const std::vector<double> all = numbers(tag);
    if (all.size() != N) return std::nullopt;
    std::array<double, N> out{};
    for (std::size_t i = 0; i < N; ++i) out[i] = all[i];
    return out;
  }
  std::optional<double> number(Tag tag) const;
  /// US, SS or UL as it is stored; of several the first.
  std::optional<std::uint32_t> whole(Tag tag) const;
  /// All values of an AT or US, of `bytes` each.
  std::vector<std::uint32_t> wholes(Tag tag, std::size_t bytes) const;
};

struct DataSet {
  std::filesystem::path path;
  std::uint64_t file_bytes = 0;
  Item top;
  std::uint64_t pixels_at = 0;     ///< of their first byte; 0: the file has none
  std::uint64_t pixels_bytes = 0;  ///< raw only
  Syntax syntax;

  // What views look into.
  std::shared_ptr<const std::string> head;
  std::shared_ptr<const std::string> text_set;
  std::shared_ptr<const Syntax> shared_syntax;
};

/// Whether a file that begins so is DICOM: its magic, or a data set without one, as old programs wrote it.
bool is_data_set(std::string_view head);

/// Throws Error{missing_input, io}, and Error{data}: no DICOM, elements longer than the file, sequences
/// deeper than 16, a transfer syntax that is not known.
DataSet read_data_set(const std::filesystem::path& path, const files::ReadOptions& options);

/// The message's name of a packing.
std::string_view packing_name(Packing packing);

}  // namespace ecorche::io::dicom
