# SPDX-License-Identifier: Apache-2.0
"""docs/results.md: a table a part, under the date, commit and machine that it was made by."""
import re

from reproduce.rows import from_json

HEAD = """<!-- SPDX-License-Identifier: Apache-2.0 -->
# The papers, reproduced
<!-- Made by scripts/reproduce{words}: run it again instead of changing this page. -->

Each figure, table and number of the two papers that ecorche is built on, beside what it does here, and the command that shows it. `scripts/reproduce`
makes this page, as a whole or part by part (`--only`); `--data DIR` adds the rows that need public data sets.

- **Papers.** [Sujar 2018 and Gagvani 2001](explanation/index.md#the-papers), and *beyond them* Zhang, Zhao and Unberath 2026.
- **"not stated in what we hold".** We do not have the papers' text here, only what our design took from it. A figure that it did not take is not guessed.
- **Other bodies.** Theirs are not public. Ours are the built-in patient, which is made of simple shapes, and with `--data` six public bodies.
- **Other machines.** Seconds of a machine of 2013 or 2001 and of today's say little about methods. Parts whose seconds were taken beside other
  work on the same machine say so.
"""
PAPERS = {
    "Sujar18": "Sujar et al. 2018",
    "Gagvani01": "Gagvani and Silver 2001",
    "Zhang26": "Beyond them: the measures of Zhang, Zhao and Unberath 2026",
    "bodies": "Six public bodies",
}


def cell(text):
    return " ".join(str(text).split()).replace("|", "\\|")


def sections_of(page):
    """The parts of an earlier page, by title, each as text() put it there."""
    found = re.split(r"(?m)^### (.*)\n", page)[1:]
    return {title: re.split(r"(?m)^## ", text)[0].strip() for title, text in zip(found[::2], found[1::2])}


def not_run(part):
    return f"Not run: `scripts/reproduce --only {part.name}{' --data DIR' if part.needs_data else ''}` does."


def section(part, kept, before, pictures):
    """A part's heading, table and pictures. Of a part that was not run: what stood `before` (None: nothing did)."""
    lines = [f"\n### {part.title}\n"]
    if kept is None:
        return lines + [f"{before or not_run(part)}\n"]
    busy = f"; **not quiet**: others took {100 * kept['others']:.0f} % of the processors" if part.timed and kept["others"] > 0.05 else ""
    lines.append(f"`scripts/reproduce --only {part.name}`: {kept['date']}, commit {kept['commit']}; {kept['machine']}{busy}.\n")
    lines.append("| in the paper | there | here | command | what differs |\n|---|---|---|---|---|")
    found = from_json(kept["found"])
    lines += [f"| {cell(row.where)} | {cell(row.theirs)} | {cell(row.ours)} | `{cell(row.command)}` | {cell(row.differs)} |" for row in found.rows]
    lines += [f"\n![{picture.about}]({pictures}/{picture.file})\n\n*{picture.about}.*" for picture in found.pictures]
    return lines + [""]


def text(parts, kept, before, pictures, words=""):
    """The page: `kept` holds what was found of parts that were run now, by name; others are as the page `before` has them."""
    lines, paper, earlier = [HEAD.format(words=words)], None, sections_of(before)
    for part in parts:
        if part.paper != paper:
            paper = part.paper
            lines.append(f"\n## {PAPERS[paper]}")
        lines += section(part, kept.get(part.name), earlier.get(part.title), pictures)
    return "\n".join(lines).rstrip() + "\n"
