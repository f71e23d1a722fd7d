#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Thirty stated poses: twelve of a stride, twelve of one joint about half way, six of a whole body. Written as pose files.

The angles are anatomical, in degrees. A joint or an angle that the model does not have is left out; where nothing is left
of a pose (no legs, say), the model's own limited angles take its place, in even steps up to half way from rest to the farther limit:
one alone, or all at once and half as far.
"""
import argparse
import math
import pathlib

import programs


def both(joint, **angles):
    return {f"{joint}_left": angles, f"{joint}_right": angles}


def stride(phase):
    """A walk's angles after phase turns of 2 pi: hips and shoulders swing against each other, knees bend as they come forward."""
    out = {"lumbosacral": {"rotation": 4 * math.cos(phase)}}
    for side, at in (("left", phase), ("right", phase + math.pi)):
        out[f"hip_{side}"] = {"flexion": 8 + 22 * math.cos(at)}
        out[f"knee_{side}"] = {"flexion": 8 + 50 * max(0.0, -math.sin(at))}
        out[f"ankle_{side}"] = {"dorsiflexion": 8 * math.sin(at)}
        out[f"shoulder_{side}"] = {"flexion": -20 * math.cos(at)}
        out[f"elbow_{side}"] = {"flexion": 25 - 10 * math.cos(at)}
    return out


def stated():
    """name -> joint -> angle -> degrees."""
    out = {f"stride_{i + 1:02d}": stride(2 * math.pi * i / 12) for i in range(12)}
    single = [("knee_right", "flexion", 70), ("knee_left", "flexion", 45), ("hip_right", "flexion", 60), ("hip_left", "adduction", -20),
              ("hip_left", "rotation", 25), ("shoulder_right", "flexion", 60), ("shoulder_left", "adduction", -50), ("elbow_right", "flexion", 75),
              ("elbow_left", "flexion", 110), ("wrist_right", "flexion", 40), ("ankle_left", "dorsiflexion", -25),
              ("cervicothoracic", "rotation", 25)]
    out.update({f"joint_{i + 1:02d}": {joint: {angle: value}} for i, (joint, angle, value) in enumerate(single)})
    out["sitting"] = {**both("hip", flexion=80), **both("knee", flexion=85), **both("elbow", flexion=60)}
    out["half_squat"] = {**both("hip", flexion=55), **both("knee", flexion=65), **both("ankle", dorsiflexion=15)}
    out["step_up"] = {"hip_right": {"flexion": 70}, "knee_right": {"flexion": 80}, "elbow_left": {"flexion": 60}}
    out["arms_out"] = both("shoulder", adduction=-80)
    out["reach"] = {"shoulder_right": {"flexion": 85}, "elbow_right": {"flexion": 20}, "thoracolumbar": {"rotation": 10}}
    out["bow"] = {joint: {"flexion": value} for joint, value in
                  (("lumbosacral", 20), ("thoracolumbar", 15), ("cervicothoracic", 10))}
    return out


def own(rig, count):
    """As many poses of the angles of `rig` that have a limit: half of them of one angle alone, half of all at once."""
    ends = {}
    for row in rig:
        for angle in row["angles"]:
            bounds = [limit - angle["rest_deg"] for limit in (angle["min_deg"], angle["max_deg"]) if limit is not None]
            if bounds:
                ends[row["joint"], angle["name"]] = angle["rest_deg"], max(bounds, key=abs) / 2
    out, singles = {}, count - count // 2
    rounds = -(-singles // max(1, len(ends)))
    for i in range(singles if ends else 0):
        (joint, angle), (rest, far) = list(ends.items())[i % len(ends)]
        out[f"single_{i + 1:02d}"] = {joint: {angle: rest + far * (i // len(ends) + 1) / rounds}}
    for i in range(count // 2 if ends else 0):
        pose = out[f"all_{i + 1:02d}"] = {}
        for (joint, angle), (rest, far) in ends.items():
            pose.setdefault(joint, {})[angle] = rest + far / 2 * (i + 1) / (count // 2)
    return out


def rigid(count):
    """Turns of the whole body: about axes spread over the sphere (a golden spiral), by 20 to 160 degrees."""
    out = {}
    for i in range(count):
        z, around = 1 - (2 * i + 1) / count, i * math.pi * (3 - math.sqrt(5))
        flat, half = math.sqrt(1 - z * z), math.radians(20 + 140 * i / max(1, count - 1)) / 2
        axis = (flat * math.cos(around), flat * math.sin(around), z)
        out[f"rigid_{i + 1:02d}"] = [math.cos(half), *(math.sin(half) * a for a in axis)]
    return out


def write(model, folder, rigid_turns=6):
    """Writes the poses that `model` can take, and turns of the whole; returns the names of both."""
    info = programs.ecorche("info", model)
    known = {row["joint"]: {angle["name"] for angle in row["angles"]} for row in info["rig"]}
    head = f"# SPDX-License-Identifier: Apache-2.0\necorche_pose: 1\nskeleton: {info['skeleton']}\n"
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    poses = {name: joints for name, joints in stated().items()
             if any(angle in known.get(joint, ()) for joint, angles in joints.items() for angle in angles)}
    poses.update(own(info["rig"], len(stated()) - len(poses)))
    for name, joints in poses.items():
        lines = ""
        for joint, angles in joints.items():
            kept = ", ".join(f"{angle}_deg: {value:.6g}" for angle, value in angles.items() if angle in known.get(joint, ()))
            lines += f"  {joint}: {{{kept}}}\n" if kept else ""
        (folder / f"{name}.yaml").write_text(f"{head}joints:\n{lines}")
        names.append(name)
    turns = rigid(rigid_turns)
    for name, turn in turns.items():
        (folder / f"{name}.yaml").write_text(f"{head}root: {{rotation: [{', '.join(f'{x:.17g}' for x in turn)}]}}\n")
    return names, list(turns)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=pathlib.Path, help="whose joints they are for")
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path, help="folder of the pose files")
    options = parser.parse_args()
    names, _ = write(options.model, options.output, 0)
    print(f"{len(names)} poses in {options.output}")


if __name__ == "__main__":
    main()
