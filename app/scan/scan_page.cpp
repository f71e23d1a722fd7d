// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_page.hpp"

#include <algorithm>
#include <map>

#include "app/report/html.hpp"
#include "app/scan/scan_picture.hpp"
#include "core/values/text.hpp"

namespace ecorche::app {
namespace {

using report::escaped;
using Role = ScanEntry::Role;

constexpr int kPixels = 640;

constexpr const char* kStyle = R"(
:root{color-scheme:light dark;--ink:#1d1f23;--soft:#63676e;--line:#dcdcd6;--page:#fbfbf9;--bad:#b3261e;--fair:#8a6100;--good:#2e7d4a}
@media(prefers-color-scheme:dark){:root{--ink:#e8e8e4;--soft:#a0a4aa;--line:#3a3d42;--page:#17181b;--bad:#ff8a80;--fair:#e6c07a;--good:#7fce9a}}
*{box-sizing:border-box}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--page);max-width:64rem;margin:2rem auto;padding:0 1.2rem}
h1{font-size:1.9rem;margin:0;overflow-wrap:anywhere}h2{font-size:1.2rem;margin:2.4rem 0 .6rem;border-bottom:1px solid var(--line)}
.row{display:flex;flex-wrap:wrap;gap:1.2rem;align-items:flex-start}figure{margin:0;min-width:0}
img{max-width:100%;height:auto;max-height:42rem;border-radius:4px;display:block}
figcaption,.soft{color:var(--soft);font-size:.87rem}li{margin:.35rem 0;overflow-wrap:anywhere}
table{border-collapse:collapse;width:100%}th{text-align:left;font-weight:600;color:var(--soft)}
td,th{padding:.2rem .8rem .2rem 0;vertical-align:top;border-bottom:1px solid var(--line)}td:last-child,td:nth-last-child(2){overflow-wrap:anywhere}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.bad{color:var(--bad);font-weight:600}.fair{color:var(--fair)}.good{color:var(--good)}
.key span{display:inline-block;margin:0 .9rem .2rem 0;white-space:nowrap}.key i{display:inline-block;width:.85em;height:.85em;border-radius:2px;margin-right:.35em;vertical-align:-.08em}
@media(max-width:40rem){body{margin:1rem auto;padding:0 .8rem}table,tbody,tr,td{display:block}th{display:none}
td{border:0;padding:0}td.n{text-align:left}tr{border-bottom:1px solid var(--line);padding:.45rem 0}
td[data-of]::before{content:attr(data-of) ': ';color:var(--soft)}td:first-child{font-weight:600}tr:first-child{border:0;padding:0}td{overflow-wrap:anywhere}}
)";

std::string picture(const report::Picture& drawn, const std::string& caption) {
  return report::text("<figure><img width='%d' height='%d' alt='%s' src='", drawn.width, drawn.height,
                      escaped(caption).c_str()) +
         report::data_uri(drawn) + "'><figcaption>" + escaped(caption) + "</figcaption></figure>\n";
}

std::string pictures(const ScanCase& scan) {
  const std::vector<report::Colour> colours = entry_colours(scan);
  std::string out = "<div class=row>" +
                    picture(picture_of(scan, true, kPixels, colours),
                            "From the front: the patient's left is on the right.") +
                    picture(picture_of(scan, false, kPixels, colours),
                            "From the patient's left: the back is on the right.") +
                    "</div>\n<p class=key>";
  std::map<std::string, report::Colour> segments;
  for (std::size_t e = 0; e < scan.entries.size(); ++e) {
    if (scan.entries[e].role == Role::bone && scan.entries[e].drawn && scan.entries[e].voxels > 0)
      segments.emplace(scan.entries[e].segment, colours[e]);
  }
  for (const auto& [segment, colour] : segments)
    out += "<span><i style='background:" + report::css(colour) + "'></i>" + escaped(segment) + "</span>";
  return out + "</p>\n<p class=soft>Bones have the colour of the segment that moves them.</p>\n";
}

std::string list(const char* title, const std::vector<std::string>& lines, const char* none) {
  std::string out = std::string("<h2>") + title + "</h2>\n";
  if (lines.empty()) return out + "<p>" + none + "</p>\n";
  out += "<ul>\n";
  for (const std::string& line : lines) out += "<li>" + escaped(line) + "\n";
  return out + "</ul>\n";
}

std::string sure(double confidence) {
  const char* colour = confidence >= 0.8 ? "good" : confidence >= 0.5 ? "fair" : "bad";
  return report::text("<td class='n %s' data-of=confidence>%.2f", colour, confidence);
}

std::string entries(const ScanCase& scan, Role role, const char* title) {
  const double voxel_ml =
      scan.labels.grid.spacing[0] * scan.labels.grid.spacing[1] * scan.labels.grid.spacing[2] * 1e-3;
  std::string rows;
  for (const ScanEntry& entry : scan.entries) {
    if (entry.role != role || !entry.drawn || entry.voxels == 0) continue;
    const bool bone = role == Role::bone;
    rows += "<tr><td>" + escaped(entry.name) + "<td data-of='" + (bone ? "segment" : "group") + "'>" +
            escaped(bone ? entry.segment : std::string(group_name(entry.group))) +
            report::text("<td class=n data-of=ml>%s",
                         text::number(voxel_ml * static_cast<double>(entry.voxels), 3).c_str()) +
            sure(entry.confidence) + "<td data-of=why>" + escaped(entry.how);
    if (!entry.cut.empty())
      rows += "; <b>cut by the " + escaped(text::joined(entry.cut, " and ")) + " border</b>";
    rows += "</tr>\n";
  }
  if (rows.empty()) return {};
  return std::string("<h2>") + title + "</h2>\n<table><tr><th>name<th>" +
         (role == Role::bone ? "segment" : "group") + "<th class=n>ml<th class=n>confidence<th>why</tr>\n" +
         rows + "</table>\n";
}

std::string fates(const ScanCase& scan) {
  std::string out =
      "<h2>Every label</h2>\n<table><tr><th>label<th>file<th class=n>voxels<th "
      "class=n>confidence<th>became<th>why</tr>\n";
  for (const LabelFate& fate : scan.fates) {
    out += "<tr><td>" + escaped(fate.name) + "<td data-of=file>" + escaped(fate.from) +
           report::text("<td class=n data-of=voxels>%zu", fate.voxels) + sure(fate.confidence) +
           "<td data-of=became>" + escaped(fate.became) + "<td data-of=why>" + escaped(fate.how) + "</tr>\n";
  }
  return out + "</table>\n";
}

std::string skin(const ScanCase& scan) {
  std::string out = "<h2>Skin</h2>\n<p>Drawn " + escaped(scan.skin.how) +
                    report::text(" (confidence %.2f).</p>\n", scan.skin.confidence);
  if (scan.skin.caps.empty()) return out;
  out +=
      "<p>The image ends within the body. There the skin is cut flat, and these caps are no "
      "skin:</p>\n<ul>\n";
  for (const std::string& cap : scan.skin.caps) out += "<li>" + escaped(cap) + "\n";
  return out + "</ul>\n";
}

}  // namespace

std::string scan_page(const ScanCase& scan, const std::string& name) {
  const auto bones = std::count_if(scan.entries.begin(), scan.entries.end(), [](const ScanEntry& e) {
    return e.role == Role::bone && e.drawn && e.voxels > 0;
  });
  return "<!doctype html>\n<html lang=en><meta charset=utf-8><meta name=viewport "
         "content='width=device-width'>\n<title>" +
         escaped(name) + ": from scan to case</title>\n<style>" + kStyle + "</style>\n<body>\n<h1>" +
         escaped(name) + "</h1>\n" +
         report::text(
             "<p>%zu labels were read; %td bones came of them. For training and education, not for planning "
             "surgery.</p>\n",
             scan.fates.size(), bones) +
         pictures(scan) + list("To be looked at", scan.doubts, "Nothing.") + skin(scan) +
         entries(scan, Role::bone, "Bones") + entries(scan, Role::tissue, "Tissues") +
         list("Also", scan.notes, "Nothing more.") + fates(scan) + "</body></html>\n";
}

}  // namespace ecorche::app
