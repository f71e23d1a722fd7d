// SPDX-License-Identifier: Apache-2.0
// Acclaim motion files (CMU's own): a skeleton `.asf` and frames `.amc`.
#pragma once

#include "io/motion/clip_file.hpp"
#include "io/motion/text_stream.hpp"

namespace ecorche::io {

/// Opens both; joints are named after the bones, each where its bone begins, the root first. A bone's turn is
/// C M C^-1 with M its own degrees of freedom and C its `axis`, each a product of turns about fixed axes in
/// the order given (Acclaim, Lander 1998). The unit is the file's `length`: CMU's 0.45 means 1/0.45 inches.
/// Degrees of freedom other than turns are read and left out. Throws Error{missing_input} and Error{data}:
/// bones twice, unknown, without parent or in a circle, values missing or too many, a root that is turned at
/// rest.
std::unique_ptr<ClipFile> open_amc(const std::filesystem::path& amc, const std::filesystem::path& asf,
                                   const MotionSpace& space = {});
std::unique_ptr<ClipFile> open_amc(TextStream amc, TextStream asf, const std::string& name,
                                   const MotionSpace& space = {});

/// The skeleton that belongs to `amc`: its own name, its name up to the first '_' (CMU: 02_01.amc, 02.asf),
/// or the only `.asf` of the folder. Throws Error{missing_input} where there is none.
std::filesystem::path asf_of(const std::filesystem::path& amc);

}  // namespace ecorche::io
