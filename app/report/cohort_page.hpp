// SPDX-License-Identifier: Apache-2.0
// The pages of a cohort: one about everybody, one about each.
#pragma once

#include <string>
#include <vector>

#include "app/report/cohort.hpp"

namespace ecorche::app::report {

/// HTML 5 with style, pictures and a script of its own inside; nothing is fetched, and without script
/// everything is there but search and sorting. Failures with their reasons, outliers with pictures,
/// distributions, and a table whose rows lead to `NAME/report.html`.
std::string group_page(const std::vector<Participant>& cohort, const std::vector<Figure>& figures);

/// The section about a participant's poses, for its own page.
std::string pose_section(const Participant& one);

/// The page of a participant that has no model: why.
std::string failed_page(const Participant& one);

}  // namespace ecorche::app::report
