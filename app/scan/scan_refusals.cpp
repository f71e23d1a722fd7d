// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_refusals.hpp"

#include <algorithm>
#include <cmath>

#include "app/scan/scan_doubts.hpp"
#include "core/values/text.hpp"

namespace ecorche::app {
namespace {

constexpr std::size_t kNamesTold = 3;

std::string whole_percent(double share) {
  return std::to_string(std::lround(100 * share)) + " %";
}

// Names of the scan's labels that nobody knows, the first few.
std::string unknown_names(const LabelNames& names) {
  std::vector<std::string> out;
  std::size_t more = 0;
  for (const Named& named : names.named) {
    if (named.structure != nullptr) continue;
    if (out.size() < kNamesTold) {
      out.push_back("'" + named.name + "'");
    } else {
      ++more;
    }
  }
  return text::joined(out) + (more > 0 ? " and " + std::to_string(more) + " more" : "");
}

}  // namespace

void refuse_without_skin(const Scan& scan, double exposed, const Bounds& bones,
                         const std::vector<SkinPlace>& tried) {
  const std::string where = scan.labels.front().path.string();
  std::string what = "nothing says where the skin is: " + whole_percent(exposed) +
                     " of the outside of all that is labelled is bone" + images_without_hu(scan.images);
  if (tried.empty())
    throw Error(ErrorKind::data, where, what,
                "give the CT too, or a label of the whole body (TotalSegmentator -ta body), before or after "
                "these files");
  what += ", and the bones lie " + bones.in_words() + ", but ";
  for (std::size_t i = 0; i < tried.size(); ++i)
    what += (i > 0 ? ", and " : "") + tried[i].what + " " + tried[i].bounds.in_words() + ", which holds " +
            whole_percent(tried[i].covers) + " of them";
  throw Error(ErrorKind::data, where, what,
              "see that all files are of one scan and that their headers are right, and leave out what is of "
              "another; where a CT's skin is less dense, lower --skin-hu");
}

void refuse_without_bones(const Scan& scan, const LabelNames& names,
                          const std::vector<std::size_t>& counted) {
  const std::string where = scan.labels.front().path.string();
  for (std::size_t e = 0; e < names.named.size(); ++e) {
    const Named& named = names.named[e];
    const bool without_side =
        named.structure != nullptr && named.structure->sided && named.side == Side::both;
    if (!without_side || counted[e] == 0) continue;
    throw Error(ErrorKind::data, where,
                named.name + " is known, but not its side, nor that of any other bone",
                "say it where one limb alone was scanned (--side left or --side right), or give labels that "
                "have sides with it");
  }
  const std::string unknown = unknown_names(names);
  const auto ct =
      std::find_if(scan.images.begin(), scan.images.end(), [](const ScanImage& i) { return i.ct; });
  throw Error(ErrorKind::data, where,
              "no label of a bone is known" + (unknown.empty() ? "" : ": " + unknown + " may be any"),
              "see the names that are known in docs/reference/structures.md, " +
                  (ct == scan.images.end() ? "give the CT alone"
                                           : "give " + ct->path.filename().string() + " without this file") +
                  ", whose bones are then found and named by a template, or write the case by hand");
}

}  // namespace ecorche::app
