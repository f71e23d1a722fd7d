// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "io/case/yaml_reader.hpp"

namespace ecorche::io::yaml {

/// Parses one document. `file` names it in messages. Throws Error{config}.
Node parse_tree(const std::string& text, const std::string& file);

}  // namespace ecorche::io::yaml
