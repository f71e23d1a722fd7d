// SPDX-License-Identifier: Apache-2.0
// `ecorche cohort`: the arguments of a BIDS App in front of the Snakemake workflow, and nothing else.
#include <tbb/info.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <sstream>

#include "app/cli.hpp"
#include "app/command.hpp"
#include "core/files/atomic_file.hpp"
#include "core/platform/other_program.hpp"
#include "core/platform/process.hpp"
#include "core/values/text.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

struct CohortSettings {
  fs::path bids, out, config;
  std::vector<std::string> levels, labels, words;
  std::string profile = "local";
  bool dry_run = false;
  int sample = 0;
  std::int64_t seed = 1;
};

// Beside the program where it was installed, or above it where it was built.
fs::path find_workflow() {
  std::error_code ignored;
  const fs::path self = fs::read_symlink(platform::own_program(), ignored);
  for (fs::path folder = self.parent_path(); folder.has_relative_path(); folder = folder.parent_path()) {
    for (const char* below : {"share/ecorche/workflow", "workflow"}) {
      if (fs::exists(folder / below / "Snakefile", ignored)) return folder / below;
    }
  }
  throw Error(ErrorKind::missing_input, "workflow",
              "the workflow of cohorts is neither beside nor above " + self.string(),
              "install ecorche with `cmake --install`, or run it from its source tree's build");
}

fs::path find_profile(const fs::path& workflow, const std::string& name) {
  std::error_code ignored;
  for (const fs::path& folder : {workflow / "profiles" / name, fs::path(name)}) {
    if (fs::exists(folder / "config.yaml", ignored)) return fs::absolute(folder);
  }
  throw Error(ErrorKind::missing_input, "--profile", "no profile '" + name + "'",
              "local, slurm, or a folder that holds a config.yaml of Snakemake's");
}

std::string joined_labels(const std::vector<std::string>& labels) {
  std::vector<std::string> names;
  for (const std::string& label : labels) {
    const std::string name = label.starts_with("sub-") ? label : "sub-" + label;
    if (name.size() < 5 ||
        !std::all_of(name.begin() + 4, name.end(), [](unsigned char c) { return std::isalnum(c) != 0; }))
      throw Error(ErrorKind::usage, "--participant-label", "'" + label + "' is no label",
                  "letters and digits, with or without sub-");
    names.push_back(name);
  }
  return text::joined(names, ",");
}

std::vector<std::string> words_of(const CohortSettings& settings, int threads) {
  const fs::path workflow = find_workflow(), profile = find_profile(workflow, settings.profile);
  std::vector<std::string> words{"--snakefile", workflow / "Snakefile", "--profile",
                                 profile,       "--directory",          fs::absolute(settings.out)};
  // A cluster has cores of its own; those here are for what runs here.
  if (settings.profile != "slurm") words.insert(words.end(), {"--cores", std::to_string(threads)});
  std::vector<std::string> files;
  std::error_code ignored;
  if (fs::exists(profile / "cohort.yaml", ignored)) files.push_back(profile / "cohort.yaml");
  if (!settings.config.empty()) {
    if (!fs::is_regular_file(settings.config, ignored))
      throw Error(ErrorKind::missing_input, settings.config.string(), "cannot be read",
                  "name a configuration file");
    files.push_back(fs::absolute(settings.config));
  }
  if (!files.empty()) words.emplace_back("--configfile");
  words.insert(words.end(), files.begin(), files.end());
  words.insert(words.end(),
               {"--config", "bids=" + fs::absolute(settings.bids).string(),
                "out=" + fs::absolute(settings.out).string(),
                "ecorche=" + fs::read_symlink(platform::own_program(), ignored).string(),
                "from=" + fs::current_path().string(), "levels=" + text::joined(settings.levels, ",")});
  if (!settings.labels.empty()) words.push_back("labels=" + joined_labels(settings.labels));
  if (settings.sample > 0)
    words.insert(words.end(),
                 {"sample=" + std::to_string(settings.sample), "seed=" + std::to_string(settings.seed)});
  if (settings.dry_run) words.emplace_back("--dry-run");
  for (const std::string& more : settings.words) {
    std::istringstream parts(more);
    for (std::string word; parts >> word;) words.push_back(word);
  }
  return words;
}

// What the group's page says; null where there is none.
nlohmann::json counts_of(const fs::path& out) {
  std::error_code ignored;
  if (!fs::exists(out / "group.json", ignored)) return {};
  const nlohmann::json group = nlohmann::json::parse(files::read_text(out / "group.json"), nullptr, false);
  return group.is_object() && group.contains("counts") ? group["counts"] : nlohmann::json();
}

int run(const Program& program, const CohortSettings& settings) {
  const auto snakemake = platform::find_program("snakemake");
  if (!snakemake) {
    throw Error(ErrorKind::missing_input, "cohort", "snakemake is not installed, which runs cohorts",
                "apt-get install --no-install-recommends snakemake");
  }
  const int threads = program.threads > 0 ? program.threads : tbb::info::default_concurrency();
  const std::vector<std::string> words = words_of(settings, threads);
  const int code = platform::run_program(*snakemake, words, program.stop);
  if (program.stop.stop_requested())
    throw Error(ErrorKind::interrupted, "cohort", "stopped", "run it again: what is done is kept");
  // The workflow itself has said what it refuses.
  nlohmann::json object{{"ok", code == 0}, {"out", settings.out.string()}, {"exit_code", code}};
  const bool group =
      code == 0 && !settings.dry_run &&
      std::find(settings.levels.begin(), settings.levels.end(), "group") != settings.levels.end();
  if (group) object["counts"] = counts_of(settings.out);
  std::string line = settings.out.string() + (settings.dry_run ? ": nothing was run" : ": done");
  if (group && object["counts"].is_object()) {
    line = (settings.out / "group.html").string() + ":";
    for (const auto& [state, count] : object["counts"].items()) line += " " + count.dump() + " " + state;
    if (object["counts"].value("failed", 0) + object["counts"].value("warn", 0) > 0) program.warn();
  }
  if (code == 0 || program.json) program.result(line, object);
  if (code == 1) {
    program.note(
        "error: cohort: not every step came to its end (see above; run it again: what is done is kept)");
    return exit_code(ErrorKind::temporary);
  }
  return code;
}

}  // namespace

void declare_cohort(CLI::App& app, Program& program, Run& chosen) {
  const auto settings = std::make_shared<CohortSettings>();
  CLI::App* command = app.add_subcommand(
      "cohort", "prepare and pose every participant of a BIDS tree, by Snakemake, and report on all");
  command->add_option("BIDS", settings->bids, "a BIDS tree, or a table participants.tsv")->required();
  command->add_option("OUT", settings->out, "the folder of results; what is there already is not made again")
      ->required();
  command
      ->add_option(
          "LEVEL", settings->levels,
          "participant: everybody's model, poses and page; group: the page of all who are done; or both")
      ->required()
      ->expected(1, 2)
      ->check(CLI::IsMember({"participant", "group"}));
  command->add_option("--participant-label,--participant_label", settings->labels,
                      "only these, with or without sub- (default: all)");
  command->add_option("--config", settings->config, "what differs from the usual: poses, options (YAML)");
  command
      ->add_option("--profile", settings->profile,
                   "where it runs: local, slurm, or a folder of a Snakemake profile")
      ->capture_default_str();
  CLI::Option* sample =
      command
          ->add_option(
              "--sample", settings->sample,
              "draw so many poses of each participant within the limits of its joints, for training: images, "
              "labels, displacements, joints, radiographs")
          ->check(CLI::Range(1, 99999));
  command->add_option("--seed", settings->seed, "of those poses")
      ->needs(sample)
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53))
      ->capture_default_str();
  command->add_flag("-n,--dry-run", settings->dry_run, "only say which steps would run, and why");
  command->add_option("--snakemake", settings->words, "further words for Snakemake, as \"--until check\"");
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
