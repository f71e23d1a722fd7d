// SPDX-License-Identifier: Apache-2.0
// The one exception of ecorche, and the status that edges return instead of it.
#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <string_view>

namespace ecorche {

/// What went wrong, at the grain of the process' exit codes (sysexits.h).
enum class ErrorKind : std::uint8_t {
  usage,          ///< 64: the command line cannot be understood
  data,           ///< 65: a file was read and its contents are wrong
  missing_input,  ///< 66: an input file is absent or unreadable
  internal,       ///< 70: a bug of ours, or an invariant that did not hold
  cannot_create,  ///< 73: an output file or folder cannot be made
  io,             ///< 74: reading or writing failed half way
  temporary,      ///< 75: try again (address in use, server not reachable)
  protocol,       ///< 76: the peer broke the protocol
  refused,        ///< 77: the peer, or a guard, refuses
  config,         ///< 78: a case, skeleton, pose or option file is wrong
  interrupted,    ///< 130: the user asked to stop
};

/// The process' exit code for `kind`.
int exit_code(ErrorKind kind) noexcept;

/// The only exception that ecorche throws. Printed as `error: WHERE: WHAT (HOW TO MEND)`.
class Error : public std::exception {
 public:
  /// Line breaks of the texts become blanks.
  Error(ErrorKind kind, std::string where, std::string what, std::string mend);

  /// Decides the exit code.
  ErrorKind kind() const noexcept { return kind_; }
  const std::string& where() const noexcept { return where_; }      ///< file:line:key, option or address
  const std::string& problem() const noexcept { return problem_; }  ///< what is wrong, with the value met
  const std::string& mend() const noexcept { return mend_; }        ///< what the reader can do about it
  /// `WHERE: WHAT (HOW TO MEND)`, on one line.
  const char* what() const noexcept override { return line_.c_str(); }

 private:
  ErrorKind kind_;
  std::string where_, problem_, mend_, line_;
};

/// Numbers of google.rpc.Code, which the wire uses.
enum class StatusCode : std::uint8_t {
  ok = 0,
  cancelled = 1,
  unknown = 2,
  invalid_argument = 3,
  deadline_exceeded = 4,
  not_found = 5,
  already_exists = 6,
  permission_denied = 7,
  resource_exhausted = 8,
  failed_precondition = 9,
  aborted = 10,
  out_of_range = 11,
  unimplemented = 12,
  internal = 13,
  unavailable = 14,
  data_loss = 15,
  unauthenticated = 16,
};

/// What runtime and wire edges return: nothing is thrown across a thread, a session or the C ABI.
struct Status {
  StatusCode code = StatusCode::ok;
  std::string message;
  /// Whether it worked.
  bool ok() const noexcept { return code == StatusCode::ok; }
};

/// The status that carries `error` over the wire.
Status to_status(const Error& error);

}  // namespace ecorche
