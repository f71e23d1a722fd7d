# SPDX-License-Identifier: Apache-2.0
"""A participant's figures and poses, from what the commands wrote."""
import json

FIGURES = {  # name: how to find it in preprocess.json
    "tets": lambda m: m["tets"], "nodes": lambda m: m["nodes"], "segments": lambda m: m["segments"],
    "weight_min": lambda m: m["weights"]["min"], "weight_max": lambda m: m["weights"]["max"],
    "row_sum_error": lambda m: m["weights"]["row_sum_error"], "repaired_rows": lambda m: m["weights"]["repaired_rows"],
    "min_dihedral_deg": lambda m: m["mesh"]["min_dihedral_deg"], "max_outside_mm": lambda m: m["tissues"]["max_outside_mm"],
    "joint_confidence": lambda m: min((fit["confidence"] for fit in m["rig"]), default=1),
}
QUALITY = ["verdict", "inverted_tets", "inverted_rest_mm3", "inverted_share", "min_det_f", "volume_change", "unsigned_volume_change",
           "bone_rigidity_mm", "warnings", "clamped"]


def read(path):
    return json.loads(path.read_text(encoding="utf-8"))


def pose_rows(folder, name):
    """One row, or one a frame where the pose was a motion."""
    posed = folder / "posed" / name
    frames = [posed] if (posed / "quality.json").is_file() else sorted(path for path in posed.iterdir() if (path / "quality.json").is_file())
    for frame in frames:
        quality = read(frame / "quality.json")
        row = {key: quality[key] for key in QUALITY}
        worst = quality["warnings"][0]["what"] if quality["warnings"] else ""
        yield {"pose": name if frame == posed else f"{name}/{frame.name}", **row, "warnings": len(quality["warnings"]),
               "clamped": len(quality["clamped"]), "worst": worst}


def of(folder, participant, after, before):
    failed = next((record for record in before if not record["ok"]), None)
    out = {"participant": participant, "ok": failed is None, "failed": None, "figures": {}, "least_joint": "", "warnings": [], "poses": [], "left_out": [],
           "repaired": (folder / "mended").is_dir()}
    if failed:
        out["failed"] = {"step": failed["step"], "fault": failed["fault"], **failed["error"]}
        return out
    made = read(folder / "preprocess.json")
    out["figures"] = {name: find(made) for name, find in FIGURES.items()}
    out["least_joint"] = min(made["rig"], key=lambda fit: fit["confidence"])["joint"] if made["rig"] else ""
    out["warnings"] = made["warnings"]
    for name, record in zip(after, before):
        if name.startswith("pose-"):
            pose, why = name.partition("-")[2], record["facts"].get("left_out")
            out["left_out"] += [{"pose": pose, "why": why}] if why else []
            out["poses"] += [] if why else pose_rows(folder, pose)
    return out


def quality_table(rows):
    names = ["pose", *QUALITY, "worst"]
    cell = lambda value: format(value, ".9g") if isinstance(value, float) else str(value).replace("\t", " ").replace("\n", " ")  # noqa: E731
    return "".join("\t".join(row) + "\n" for row in [names, *([cell(row[name]) for name in names] for row in rows)])
