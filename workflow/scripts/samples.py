# SPDX-License-Identifier: Apache-2.0
"""A training set from one body: poses drawn within the limits of its joints, and what each looks like.

Sample i of a participant depends on the seed, the participant and i alone: more samples leave those before as they are, and a run that was
killed goes on where it was. A sample's folder appears whole.
"""
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import random
import shutil

import record

DEGREES = 2  # decimals
WORDS = ["--tissues", "none", "--volumes", "all", "--field", "--volume-format", "nii.gz"]  # of `ecorche pose`


def draw(rig, seed, participant, index, reach):
    """{joint: {angle: degrees}}: uniform between rest and each limit, `reach` of the way at most. Angles without limits, and joints that
    others lead, stay at rest."""
    numbers = random.Random(f"{seed}:{participant}:{index}")
    pose = {}
    for joint in rig:
        for angle in joint["angles"]:
            at = numbers.random()  # always one an angle, so that no joint's draw depends on another's limits
            low, high, rest = angle["min_deg"], angle["max_deg"], angle["rest_deg"]
            if joint["coupled"] or low is None or high is None or not (math.isfinite(low) and math.isfinite(high)) or high <= low:
                continue
            low, high = rest + reach * (min(low, rest) - rest), rest + reach * (max(high, rest) - rest)
            pose.setdefault(joint["joint"], {})[angle["name"]] = round(low + at * (high - low), DEGREES)
    return pose


def as_yaml(skeleton, pose):
    lines = ["ecorche_pose: 1", f"skeleton: {skeleton}", "joints:"]
    lines += [f"  {joint}: {{{', '.join(f'{angle}_deg: {value}' for angle, value in angles.items())}}}" for joint, angles in pose.items()]
    return "\n".join(lines) + "\n"


def landmark_names(path):
    """Of its points, in their order, as `ecorche probe` reads the file; none where no column is called name."""
    lines = [line.strip() for line in path.read_text(encoding="utf-8").splitlines()]
    rows = list(csv.reader([line for line in lines if line and line[0] != "#"], skipinitialspace=True))
    head = [cell.strip() for cell in rows[0]] if rows else []
    at = head.index("name") if "name" in head else None
    return [] if at is None else [row[at].strip() if at < len(row) else "" for row in rows[1:]]


def put_names(path, names):
    """In front of what `ecorche probe` wrote, which has none."""
    rows = list(csv.reader(path.read_text().splitlines()))
    with open(path, "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([name, *row] for name, row in zip(["name", *names], rows, strict=True))


def make(step):
    given, folder = step.given, step.folder / "samples"
    info = step.call("info", "model.hdf")
    key = {"model": info["identity"], "program": given["program"], "seed": given["seed"], "reach": given["reach"], "views": given["views"],
           "words": given["words"], "landmarks": given["landmarks"] and given["landmarks"]["sha256"]}
    folder.mkdir(exist_ok=True)
    record.write_text(folder / "joints.csv", "joint,x,y,z\n" + "".join(
        f"{joint['joint']},{','.join(format(mm, '.6g') for mm in joint['center_mm'])}\n" for joint in info["rig"]))
    def drawn(index):
        pose = draw(info["rig"], given["seed"], step.options.participant, index, given["reach"])
        return one(step, folder, f"{index:05d}", {**key, "index": index}, info["skeleton"], pose, given)

    # Side by side: one sample has too little to do for several threads.
    with concurrent.futures.ThreadPoolExecutor(step.options.threads) as pool:
        making = [pool.submit(drawn, index) for index in range(given["count"])]
        try:
            rows = [one.result() for one in making]
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    names = {row["sample"] for row in rows}
    for path in folder.iterdir():
        if path.is_dir() and path.name not in names:
            shutil.rmtree(path)
    record.write_text(folder / "manifest.json", json.dumps({"ecorche_samples": 1, "participant": step.options.participant, **key, "samples": rows},
                                                           indent=1, sort_keys=True) + "\n")
    return ["samples"], {"samples": len(rows)}


def one(step, folder, name, key, skeleton, pose, given):
    done, part = folder / name, folder / f".part-{name}"
    try:
        kept = json.loads((done / "sample.json").read_text())
        if kept["key"] == key and all((done / file["file"]).stat().st_size == file["bytes"] for file in kept["files"]):
            return kept["row"] | {"files": kept["files"]}
    except (OSError, ValueError, KeyError, TypeError):
        pass
    for path in (done, part):
        shutil.rmtree(path, ignore_errors=True)
    drawn = folder / f".{name}.yaml"
    record.write_text(drawn, as_yaml(skeleton, pose))
    step.call("pose", "model.hdf", "-o", part, "--pose", drawn, *given["words"], threads=1)
    step.call("probe", "model.hdf", "--points", folder / "joints.csv", "-o", part / "joints.csv", "--pose", drawn, "--direction", "rest-to-posed",
              "--volumes", "none", threads=1)
    if given["landmarks"]:
        points = pathlib.Path(given["landmarks"]["file"])
        step.call("probe", "model.hdf", "--points", points, "-o", part / "landmarks.csv", "--pose", drawn, "--direction", "rest-to-posed",
                  "--volumes", "none", threads=1)
        if names := landmark_names(points):
            put_names(part / "landmarks.csv", names)
    for view in given["views"]:
        step.call("radiograph", "model.hdf", "-o", part / f"{view}.png", "--pose", drawn, "--view", view, threads=1)
    quality = json.loads((part / "quality.json").read_text())
    row = {"sample": name, "angles_deg": pose, "verdict": quality["verdict"], "inverted_share": quality["inverted_share"],
           "volume_change": quality["volume_change"]}
    files = [{"file": path.name, "bytes": path.stat().st_size, "sha256": record.sha256(path)} for path in sorted(part.iterdir())]
    record.write_text(part / "sample.json", json.dumps({"key": key, "row": row, "files": files}, sort_keys=True) + "\n")
    drawn.unlink()
    os.rename(part, done)
    return row | {"files": files}
