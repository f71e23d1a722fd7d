// SPDX-License-Identifier: Apache-2.0
#include "app/scan/case_folder.hpp"

#include <algorithm>

#include "app/scan/case_text.hpp"
#include "app/scan/scan_picture.hpp"
#include "core/files/atomic_file.hpp"
#include "core/values/identifier.hpp"
#include "io/image/image_file.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

constexpr int kPicturePixels = 720;

// A byte a voxel is enough for most.
Image narrow(const Image& labels, std::size_t most) {
  if (most > 255) return labels;
  Image out(labels.grid, ScalarType::u8);
  const auto from = labels.scalars<std::uint16_t>();
  std::transform(from.begin(), from.end(), out.scalars<std::uint8_t>().begin(),
                 [](std::uint16_t v) { return static_cast<std::uint8_t>(v); });
  return out;
}

// The files of a case; gone again, with the folder where it is new, unless all were written.
class Unfinished {
 public:
  explicit Unfinished(const fs::path& folder) : folder_(folder) {
    std::error_code ignored;
    made_ = !fs::exists(folder, ignored);
    files::make_folder(folder);
  }
  ~Unfinished() {
    std::error_code ignored;
    for (const fs::path& file : files_) fs::remove(file, ignored);
    if (made_ && !whole_) fs::remove(folder_, ignored);
  }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;

  const fs::path& add(const std::string& name) { return files_.emplace_back(folder_ / name); }
  void whole() {
    files_.clear();
    whole_ = true;
  }

 private:
  fs::path folder_;
  std::vector<fs::path> files_;
  bool made_ = false, whole_ = false;
};

// Whether files of a posed body, or of the case, are called so.
bool is_taken(const std::string& name) {
  return name.empty() || name == "labels" || name.starts_with("labels_") || name == "mask" ||
         name == "displacement";
}

}  // namespace

void check_case_target(const fs::path& folder, const std::vector<fs::path>& inputs) {
  std::error_code ignored;
  for (const fs::path& input : inputs) {
    if (fs::equivalent(input, folder, ignored))
      throw Error(ErrorKind::usage, "--output", "'" + folder.string() + "' holds the input",
                  "name another folder");
  }
  if (!fs::exists(folder, ignored)) return;
  if (!fs::is_directory(folder, ignored))
    throw Error(ErrorKind::cannot_create, folder.string(), "is a file", "name a folder with -o");
  if (!fs::is_empty(folder, ignored))
    throw Error(ErrorKind::cannot_create, folder.string(), "holds files",
                "name a new or empty folder with -o");
}

WrittenCase write_scan_case(const fs::path& folder, const std::vector<fs::path>& inputs, const Scan& scan,
                            const ScanCase& made, const Context& context) {
  Unfinished unfinished(folder);
  io::write_image(unfinished.add("labels.nrrd"), narrow(made.labels, made.entries.size()));
  context.report(0.4);
  std::vector<CaseVolumeFile> volumes;
  for (const ScanImage& image : scan.images) {
    std::string name = image.ct ? "ct" : identifier_from(image.path.filename().stem().stem().string(), 40);
    if (is_taken(name)) name = "image";
    const std::string first = name;
    for (int number = 2;
         std::any_of(volumes.begin(), volumes.end(), [&](const CaseVolumeFile& v) { return v.name == name; });
         ++number)
      name = first + "_" + std::to_string(number);
    const std::string file = name + ".nrrd";
    io::write_image(unfinished.add(file), image.image);
    volumes.push_back({name, file, image.background});
  }
  context.report(0.9);
  files::write_text(unfinished.add("picture.png"), report::png_bytes(both_views(made, kPicturePixels)));
  std::vector<std::string> from;
  from.reserve(inputs.size());
  for (const fs::path& input : inputs)
    from.push_back(input.filename().empty() ? input.parent_path().filename().string()
                                            : input.filename().string());
  fs::path clean = folder.lexically_normal();
  if (clean.filename().empty()) clean = clean.parent_path();
  std::string name = identifier_from(clean.filename().string());
  if (name.empty()) name = "patient";
  files::write_text(unfinished.add("case.yaml"), case_text(made, name, folder, from, volumes));
  unfinished.whole();
  context.report(1);
  return {name};
}

}  // namespace ecorche::app
