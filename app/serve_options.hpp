// SPDX-License-Identifier: Apache-2.0
// What `ecorche serve` may be told: declared here once, for the command line and the configuration file.
#pragma once

#include <string>
#include <vector>

#include "app/cli_fwd.hpp"
#include "runtime/server/resources/options.hpp"

namespace ecorche::app {

struct ServeSettings {
  std::vector<std::string> models;
  std::string config;
  bool check_config = false;
  std::string listen = "127.0.0.1:7070";
  std::string http;  // empty: of this machine alone, by the first port from 7071 on that is free
  bool no_http = false;
  std::string viewer_folder;
  std::string port_file;
  std::string token_file, tokens;
  std::string clips;
  std::string log = "info", log_format = "text";
  bool real_time = false, probes_first = false;
  bool merge_pages = false;
  std::string shared_models;
  server::Options options;
};

/// `settings` outlives the command.
void declare_serve_options(CLI::App& command, ServeSettings& settings);

}  // namespace ecorche::app
