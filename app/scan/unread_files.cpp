// SPDX-License-Identifier: Apache-2.0
#include "app/scan/unread_files.hpp"

#include <set>

#include "io/image/dicom.hpp"
#include "io/image/mask_folder.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

constexpr int kLookedAt = 20000;

fs::path real_place(const fs::path& path) {
  std::error_code error;
  fs::path out = fs::weakly_canonical(path, error);
  if (out.filename().empty()) out = out.parent_path();
  return error ? path : out;
}

struct Given {
  std::set<fs::path> files, folders, dicom;  // real places; `dicom` is read with all below it

  bool reads(const fs::path& file, bool image) const {
    if (files.contains(file) || (image && folders.contains(file.parent_path()))) return true;
    for (fs::path above = file.parent_path(); !image && above.has_relative_path();
         above = above.parent_path()) {
      if (dicom.contains(above)) return true;
    }
    return false;
  }
};

}  // namespace

std::vector<std::string> unread_below(const std::vector<fs::path>& given) {
  std::error_code error;
  Given all;
  for (const fs::path& path : given) {
    auto& of = !fs::is_directory(path, error) ? all.files : io::is_dicom(path) ? all.dicom : all.folders;
    of.insert(real_place(path));
  }
  std::vector<std::string> out;
  for (const fs::path& folder : given) {
    if (!fs::is_directory(folder, error)) continue;
    const fs::path top = real_place(folder);
    std::set<fs::path> unread;
    int looked_at = 0;
    for (fs::recursive_directory_iterator at(top, error);
         !error && at != fs::recursive_directory_iterator() && ++looked_at <= kLookedAt;
         at.increment(error)) {
      const fs::path& file = at->path();
      if (!at->is_regular_file(error) || file.filename().string().starts_with('.')) continue;
      const bool image = io::is_image_name(file);
      if ((image || io::is_dicom(file)) && !all.reads(file, image))
        unread.insert(file.lexically_relative(top));
    }
    if (unread.empty()) continue;
    out.push_back(folder.string() + ": " + std::to_string(unread.size()) +
                  (unread.size() == 1 ? " image below it is" : " images below it are") +
                  " not read, the first " + unread.begin()->string() +
                  ": where they belong to this scan, give them, or their folders, too");
  }
  return out;
}

}  // namespace ecorche::app
