// SPDX-License-Identifier: Apache-2.0
#include "app/report/cohort_page.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "app/report/histogram.hpp"
#include "app/report/html.hpp"
#include "app/report/picture.hpp"
#include "core/values/text.hpp"

namespace ecorche::app::report {
namespace {

using State = Participant::State;

constexpr std::size_t kBins = 16;
constexpr std::size_t kMostOutliers = 24;  // with a picture each; the table has them all

constexpr const char* kCohortStyle = R"(
:root{color-scheme:light dark;--ink:#1d1f23;--soft:#5c6067;--line:#dcdcd6;--page:#fbfbf9;--bar:#3f7fb5;--bad:#b3261e;--fair:#8a6100;--good:#2e7d4a;--field:#fff}
@media(prefers-color-scheme:dark){:root{--ink:#e8e8e4;--soft:#a0a4aa;--line:#3a3d42;--page:#17181b;--bar:#6fa9d8;--bad:#ff8a80;--fair:#e6c07a;--good:#7fce9a;--field:#222428}}
*{box-sizing:border-box}
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--page);max-width:78rem;margin:2rem auto;padding:0 1.2rem}
h1{font-size:1.9rem;margin:0;overflow-wrap:anywhere}h2{font-size:1.2rem;margin:2.4rem 0 .6rem;border-bottom:1px solid var(--line)}h3{font-size:1rem;margin:.2rem 0}
a{color:inherit}.soft{color:var(--soft);font-size:.87rem}.bad{color:var(--bad);font-weight:600}.fair{color:var(--fair)}.good{color:var(--good)}
.counts{display:flex;flex-wrap:wrap;gap:.4rem 2rem;font-size:1.05rem;margin:.8rem 0}.counts b{font-size:1.5rem;font-weight:600;margin-right:.3rem}
.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(15rem,1fr));gap:1rem}.card{display:flex;gap:.8rem;min-width:0}
.card img{width:5.5rem;height:11rem;object-fit:contain;background:#fafaf8;border-radius:4px;flex:none}.card div{min-width:0;overflow-wrap:anywhere}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(16rem,1fr));gap:1rem 2rem}svg{width:100%}svg text{font-size:10px;fill:var(--soft)}
.bar{fill:var(--bar)}.axis{stroke:var(--soft)}li{margin:.5rem 0;overflow-wrap:anywhere}
input{font:inherit;color:inherit;background:var(--field);border:1px solid var(--soft);border-radius:4px;padding:.35rem .6rem;width:22rem;max-width:100%;margin-bottom:.6rem}
.wide{overflow-x:auto}table{border-collapse:collapse;width:100%}th{text-align:left;font-weight:600;color:var(--soft);vertical-align:bottom}
td,th{padding:.2rem .8rem .2rem 0;border-bottom:1px solid var(--line);vertical-align:top}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}td.n{white-space:nowrap}
td.why{min-width:9rem;overflow-wrap:anywhere}th button{white-space:normal}th button{font:inherit;color:inherit;background:none;border:0;padding:0;cursor:pointer;text-align:inherit}
th[aria-sort=ascending] button::after{content:' \25b2'}th[aria-sort=descending] button::after{content:' \25bc'}
@media(max-width:40rem){body{margin:1rem auto;padding:0 .8rem}table,tbody,tr,td{display:block}thead{display:none}
td,td.n{border:0;padding:0;text-align:left;white-space:normal;overflow-wrap:anywhere}td.why{min-width:0}tr{border-bottom:1px solid var(--line);padding:.45rem 0}
td[data-of]::before{content:attr(data-of) ': ';color:var(--soft)}td:first-child{font-weight:600}}
)";

// Search hides rows; a click on a head sorts by it, numbers as numbers, what is missing last.
constexpr const char* kScript = R"(
const body=document.querySelector('#all tbody'),rows=[...body.rows],said=document.querySelector('#shown');
document.querySelector('#search').addEventListener('input',event=>{
  const words=event.target.value.toLowerCase().split(/\s+/).filter(Boolean);let shown=0;
  for(const row of rows){row.hidden=!words.every(word=>row.textContent.toLowerCase().includes(word));shown+=!row.hidden}
  said.textContent=`${shown} of ${rows.length} shown`});
document.querySelectorAll('#all th button').forEach((button,at)=>button.addEventListener('click',()=>{
  const head=button.parentElement,down=head.getAttribute('aria-sort')==='ascending';
  document.querySelectorAll('#all th').forEach(other=>other.removeAttribute('aria-sort'));
  head.setAttribute('aria-sort',down?'descending':'ascending');
  const key=row=>{const cell=row.cells[at];return 'v' in cell.dataset?cell.dataset.v===''?NaN:Number(cell.dataset.v):cell.textContent};
  const order=(a,b)=>{const x=key(a),y=key(b);
    if(typeof x==='number')return Number.isNaN(x)||Number.isNaN(y)?Number.isNaN(x)-Number.isNaN(y):down?y-x:x-y;
    return (down?-1:1)*x.localeCompare(y,'en',{numeric:true})};
  body.append(...rows.sort(order))}));
)";

std::string document(const std::string& title, const std::string& body) {
  return "<!doctype html>\n<html lang=en><head><meta charset=utf-8><meta name=viewport "
         "content='width=device-width'>\n<title>" +
         escaped(title) + "</title>\n<style>" + kCohortStyle + "</style></head>\n<body>\n" + body +
         "</body></html>\n";
}

const char* tone(State state) {
  return state == State::pass     ? "good"
         : state == State::warn   ? "fair"
         : state == State::failed ? "bad"
                                  : "soft";
}

std::string shown(double value, const Figure& figure) {
  if (!std::isfinite(value)) return "";
  const double x = value * figure.per;
  const std::string number = std::abs(x) >= 1000 ? text("%.0f", x) : text::number(x, 4);
  return number + (figure.unit.empty() ? "" : " " + figure.unit);
}

// Long names may be broken where their words end.
std::string breakable(const std::string& name) {
  std::string out;
  for (const char c : escaped(name)) {
    out += c;
    if (c == '.' || c == '_') out += "<wbr>";
  }
  return out;
}

std::string counts(const std::vector<Participant>& cohort) {
  std::map<State, int> of;
  for (const Participant& one : cohort) ++of[one.state];
  std::string out = "<div class=counts>";
  for (const State state : {State::pass, State::warn, State::failed, State::unfinished}) {
    if (state == State::unfinished && of[state] == 0) continue;
    out += text("<span class=%s><b>%d</b>%s</span>", tone(state), of[state], state_name(state));
  }
  return out +
         "</div>\n<p class=soft>pass: every pose keeps its limits. warn: some pose does not, or it can take "
         "none. failed: it has "
         "no "
         "model, or not every pose. For training and education, not for planning surgery.</p>\n";
}

std::string link_to(const Participant& one) {
  const std::string name = escaped(one.name);
  return one.state == State::unfinished ? name : "<a href='" + name + "/report.html'>" + name + "</a>";
}

std::string reason(const Participant& one) {
  return escaped(one.where + ": " + one.what) + " <span class=soft>(" + escaped(one.mend) + ")</span>";
}

std::string failures(const std::vector<Participant>& cohort) {
  std::string out;
  for (const Participant& one : cohort) {
    if (one.state != State::failed) continue;
    out +=
        "<li>" + link_to(one) + ", " + escaped(one.step) +
        (one.fault == "machine" ? ", by its machine: it is tried again when the cohort is run again" : "") +
        ": " + reason(one) + "\n";
  }
  return "<h2>Failed</h2>\n" + (out.empty() ? "<p>Nobody.</p>\n" : "<ul>\n" + out + "</ul>\n");
}

std::string outliers(const std::vector<Participant>& cohort, const std::vector<Figure>& figures) {
  // A card a participant, with all that it differs in; who differs in most comes first.
  std::map<std::size_t, std::string> lines;
  std::map<std::size_t, int> times;
  for (const Figure& figure : figures) {
    for (const std::size_t i : figure.outliers) {
      lines[i] += escaped(figure.title) + ": <b>" + escaped(shown(figure.of[i], figure)) +
                  "</b> <span class=soft>(" + escaped(shown(figure.median, figure)) +
                  " in the middle)</span><br>";
      ++times[i];
    }
  }
  if (lines.empty()) return "<h2>Unlike the others</h2>\n<p>Nobody.</p>\n";
  std::vector<std::size_t> order;
  order.reserve(lines.size());
  for (const auto& [i, line] : lines) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return times[a] > times[b]; });
  std::string out = "<h2>Unlike the others</h2>\n<div class=cards>\n";
  for (std::size_t n = 0; n < std::min(order.size(), kMostOutliers); ++n) {
    const Participant& one = cohort[order[n]];
    out += "<div class=card>";
    if (!one.picture.empty())
      out += "<img alt='" + escaped(one.name) + " from the front' src='" + data_uri(one.picture) + "'>";
    out += "<div><h3>" + link_to(one) + "</h3>" + lines[order[n]] + "</div></div>\n";
  }
  out += "</div>\n";
  if (order.size() > kMostOutliers)
    out += text("<p class=soft>and %zu more, bold in the table</p>\n", order.size() - kMostOutliers);
  return out;
}

std::string distributions(const std::vector<Figure>& figures) {
  std::string out;
  for (const Figure& figure : figures) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double x : figure.of) {
      if (std::isfinite(x)) low = std::min(low, x * figure.per), high = std::max(high, x * figure.per);
    }
    if (!(low <= high)) continue;
    if (low == high) {
      out += "<div><h3>" + escaped(figure.title) + "</h3><p class=soft>" +
             escaped(shown(figure.median, figure)) + " of all</p></div>\n";
      continue;
    }
    Histogram bars(figure.title, figure.unit, low, high, kBins);
    for (const double x : figure.of) {
      if (std::isfinite(x)) bars.add(x * figure.per);
    }
    out += "<div><h3>" + escaped(figure.title) + (figure.unit.empty() ? "" : ", " + escaped(figure.unit)) +
           "</h3>" + svg(bars) + "</div>\n";
  }
  return "<h2>Distributions</h2>\n<p class=soft>A bar's height is the root of its share, so that a single "
         "one is seen "
         "beside many.</p>\n<div class=plots>\n" +
         out + "</div>\n";
}

std::string table(const std::vector<Participant>& cohort, const std::vector<Figure>& figures) {
  std::string out =
      "<h2>Everybody</h2>\n<label class=soft for=search>Search in names, states and "
      "reasons</label><br><input id=search "
      "type=search autocomplete=off> <span class=soft id=shown aria-live=polite></span>\n<div "
      "class=wide><table "
      "id=all><thead><tr><th scope=col><button>participant</button><th scope=col><button>state</button>";
  out += "<th scope=col><button>reason</button>";
  for (const Figure& figure : figures)
    out += "<th scope=col class=n><button>" + breakable(figure.name) + "</button>";
  out += "</tr></thead>\n<tbody>\n";
  for (std::size_t i = 0; i < cohort.size(); ++i) {
    const Participant& one = cohort[i];
    out += "<tr><td>" + link_to(one) + "<td class=" + tone(one.state) + ">" + state_name(one.state) +
           (one.repaired ? " <span class=soft>(mended)</span>" : "");
    std::string why = one.state == State::failed ? reason(one) : "";
    if (one.state == State::warn) {
      for (const PosedRow& row : one.poses) {
        if (!row.pass) why += (why.empty() ? "" : ", ") + escaped(row.pose);
      }
    }
    for (const LeftOutPose& pose : one.left_out)
      why += (why.empty() ? "" : ", ") + escaped(pose.pose) + " <span class=soft>left out</span>";
    out += "<td class=why data-of=reason>" + why;
    for (const Figure& figure : figures) {
      const double x = figure.of[i];
      const bool far = std::find(figure.outliers.begin(), figure.outliers.end(), i) != figure.outliers.end();
      out += "<td class=n data-of='" + escaped(figure.name) + "' data-v='" +
             (std::isfinite(x) ? text("%.9g", x) : "") + "'>" + (far ? "<b>" : "") +
             escaped(shown(x, figure)) + (far ? "</b>" : "");
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

}  // namespace

std::string group_page(const std::vector<Participant>& cohort, const std::vector<Figure>& figures) {
  return document("A cohort of " + std::to_string(cohort.size()),
                  text("<h1>A cohort of %zu</h1>\n", cohort.size()) + counts(cohort) + failures(cohort) +
                      outliers(cohort, figures) + distributions(figures) + table(cohort, figures) +
                      "<p class=soft>The same as group.tsv and group.json.</p>\n<script>" + kScript +
                      "</script>\n");
}

std::string pose_section(const Participant& one) {
  std::string out =
      "<h2>Poses</h2>\n<table><tr><th>pose<th>verdict<th class=n>inverted, ml<th class=n>volume, %<th "
      "class=n>least det "
      "F<th class=n>warnings<th>the worst</tr>\n";
  for (const PosedRow& row : one.poses) {
    out += "<tr><td>" + escaped(row.pose) +
           text("<td class=%s>%s<td class=n>%s<td class=n>%+.2f<td class=n>%.3g<td class=n>%.0f",
                row.pass ? "good" : "bad", row.pass ? "pass" : "warn",
                text::number(row.inverted_mm3 / 1000, 4).c_str(), 100 * row.volume_change, row.min_det_f,
                row.warnings) +
           "<td class=why>" + escaped(row.worst) + "</tr>\n";
  }
  for (const LeftOutPose& pose : one.left_out)
    out += "<tr><td>" + escaped(pose.pose) + "<td class=soft>left out<td colspan=4><td class=why>" +
           escaped(pose.why) + "</tr>\n";
  return out + "</table>\n";
}

std::string failed_page(const Participant& one) {
  return document(one.name + ": failed",
                  "<h1>" + escaped(one.name) + "</h1>\n<p class=bad>Failed in the step " + escaped(one.step) +
                      text(", exit %d.</p>\n<p>", one.exit_code) + reason(one) +
                      "</p>\n<p class=soft>All that was said: log/" + escaped(one.step) + ".log</p>\n" +
                      (one.poses.empty() ? "" : pose_section(one)));
}

}  // namespace ecorche::app::report
