// SPDX-License-Identifier: Apache-2.0
#include "app/report/page.hpp"

#include <algorithm>
#include <cmath>

#include <ecorche/values/joint_rule.hpp>
#include "app/report/html.hpp"
#include "app/report/places.hpp"
#include "app/report/quality.hpp"
#include "app/report/slice.hpp"
#include "core/values/text.hpp"
#include "preprocess/bounds.hpp"

namespace ecorche::app::report {
namespace {

constexpr Colour kGround{250, 250, 248};
constexpr int kBodyPixels = 640, kAxialPixels = 300;

constexpr const char* kStyle = R"(
:root{color-scheme:light dark;--ink:#1d1f23;--soft:#63676e;--line:#dcdcd6;--page:#fbfbf9;--bar:#3f7fb5;--bad:#b3261e;--good:#2e7d4a}
@media(prefers-color-scheme:dark){:root{--ink:#e8e8e4;--soft:#a0a4aa;--line:#3a3d42;--page:#17181b;--bar:#6fa9d8;--bad:#ff8a80;--good:#7fce9a}}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--page);max-width:62rem;margin:2rem auto;padding:0 1.2rem}
h1{font-size:1.9rem;margin:0}h2{font-size:1.2rem;margin:2.4rem 0 .6rem;border-bottom:1px solid var(--line)}
table{border-collapse:collapse;width:100%}th{text-align:left;font-weight:600;color:var(--soft)}
td,th{padding:.18rem .7rem .18rem 0;vertical-align:top;border-bottom:1px solid var(--line)}
td:nth-child(3){white-space:nowrap}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.why,.soft,figcaption{color:var(--soft);font-size:.87rem}.bad{color:var(--bad);font-weight:600}.good{color:var(--good)}
@media(max-width:40rem){table{display:block;overflow-x:auto}.why{min-width:16rem}}
.row{display:flex;flex-wrap:wrap;gap:1.2rem;align-items:flex-start}figure{margin:0}img{max-width:100%;height:auto;border-radius:4px;display:block}
.key span{display:inline-block;margin:0 .9rem .2rem 0;white-space:nowrap}.key i{display:inline-block;width:.85em;height:.85em;border-radius:2px;margin-right:.35em;vertical-align:-.08em}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(17rem,1fr));gap:1rem 2rem}svg{width:100%}svg text{font-size:10px;fill:var(--soft)}
.bar{fill:var(--bar)}.axis{stroke:var(--soft)}.time{height:.7em;background:var(--bar);border-radius:2px}li{margin:.5rem 0}
)";

std::string picture(const Picture& drawn, const std::string& caption) {
  return text("<figure><img width='%d' height='%d' alt='%s' src='", drawn.width, drawn.height,
              escaped(caption).c_str()) +
         data_uri(drawn) + "'><figcaption>" + escaped(caption) + "</figcaption></figure>\n";
}

std::string header(const Model& model) {
  const Certificate& c = model.certificate;
  const bool good = preprocess::broken_bounds(c, preprocess::body_size(model)).empty();
  return "<h1>" + escaped(model.name) + "</h1>\n" +
         text("<p>%zu tets, %zu nodes, %zu segments, %zu bones, %zu tissues of %llu vertices.<br>",
              model.tet_count(), model.node_count(), model.segment_count(), model.bone_names.size(),
              model.tissues.size(), static_cast<unsigned long long>(c.tissue_vertices)) +
         (good ? "<span class='good'>The certificate keeps every bound.</span>"
               : "<span class='bad'>The certificate breaks its bounds.</span>") +
         " For training and education, not for planning surgery.</p>\n";
}

std::string certificate(const Certificate& c, const preprocess::BodySize& size) {
  std::string out = "<h2>Certificate</h2>\n<table><tr><th>figure<th class=n>value<th>bound<th>because</tr>\n";
  for (const preprocess::JudgedFigure& figure : preprocess::judge(c, size)) {
    out += text("<tr><td>%s<td class='n%s'>%s<td>", escaped(figure.figure).c_str(), figure.kept ? "" : " bad",
                text::number(figure.value, 6).c_str());
    if (figure.bound != nullptr) {
      out += escaped(preprocess::describe(*figure.bound)) + "<td class=why>" + escaped(figure.bound->reason);
    } else {
      out += "<td>";
    }
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

std::string slices(const Model& model) {
  std::string out =
      "<h2>Bones and weights</h2>\n<p class=soft>Cuts through the tets. The colour of a place is that of its "
      "segments, mixed by their weights; bone is paler; a thin line parts where another segment weighs most."
      "</p>\n<div class=row>\n";
  const Box box = box_of(model);
  const View front = View::coronal().of(box.low, box.high, kBodyPixels);
  out += picture(slice(model, front, kGround, depth_of_bones(model, front)),
                 "at the bones' depth, from the front: the patient's left is on the right");
  out += picture(slice(model, View::sagittal().of(box.low, box.high, kBodyPixels), kGround),
                 "through the middle, from the left");
  for (const double share : {0.85, 0.55, 0.28}) {
    View view = View::axial().of(box.low, box.high, kAxialPixels);
    view.centre[2] = box.low[2] + share * (box.high[2] - box.low[2]);
    out += picture(slice(model, view, kGround), text("at %.0f mm, from the feet", view.centre[2]));
  }
  out += "</div>\n<p class=key>";
  for (std::size_t s = 0; s < model.segment_count(); ++s) {
    out += "<span><i style='background:" + css(colour_of(s)) + "'></i>" +
           escaped(model.rig.skeleton.segments[s].name) + "</span>";
  }
  return out + "</p>\n";
}

std::string rig(const Model& model) {
  std::string out =
      "<h2>Rig</h2>\n<p class=soft>Rings are joint centres: green where the fit is sure "
      "(confidence from 0.8), yellow from 0.5, red below.</p>\n<div class=row>\n";
  for (const Place& place : rig_pictures(model, kBodyPixels)) out += picture(place.picture, place.caption);
  out +=
      "</div>\n<table><tr><th>joint<th>centre by<th class=n>x, y, z mm<th class=n>residual mm<th class=n>"
      "inliers<th class=n>confidence</tr>\n";
  for (std::size_t s = 0; s < model.segment_count(); ++s) {
    const JointFit& fit = model.rig.fits[s];
    const Eigen::Vector3d& at = model.rig.skeleton.segments[s].joint.center;
    out += text(
        "<tr><td>%s<td>%s<td class=n>%.1f, %.1f, %.1f<td class=n>%.2f<td class=n>%.0f %%<td class='n%s'>%.2f"
        "</tr>\n",
        escaped(fit.joint).c_str(), std::string(center_rule_name(fit.rule)).c_str(), at[0], at[1], at[2],
        fit.residual_mm, 100 * fit.inlier_share, fit.confidence < 0.5 ? " bad" : "", fit.confidence);
  }
  return out + "</table>\n";
}

std::string contacts(const Model& model) {
  const std::vector<parting::CutContact> found = parting::cut_contacts(model);
  if (found.empty()) return {};
  std::string out =
      "<h2>Limbs that touched</h2>\n<p class=soft>Here the scan joined limbs to what they do not hang on; "
      "they were "
      "cut free, and no flesh was taken away. Rings are where: green where that is sure (confidence from "
      "0.8), "
      "yellow from 0.5. Where flesh has grown together in truth, name both in the case, under contacts, "
      "joined.</p>\n<div class=row>\n";
  for (const Place& place : contact_pictures(model, found, kBodyPixels))
    out += picture(place.picture, place.caption);
  out +=
      "</div>\n<table><tr><th>limb<th>cut free of<th>most of<th class=n>cm2<th class=n>x, y, z mm<th class=n>"
      "confidence</tr>\n";
  for (const parting::CutContact& contact : found) {
    out +=
        text("<tr><td>%s<td>%s<td>%s, %s<td class=n>%.1f<td class=n>%.1f, %.1f, %.1f<td class=n>%.2f</tr>\n",
             escaped(contact.limb).c_str(),
             contact.other_limb.empty() ? "the trunk" : escaped(contact.other_limb).c_str(),
             escaped(contact.own).c_str(), escaped(contact.other).c_str(), contact.cm2, contact.at[0],
             contact.at[1], contact.at[2], contact.confidence);
  }
  return out + "</table>\n";
}

std::string histograms(const Model& model) {
  std::string out =
      "<h2>Quality</h2>\n<p class=soft>Heights are square roots of shares, so that few stay visible "
      "beside many; point at a bar for its count.</p>\n<div class=plots>\n";
  for (const Histogram& histogram : quality(model)) {
    out += "<figure>" + svg(histogram) + "<figcaption>" + escaped(histogram.title) +
           (histogram.unit.empty() ? "" : ", " + escaped(histogram.unit)) + "</figcaption></figure>\n";
  }
  return out + "</div>\n";
}

std::string times(const std::vector<preprocess::StageTime>& stages) {
  double longest = 1e-9, all = 0;
  for (const preprocess::StageTime& stage : stages) {
    longest = std::max(longest, stage.seconds);
    all += stage.seconds;
  }
  std::string out =
      "<h2>Times</h2>\n<table><tr><th>stage<th class=n>seconds<th class=n>peak MiB<th style='width:50%'>"
      "</tr>\n";
  for (const preprocess::StageTime& stage : stages) {
    out += text("<tr><td>%s<td class=n>%.2f<td class=n>%.0f<td>", escaped(stage.name).c_str(), stage.seconds,
                stage.peak_rss_mib) +
           (stage.kept ? "<span class=soft>kept from an earlier run</span>"
                       : text("<div class=time style='width:%.1f%%'></div>", 100 * stage.seconds / longest)) +
           "</tr>\n";
  }
  return out + text("<tr><td><b>all</b><td class=n><b>%.2f</b><td class=n><td></tr></table>\n", all);
}

std::string warned(const Model& model, const std::vector<std::string>& warnings) {
  std::string out = "<h2>Warnings</h2>\n";
  if (warnings.empty()) return out + "<p>None.</p>\n";
  constexpr std::size_t most_pictured = 24;  // a page stays a page
  out += "<ol>\n";
  std::size_t pictured = 0;
  for (const WarningGroup& group : grouped(model, warnings)) {
    out += "<li>" + escaped(group.text) + "\n";
    if (group.count > 1) {
      out +=
          text("<details><summary class=soft>and %zu more like it</summary><p class=soft>", group.count - 1);
      for (const std::string& name : group.joints) out += escaped(name) + " ";
      for (const std::string& name : group.tissues) out += escaped(name) + " ";
      out += "</p></details>\n";
    }
    if (group.joints.empty() && group.tissues.empty()) continue;
    if (pictured++ >= most_pictured) continue;
    const Place place = place_of(model, group);
    out += picture(place.picture, place.caption);
  }
  return out + "</ol>\n";
}

std::string provenance(const Model& model) {
  // Folded: a row for every file of the case.
  std::string out = "<h2>Provenance</h2>\n<details><summary>" + std::to_string(model.provenance.size()) +
                    " rows: versions, options and digests of every input</summary>\n<table>\n";
  for (const auto& [key, value] : model.provenance)
    out += "<tr><td>" + escaped(key) + "<td>" + escaped(value) + "</tr>\n";
  return out + "</table></details>\n";
}

}  // namespace

std::string page(const Input& input) {
  const Model& model = input.model;
  return "<!doctype html>\n<html lang=en><meta charset=utf-8><meta name=viewport "
         "content='width=device-width'>\n<title>" +
         escaped(model.name) + ": how it was prepared</title>\n<style>" + kStyle + "</style>\n<body>\n" +
         header(model) + certificate(model.certificate, preprocess::body_size(model)) + slices(model) +
         rig(model) + contacts(model) + input.more + histograms(model) + warned(model, input.warnings) +
         times(input.stages) + provenance(model) + "</body></html>\n";
}

}  // namespace ecorche::app::report
