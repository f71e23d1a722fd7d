// SPDX-License-Identifier: Apache-2.0
// Names of labels in a NIfTI's header extension, where TotalSegmentator writes them for its multilabel files:
// a Caret XML with `<Label Key="69" ...><![CDATA[humerus_left]]></Label>`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include <ecorche/values/image.hpp>

namespace ecorche::io {

/// What the file's extensions name, as they spell it; nothing where the file is no NIfTI, has no extension,
/// or none that names labels. Label 0 is left out. Extensions are a foreign program's: damaged ones are as
/// none. Throws Error{missing_input} where the file cannot be opened, Error{data} where it cannot be
/// inflated.
std::map<std::int64_t, std::string> read_nifti_names(const std::filesystem::path& path);

/// Writes a `.nii.gz` whose header extension names its labels, as TotalSegmentator does; atomically. Throws
/// Error{usage} for another ending, Error{cannot_create}, Error{io}.
void write_named_nifti(const std::filesystem::path& path, const Image& labels,
                       const std::map<std::int64_t, std::string>& names);

}  // namespace ecorche::io
