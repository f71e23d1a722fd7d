// SPDX-License-Identifier: Apache-2.0
// What the ids of a label map mean, from the tables that other programs write.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace ecorche::io {

using LabelNames = std::map<std::int64_t, std::string>;  ///< id -> identifier; 0 is nothing and left out

/// A table of labels: `.ctbl` (3D Slicer: `id name r g b a`), `.tsv` (BIDS: a header with `index` and
/// `name`), or `.txt` and `.label`, told by content: ITK-SNAP's description (`id r g b a visible mesh
/// "name"`) or, as FreeSurfer writes it, the columns of a `.ctbl`. Names become identifiers by
/// `make_identifiers`. Throws Error{missing_input} or Error{data} with the line.
LabelNames read_label_table(const std::filesystem::path& path);

/// Names as people write them made into identifiers (`identifier_from`), each once: what is left empty is
/// `label_<id>`; of equal ones the later, by id, get `_<id>` behind them.
LabelNames make_identifiers(const std::map<std::int64_t, std::string>& names);

}  // namespace ecorche::io
