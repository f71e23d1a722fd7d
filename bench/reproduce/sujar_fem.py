# SPDX-License-Identifier: Apache-2.0
"""Sujar18 figure 9: CoR beside finite elements."""
import json

import programs
from reproduce.rows import Found, Part, Row, folder_of, small_or

ELBOW, KNEE = ("elbow_left", 60), ("knee_left", 45)

NOTES = {"corotational": "The paper's own material; it softens under pressure and does not resist inversion.", "stable_neo_hookean": "Not the paper's material."}


def solved(kit, joint, degrees, material):
    """What fem.json says of one joint turned, and the folder of its surfaces."""
    out = folder_of(kit, "fem") / f"{joint}_{degrees}_{material}"
    pose = kit.pose(f"{joint}_{degrees}", {joint: {"flexion": degrees}})
    # One start: half of the time. That two starts agree is asked by bench/fem.
    programs.ecorche("fem", kit.model(spheres=False), "-o", out, "--pose", pose, "--material", material, "--one-start", "--tissues", "all")
    return json.loads((out / "fem.json").read_text()), out


def row(kit, joint, degrees, material):
    fem, out = solved(kit, joint, degrees, material)
    to, ended = fem["to_cor"], "" if fem["converged"] else "did not converge; "
    return Row(f"figure 9: {joint.replace('_', ' ')} {degrees} degrees, {material.replace('_', '-')}",
               "CoR shown beside a co-rotational solution; no figure is stated in what we hold",
               f"{ended}CoR is {to['mean_mm']:.1f} mm from it (95 % within {to['p95_mm']:.1f}, most {to['max_mm']:.1f}); {fem['inverted_tets']} inverted, "
               f"volume {100 * fem['volume_change']:+.2f} %", f"ecorche fem MODEL --pose POSE --material {material} --one-start -o DIR",
               NOTES[material] + (" Tets are inside out: not a solution to trust." if fem["inverted_tets"] else "")), out


def figure_9(kit):
    rows, shown = [], None
    for joint, degrees in small_or(kit, [(ELBOW[0], 30)], [ELBOW, KNEE]):
        for material in ("corotational", "stable_neo_hookean"):
            found, out = row(kit, joint, degrees, material)
            rows.append(found)
        shown = shown or (joint, degrees, out)  # the last material's
    joint, degrees, fem = shown
    if not kit.draw:
        return Found(rows)
    cor = folder_of(kit, "fem") / f"{joint}_{degrees}_cor"
    programs.ecorche("pose", kit.model(spheres=False), "-o", cor, "--pose", kit.made / f"{joint}_{degrees}.yaml", "--tissues", "all")
    place = next(row["center_mm"] for row in programs.ecorche("info", kit.model(spheres=False))["rig"] if row["joint"] == joint)
    around = f"--around={','.join(f'{value:.1f}' for value in (*place, 260))}"
    files = []
    for body in (cor, fem):
        programs.call(programs.ROOT / "scripts/render", body, "-o", kit.made / "pictures", "--name", body.name, "--view", "oblique", "--height", 700, around)
        files.append(kit.made / f"pictures/{body.name}_oblique.png")
    about = f"The {joint.split('_')[0]} turned by {degrees} degrees: CoR at the left, stable neo-Hookean finite elements at the right"
    return Found(rows, [kit.row_of(files, "sujar_fem", about)])


PARTS = [Part("fem", "Sujar18", "Beside finite elements (figure 9)", figure_9)]
