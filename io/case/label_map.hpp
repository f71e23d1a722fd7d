// SPDX-License-Identifier: Apache-2.0
// The `labels:` entry of a case: its image, its layers, and what the ids mean.
#pragma once

#include <filesystem>
#include <functional>

#include <ecorche/values/case.hpp>
#include "core/files/read_options.hpp"
#include "io/case/yaml_reader.hpp"
#include "io/image/image_choice.hpp"

namespace ecorche::io {

/// Where the file that `file` names lies, for an entry that may say `root: data`.
using Locate = std::function<std::filesystem::path(const yaml::Value& entry, const yaml::Value& file)>;

/// Reads `{file, table}`: the table is a map of ids to names, a file that `read_label_table` reads, or
/// absent, and then the image's own (`.seg.nrrd`). Throws Error{config}, Error{missing_input} or Error{data}.
CaseLabels read_label_map(const yaml::Value& entry, const Locate& locate, const files::ReadOptions& options);

/// What an entry with an image says under `form` (qform, sform), `series` and `phase`.
ImageChoice read_choice(const yaml::Value& entry);

}  // namespace ecorche::io
