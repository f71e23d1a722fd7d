// SPDX-License-Identifier: Apache-2.0
// The `labels:` entry of a case: its image, its layers, and what the ids mean.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include "core/files/read_options.hpp"
#include "io/case/yaml_reader.hpp"
#include "io/image/image_choice.hpp"

namespace ecorche::io {

/// Where the file that `file` names lies, for an entry that may say `root: data`. Where `folders`, it may be
/// a folder.
using Locate =
    std::function<std::filesystem::path(const yaml::Value& entry, const yaml::Value& file, bool folders)>;

/// The entry's label maps, each a map `{file, table, root, form, series, phase, except, resample}`: of a list
/// all, in its order; of a map with `maps` those; else the entry itself.
std::vector<yaml::Value> label_maps(const yaml::Value& entry);

/// Reads them and makes them one (merge_labels.hpp). `table` is a map of ids to names, a file that
/// `read_label_table` reads, or absent, and then the image's own; `file` may be a folder of masks. A map on
/// another grid than the first one's is refused, unless it says `resample: nearest`. Throws Error{config},
/// Error{missing_input} or Error{data}.
CaseLabels read_label_map(const yaml::Value& entry, const Locate& locate, const files::ReadOptions& options,
                          const Context& context);

/// What an entry with an image says under `form` (qform, sform), `series` and `phase`.
ImageChoice read_choice(const yaml::Value& entry);

}  // namespace ecorche::io
