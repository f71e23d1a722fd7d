// SPDX-License-Identifier: Apache-2.0
// What a case says of limbs that touch.
#pragma once

#include <ecorche/values/case.hpp>
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

/// `contacts`: cut, joined, or {joined: [[hand_left, pelvis], ..]}: pairs of the skeleton's segments. Throws
/// Error{config}.
CaseContacts read_contacts(const yaml::Value& value, const Skeleton& skeleton);

}  // namespace ecorche::io
