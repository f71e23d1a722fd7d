// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_sides.hpp"

#include <algorithm>
#include <set>

#include "core/values/text.hpp"
#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"
#include "preprocess/scan/sides.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::app {
namespace {

constexpr std::size_t kPoints = 150;  // of a piece, to measure distances by

// Segments of the template that hang together, without their sides.
scan::Neighbours neighbours_of_template() {
  const io::PlacedSkeleton placed = io::parse_skeleton(
      io::yaml::Value::parse(io::skeleton_template("human").value(), "human.yaml"), io::Frame{});
  scan::Neighbours out;
  for (const Segment& segment : placed.skeleton.segments) {
    if (segment.parent < 0) continue;
    const auto& parent = placed.skeleton.segments[static_cast<std::size_t>(segment.parent)];
    out.push_back({scan::without_side(segment.name), scan::without_side(parent.name)});
  }
  return out;
}

std::string place_of(const std::array<double, 3>& p) {
  return "[" + text::number(p[0], 4) + ", " + text::number(p[1], 4) + ", " + text::number(p[2], 4) + "]";
}

class Splitter {
 public:
  Splitter(ScanCase& out, const std::vector<Named>& named, const scan::Pieces& pieces)
      : out_(out), named_(named), pieces_(pieces), id_of_(pieces.pieces.size()) {
    for (std::size_t p = 0; p < id_of_.size(); ++p) id_of_[p] = pieces.pieces[p].id;
  }

  void split(Side only) {
    std::vector<std::size_t> of;  // piece of each that is handed on
    std::vector<scan::SidedPiece> asked;
    auto points = scan::sample_points(pieces_, out_.labels.grid, kPoints);
    bool any = false;
    for (std::size_t p = 0; p < pieces_.pieces.size(); ++p) {
      const scan::Piece& piece = pieces_.pieces[p];
      const Named& named = named_[piece.id - 1U];
      const io::Structure* s = named.structure;
      if (piece.voxels == 0 || s == nullptr || s->becomes != io::Structure::Becomes::bone) continue;
      // The girdle's parent is the thorax, yet ribs have sides of their own: they are neighbours with a side.
      const bool limb = s->sided || named.side != Side::both;
      asked.push_back(
          {s->name, limb ? s->segment : "", named.side, piece.voxels, piece.centre, std::move(points[p])});
      of.push_back(p);
      any = any || (s->sided && named.side == Side::both);
    }
    if (!any) return;
    const std::vector<scan::SideFound> found = scan::find_sides(asked, neighbours_of_template(), only);
    for (std::size_t i = 0; i < of.size(); ++i) {
      const scan::Piece& piece = pieces_.pieces[of[i]];
      const Named& named = named_[piece.id - 1U];
      if (!named.structure->sided || named.side != Side::both) continue;
      give(of[i], piece, named, found[i]);
    }
    relabel();
  }

 private:
  void give(std::size_t p, const scan::Piece& piece, const Named& named, const scan::SideFound& found) {
    if (found.side == Side::both) {
      id_of_[p] = 0;
      out_.doubts.push_back(named.name + ": a piece of " + std::to_string(piece.voxels) + " voxels at " +
                            place_of(piece.centre) + " is left out: " + found.why);
      return;
    }
    const std::string side = found.side == Side::left ? "_left" : "_right";
    const std::string name = named.name + side;
    auto entry = std::find_if(out_.entries.begin(), out_.entries.end(),
                              [&](const ScanEntry& e) { return e.name == name; });
    if (entry == out_.entries.end()) {
      ScanEntry made = out_.entries[piece.id - 1U];
      made.name = name;
      made.segment = named.structure->segment + side;
      made.how += "; its side: " + found.why;
      made.confidence = std::min(made.confidence, found.confidence);
      made.drawn = true;
      out_.entries.push_back(std::move(made));
      entry = out_.entries.end() - 1;
    } else {
      entry->confidence = std::min(entry->confidence, found.confidence);
    }
    id_of_[p] = static_cast<std::uint16_t>(entry - out_.entries.begin() + 1);
  }

  void relabel() {
    const auto voxels = out_.labels.scalars<std::uint16_t>();
    for (const scan::Run& run : pieces_.runs) {
      if (pieces_.pieces[run.piece].voxels == 0 || id_of_[run.piece] == pieces_.pieces[run.piece].id)
        continue;
      const std::size_t begin = out_.labels.grid.offset(run.begin, run.j, run.k);
      std::fill_n(voxels.begin() + static_cast<std::ptrdiff_t>(begin), run.end - run.begin,
                  id_of_[run.piece]);
    }
  }

  ScanCase& out_;
  const std::vector<Named>& named_;
  const scan::Pieces& pieces_;
  std::vector<std::uint16_t> id_of_;  // of each piece
};

}  // namespace

void give_sides(ScanCase& out, const std::vector<Named>& named, const scan::Pieces& pieces, Side only) {
  Splitter(out, named, pieces).split(only);
}

std::string fate_in_words(const ScanCase& scan, std::size_t e, bool sides_given) {
  const ScanEntry& entry = scan.entries[e];
  if (entry.role == ScanEntry::Role::body) return "the body, for the skin";
  if (!sides_given)
    return entry.name + ", " +
           (entry.role == ScanEntry::Role::bone ? "bone of " + entry.segment
                                                : std::string(group_name(entry.group)));
  std::string out;
  for (const char* side : {"_left", "_right"}) {
    const auto found = std::find_if(scan.entries.begin(), scan.entries.end(), [&](const ScanEntry& o) {
      return o.name == entry.name + side && o.drawn && o.voxels > 0;
    });
    if (found != scan.entries.end()) out += (out.empty() ? "" : " and ") + found->name;
  }
  return out.empty() ? "left out: its side cannot be told" : out + ", bones";
}

}  // namespace ecorche::app
