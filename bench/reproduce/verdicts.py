# SPDX-License-Identifier: Apache-2.0
"""Verdicts of poses that bend joints far: as skinned, as corrected towards finite elements, and settled, with a picture of each that does not pass."""
import json

import programs
from posed_place import posed_place
from reproduce.rows import Found, Part, Row, UNKNOWN, folder_of, small_or

BODIES = ("bodyparts3d", "icrp110_female")
POSES = ("sitting", "squatting", "arms_up")
AROUND = 130  # mm, of what a picture shows


def corrected(coarse, fine):
    """`fine` with the correction that was calibrated on `coarse`; samples are those of bench/correct, where it ran."""
    made, out = (model.with_name(f"{model.stem}_verdicts.hdf") for model in (coarse, fine))
    if programs.outdated(out, coarse, fine):
        programs.ecorche("--threads", 2, "calibrate", coarse, "-o", made, "--cache", programs.MADE / "samples", "--no-ranges")
        programs.ecorche("--threads", 2, "calibrate", fine, "-o", out, "--from", made, "--no-ranges")
    return out


def judged(model, pose, out, *words):
    """quality.json of a pose, whose bones and tets lie in `out`."""
    bones = [tissue["name"] for tissue in programs.ecorche("info", model)["tissues"] if tissue["group"] == "bone"]
    programs.ecorche("pose", model, "-o", out, "--pose", f"lib:{pose}", "--tissues", ",".join(bones), "--volumes", "none", "--tets", *words)
    return json.loads((out / "quality.json").read_text())


def said(quality):
    first = quality["warnings"][0]["what"] if quality["warnings"] else ""
    more = len(quality["warnings"]) - 1
    return quality["verdict"] + (f" ({first}{f', and {more} more' if more > 0 else ''})" if first else "")


def drawn(kit, folder, quality, name, about):
    """The posed bones around the place that the first warning names."""
    around = ",".join(f"{value:.1f}" for value in (*posed_place(folder, quality["warnings"][0]["at_mm"]), AROUND))
    return kit.render(folder, name=name, suffix="side", about=about, words=("--only", "tissues", "--view", "side", f"--around={around}"))


def rows_of(kit, body, tets, coarse_tets):
    coarse, fine = (programs.example_model(body, kit.data, count) for count in (coarse_tets, tets))
    model, rows, pictures = corrected(coarse, fine), [], []
    for pose in small_or(kit, POSES[:1], POSES):
        out = folder_of(kit, "verdicts") / f"{body}_{pose}"
        found = {"skinned": judged(fine, pose, out), "corrected": judged(model, pose, out), "settled": judged(model, pose, out, "--settle")}
        rows.append(Row(f"{body}: {pose.replace('_', ' ')}", UNKNOWN, "; ".join(f"{way}: {said(quality)}" for way, quality in found.items()),
                        f"ecorche pose MODEL --pose lib:{pose} [--settle] -o DIR", "" if found["corrected"]["verdict"] == "pass" else "Asked of the corrected body: pass."))
        if found["settled"]["verdict"] != "pass":
            pictures += drawn(kit, out, found["settled"], f"verdict_{body}_{pose}",
                              f"{body}, {pose.replace('_', ' ')}, settled: {found['settled']['warnings'][0]['what']}")
    return rows, pictures


def verdicts(kit):
    found = [rows_of(kit, body, small_or(kit, 20_000, 300_000), small_or(kit, 20_000, 100_000)) for body in (BODIES[1:] if kit.small else BODIES)]
    return Found([row for rows, _ in found for row in rows], [picture for _, pictures in found for picture in pictures])


PARTS = [Part("verdicts", "bodies", "Sitting, squatting, arms up: skinned, corrected, settled", verdicts, needs_data=True)]
