// SPDX-License-Identifier: Apache-2.0
// XXH64, seed 0, over bytes that come piece by piece.
#pragma once

#include <xxhash.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

namespace ecorche::model_file {

class Digest {
 public:
  Digest() : state_(XXH64_createState(), XXH64_freeState) { XXH64_reset(state_.get(), 0); }

  Digest& bytes(std::span<const std::byte> bytes) {
    if (!bytes.empty()) XXH64_update(state_.get(), bytes.data(), bytes.size());
    return *this;
  }
  /// Little-endian, in the width of T.
  template <class T>
  Digest& number(T value) {
    return bytes(std::as_bytes(std::span(&value, 1)));
  }
  /// Its length as u64, then its bytes.
  Digest& text(std::string_view text) {
    return number(std::uint64_t{text.size()}).bytes(std::as_bytes(std::span(text)));
  }
  std::uint64_t value() const { return XXH64_digest(state_.get()); }

 private:
  std::unique_ptr<XXH64_state_t, XXH_errorcode (*)(XXH64_state_t*)> state_;
};

/// What guards the contents page: of its paths, then of its digests, both as they stand in the file.
inline std::uint64_t contents_digest(std::span<const std::byte> paths, std::span<const std::byte> digests) {
  return Digest().bytes(paths).bytes(digests).value();
}

}  // namespace ecorche::model_file
