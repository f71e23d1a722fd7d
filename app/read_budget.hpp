// SPDX-License-Identifier: Apache-2.0
// What every subcommand that reads foreign files lets its user say about their size.
#pragma once

#include "app/cli.hpp"
#include "app/program.hpp"
#include "core/files/read_options.hpp"
#include "io/image/image_choice.hpp"

namespace ecorche::app {

/// `--read-budget`. `limits` must outlive the command line's parsing.
inline void add_read_budget(CLI::App& command, files::ReadLimits& limits) {
  constexpr double most = 1 << 24;
  command
      .add_option_function<double>(
          "--read-budget",
          [&limits](const double& mib) {
            limits = files::ReadLimits::of(static_cast<std::uint64_t>(mib * (1 << 20)));
          },
          "MiB of memory that reading one file may take, beyond 64 times its own size [256; 2048 for images]")
      ->check(CLI::Range(1.0, most));
}

/// `--series`, `--phase`. `choice` must outlive the command line's parsing.
inline std::vector<CLI::Option*> add_image_choice(CLI::App& command, io::ImageChoice& choice) {
  return {command.add_option("--series", choice.series,
                             "which series of a DICOM folder, by UID, the end of one, or description"),
          command
              .add_option("--phase", choice.phase,
                          "which volume of an image in time (4-D, or a DICOM series), from 1")
              ->check(CLI::Range(1, 10000))};
}

/// Readers tell on stderr what they had to change.
inline files::ReadOptions reading(const Program& program, const files::ReadLimits& limits) {
  return {limits, [&program](std::string_view line) { program.note("warning: " + std::string(line)); }};
}

}  // namespace ecorche::app
