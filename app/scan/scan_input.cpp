// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_input.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <exception>
#include <numeric>
#include <set>

#include "app/scan/label_values.hpp"
#include "core/files/look.hpp"
#include "core/values/text.hpp"
#include "io/case/structures.hpp"
#include "io/image/dicom.hpp"
#include "io/image/dicom_image.hpp"
#include "io/image/dicom_segmentation.hpp"
#include "io/image/image_file.hpp"
#include "io/image/label_json.hpp"
#include "io/image/label_table.hpp"
#include "io/image/mask_folder.hpp"
#include "io/image/nifti_names.hpp"
#include "io/image/non_finite.hpp"
#include "io/image/unsheared.hpp"
#include "io/image/whole_labels.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kAtOnce = 4;  // files that are read beside each other: each takes memory
constexpr double kAirHu = -500, kAirBackground = -1024;

std::string small_ending(const fs::path& path) {
  return text::lower(path.extension().string());
}

bool is_table_name(const fs::path& path) {
  static const std::set<std::string> endings{".json", ".tsv", ".ctbl", ".txt", ".label"};
  return endings.contains(small_ending(path));
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

// What one file holds, as far as that can be told without the others.
struct Looked {
  Image image;
  std::optional<std::set<std::int64_t>> values;  // where they may be labels
  std::map<std::int64_t, std::string> names;     // in its header
  std::optional<io::Mask> mask;                  // instead of the image, of a file of a folder
  std::vector<std::string> notes;
  bool in_time = false;  // of several volumes, of which one was taken
  std::exception_ptr error;
};

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
    read_files(files);
    if (choice_.phase != 0 && !in_time_)
      throw Error(ErrorKind::usage, "--phase", "no image here is in time", "leave it out");
    if (!choice_.series.empty() && !dicom_)
      throw Error(ErrorKind::usage, "--series", "nothing here is DICOM, which alone has series",
                  "leave it out");
    take_mask_groups();
    name_labels();
    if (out_.labels.empty() && out_.images.empty())
      throw Error(ErrorKind::data, paths.front().string(), "holds no image",
                  "give a CT and its segmentation: .nii.gz, .nrrd, .mha or DICOM, or a folder of masks");
    return std::move(out_);
  }

 private:
  struct MaskFolder {
    io::MaskLayers layers;
    std::size_t files = 0;
  };

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

  // Several beside each other; what becomes of them is decided in their order. Bytes tell how long it takes.
  void read_files(const std::vector<fs::path>& files) {
    std::vector<double> bytes;
    bytes.reserve(files.size());
    for (const fs::path& path : files) bytes.push_back(bytes_of(path));
    const double all = std::accumulate(bytes.begin(), bytes.end(), 0.0);
    double done = 0;
    const auto most = static_cast<std::size_t>(std::max(1, tbb::this_task_arena::max_concurrency()));
    const std::size_t at_once = std::min(kAtOnce, most);
    for (std::size_t begin = 0; begin < files.size(); begin += at_once) {
      context_.check_stop();
      std::vector<Looked> some(std::min(at_once, files.size() - begin));
      tbb::parallel_for(std::size_t{0}, some.size(), [&](std::size_t i) {
        try {
          some[i] = look(files[begin + i]);
        } catch (...) {
          some[i].error = std::current_exception();
        }
      });
      for (std::size_t i = 0; i < some.size(); ++i) {
        say(files[begin + i], some[i]);
        if (some[i].error) std::rethrow_exception(some[i].error);
        dicom_ = dicom_ || io::is_dicom(files[begin + i]);
        in_time_ = in_time_ || some[i].in_time || dicom_;
        take(files[begin + i], std::move(some[i]));
        context_.report((done += bytes[begin + i]) / all);
      }
    }
  }

  // What all masks of a folder have alike is said once, of the folder.
  void say(const fs::path& path, const Looked& looked) {
    for (const std::string& note : looked.notes) {
      const std::string own = path.string() + ":";
      if (!looked.mask || !note.starts_with(own)) {
        options_.say(note);
        continue;
      }
      const std::string line = path.parent_path().string() + ":" + note.substr(own.size());
      if (said_.insert(line).second) options_.say(line);
    }
  }

  static double bytes_of(const fs::path& path) {
    std::error_code error;
    double out = 1;
    if (!fs::is_directory(path, error)) {
      const auto size = fs::file_size(path, error);
      return error ? out : out + static_cast<double>(size);
    }
    for (fs::directory_iterator at(path, error); !error && at != fs::directory_iterator();
         at.increment(error))
      if (at->is_regular_file(error)) out += static_cast<double>(at->file_size(error));
    return out;
  }

  static bool is_slicer(const fs::path& path) {
    return text::lower(path.filename().string()).ends_with(".seg.nrrd");
  }

  Looked look(const fs::path& path) const {
    Looked out;
    if (io::is_dicom(path) || is_slicer(path)) return out;
    const files::ReadOptions options{options_.limits,
                                     [&out](std::string_view line) { out.notes.emplace_back(line); }};
    out.image = io::read_stored_image(path, options, choice_.phase, out.in_time);
    check_components(path, out.image);
    out.values = label_values(out.image);
    out.names = io::read_nifti_names(path);
    if (!out.values && out.names.empty()) {
      if (std::optional<Image> mask = io::as_binary(out.image))
        out.image = std::move(*mask), out.values = {1};
    }
    const bool alone = (!out.values || out.values->size() <= 1) && out.names.empty() &&
                       folders_.contains(path.parent_path()) && !table_for(path);
    if (alone && !out.values) check_is_picture(path, out.image);
    if (alone && out.values) {
      io::make_unsheared(out.image, io::VoxelKind::labels, path, options);
      out.mask = io::as_mask(out.image);
      out.image = {};
    }
    return out;
  }

  void take(const fs::path& path, Looked looked) {
    if (io::is_dicom(path)) {
      std::optional<io::Segmentation> map = io::read_dicom_segmentation(path, options_, {});
      // A study's folder may hold both: the series, and what was segmented in it.
      if (!map || io::holds_slices(path, options_)) add_grey(path, io::read_image(path, options_, choice_));
      if (map) out_.labels.push_back({path, std::move(*map), "its segments"});
      return;
    }
    if (is_slicer(path)) {
      io::Segmentation map = io::read_segmentation(path, options_);
      const bool named = !map.names.empty();
      out_.labels.push_back({path, std::move(map), named ? "its own segments" : ""});
      return;
    }
    if (looked.mask) {
      MaskFolder& folder = masks_[path.parent_path()];
      folder.layers.add(*looked.mask, path);
      ++folder.files;
      return;
    }
    const auto& values = looked.values;
    // A file that names labels means them: values that are none are refused below.
    const bool labels =
        !looked.names.empty() || (values && (table_for(path) || !looks_grey(looked.image, values->size())));
    if (!labels) {
      io::replace_non_finite(looked.image, path, options_);
      io::make_unsheared(looked.image, io::VoxelKind::grey, path, options_);
      add_grey(path, std::move(looked.image));
      return;
    }
    if (values && values->empty()) {
      out_.notes.push_back(path.string() + ": holds no label: it is left out");
      return;
    }
    Image whole = io::whole_labels(std::move(looked.image), path);
    io::make_unsheared(whole, io::VoxelKind::labels, path, options_);
    io::Segmentation map = io::segmentation_of(std::move(whole), path);
    const bool named = !map.names.empty();
    if (!named && values && values->size() == 1) {  // a mask by itself is named by its file
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
                        : "save one number a voxel, or take one by --phase where they follow in time");
  }

  // Among masks, with a name as they have: then it is one of them, and must not be lost as a picture.
  static void check_is_picture(const fs::path& path, const Image& image) {
    if (io::recognise(io::image_stem(path)).structure == nullptr) return;
    const std::size_t shares = io::count_shares(image);
    if (shares == 0) return;
    throw Error(ErrorKind::data, path.string(),
                "is named as a mask, but " + std::to_string(shares) + " of its " +
                    std::to_string(image.grid.voxels()) + " values are NaN, or between 0 and 1",
                "save 0 and 1 (of probabilities, 1 from 0.5 on); an image is given by its own name, not by "
                "its folder's");
  }

  void add_grey(const fs::path& path, Image image) {
    check_components(path, image);
    out_.images.push_back(grey(path, std::move(image)));
  }

  void take_mask_groups() {
    for (auto& [folder, masks] : masks_) {
      io::Segmentation map = masks.layers.take(folder);
      if (const std::size_t empty = masks.layers.empty(); empty > 0)
        out_.notes.push_back(folder.string() + ": " + std::to_string(empty) + " of " +
                             std::to_string(masks.files) + " masks are empty: those structures are absent");
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
      if (files::is_folder(labels.path)) continue;
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
  std::set<std::string> said_;  // of folders
  std::map<fs::path, MaskFolder> masks_;
  bool in_time_ = false, dicom_ = false;  // whether a phase, a series may be chosen of any of the files
};

}  // namespace

std::string ScanImage::value(double v) const {
  return text::number(v, 6) + (own_values ? " (its own values, no HU)" : " HU");
}

Scan read_scan(const std::vector<fs::path>& paths, const files::ReadOptions& options,
               const io::ImageChoice& choice, const Context& context) {
  return Reader(options, choice, context).read(paths);
}

}  // namespace ecorche::app
