# SPDX-License-Identifier: Apache-2.0
"""Sujar18 figure 10: a page ready to be run with people; no answers."""
import json

import programs
from reproduce.rows import Found, Part, Row, folder_of

STUDY = programs.ROOT / "examples/study"


def pictures_of(file):
    text = file.read_text()
    return json.loads(text[text.index("["):text.rindex("]") + 1].replace(",\n]", "]"))


def study(kit):
    """Of the small size one pose is drawn anew; of the full one the page's own pictures are counted."""
    folder = STUDY
    if kit.small:
        folder = folder_of(kit, "study")
        programs.call(STUDY / "draw", kit.model(spheres=False), "-o", folder, "--poses", "wrist", "--height", 120)
    shown = pictures_of(folder / "pictures.js")
    missing = [row["file"] for row in shown if not (folder / row["file"]).is_file()]
    if missing:
        raise SystemExit(f"error: reproduce: {folder}: {', '.join(missing)} is not there (run examples/study/draw MODEL)")
    count = {method: sum(row["method"] == method for row in shown) for method in ("fem", "cor")}
    poses = len({row["pose"] for row in shown})
    theirs = "22 pictures, 11 by finite elements and 11 by CoR, six poses, Likert 1 to 8, Wilcoxon's signed-rank test"
    return Found([Row("figure 10: plausibility as people see it", f"{theirs}; its answers are not stated in what we hold",
                      f"a page with {len(shown)} pictures, {count['fem']} by finite elements and {count['cor']} by CoR, {poses} poses; **nobody was asked**",
                      "examples/study/draw MODEL", "Our wording, our poses: theirs are not stated in what we hold.")])


PARTS = [Part("study", "Sujar18", "As people see it (figure 10)", study)]
