// SPDX-License-Identifier: Apache-2.0
// Voxels that want a place of a lattice for their label, and who gets it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

namespace ecorche::tet {

/// One voxel's, on a tet or a node.
struct Claim {
  std::int64_t place;
  std::uint16_t label;
  auto operator<=>(const Claim&) const = default;
};

struct CountedClaims {
  std::vector<Claim> winners;  ///< ascending, one a place: the label with most claims on it
  std::map<std::uint16_t, std::int64_t> favourite;  ///< per label: the place with most of its claims
};

/// Ties go to the lower label and to the lower place. The order of the claims does not matter.
inline CountedClaims count_claims(const std::vector<std::vector<Claim>>& found) {
  std::vector<Claim> claims;
  for (const std::vector<Claim>& some : found) claims.insert(claims.end(), some.begin(), some.end());
  std::sort(claims.begin(), claims.end());
  CountedClaims out;
  std::map<std::uint16_t, std::ptrdiff_t> most_of_label;
  std::ptrdiff_t most_here = 0;
  for (auto first = claims.begin(); first != claims.end();) {
    const auto last = std::upper_bound(first, claims.end(), *first);
    const std::ptrdiff_t votes = last - first;
    if (out.winners.empty() || out.winners.back().place != first->place) {
      out.winners.push_back(*first);
      most_here = votes;
    } else if (votes > most_here) {
      out.winners.back() = *first;
      most_here = votes;
    }
    if (std::ptrdiff_t& most = most_of_label[first->label]; votes > most) {
      most = votes;
      out.favourite[first->label] = first->place;
    }
    first = last;
  }
  return out;
}

}  // namespace ecorche::tet
