// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_case.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "app/scan/ct_bones.hpp"
#include "app/scan/label_names.hpp"
#include "app/scan/nameless_labels.hpp"
#include "app/scan/scan_bodies.hpp"
#include "app/scan/scan_borders.hpp"
#include "app/scan/scan_doubts.hpp"
#include "app/scan/scan_refusals.hpp"
#include "app/scan/scan_sides.hpp"
#include "app/scan/scan_specks.hpp"
#include "core/values/text.hpp"
#include "io/image/same_grid.hpp"
#include "preprocess/scan/ct_body.hpp"
#include "preprocess/scan/pieces.hpp"

namespace ecorche::app {
namespace {

using io::Structure;
using Becomes = Structure::Becomes;
using Role = ScanEntry::Role;

constexpr std::size_t kMostEntries = 65534;
constexpr int kFewestLayers = 3;          // of voxels along each axis
constexpr std::size_t kLeastVoxels = 20;  // of anything that becomes a surface
constexpr double kCovered = 0.35;         // a structure that keeps less of itself is another one's
constexpr double kExposed = 0.05;         // share of bone on the outside of what is a body
constexpr double kBare = 0.1;             // share of bone that may lie outside of a body's label

std::string percent_of(double share) {
  return std::to_string(std::lround(100 * share)) + " %";
}

class Decider {
 public:
  Decider(Scan& scan, const ScanOptions& options, const Context& context)
      : scan_(scan), options_(options), context_(context) {}

  ScanCase decide() {
    out_.notes = scan_.notes;
    name_nameless(scan_, options_, out_, context_.quiet());
    names_ = name_labels(scan_);
    // Labels that nobody knows may be bones: they are refused below.
    if (std::none_of(names_.named.begin(), names_.named.end(), [](const Named& named) {
          return named.structure == nullptr || named.structure->becomes == Becomes::bone;
        })) {
      scan_.labels.push_back(bones_of_ct(scan_, options_, out_, context_.quiet()));
      names_ = name_labels(scan_);
    }
    on_one_grid();
    merge();
    context_.report(0.3);
    drop_covered();
    pieces_ = take_specks_off(out_, body_, context_.quiet());
    recount();
    give_sides(out_, names_.named, pieces_, options_.side);
    recount();
    context_.report(0.6);
    find_skin();
    context_.report(0.9);
    finish();
    return std::move(out_);
  }

 private:
  // That of the finest map.
  void on_one_grid() {
    const auto volume = [](const ScanLabels& l) {
      const ImageGrid& g = l.map.layers.front().grid;
      return g.spacing[0] * g.spacing[1] * g.spacing[2];
    };
    const auto finest =
        std::min_element(scan_.labels.begin(), scan_.labels.end(),
                         [&](const ScanLabels& a, const ScanLabels& b) { return volume(a) < volume(b); });
    grid_ = finest->map.layers.front().grid;
    if (const int least = *std::min_element(grid_.size.begin(), grid_.size.end()); least < kFewestLayers)
      throw Error(ErrorKind::data, finest->path.string(),
                  "has " + std::to_string(least) + (least == 1 ? " layer" : " layers") +
                      " of voxels along one axis: no body can be drawn round them",
                  "give the whole scan, not a slice of it");
    for (ScanLabels& labels : scan_.labels) {
      const ImageGrid own = labels.map.layers.front().grid;
      if (io::same_place(own, grid_)) continue;
      out_.doubts.push_back(labels.path.filename().string() + " has a grid of its own, " +
                            io::described(own) + ": it is resampled by nearest neighbour to that of " +
                            finest->path.filename().string());
      whole_[static_cast<std::size_t>(&labels - scan_.labels.data())] =
          bounds_above(labels.map.layers.front(), 0);
      for (Image& layer : labels.map.layers) layer = io::resampled_nearest(layer, grid_);
    }
  }

  void merge() {
    const std::size_t count = names_.named.size();
    if (count > kMostEntries)
      throw Error(ErrorKind::data, "labels", "there are more than 65534", "leave some out");
    out_.labels = Image(grid_, ScalarType::u16);
    const auto to = out_.labels.scalars<std::uint16_t>();
    std::vector<std::uint8_t> rank(to.size(), 255);
    body_.assign(to.size(), 0);
    original_.assign(count, 0);
    for (std::size_t m = 0; m < scan_.labels.size(); ++m) {
      for (const Image& layer : scan_.labels[m].map.layers) {
        context_.check_stop();
        with_scalar_type(layer.type, [&](auto zero) {
          merge_layer(layer.scalars<decltype(zero)>(), names_.of_map[m], to, rank);
        });
      }
      scan_.labels[m].map.layers.clear();  // its memory is not needed any more
    }
    for (const Named& named : names_.named) {
      ScanEntry entry;
      entry.name = named.name;
      entry.how = named.how;
      entry.confidence = named.confidence;
      entry.group = named.group;
      const Becomes becomes = named.structure != nullptr ? named.structure->becomes : Becomes::tissue;
      if (becomes == Becomes::bone) {
        entry.role = Role::bone;
        entry.segment = named.structure->segment;
        if (named.structure->sided && named.side != Side::both)
          entry.segment += named.side == Side::left ? "_left" : "_right";
      } else if (becomes == Becomes::body || becomes == Becomes::shell) {
        entry.role = Role::body;
        entry.drawn = false;
      }
      out_.entries.push_back(std::move(entry));
    }
    recount();
  }

  template <class T>
  void merge_layer(std::span<const T> from, const std::map<std::int64_t, std::size_t>& entries,
                   std::span<std::uint16_t> to, std::vector<std::uint8_t>& rank) {
    T last{};
    std::size_t entry = LabelNames::no_entry;
    std::uint8_t own = 255;
    bool body = false;
    for (std::size_t v = 0; v < from.size(); ++v) {
      if (from[v] == T{}) continue;
      if (from[v] != last) {
        last = from[v];
        const auto found = entries.find(static_cast<std::int64_t>(last));
        entry = found == entries.end() ? LabelNames::no_entry : found->second;
        if (entry == LabelNames::no_entry) continue;
        own = static_cast<std::uint8_t>(names_.named[entry].rank);
        body = own >= 8;
      }
      if (entry == LabelNames::no_entry) continue;
      ++original_[entry];
      if (body) body_[v] = 1;
      if (own >= rank[v]) continue;
      rank[v] = own;
      to[v] = static_cast<std::uint16_t>(entry + 1);
    }
  }

  void recount() {
    for (ScanEntry& entry : out_.entries) entry.voxels = 0;
    for (const std::uint16_t id : std::as_const(out_.labels).scalars<std::uint16_t>()) {
      if (id != 0) ++out_.entries[id - 1U].voxels;
    }
  }

  // Voxels of entries for which `gone` is not 0 become the body's, where there is one, else nothing.
  void erase(const std::vector<std::uint8_t>& gone) {
    std::uint16_t body = 0;
    for (std::size_t e = 0; e < out_.entries.size(); ++e) {
      if (out_.entries[e].role == Role::body && body == 0) body = static_cast<std::uint16_t>(e + 1);
    }
    std::size_t at = 0;
    for (std::uint16_t& id : out_.labels.scalars<std::uint16_t>()) {
      if (id != 0 && gone[id - 1U] != 0) id = body_[at] != 0 ? body : std::uint16_t{0};
      ++at;
    }
  }

  void drop_covered() {
    std::vector<std::uint8_t> gone(out_.entries.size(), 0);
    for (std::size_t e = 0; e < out_.entries.size(); ++e) {
      const ScanEntry& entry = out_.entries[e];
      if (entry.role == Role::body || original_[e] == 0 || names_.named[e].rank >= 5) continue;
      if (static_cast<double>(entry.voxels) >= kCovered * static_cast<double>(original_[e])) continue;
      gone[e] = 1;
      left_out_[e] = "finer labels cover it";
    }
    erase(gone);
    recount();
  }

  void find_skin() {
    const double bare = bare_share([&](std::size_t v) { return body_[v] != 0; });
    if (!has(Role::bone)) refuse_without_bones(scan_, names_, original_);
    bool body = false, shell = false;
    for (std::size_t e = 0; e < out_.entries.size(); ++e) {
      if (out_.entries[e].role != Role::body || original_[e] == 0) continue;
      (names_.named[e].structure->becomes == Becomes::shell ? shell : body) = true;
    }
    if (body && bare <= kBare) {
      out_.skin = {"round the label of the body", 1, {}};
      return;
    }
    const double exposed = exposed_bone(out_, context_.quiet());
    if (shell && exposed < kExposed) {
      out_.skin = {"round the label of the skin, a shell, with what it encloses", 0.8, {}};
      return;
    }
    // Labels of one map exclude each other, so that the body's has holes.
    if (body && has(Role::body) && names_.of_map.size() == 1 && ct() == nullptr && exposed < kExposed) {
      out_.skin = {"round the label of the body and all that is labelled within it", 0.9, {}};
      return;
    }
    if (body)
      out_.doubts.push_back("the body's label leaves " + percent_of(bare) +
                            " of the bones outside: it is not used for the skin");
    if (from_ct()) return;
    if (exposed < kExposed) {
      out_.skin = {"round all that is labelled", exposed < 0.01 ? 0.9 : 0.6, {}};
      return;
    }
    if (options_.skin_from_labels) {
      out_.skin = {
          "round all that is labelled, with gaps up to 10 mm closed, as --skin-from-labels asks", 0.3, {}, 5};
      return;
    }
    refuse_without_skin(scan_, exposed, bones(), tried(1 - bare));
  }

  Bounds bones() const {
    const auto labels = out_.labels.scalars<std::uint16_t>();
    return bounds_where(grid_, [&](std::size_t v) {
      return labels[v] != 0 && out_.entries[labels[v] - 1U].role == Role::bone;
    });
  }

  // What of all that was given might have been the skin.
  std::vector<SkinPlace> tried(double body_covers) const {
    std::vector<SkinPlace> out;
    for (std::size_t m = 0; m < names_.of_map.size(); ++m) {
      bool body = false;
      for (const auto& [id, e] : names_.of_map[m])
        body = body || (e != LabelNames::no_entry && out_.entries[e].role == Role::body);
      if (!body) continue;
      // A map that was resampled may lie outside of this grid.
      const Bounds own = whole_.contains(m)
                             ? whole_.at(m)
                             : bounds_where(grid_, [&](std::size_t v) { return body_[v] != 0; });
      out.push_back({"the body of " + scan_.labels[m].path.filename().string() + " lies", own, body_covers});
    }
    if (const ScanImage* const ct = this->ct())
      out.push_back({"what is denser than " + ct->value(options_.skin_hu) + " in " +
                         ct->path.filename().string() + " lies",
                     bounds_above(ct->image, options_.skin_hu), ct_covers_});
    return out;
  }

  bool has(Role role) const {
    return std::any_of(out_.entries.begin(), out_.entries.end(),
                       [role](const ScanEntry& e) { return e.role == role && e.voxels > 0; });
  }

  // The share of the bones' voxels for which `within` is false.
  template <class F>
  double bare_share(F&& within) const {
    const auto labels = out_.labels.scalars<std::uint16_t>();
    std::vector<std::uint8_t> is_bone(out_.entries.size() + 1, 0);
    for (std::size_t e = 0; e < out_.entries.size(); ++e) is_bone[e + 1] = out_.entries[e].role == Role::bone;
    std::size_t bone = 0, bare = 0;
    for (std::size_t v = 0; v < labels.size(); ++v) {
      if (labels[v] == 0 || is_bone[labels[v]] == 0) continue;
      ++bone;
      bare += within(v) ? 0 : 1;
    }
    return bone == 0 ? 0 : static_cast<double>(bare) / static_cast<double>(bone);
  }

  // Null where the scan has none.
  const ScanImage* ct() const {
    const auto found =
        std::find_if(scan_.images.begin(), scan_.images.end(), [](const ScanImage& i) { return i.ct; });
    return found == scan_.images.end() ? nullptr : &*found;
  }

  bool from_ct() {
    const ScanImage* const ct = this->ct();
    if (ct == nullptr) return false;
    std::vector<std::uint8_t> known(grid_.voxels(), 0);
    const auto labels = out_.labels.scalars<std::uint16_t>();
    for (std::size_t v = 0; v < known.size(); ++v) known[v] = labels[v] != 0 ? 1 : 0;
    const Image* image = &ct->image;
    Image placed;
    if (!io::same_place(ct->image.grid, grid_)) {
      placed = io::resampled_nearest(ct->image, grid_, ct->background);
      image = &placed;
    }
    const scan::CtBody body =
        scan::find_body(*image, options_.skin_hu, options_.bridge_mm, known, context_.quiet());
    const double bare = bare_share([&](std::size_t v) { return body.inside[v] != 0; });
    ct_covers_ = 1 - bare;
    if (bare > kBare) {
      out_.doubts.push_back("what is denser than " + text::number(options_.skin_hu) + " HU in " +
                            ct->path.filename().string() + " leaves " + percent_of(bare) +
                            " of the bones outside: it is not used for the skin");
      return false;
    }
    ScanEntry entry;
    entry.name = "body";
    entry.role = Role::body;
    entry.drawn = false;
    entry.how = "denser than " + ct->value(options_.skin_hu) + " in the CT";
    entry.confidence = 0.8;
    const auto taken = [&](const ScanEntry& e) { return e.name == entry.name; };
    for (int number = 2; std::any_of(out_.entries.begin(), out_.entries.end(), taken); ++number)
      entry.name = "body_" + std::to_string(number);
    out_.entries.push_back(entry);
    const auto id = static_cast<std::uint16_t>(out_.entries.size());
    for (std::size_t v = 0; v < labels.size(); ++v) {
      if (body.inside[v] == 0) continue;
      body_[v] = 1;
      if (labels[v] == 0) labels[v] = id;
    }
    std::string how =
        "round what is denser than " + ct->value(options_.skin_hu) + " in " + ct->path.filename().string();
    if (body.taken_off_ml >= 1)
      how += ", without " + text::number(body.taken_off_ml) +
             " ml that are no part of the patient (table, clothes)";
    out_.skin = {how, 0.8, {}};
    return true;
  }

  // What became of each label; what is too small goes; what the borders cut is told.
  void finish() {
    recount();
    std::vector<std::uint8_t> gone(out_.entries.size(), 0);
    for (std::size_t e = 0; e < out_.entries.size(); ++e) {
      const ScanEntry& entry = out_.entries[e];
      if (!entry.drawn || entry.voxels >= kLeastVoxels) continue;
      gone[e] = 1;
      if (left_out_.contains(e) || sides_given(e)) continue;
      left_out_[e] = "only " + std::to_string(entry.voxels) + " voxels of it are there";
      out_.notes.push_back(entry.name + ": only " + std::to_string(entry.voxels) +
                           " voxels of it are there: it is left out");
    }
    erase(gone);
    for (std::size_t e = 0; e < gone.size(); ++e)
      out_.entries[e].drawn = out_.entries[e].drawn && gone[e] == 0;
    recount();
    tell_borders(out_, context_.quiet());
    tell_missing(out_);
    tell_contradictions(out_, scan_.images);
    tell_bodies(out_, context_.quiet());
    out_.fates = std::move(names_.fates);
    for (std::size_t m = 0; m < names_.of_map.size(); ++m) {
      for (const auto& [id, e] : names_.of_map[m]) {
        if (e == LabelNames::no_entry) continue;
        LabelFate& fate = out_.fates[names_.fate_of[m].at(id)];
        const auto why = left_out_.find(e);
        fate.became =
            why != left_out_.end() ? "left out: " + why->second : fate_in_words(out_, e, sides_given(e));
      }
    }
    if (std::none_of(out_.entries.begin(), out_.entries.end(),
                     [](const ScanEntry& e) { return e.role == Role::bone && e.drawn; }))
      throw Error(ErrorKind::data, scan_.labels.front().path.string(), "no bone is left",
                  "see the notes above, and give --side where one limb alone was scanned");
  }

  // An entry without a side whose pieces went to those with one.
  bool sides_given(std::size_t e) const {
    return e < names_.named.size() && names_.named[e].structure != nullptr &&
           names_.named[e].structure->sided && names_.named[e].side == Side::both;
  }

  Scan& scan_;
  const ScanOptions& options_;
  const Context& context_;
  ScanCase out_;
  ImageGrid grid_;
  LabelNames names_;
  scan::Pieces pieces_;
  std::vector<std::uint8_t> body_;     // of each voxel: a label of the body covers it
  std::vector<std::size_t> original_;  // voxels of each entry before others were put over it
  std::map<std::size_t, std::string> left_out_;
  std::map<std::size_t, Bounds> whole_;  // of maps that were resampled, before
  double ct_covers_ = 0;                 // share of the bones
};

}  // namespace

ScanCase decide(Scan& scan, const ScanOptions& options, const Context& context) {
  return Decider(scan, options, context).decide();
}

}  // namespace ecorche::app
