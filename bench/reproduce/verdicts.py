# SPDX-License-Identifier: Apache-2.0
"""Verdicts of poses that bend joints far: skinned, corrected by joints alone and with whole poses, settled; with a picture of each that is not mended."""
import json

import programs
from posed_place import posed_place
from reproduce.rows import Found, Part, Row, UNKNOWN, folder_of, small_or

BODIES = ("bodyparts3d", "icrp110_female")
POSES = ("sitting", "squatting", "arms_up")
AROUND = 130  # mm, of what a picture shows
SHOWN = ("bodyparts3d", "phantom")  # bodies with an open licence: no picture of another is kept


def corrected(coarse, fine):
    """`fine` with the correction that was calibrated on `coarse`, of joints alone, and with whole poses; samples are those of bench/correct, where it ran."""
    made, joints, whole = coarse.with_name(f"{coarse.stem}_verdicts.hdf"), fine.with_name(f"{fine.stem}_joints.hdf"), fine.with_name(f"{fine.stem}_whole.hdf")
    if programs.outdated(whole, coarse, fine):
        programs.ecorche("--threads", 2, "calibrate", coarse, "-o", made, "--cache", programs.MADE / "samples", "--no-ranges", "--no-poses")
        programs.ecorche("--threads", 2, "calibrate", fine, "-o", joints, "--from", made, "--no-ranges", "--no-poses")
        programs.ecorche("--threads", 2, "calibrate", fine, "-o", whole, "--from", made, "--no-ranges")
    return joints, whole


def posed(model, pose, out, tissues, words):
    """quality.json of a pose, whose tissues and tets lie in `out`."""
    programs.ecorche("pose", model, "-o", out, "--pose", f"lib:{pose}", "--tissues", ",".join(tissues) or "none", "--volumes", "none", "--tets", *words)
    return json.loads((out / "quality.json").read_text())


def said(quality):
    first = quality["warnings"][0]["what"] if quality["warnings"] else ""
    more = len(quality["warnings"]) - 1
    return quality["verdict"] + (f" ({first}{f', and {more} more' if more > 0 else ''})" if first else "")


def drawn(kit, model, name, pose, qualities):
    """The corrected and the settled body about the place of the first warning: bones that run into each other, or skin."""
    of = next(quality for quality in reversed(qualities) if quality["warnings"])["warnings"][0]
    bones = [tissue["name"] for tissue in programs.ecorche("info", model)["tissues"] if tissue["group"] == "bone"]
    files = []
    for quality, words in zip(qualities, ((), ("--settle",))):
        out = folder_of(kit, "verdicts") / f"{name}{'_settled' if words else ''}"
        posed(model, pose, out, bones if of["kind"] == "bone_overlap" else ["skin"], words)
        around = ",".join(f"{value:.1f}" for value in (*posed_place(out, of["at_mm"]), AROUND))
        programs.call(programs.ROOT / "scripts/render", out, "-o", kit.made / "pictures", "--name", out.name, "--only", "tissues", "--view", "oblique",
                      "--height", 600, f"--around={around}")
        files.append(kit.made / f"pictures/{out.name}_oblique.png")
    return kit.row_of(files, f"verdict_{name}", f"{name.replace('_', ' ')}, corrected at the left, {said(qualities[0])}; settled at the right, {said(qualities[1])}")


def rows_of(kit, body, tets, coarse_tets):
    coarse, fine = (programs.example_model(body, kit.data, count) for count in (coarse_tets, tets))
    joints, whole = corrected(coarse, fine)
    rows, pictures = [], []
    for pose in small_or(kit, POSES[:1], POSES):
        out = folder_of(kit, "verdicts") / "judged"
        found = {way: posed(of, pose, out, [], words) for way, of, words in
                 (("skinned", fine, ()), ("joints alone", joints, ()), ("corrected", whole, ()), ("settled", joints, ("--settle",)))}
        passes = found["corrected"]["verdict"] == "pass"
        rows.append(Row(f"{body}: {pose.replace('_', ' ')}", UNKNOWN, "; ".join(f"{way}: {said(quality)}" for way, quality in found.items()),
                        f"ecorche pose MODEL --pose lib:{pose} [--settle] -o DIR", "" if passes else "Asked of the corrected body: pass."))
        if kit.draw and not passes and body in SHOWN:
            pictures.append(drawn(kit, whole, f"{body}_{pose}", pose, (found["corrected"], found["settled"])))
    return rows, pictures


def verdicts(kit):
    found = [rows_of(kit, body, small_or(kit, 20_000, 300_000), small_or(kit, 20_000, 100_000)) for body in (BODIES[1:] if kit.small else BODIES)]
    return Found([row for rows, _ in found for row in rows], [picture for _, pictures in found for picture in pictures])


PARTS = [Part("verdicts", "bodies", "Sitting, squatting, arms up: skinned, corrected, settled", verdicts, needs_data=True)]
