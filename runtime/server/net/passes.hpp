// SPDX-License-Identifier: Apache-2.0
// Who may come in, and what each may do: tokens by their digests.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ecorche::server {

/// What a client may do; each also what those before it may.
enum class Right : std::uint8_t {
  watch,  ///< look: open, subscribe, measure, draw
  pose,   ///< control sessions: pose, play clips, hang spheres
  manage  ///< what outlives sessions: read models again, record
};

const char* right_name(Right right);
/// Nothing for another word.
std::optional<Right> right_from_name(std::string_view name);

/// SHA-256.
using TokenDigest = std::array<unsigned char, 32>;

TokenDigest digest_of(std::string_view token);
/// Of 64 hexadecimal digits of either case; nothing for other text.
std::optional<TokenDigest> digest_from_hex(std::string_view text);

/// A token's rights and limits. The token itself is known to who shows it alone: its digest cannot be turned
/// back, as a token is random and long (unlike a password, it needs no salt and no slow hash).
struct Pass {
  std::string name;  ///< in the log
  TokenDigest digest{};
  Right right = Right::manage;
  std::uint32_t connections = 0;                   ///< at once; 0: as many as all may be
  std::optional<double> messages_per_second = {};  ///< of each connection, in place of the server's
};

/// One of the places that a pass has; given back with the last copy.
using Seat = std::shared_ptr<const void>;

/// The passes of a server; without any, whoever comes may do all. On the I/O thread.
class Passes {
 public:
  explicit Passes(std::vector<Pass> passes);

  /// Nobody is asked for a token.
  bool open() const { return rows_.empty(); }
  /// The pass of the token, everybody's where the server is open; null for another token. Compares the digest
  /// with each row's, all of them, in a time that depends on their number alone.
  std::shared_ptr<const Pass> find(std::string_view token) const;
  /// The pass that takes the place of this one of an earlier list; null: its token is no longer good.
  std::shared_ptr<const Pass> again(const Pass& pass) const { return find(pass.digest); }
  /// Null where all are taken.
  Seat take_seat(const Pass& pass);
  /// Others from now on. Seats stay with their tokens.
  void replace(std::vector<Pass> passes);

 private:
  struct Row {
    std::shared_ptr<const Pass> pass;
    std::shared_ptr<const char> seats;  ///< a copy of it is a seat
  };
  std::shared_ptr<const Pass> find(const TokenDigest& digest) const;

  std::vector<Row> rows_;
  std::shared_ptr<const Pass> everybody_ = std::make_shared<const Pass>();
};

}  // namespace ecorche::server
