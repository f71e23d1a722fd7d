# SPDX-License-Identifier: Apache-2.0
"""Gagvani01 3 and 4: thinning, the tree, and what hangs on what."""
import json
import math

import numpy as np

import programs
from reproduce.rows import Found, Part, Row, UNKNOWN, folder_of, number, small_or

THRESHOLD = ("--threshold=-500:", "--largest", "--isotropic", 0)
SCAN = "290 x 169 x 940 voxels"


def skeleton(kit):
    """The phantom's CT, thinned at a low TP, hung on the phantom's rig."""
    out = folder_of(kit, "thin") / "thick.vtp"
    if not out.exists():
        programs.ecorche("thin", kit.phantom() / "volumes/ct.nrrd", *THRESHOLD, "--tp", 0.2, "--tree", "--model", kit.model(), "-o", out)
    return out


def thinner(kit, tp, *words):
    out = folder_of(kit, "thin") / f"tp_{tp:.2f}.vtp"
    return out, programs.ecorche("thin", skeleton(kit), "--tp", tp, *words, "-o", out)


def exponential(points):
    """(a, b, r2) of value = a exp(b tp), by least squares over logarithms."""
    tp, value = np.array(points, float).T
    b, level = np.polyfit(tp, np.log(value), 1)
    return math.exp(level), b, np.corrcoef(tp, np.log(value))[0, 1] ** 2


def against_tp(kit):
    """Figure 5: voxels, and what is lost of the object, along TP."""
    mask = folder_of(kit, "thin") / "object.nrrd"
    made = programs.ecorche("thin", kit.phantom() / "volumes/ct.nrrd", *THRESHOLD, "--tp", -2, "-o", mask.with_suffix(".vtp"))
    programs.ecorche("refill", mask.with_suffix(".vtp"), "-o", mask)
    voxels, loss = [], []
    for step in range(2, small_or(kit, 4, 9)):
        tp = 0.1 * step
        file, found = thinner(kit, tp)
        voxels.append((tp, found["skeletal"]))
        lost = programs.ecorche("refill", file, "-o", file.with_suffix(".nrrd"), "--object", mask)["loss"]["loss_percent"]
        if lost > 0:
            loss.append((tp, lost))
    return made["voxels"]["object"], voxels, loss


def curves(kit):
    thing, voxels, loss = against_tp(kit)
    command = "ecorche thin SKELETON.vtp --tp TP -o THINNER.vtp"
    rows = []
    for where, points, unit in (("figure 5: skeletal voxels against TP", voxels, ""), ("figure 5: loss against TP", loss, " %")):
        a, b, r2 = exponential(points) if len(points) > 1 else (float("nan"),) * 3
        rows.append(Row(where, "three curves, exponential; values are not stated in what we hold",
                        f"{a:.2g} exp({b:.1f} TP){unit}, r2 {r2:.2f}, TP {points[0][0]:.1f} to {points[-1][0]:.1f}", command,
                        f"The built-in patient, {number(thing)} voxels; one curve; of which objects theirs are is not stated in what we hold."))
    tree = thinner(kit, 0.48, "--tree")[1]
    share = 100 * tree["skeletal"] / thing
    rows.append(Row("4: skeletal voxels of the body",
                    "42 298, 0.33 % of the object; 33 630 refilled; of what 9666, 3980, 1017 and 231 are is not stated in what we hold",
                    f"{tree['skeletal']} at TP 0.48, {share:.2f} %", command, "bench/volumetric/run --data DIR sets ours at equal shares beside each of them."))
    rows.append(Row("3.3: edges of the tree", "about 20 000", f"{tree['tree']['edges']} in {tree['tree']['components']} pieces, alpha {tree['tree']['alpha']:g}",
                    "ecorche thin IMAGE --tree -o SKELETON.vtp", "Fewer voxels, so fewer edges; the paper's alpha is 0.7 to 0.95."))
    pictures = kit.render(thinner(kit, 0.48, "--tree")[0], name="gagvani_skeleton", suffix="skeleton_front",
                          about="Figure 2: the skeletal voxels by the segment that they hang on, and their tree")
    return Found(rows, pictures)


def hung(kit):
    made = programs.ecorche("thin", kit.phantom() / "volumes/ct.nrrd", *THRESHOLD, "--tp", 0.48, "--tree", "--model", kit.model(),
                            "-o", folder_of(kit, "thin") / "hung.vtp")
    alone = made["attached"]
    return Found([Row("4, figure 2: skeletal voxels hung on a skeleton of joints", "about 25 joints picked by hand",
                      f"{len(made['segments'])} segments of the fitted rig; {alone['first_pass']} voxels by what they see, {alone['second_pass']} along the tree",
                      "ecorche thin IMAGE --tree --model MODEL -o SKELETON.vtp", "Joints come from the bones; picked ones are taken, too (--picks).")])


def times(kit):
    scan = kit.phantom() / "volumes/ct.nrrd"
    t = json.loads(programs.call(programs.BIN / "bench_volumetric", "times", "paper", "-500", scan))
    command = "bench/volumetric/run --only times"
    size = " x ".join(map(str, t["size"]))
    return Found([
        Row(f"3: distances and thinning at TP 0.48, {SCAN}", "480 s", f"{t['in_all']['median_s']:.2f} s, {size}, {t['skeletal']} skeletal voxels", command,
            "The built-in patient stretched to their size."),
        Row("3: a thinner skeleton out of one that is there", "under 1 s", f"{1000 * t['thinner']['median_s']:.1f} ms, of {t['thinner']['from_voxels']} voxels",
            command),
        Row("3.1: distances alone", UNKNOWN,
            f"{t['distance']['median_s']:.3f} s exact; VTK {t['vtk']['times_ours']:.0f} times, ITK {t['itk']['times_ours']:.0f} times as long", command),
    ])


PARTS = [
    Part("thinning", "Gagvani01", "Thinning (sections 3 and 4; figure 5)", curves),
    Part("hanging", "Gagvani01", "Voxels on joints (section 4; figure 2)", hung),
    Part("thinning_times", "Gagvani01", "Thinning: seconds (section 3)", times, benches=("bench_volumetric",), timed=True),
]
