// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_specks.hpp"

#include <array>

#include "core/values/text.hpp"

namespace ecorche::app {
namespace {

using Role = ScanEntry::Role;

constexpr double kSpeckShare = 0.01;  // of a structure's voxels: smaller pieces are specks

std::string speck_place(const std::array<double, 3>& p) {
  return "[" + text::number(p[0], 4) + ", " + text::number(p[1], 4) + ", " + text::number(p[2], 4) + "]";
}

}  // namespace

scan::Pieces take_specks_off(ScanCase& out, const std::vector<std::uint8_t>& in_body,
                             const Context& context) {
  std::vector<std::uint8_t> wanted(out.entries.size() + 1, 0);
  for (std::size_t e = 0; e < out.entries.size(); ++e) wanted[e + 1] = out.entries[e].drawn ? 1 : 0;
  scan::Pieces found = scan::find_pieces(out.labels, wanted, context);
  std::vector<std::uint8_t> speck(found.pieces.size(), 0);
  struct Count {
    std::size_t pieces = 0, voxels = 0;
    std::array<double, 3> first{0, 0, 0};
  };
  std::vector<Count> specks(out.entries.size());
  for (std::size_t p = 0; p < speck.size(); ++p) {
    const scan::Piece& piece = found.pieces[p];
    const std::size_t e = piece.id - 1U;
    if (static_cast<double>(piece.voxels) >= kSpeckShare * static_cast<double>(out.entries[e].voxels))
      continue;
    speck[p] = 1;
    if (specks[e].pieces++ == 0) specks[e].first = piece.centre;
    specks[e].voxels += piece.voxels;
  }
  std::uint16_t body = 0;
  for (std::size_t e = 0; e < out.entries.size() && body == 0; ++e)
    body = out.entries[e].role == Role::body ? static_cast<std::uint16_t>(e + 1) : std::uint16_t{0};
  const auto voxels = out.labels.scalars<std::uint16_t>();
  for (const scan::Run& run : found.runs) {
    if (speck[run.piece] == 0) continue;
    const std::size_t begin = out.labels.grid.offset(run.begin, run.j, run.k);
    for (std::size_t v = begin; v < begin + static_cast<std::size_t>(run.end - run.begin); ++v)
      voxels[v] = in_body[v] != 0 ? body : std::uint16_t{0};
  }
  for (std::size_t e = 0; e < specks.size(); ++e) {
    if (specks[e].pieces == 0) continue;
    out.notes.push_back(out.entries[e].name + ": " + std::to_string(specks[e].pieces) +
                        (specks[e].pieces == 1 ? " speck" : " specks") + " of " +
                        std::to_string(specks[e].voxels) + " voxels in all taken off, the first at " +
                        speck_place(specks[e].first));
  }
  // Pieces that are gone must not count below.
  for (std::size_t p = 0; p < speck.size(); ++p) {
    if (speck[p] != 0) found.pieces[p].voxels = 0;
  }
  return found;
}

}  // namespace ecorche::app
