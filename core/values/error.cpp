// SPDX-License-Identifier: Apache-2.0
#include <ecorche/values/error.hpp>

#include "core/values/utf8.hpp"

namespace ecorche {

int exit_code(ErrorKind kind) noexcept {
  switch (kind) {
    case ErrorKind::usage:
      return 64;
    case ErrorKind::data:
      return 65;
    case ErrorKind::missing_input:
      return 66;
    case ErrorKind::internal:
      return 70;
    case ErrorKind::cannot_create:
      return 73;
    case ErrorKind::io:
      return 74;
    case ErrorKind::temporary:
      return 75;
    case ErrorKind::protocol:
      return 76;
    case ErrorKind::refused:
      return 77;
    case ErrorKind::config:
      return 78;
    case ErrorKind::interrupted:
      return 130;
  }
  return 70;
}

// Foreign messages (HDF5, YAML, the file system) may hold line breaks, and names of a damaged file any bytes;
// an error is one line, and text: it goes into JSON, and on the wire.
// NOLINTNEXTLINE(performance-unnecessary-value-param): whoever throws hands over what was made for it
Error::Error(ErrorKind kind, std::string where, std::string what, std::string mend)
    : kind_(kind),
      where_(text::one_line(where)),
      problem_(text::one_line(what)),
      mend_(text::one_line(mend)),
      line_(where_ + ": " + problem_ + " (" + mend_ + ")") {}

Status to_status(const Error& error) {
  switch (error.kind()) {
    case ErrorKind::usage:
    case ErrorKind::data:
    case ErrorKind::config:
      return {StatusCode::invalid_argument, error.what()};
    case ErrorKind::missing_input:
      return {StatusCode::not_found, error.what()};
    case ErrorKind::temporary:
      return {StatusCode::unavailable, error.what()};
    case ErrorKind::protocol:
      return {StatusCode::failed_precondition, error.what()};
    case ErrorKind::refused:
      return {StatusCode::permission_denied, error.what()};
    case ErrorKind::interrupted:
      return {StatusCode::cancelled, error.what()};
    case ErrorKind::internal:
    case ErrorKind::cannot_create:
    case ErrorKind::io:
      break;
  }
  return {StatusCode::internal, error.what()};
}

}  // namespace ecorche
