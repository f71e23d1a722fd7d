// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/net/passes.hpp"

#include <openssl/crypto.h>
#include <openssl/sha.h>

#include <algorithm>
#include <utility>

namespace ecorche::server {
namespace {

constexpr const char* kRights[] = {"watch", "pose", "manage"};
static_assert(std::tuple_size_v<TokenDigest> == SHA256_DIGEST_LENGTH);

// -1 for what is no digit.
int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

const char* right_name(Right right) {
  return kRights[static_cast<std::size_t>(right)];
}

std::optional<Right> right_from_name(std::string_view name) {
  const auto* const found = std::find(std::begin(kRights), std::end(kRights), name);
  if (found == std::end(kRights)) return std::nullopt;
  return static_cast<Right>(found - std::begin(kRights));
}

TokenDigest digest_of(std::string_view token) {
  TokenDigest out;
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), out.data());
  return out;
}

std::optional<TokenDigest> digest_from_hex(std::string_view text) {
  TokenDigest out;
  if (text.size() != 2 * out.size()) return std::nullopt;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const int high = hex_digit(text[2 * i]), low = hex_digit(text[2 * i + 1]);
    if (high < 0 || low < 0) return std::nullopt;
    out[i] = static_cast<unsigned char>(high * 16 + low);
  }
  return out;
}

Passes::Passes(std::vector<Pass> passes) {
  replace(std::move(passes));
}

std::shared_ptr<const Pass> Passes::find(std::string_view token) const {
  return open() ? everybody_ : find(digest_of(token));
}

std::shared_ptr<const Pass> Passes::find(const TokenDigest& digest) const {
  if (open()) return everybody_;
  std::shared_ptr<const Pass> found;
  for (const Row& row : rows_)
    if (CRYPTO_memcmp(row.pass->digest.data(), digest.data(), digest.size()) == 0) found = row.pass;
  return found;
}

Seat Passes::take_seat(const Pass& pass) {
  for (const Row& row : rows_) {
    if (row.pass->digest != pass.digest) continue;
    const auto taken = static_cast<std::uint32_t>(row.seats.use_count() - 1);
    if (row.pass->connections != 0 && taken >= row.pass->connections) return nullptr;
    return row.seats;
  }
  return everybody_;
}

void Passes::replace(std::vector<Pass> passes) {
  std::vector<Row> rows;
  rows.reserve(passes.size());
  for (Pass& pass : passes) {
    const auto before = std::find_if(rows_.begin(), rows_.end(),
                                     [&](const Row& row) { return row.pass->digest == pass.digest; });
    std::shared_ptr<const char> seats =
        before == rows_.end() ? std::make_shared<const char>('\0') : std::move(before->seats);
    rows.push_back({std::make_shared<const Pass>(std::move(pass)), std::move(seats)});
  }
  rows_ = std::move(rows);
}

}  // namespace ecorche::server
