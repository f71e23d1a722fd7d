// SPDX-License-Identifier: Apache-2.0
// https://dicom.nema.org/medical/dicom/current/output/chtml/part10/chapter_7.html
#include "io/image/dicom.hpp"

#include <array>
#include <fstream>
#include <string_view>

#include "core/values/text.hpp"

namespace ecorche::io {
namespace {

namespace fs = std::filesystem;

constexpr int kLookedAt = 256;  // files of a folder: a series lies with its like

bool is_file_of_dicom(const fs::path& path) {
  const std::string ending = text::lower(path.extension().string());
  if (ending == ".dcm" || ending == ".ima") return true;
  std::ifstream file(path, std::ios::binary);
  std::array<char, 132> head{};
  file.read(head.data(), head.size());
  return file && std::string_view(head.data() + 128, 4) == "DICM";
}

}  // namespace

bool is_dicom(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return fs::is_regular_file(path, error) && is_file_of_dicom(path);
  int looked_at = 0;
  for (fs::recursive_directory_iterator at(path, error); !error && at != fs::recursive_directory_iterator();
       at.increment(error)) {
    if (++looked_at > kLookedAt) break;
    if (at->is_regular_file(error) && is_file_of_dicom(at->path())) return true;
  }
  return false;
}

}  // namespace ecorche::io
