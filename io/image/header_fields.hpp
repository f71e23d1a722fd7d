// SPDX-License-Identifier: Apache-2.0
// What the two header formats share: numbers out of text, and refusals.
#pragma once

#include <charconv>
#include <filesystem>
#include <string>
#include <string_view>

#include <ecorche/values/error.hpp>
#include "core/values/text.hpp"
#include "io/image/header.hpp"

namespace ecorche::io::fields {

[[noreturn]] inline void refuse(const std::filesystem::path& path, std::string what,
                                std::string mend = "write the image again") {
  throw Error(ErrorKind::data, path.string(), std::move(what), std::move(mend));
}

/// A whole number from `least` to `most`; `key` for the message.
inline std::int64_t integer(std::string_view text, std::int64_t least, std::int64_t most,
                            const std::string& key, const std::filesystem::path& path) {
  std::int64_t value = 0;
  text = text::trim(text);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < least || value > most) {
    refuse(path, key + " is '" + std::string(text.substr(0, 40)) + "'",
           "it must be a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return value;
}

/// How many volumes follow each other in time.
inline int volumes_of(std::int64_t count, const std::filesystem::path& path) {
  if (count > most_volumes)
    refuse(path, "declares " + std::to_string(count) + " volumes in time",
           "it may have " + std::to_string(most_volumes) + ": save those that are needed");
  return static_cast<int>(count);
}

/// A data file named by a header: a plain name beside it. Anything else could read any file of the machine.
inline std::filesystem::path beside(const std::filesystem::path& path, std::string_view name) {
  const bool plain = !name.empty() && name != "." && name != ".." &&
                     name.find_first_of("/\\%") == name.npos && text::lower(name.substr(0, 4)) != "list" &&
                     name.find_first_of(std::string_view("\0", 1)) == name.npos;
  if (!plain) {
    refuse(path, "its voxels are in '" + std::string(name.substr(0, 80)) + "'",
           "put them in one file beside the header, named without folders or patterns");
  }
  return path.parent_path() / name;
}

/// Voxels are integers of 64 bits.
inline void set_wide(ImageHeader& header, bool is_unsigned) {
  header.type = ScalarType::i32;
  header.wide = true;
  header.wide_unsigned = is_unsigned;
}

/// Refuses what does not fit `largest_image_bytes`; sizes are at least 1 each.
inline void check_size(const ImageHeader& header, const std::filesystem::path& path) {
  // Each factor is below 2^31 and the product is checked as it grows: it cannot overflow.
  std::uint64_t bytes = header.stored_bytes();
  for (const std::int64_t factor : {std::int64_t{header.components}, std::int64_t{header.size[0]},
                                    std::int64_t{header.size[1]}, std::int64_t{header.size[2]}}) {
    bytes *= static_cast<std::uint64_t>(factor);
    if (bytes > largest_image_bytes) {
      refuse(path,
             "declares " + std::to_string(header.size[0]) + " x " + std::to_string(header.size[1]) + " x " +
                 std::to_string(header.size[2]) + " voxels of " + std::to_string(header.components) + " " +
                 std::string(scalar_name(header.type)),
             "images may hold 2^33 bytes: crop it or make its voxels larger");
    }
  }
}

}  // namespace ecorche::io::fields
