# SPDX-License-Identifier: Apache-2.0
"""Gagvani01 6 and 7: effects, the skeleton as an index, and what goes wrong."""
import json
import statistics

import programs
import voxels
from reproduce.gagvani_thin import THRESHOLD, skeleton
from reproduce.rows import Found, Part, Row, UNKNOWN, folder_of, number, small_or


def effects(kit):
    """Bulging, melting, exploding and morphing: each does nothing at time 0, and something at its end."""
    folder, ct, rest = folder_of(kit, "effects"), kit.phantom() / "volumes/ct.nrrd", ("--background", -1024)

    def held(name, *words):
        """How many voxels of the object there are, by the threshold that it was thinned by."""
        file = folder / f"{name}.nrrd"
        programs.ecorche("refill", skeleton(kit), ct, "-o", file, *words, *rest)
        return int((voxels.read(file).values >= -500).sum())

    pose = kit.pose("bent_elbow", {"elbow_left": {"flexion": 90}})
    bent = ("--rig", kit.model(), "--pose", pose, "--no-bridge")
    whole, flat, bulged = held("rest"), held("bent", *bent), held("bulged", *bent, "--bulge", 0.3)
    other = kit.made / f"other_{kit.phantom_size}"
    if not (other / "truth.yaml").exists():
        programs.ecorche("phantom", "-o", other, "--size", kit.phantom_size, "--vary", "--seed", 8)
    programs.ecorche("thin", other / "volumes/ct.nrrd", *THRESHOLD, "--tp", 0.2, "-o", folder / "other.vtp")
    exploded, morphed = held("exploded", "--explode", 0.5), held("morphed", "--morph", folder / "other.vtp", other / "volumes/ct.nrrd", "--time", 0.5)
    rows = [
        Row("6: joints bulged", UNKNOWN, f"with an elbow bent by 90 degrees, and every joint bulged by 0.3, {number(bulged)} voxels; {number(flat)} without",
            "ecorche refill SKELETON.vtp ct.nrrd --pose POSE --bulge 0.3 -o bulged.nrrd"),
        Row("6: melting", UNKNOWN, f"{100 * held('melting', '--melt', '--time', 0.5) / whole:.0f} % of the voxels are left half way, small balls gone first",
            "ecorche refill SKELETON.vtp ct.nrrd --melt --time 0.5 -o melting.nrrd"),
        Row("6: explosion", UNKNOWN, f"balls moved apart by half of their distance from the middle hold {number(exploded)} voxels; {number(whole)} before",
            "ecorche refill SKELETON.vtp ct.nrrd --explode 0.5 -o exploded.nrrd"),
        Row("6: morphing", UNKNOWN, f"half way from one built-in patient to another: {number(morphed)} voxels",
            "ecorche refill A.vtp A.nrrd --morph B.vtp B.nrrd --time 0.5 -o morphed.nrrd"),
    ]
    names = ("rest", "melting", "exploded", "morphed")
    return Found(rows, kit.render(*(folder / f"{name}.nrrd" for name in names), name="gagvani_effects", suffix="beside", words=("--beside", "--grey"),
                                  about="The patient's CT at rest, melting, exploded, and half way to another patient"))


def index(kit):
    way = programs.ecorche("path", kit.model(), "--from=-88,0,300", "--to=0,0,900", "-o", folder_of(kit, "effects") / "way.csv")
    meet = programs.ecorche("contact", kit.model(), kit.model(), "--other-pose", "lib:sitting")
    return Found([
        Row("7: a way through the body", UNKNOWN,
            f"{len(way['points'])} balls, {way['length_mm']:.0f} mm from a shank to the pelvis, {way['narrowest_mm']:.0f} mm where it is narrowest",
            "ecorche path MODEL --from=-88,0,300 --to=0,0,900 -o way.csv"),
        Row("7: two bodies that meet", UNKNOWN, f"found in {meet['seconds']:.2f} s, {number(meet['pairs'])} pairs of balls",
            "ecorche contact MODEL MODEL --other-pose lib:sitting"),
    ])


def sweep(kit):
    step = small_or(kit, 90, 30)
    rows = programs.ecorche("tears", kit.model(), "--sweep", "--step", step)["sweep"]
    first = lambda key: [row[key] for row in rows if row[key]]  # noqa: E731

    def told(angles):
        if not angles:
            return f"none of {len(rows)} ways tears up to 180 degrees"
        return f"{len(angles)} of {len(rows)} ways tear, in the median of these at {statistics.median(angles):.0f} degrees; the others hold to 180"

    command = f"ecorche tears MODEL --sweep --step {step}"
    return Found([Row("7: where a joint breaks, turned alone", "about 90 degrees; whether bulged is not stated in what we hold", told(first("breaks_at_deg")),
                      command,
                      f"In steps of {step} degrees, every joint about every axis, limits aside; a frame errs by our rule, not by eye."),
                  Row("7: the same, bulged", UNKNOWN, told(first("bulged_breaks_at_deg")), command),
                  Row("beyond: the same, bridged", "-", told(first("bridged_breaks_at_deg")), command)])


def tears(kit):
    step = 20
    if not kit.data:
        look = programs.ecorche("tears", kit.model(), "--motion", kit.phantom() / "motion/walk.bvh", "--frames", "0:60:20")["frames"]
        found = {"frames": len(look), "err": sum(row["errs"] for row in look)}
        command = "ecorche tears MODEL --motion walk.bvh --frames 0:60:20"
    else:
        command = f"bench/tears/run DATA/mocap --step {step}"
        programs.call(programs.ROOT / "bench/tears/run", kit.data / "mocap", "--step", step, "--prove", 50)
        found = json.loads((programs.MADE / "tears/summary.json").read_text())
    proof = f"; of {found['seeded']} seeded tears {found['found']} found" if "seeded" in found else ""
    return Found([Row("7: frames with visible errors", "5 % of about 5000", f"{100 * found['err'] / found['frames']:.2f} % of {found['frames']}{proof}", command,
                      "Other motions, of which every twentieth frame is looked at; errors are found by a program, theirs by eye.")])


PARTS = [
    Part("effects", "Gagvani01", "Effects (section 6)", effects),
    Part("index", "Gagvani01", "The skeleton as an index (section 7)", index),
    Part("sweep", "Gagvani01", "Where joints break (section 7)", sweep),
    Part("tears", "Gagvani01", "Frames with visible errors (section 7)", tears),
]
