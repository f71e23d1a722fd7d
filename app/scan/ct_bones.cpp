// SPDX-License-Identifier: Apache-2.0
#include "app/scan/ct_bones.hpp"

#include <algorithm>
#include <cmath>

#include "app/scan/phantom_template.hpp"
#include "core/values/text.hpp"
#include "preprocess/scan/ct_body.hpp"
#include "preprocess/scan/cut_bones.hpp"
#include "preprocess/scan/part_vertebrae.hpp"
#include "preprocess/scan/pieces.hpp"
#include "preprocess/scan/place_template.hpp"

namespace ecorche::app {
namespace {

constexpr double kLeastBoneMl = 2, kSpeckMl = 0.03;
constexpr double kPatientShare = 0.02;  // of the largest piece of bone: what holds so much is the patient
constexpr double kMostMisfit = 0.46, kLeastAgreement = 0.6;  // else it is no part of a body
constexpr double kDoubtful = 0.6;                            // of one bone
constexpr double kAsGood = 1.06;                             // times the misfit
constexpr double kPointsMm = 8;
constexpr double kLeastScale = 0.78, kMostScale = 1.17;
constexpr double kMuch = 20;     // ml: an arm's bones, no table's screws
constexpr double kSurest = 0.9;  // a template is no eye
constexpr const char* kNeck = "cervical_spine";
constexpr double kPlainJoint = 0.8;  // contrast of a joint that leaves no doubt
constexpr const char* kSegmentFirst =
    "segment it first (TotalSegmentator, MOOSE, 3D Slicer), and give the label maps with it";

using Voxels = std::vector<std::uint8_t>;

class Bones {
 public:
  Bones(const ScanImage& ct, const ScanOptions& options, ScanCase& out, const Context& context)
      : ct_(ct),
        grid_(ct.image.grid),
        options_(options),
        out_(out),
        context_(context),
        ml_(grid_.spacing[0] * grid_.spacing[1] * grid_.spacing[2] * 1e-3),
        name_(ct.path.filename().string()) {}

  ScanLabels find() {
    const Voxels mask = bone();
    context_.report(0.3);
    const scan::BodyTemplate body = phantom_template();
    const scan::Placed placed = place(body, mask);
    context_.report(0.7);
    return named(body, placed, scan::cut_bones(mask, grid_, body, placed, context_.quiet()));
  }

 private:
  // Denser than bone_hu, within the patient, without specks.
  Voxels bone() {
    Image dense(grid_, ScalarType::u16);
    const auto voxels = dense.scalars<std::uint16_t>();
    with_scalar_type(ct_.image.type, [&](auto zero) {
      const auto hu = ct_.image.scalars<decltype(zero)>();
      std::transform(hu.begin(), hu.end(), voxels.begin(), [&](auto v) {
        return static_cast<std::uint16_t>(static_cast<double>(v) > options_.bone_hu ? 1 : 0);
      });
    });
    const scan::Pieces pieces = scan::find_pieces(dense, {0, 1}, context_.quiet());
    std::size_t most = 0;
    for (const scan::Piece& piece : pieces.pieces) most = std::max(most, piece.voxels);
    const auto keep = [&](double least) {
      Voxels out(grid_.voxels(), 0);
      for (const scan::Run& run : pieces.runs) {
        if (static_cast<double>(pieces.pieces[run.piece].voxels) < least) continue;
        const std::size_t at = grid_.offset(run.begin, run.j, run.k);
        std::fill_n(out.begin() + static_cast<std::ptrdiff_t>(at), run.end - run.begin, std::uint8_t{1});
      }
      return out;
    };
    const Voxels known = keep(kPatientShare * static_cast<double>(most));
    const scan::CtBody patient =
        scan::find_body(ct_.image, options_.skin_hu, options_.bridge_mm, known, context_.quiet());
    Voxels out = keep(kSpeckMl / ml_);
    std::size_t count = 0;
    for (std::size_t v = 0; v < out.size(); ++v) {
      out[v] = out[v] != 0 && patient.inside[v] != 0 ? 1 : 0;
      count += out[v];
    }
    if (ml_ * static_cast<double>(count) < kLeastBoneMl)
      throw Error(ErrorKind::data, ct_.path.string(),
                  "holds no bone: only " + text::number(ml_ * static_cast<double>(count)) +
                      " ml of the patient are denser than " + ct_.value(options_.bone_hu),
                  "lower --bone-hu; where it is no CT, give label maps with it");
    return out;
  }

  scan::Placed place(const scan::BodyTemplate& body, const Voxels& mask) {
    const Points points = scan::spread_points(mask, grid_, kPointsMm);
    const std::vector<scan::Placed> found =
        scan::place_template(body, points, grid_, options_.side, context_.quiet());
    const scan::Placed& best = found.front();
    const std::string what(scan::view_name(best.view));
    if (best.misfit > kMostMisfit) not_known(what, best.misfit);
    if (scan::one_limb(best.view) && options_.side == Side::both)
      throw Error(ErrorKind::usage, ct_.path.string(),
                  "its bones look like one limb alone (" + what + " fits best)",
                  "say which side it is with --side; where it is no limb, its spacing or axes are wrong");
    for (const scan::Placed& other : found) {
      const bool like = scan::one_limb(other.view) == scan::one_limb(best.view) && !scan::one_limb(best.view);
      if (&other == &best || like || other.misfit > kAsGood * best.misfit) continue;
      throw Error(ErrorKind::data, ct_.path.string(),
                  "its bones may be " + what + " or " + std::string(scan::view_name(other.view)) +
                      ": both fit as well",
                  std::string("a larger field of view would tell; else ") + kSegmentFirst);
    }
    return best;
  }

  [[noreturn]] void not_known(const std::string& what, double misfit) const {
    throw Error(
        ErrorKind::data, ct_.path.string(),
        "its bones look like no part of a body that is known (nearest: " + what + ", misfit " +
            text::number(misfit, 2) + ")",
        std::string("see that its spacing and axes are right, change --bone-hu, or ") + kSegmentFirst);
  }

  ScanLabels named(const scan::BodyTemplate& body, const scan::Placed& placed, scan::CutBones cut) {
    ScanLabels labels;
    labels.path = ct_.path;
    labels.names_from = "the CT itself";
    double sum = 0, all = 0;
    std::vector<std::string> seen;
    const std::vector<Vertebra> neck = vertebrae(body, placed, cut);
    for (std::size_t b = 0; b < cut.bones.size(); ++b) {
      const scan::FoundBone& bone = cut.bones[b];
      if (bone.voxels == 0) continue;
      const auto id = static_cast<std::int64_t>(b + 1);
      const std::string& name = body.bones[b].name;
      const double sure = kSurest * bone.agreement;
      sum += bone.agreement * static_cast<double>(bone.voxels);
      all += static_cast<double>(bone.voxels);
      const std::string how = "the CT alone: denser than " + ct_.value(options_.bone_hu) +
                              ", parted and named by a template, of whose bone " +
                              std::to_string(std::lround(100 * bone.agreement)) + " % agree";
      labels.map.names.emplace(id, name);
      labels.guesses.emplace(id, LabelGuess{how, sure});
      for (std::size_t v = 0; name == kNeck && v < neck.size(); ++v) {
        const auto own = static_cast<std::int64_t>(cut.bones.size() + v + 1);
        labels.map.names.emplace(own, neck[v].name);
        labels.guesses.emplace(own, LabelGuess{how + "; " + neck[v].how, std::min(sure, neck[v].sure)});
      }
      if (sure < kDoubtful)
        out_.doubts.push_back(name + ": hardly recognised (" + text::number(sure, 2) +
                              "): look at picture.png whether it is one, else take it off the case");
      const std::string& segment = body.segments[static_cast<std::size_t>(body.bones[b].segment)].name;
      if (std::find(seen.begin(), seen.end(), segment) == seen.end()) seen.push_back(segment);
    }
    const bool arms = std::any_of(seen.begin(), seen.end(), [](const std::string& s) {
      return s.starts_with("upper_arm") || s.starts_with("forearm") || s.starts_with("hand");
    });
    const std::string what(arms || scan::one_limb(placed.view) ? scan::view_name(placed.view)
                                                               : "a body without arms in view");
    if (placed.scale < kLeastScale || placed.scale > kMostScale)
      out_.doubts.push_back(name_ + ": is " + text::number(placed.scale, 2) +
                            " times as large as the template, which few are: see that its spacing is right");
    if (all == 0 || sum < kLeastAgreement * all) not_known(what, placed.misfit);
    out_.notes.push_back(name_ + " shows " + what + ", of which are in view: " + text::joined(seen) +
                         " (size " + text::number(placed.scale, 2) + " of the template's, misfit " +
                         text::number(placed.misfit, 2) + "; --bone-hu " + text::number(options_.bone_hu, 6) +
                         ", --skin-hu " + text::number(options_.skin_hu, 6) + ")");
    out_.parted = true;
    out_.doubts.push_back(
        name_ +
        ": its bones are parted by a template, not segmented: joints, above all of collar bones and jaw, "
        "may lie 2 to 3 cm off; look at them by ecorche rig");
    const double left_out = ml_ * static_cast<double>(cut.left_out);
    if (cut.left_out > 0)
      (left_out > kMuch ? out_.doubts : out_.notes)
          .push_back(name_ + ": " + text::number(left_out, 3) +
                     " ml of what is as dense as bone lie near no bone of the template, and are left out");
    Image image(grid_, ScalarType::u16);
    std::copy(cut.of.begin(), cut.of.end(), image.scalars<std::uint16_t>().begin());
    labels.map.layers.push_back(std::move(image));
    return labels;
  }

  struct Vertebra {
    std::string name, how;
    double sure = 0;
  };

  // Those of the neck that come apart, whose voxels are numbered on behind the template's bones; none where
  // it stays one.
  std::vector<Vertebra> vertebrae(const scan::BodyTemplate& body, const scan::Placed& placed,
                                  scan::CutBones& cut) {
    const auto bone = std::find_if(body.bones.begin(), body.bones.end(),
                                   [](const scan::TemplateBone& b) { return b.name == kNeck; });
    const auto row = static_cast<std::size_t>(bone - body.bones.begin());
    if (bone == body.bones.end() || cut.bones[row].voxels == 0) return {};
    Voxels neck(cut.of.size(), 0), other(cut.of.size(), 0);
    for (std::size_t v = 0; v < neck.size(); ++v) {
      neck[v] = cut.of[v] == row + 1 ? 1 : 0;
      other[v] = cut.of[v] != 0 && neck[v] == 0 ? 1 : 0;
    }
    const scan::PartedNeck found = scan::part_neck(
        ct_.image, neck, other, placed.segments[static_cast<std::size_t>(bone->segment)].rotation,
        options_.bone_hu, options_.skin_hu, context_.quiet());
    if (found.pieces.size() < 2) {
      out_.notes.push_back(name_ + ": the vertebrae of the neck stay one bone: " + found.why);
      return {};
    }
    std::vector<Vertebra> out;
    std::vector<std::string> apart;
    for (const scan::VertebraPiece& piece : found.pieces) {
      const bool one = piece.first == piece.last;
      const std::string percent = std::to_string(std::lround(100 * piece.contrast)) + " %";
      const std::string level = "C" + std::to_string(piece.first);
      Vertebra vertebra{kNeck, "", kSurest * std::min(1.0, piece.contrast / kPlainJoint)};
      if (one) {
        vertebra.name = "vertebra_c" + std::to_string(piece.first);
        vertebra.how = "its joints are " + percent + " darker than bone";
        apart.push_back(level + " (" + text::number(vertebra.sure, 2) + ")");
      } else {
        vertebra.how = level + " to C" + std::to_string(piece.last) + " did not come apart";
        out_.notes.push_back(name_ + ": " + vertebra.how +
                             ": between them nothing is darker than bone; they stay " + kNeck);
      }
      out.push_back(std::move(vertebra));
    }
    out_.notes.push_back(name_ + ": vertebrae of the neck that came apart: " + text::joined(apart));
    for (std::size_t v = 0; v < neck.size(); ++v) {
      if (found.of[v] != 0) cut.of[v] = static_cast<std::uint16_t>(cut.bones.size() + found.of[v]);
    }
    return out;
  }

  const ScanImage& ct_;
  const ImageGrid& grid_;
  const ScanOptions& options_;
  ScanCase& out_;
  const Context& context_;
  double ml_;  // of a voxel
  std::string name_;
};

}  // namespace

ScanLabels bones_of_ct(Scan& scan, const ScanOptions& options, ScanCase& out, const Context& context) {
  auto ct = std::find_if(scan.images.begin(), scan.images.end(), [](const ScanImage& i) { return i.ct; });
  if (ct == scan.images.end()) {
    if (scan.images.empty())
      throw Error(ErrorKind::data, scan.labels.front().path.string(), "no label of a bone is known",
                  "see the names that are known in docs/reference/structures.md, give the CT too, or write "
                  "the case by hand");
    ct = scan.images.begin();
    if (!options.own_values)
      throw Error(ErrorKind::data, ct->path.string(),
                  "comes without a label of a bone, and is no CT in HU: nothing in it is below -500",
                  "give label maps with it, or both --bone-hu and --skin-hu in its own values");
    ct->ct = ct->own_values = true;
  }
  return Bones(*ct, options, out, context).find();
}

}  // namespace ecorche::app
