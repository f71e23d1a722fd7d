// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_input.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/values/text.hpp"
#include "io/image/dicom.hpp"
#include "io/image/dicom_segmentation.hpp"
#include "io/image/image_file.hpp"
#include "io/image/label_json.hpp"
#include "io/image/label_table.hpp"
#include "io/image/mask_folder.hpp"
#include "io/image/nifti_names.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostLabels = 2048;  // values of a picture are more
constexpr double kAirHu = -500, kAirBackground = -1024;

std::string small_ending(const fs::path& path) {
  return text::lower(path.extension().string());
}

bool is_table_name(const fs::path& path) {
  static const std::set<std::string> endings{".json", ".tsv", ".ctbl", ".txt", ".label"};
  return endings.contains(small_ending(path));
}

// The values of an image that may be labels: whole, none below 0, not too many.
std::optional<std::set<std::int64_t>> label_values(const Image& image) {
  std::set<std::int64_t> seen;
  const bool fits = with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    T last{};
    for (const T v : image.scalars<T>()) {
      if (v == last) continue;
      last = v;
      if (!(v >= T{}) || static_cast<double>(v) != std::floor(static_cast<double>(v)) ||
          static_cast<double>(v) > 2147483647.0)
        return false;
      seen.insert(static_cast<std::int64_t>(v));
      if (seen.size() > kMostLabels) return false;
    }
    return true;
  });
  if (!fits) return std::nullopt;
  seen.erase(0);
  return seen;
}

// Whether neighbours differ as they do in pictures: labels come in areas.
bool looks_grey(const Image& image, std::size_t values) {
  if (values < 32) return false;
  std::size_t pairs = 0, differ = 0;
  with_scalar_type(image.type, [&](auto zero) {
    const auto voxels = image.scalars<decltype(zero)>();
    for (std::size_t v = 1; v < voxels.size(); ++v) {
      if (voxels[v] == zero || voxels[v - 1] == zero) continue;
      ++pairs;
      differ += voxels[v] != voxels[v - 1] ? 1 : 0;
    }
  });
  return 2 * differ > pairs;
}

ScanImage grey(const fs::path& path, Image image) {
  double least = 0;
  with_scalar_type(image.type, [&](auto zero) {
    const auto voxels = image.scalars<decltype(zero)>();
    least = static_cast<double>(*std::min_element(voxels.begin(), voxels.end()));
  });
  const bool ct = least < kAirHu;
  return {path, std::move(image), ct, ct ? std::min(least, kAirBackground) : least};
}

struct Names {
  io::LabelNames names;
  std::map<std::int64_t, io::SegmentCodes> codes;
};

Names read_names(const fs::path& table) {
  if (small_ending(table) != ".json") return {io::read_label_table(table), {}};
  io::JsonLabels read = io::read_label_json(table);
  return {io::make_identifiers(read.names), std::move(read.codes)};
}

// `clin_ct_ribs_` of MOOSE's `clin_ct_ribs_organ_indices.json`, else the stem.
std::string table_stem(const fs::path& table) {
  const std::string name = table.filename().string();
  constexpr std::string_view moose = "organ_indices.json";
  if (name.ends_with(moose)) return name.substr(0, name.size() - moose.size());
  return table.stem().string();
}

class Reader {
 public:
  Reader(const files::ReadOptions& options, const io::ImageChoice& choice, const Context& context)
      : options_(options), choice_(choice), context_(context) {}

  Scan read(const std::vector<fs::path>& paths) {
    std::vector<fs::path> files;
    for (const fs::path& path : paths) {
      std::error_code ignored;
      if (!fs::exists(path, ignored))
        throw Error(ErrorKind::missing_input, path.string(), "no such file or folder", "mend the path");
      if (fs::is_directory(path, ignored) && !io::is_dicom(path)) {
        list_folder(path, files);
      } else if (is_table_name(path)) {
        tables_.push_back(path);
      } else {
        files.push_back(path);
      }
    }
    std::size_t done = 0;
    for (const fs::path& path : files) {
      read_file(path);
      context_.report(static_cast<double>(++done) / static_cast<double>(files.size()));
    }
    read_mask_groups();
    name_labels();
    if (out_.labels.empty() && out_.images.empty())
      throw Error(ErrorKind::data, paths.front().string(), "holds no image",
                  "give a CT and its segmentation: .nii.gz, .nrrd, .mha or DICOM, or a folder of masks");
    return std::move(out_);
  }

 private:
  void list_folder(const fs::path& folder, std::vector<fs::path>& files) {
    const std::vector<fs::path> images = io::images_within(folder);
    std::error_code error;
    for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator();
         at.increment(error)) {
      if (at->is_regular_file(error) && at->path().filename().string().ends_with("organ_indices.json"))
        tables_.push_back(at->path());
    }
    std::sort(tables_.begin(), tables_.end());
    if (images.empty())
      throw Error(ErrorKind::data, folder.string(), "holds no image that can be read",
                  "name a folder of .nii.gz, .nrrd, .mha or DICOM");
    files.insert(files.end(), images.begin(), images.end());
    folders_.insert(folder);
  }

  // A folder's masks are read again, together: only whether it is one is looked at here.
  void read_file(const fs::path& path) {
    context_.check_stop();
    if (io::is_dicom(path)) {
      if (std::optional<io::Segmentation> map = io::read_dicom_segmentation(path, options_, {})) {
        out_.labels.push_back({path, std::move(*map), "its segments"});
      } else {
        add_grey(path, io::read_image(path, options_, choice_));
      }
      return;
    }
    const bool nrrd = text::lower(path.filename().string()).ends_with(".seg.nrrd");
    if (nrrd) {
      io::Segmentation map = io::read_segmentation(path, options_);
      const bool named = !map.names.empty();
      out_.labels.push_back({path, std::move(map), named ? "its own segments" : ""});
      return;
    }
    Image image = io::read_image(path, options_);
    check_components(path, image);
    const auto values = label_values(image);
    const auto names = io::read_nifti_names(path);
    const bool in_folder = folders_.contains(path.parent_path());
    if (values && values->size() <= 1 && in_folder && names.empty() && !table_for(path)) {
      masks_[path.parent_path()].push_back(path);
      return;
    }
    const bool labels = values && (!names.empty() || table_for(path) || !looks_grey(image, values->size()));
    if (!labels) {
      add_grey(path, std::move(image));
      return;
    }
    if (values->empty()) {
      out_.notes.push_back(path.string() + ": holds no label: it is left out");
      return;
    }
    image = {};
    io::Segmentation map = io::read_segmentation(path, options_);
    const bool named = !map.names.empty();
    if (!named && values->size() == 1) {  // a mask by itself is named by its file
      map.names = io::make_identifiers({{*values->begin(), io::image_stem(path)}});
      out_.labels.push_back({path, std::move(map), "the name of its file"});
      return;
    }
    out_.labels.push_back({path, std::move(map), named ? "its header" : ""});
  }

  static void check_components(const fs::path& path, const Image& image) {
    if (image.components == 1) return;
    const bool colours = image.components == 3 || image.components == 4;
    throw Error(ErrorKind::data, path.string(),
                "has " + std::to_string(image.components) + " numbers a voxel",
                colours ? "it is a picture in colours: save the grey values, or the label map"
                        : "save one number a voxel");
  }

  void add_grey(const fs::path& path, Image image) {
    check_components(path, image);
    out_.images.push_back(grey(path, std::move(image)));
  }

  void read_mask_groups() {
    for (const auto& [folder, files] : masks_) {
      std::size_t empty = 0;
      io::Segmentation map = io::read_masks(files, options_, context_.quiet(), &empty);
      if (empty > 0)
        out_.notes.push_back(folder.string() + ": " + std::to_string(empty) + " of " +
                             std::to_string(files.size()) + " masks are empty: those structures are absent");
      out_.labels.push_back({folder, std::move(map), "the names of its files"});
    }
  }

  // The table that belongs to an image by its name: its own stem, or MOOSE's prefix of it, the longest.
  std::optional<fs::path> table_for(const fs::path& image) const {
    const std::string stem = io::image_stem(image);
    std::optional<fs::path> best;
    std::size_t length = 0;
    for (const fs::path& table : tables_) {
      const std::string own = table_stem(table);
      const bool fits = table.parent_path() == image.parent_path() && !own.empty() && stem.starts_with(own);
      if (fits && own.size() > length) best = table, length = own.size();
    }
    for (const char* ending : {".json", ".tsv", ".ctbl", ".txt", ".label"}) {
      const fs::path beside = image.parent_path() / (stem + ending);
      std::error_code ignored;
      if (length < stem.size() && fs::is_regular_file(beside, ignored)) return beside;
    }
    return best;
  }

  void name_labels() {
    std::set<fs::path> used;
    for (ScanLabels& labels : out_.labels) {
      if (fs::is_directory(labels.path)) continue;
      const auto table = table_for(labels.path);
      if (!table) continue;
      use(labels, *table);
      used.insert(*table);
    }
    // What was named by the user and fits no name goes with the one that has none.
    for (const fs::path& table : tables_) {
      if (used.contains(table)) continue;
      std::vector<ScanLabels*> nameless;
      for (ScanLabels& labels : out_.labels) {
        if (labels.map.names.empty()) nameless.push_back(&labels);
      }
      if (nameless.size() != 1)
        throw Error(ErrorKind::usage, table.string(),
                    nameless.empty() ? "belongs to no label map: all have names"
                                     : "may belong to " + std::to_string(nameless.size()) + " label maps",
                    "name it like its label map: seg.nii.gz and seg.json");
      use(*nameless.front(), table);
    }
    for (const ScanLabels& labels : out_.labels) {
      if (labels.map.names.empty())
        throw Error(ErrorKind::data, labels.path.string(), "does not say what its labels mean",
                    "give a table with it: .json, .tsv, .ctbl or .txt (docs/reference/case.md, Labels)");
    }
  }

  void use(ScanLabels& labels, const fs::path& table) {
    Names names = read_names(table);
    labels.map.names = std::move(names.names);
    labels.map.codes = std::move(names.codes);
    labels.names_from = table.filename().string();
  }

  const files::ReadOptions& options_;
  const io::ImageChoice& choice_;
  const Context& context_;
  Scan out_;
  std::vector<fs::path> tables_;
  std::set<fs::path> folders_;
  std::map<fs::path, std::vector<fs::path>> masks_;
};

}  // namespace

Scan read_scan(const std::vector<fs::path>& paths, const files::ReadOptions& options,
               const io::ImageChoice& choice, const Context& context) {
  return Reader(options, choice, context).read(paths);
}

}  // namespace ecorche::app
