# SPDX-License-Identifier: Apache-2.0
"""Gagvani01 5 and 6: a body filled again around its moved skeleton, and the way back."""
import json

import numpy as np

import programs
import voxels
from reproduce.gagvani_thin import THRESHOLD
from reproduce.rows import Found, Part, Row, UNKNOWN, folder_of, small_or

POSE = {"hip_right": {"flexion": 50}, "knee_right": {"flexion": 60}, "elbow_left": {"flexion": 70}, "shoulder_right": {"flexion": 40}}
TEN = ("stride_01", "stride_04", "stride_07", "stride_10", "joint_01", "joint_03", "joint_06", "joint_09", "sitting", "reach")


def exact(kit):
    """Every voxel kept fills the object again: nothing is lost, nothing is added."""
    folder, ct = folder_of(kit, "fill"), kit.phantom() / "volumes/ct.nrrd"
    programs.ecorche("thin", ct, *THRESHOLD, "--tp", -2, "-o", folder / "all.vtp")
    programs.ecorche("refill", folder / "all.vtp", "-o", folder / "all.nrrd")
    again = voxels.read(folder / "all.nrrd").values != 0
    scan = voxels.read(ct)
    wrong = int(np.count_nonzero(again != (scan.values >= -500))) if again.shape == scan.values.shape else None
    said = "not on the scan's lattice" if wrong is None else f"{wrong} of {again.size} voxels differ"
    return Row("5.1: refilled with every voxel as a ball", "the object itself", said, "ecorche thin IMAGE --tp -2 -o ALL.vtp",
               "" if wrong == 0 else "Pieces apart from the largest are left out.")


def posed(kit):
    folder, ct = folder_of(kit, "fill"), kit.phantom() / "volumes/ct.nrrd"
    pose = kit.pose("refilled", POSE)
    command = "ecorche refill MODEL ct.nrrd --pose POSE -o posed.nrrd"
    filled = programs.ecorche("refill", kit.model(), ct, "-o", folder / "posed.nrrd", "--pose", pose, "--background", -1024)["frames"][0]
    size = " x ".join(map(str, filled["size"]))
    rows = [exact(kit),
            Row("5: a sampled volume filled in a pose", UNKNOWN, f"{size} voxels in {filled['seconds']:.2f} s, {filled['balls']} balls", command,
                "Balls hang by the tets' weights: by lines between joints, as in the paper, a part of the calf goes with the foot."),
            Row("figures 1, 3, 4, 7 to 10, 12", "what they show is not stated in what we hold", "the built-in patient's CT in a pose", command,
                "The picture stands for the method, not for those figures.")]
    if not kit.draw:
        return Found(rows)
    return Found(rows, kit.render(folder / "posed.nrrd", name="gagvani_posed", suffix="0000", words=("--view", "oblique"),
                                  about="The built-in patient's CT, filled around its moved skeleton"))


def seconds(kit):
    bench = programs.bench("volumetric")
    bench.OUT = folder_of(kit, "refill")
    bench.phantom = lambda: kit.phantom(small_or(kit, "small", "paper"))
    r = bench.refill(None)["refill"]
    command, size = "bench/volumetric/run --only refill", " x ".join(map(str, r["size"]))
    return Found([
        Row("5: 33 630 balls filled with a sampled volume of 290 x 169 x 940", "60 minutes", f"{r['trilinear_s']:.2f} s ({r['balls']} balls, {size} voxels)",
            command, "The built-in patient."),
        Row("5: memory", "three volumes", f"{r['volumes_of_memory']:.1f} posed volumes", command),
    ])


def bent_cylinder(kit):
    test = "Refill.TheBarInABentCylinderStaysWhole"
    programs.call(programs.BIN / "unit_spheres", f"--gtest_filter={test}")  # ends this where it fails
    return Found([Row("figure 6: a bar along a bent cylinder", "with the proximity buffer the bar stays whole",
                      "it stays whole, and breaks where the buffer is left out", f"unit_spheres --gtest_filter={test}", "A test, on a cylinder of our own size.")])


def there_and_back(kit):
    poses, drawn = small_or(kit, ("joint_01", "sitting"), TEN), kit.made / "pictures/back"
    words = ("--poses", ",".join(poses), "--turns", small_or(kit, 1, 2))
    programs.call(programs.ROOT / "bench/unpose/run", kit.model(), *words, *(("--pictures", drawn) if kit.draw else ()))
    mean = json.loads((programs.MADE / "unpose" / kit.model().stem / "summary.json").read_text())
    rows, command = [], "bench/unpose/run MODEL " + " ".join(map(str, words))
    for by in ("spheres", "tets"):
        for volume, (differ, inner) in mean[by].items():
            floor = mean[f"{by} floor"][volume][0]
            rows.append(Row(f"7, figure 11: posed and back by {by}, {volume}", "3.39 % of values differ, \"of these\" 0.82 % off the boundary (of those, or of all)",
                            f"{differ:.2f} % differ, {100 * inner / max(differ, 1e-12):.1f} % of these ({inner:.2f} % of all) off the boundary", command,
                            f"{len(poses)} of our thirty poses, voxels of {small_or(kit, 6, 4)} mm. Turning the whole body there and back alone changes {floor:.1f} %."
                            + (" Worse than theirs: noisy values change wherever they are sampled again." if differ > 3.39 else "")
                            + (" Read as a share of those that differ, more of ours lie off the boundary." if inner > 0.0082 * differ else "")))
    pictures = [drawn / f"{by}_labels_0000.png" for by in ("spheres", "tets")]
    return Found(rows, [kit.row_of(pictures, "gagvani_back", "Figure 11: what differs after sitting down and getting up again, by spheres and by tets: blue on a "
                                   "boundary of labels, green off it")] if kit.draw else [])


PARTS = [
    Part("filling", "Gagvani01", "Filling a posed body (section 5)", posed),
    Part("filling_times", "Gagvani01", "Filling: seconds and memory (section 5)", seconds, benches=("bench_refill",), timed=True),
    Part("cylinder", "Gagvani01", "A bar in a bent cylinder (figure 6)", bent_cylinder),
    Part("back", "Gagvani01", "There and back (figure 11)", there_and_back),
]
