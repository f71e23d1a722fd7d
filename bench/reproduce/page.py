# SPDX-License-Identifier: Apache-2.0
"""docs/results.md: a table a part, under the date and commit that it was made by."""
import results
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

| | |
|---|---|
"""
PAPERS = {
    "Sujar18": "Sujar et al. 2018",
    "Gagvani01": "Gagvani and Silver 2001",
    "Zhang26": "Beyond them: the measures of Zhang, Zhao and Unberath 2026",
    "bodies": "Six public bodies",
}


def cell(text):
    return " ".join(str(text).split()).replace("|", "\\|")


def section(part, kept, pictures):
    """A part's heading, table and pictures; `kept` is None where it was not run."""
    lines = [f"\n### {part.title}\n"]
    if kept is None:
        return lines + [f"Not run: `scripts/reproduce --only {part.name}{' --data DIR' if part.needs_data else ''}` does.\n"]
    busy = f"; **not quiet**: others took {100 * kept['others']:.0f} % of the processors" if part.timed and kept["others"] > 0.05 else ""
    lines.append(f"`scripts/reproduce --only {part.name}`: {kept['date']}, commit {kept['commit']}{busy}.\n")
    lines.append("| in the paper | there | here | command | what differs |\n|---|---|---|---|---|")
    found = from_json(kept["found"])
    lines += [f"| {cell(row.where)} | {cell(row.theirs)} | {cell(row.ours)} | `{cell(row.command)}` | {cell(row.differs)} |" for row in found.rows]
    lines += [f"\n![{picture.about}]({pictures}/{picture.file})\n\n*{picture.about}.*" for picture in found.pictures]
    return lines + [""]


def text(parts, kept, pictures, words=""):
    """The page: `kept` holds what was found of each part, by name."""
    facts = "".join(f"| {name} | {value} |\n" for name, value in results.machine().items())
    lines, paper = [HEAD.format(words=words) + facts], None
    for part in parts:
        if part.paper != paper:
            paper = part.paper
            lines.append(f"\n## {PAPERS[paper]}")
        lines += section(part, kept.get(part.name), pictures)
    return "\n".join(lines).rstrip() + "\n"
