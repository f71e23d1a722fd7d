# SPDX-License-Identifier: Apache-2.0
"""Sujar18 3: a body prepared. Table 1, the mapping of 3.4, and the tets of figures 3, 4, 5 and 11."""
import programs
from reproduce.rows import Found, Part, Row, UNKNOWN, number, small_or

# What its largest model is, and who measured.
BODY = "2.6 M tets, 1.28 M vertices of tissues, 22 bones; 4 cores of 2013"


def table_1(kit):
    size = small_or(kit, "small", "paper")
    model = kit.made / f"table_1_{size}.hdf"
    report = programs.ecorche("preprocess", kit.phantom(size), "-o", model, "--mesher", "lattice")
    rows = [Row("table 1: its largest body", BODY,
                f"{report['tets'] / 1e6:.2f} M tets, {report['tissues']['vertices'] / 1e6:.2f} M vertices, {report['segments']} segments with bones",
                f"ecorche phantom -o body --size {size}", "The built-in patient: its organs are simpler shapes than a segmented person's.")]
    for title, seconds, peak, theirs in programs.bench("paper").figures(report):
        rows.append(Row(f"table 1: {title}", theirs or UNKNOWN, f"{number(seconds)} s, {peak:.0f} MiB", "bench/paper/run",
                        "Most joints of the built-in patient are given, some are fitted." if title == "rig" else ""))
    return Found(rows)


def mapping(kit):
    model = kit.model()
    found = programs.ecorche("verify", model)
    info = programs.ecorche("info", model)
    rigid = [tissue for tissue in info["tissues"] if tissue["segment"] is not None]
    held, tissues = sum(tissue["vertices"] for tissue in rigid), found["tissues"]
    command = "ecorche verify MODEL"
    theirs = "three ways (which ones is not stated in what we hold)"
    return Found([
        Row("3.4: a vertex within a tet", theirs, f"{tissues['vertices'] - held - tissues['outside']} of {tissues['vertices']}: barycentric coordinates", command),
        Row("3.4: a vertex outside of all tets", theirs,
            f"{tissues['outside']}, at most {tissues['max_outside_mm']:.1f} mm away: the affine map of the nearest tet", command,
            "The mesh cuts corners of the skin; finer meshes leave fewer outside."),
        Row("3.4: a vertex of a bone", theirs, f"{held}: moved by its segment, rigid within {found['bones']['rigidity']:.0e} mm", command),
    ])


def tets(kit):
    if not kit.draw:
        return Found([tets_row(kit)])
    out = kit.made / "pictures"
    programs.call(programs.ROOT / "scripts/render", kit.model(), "-o", out, "--name", "tets", "--height", 800, "--only", "tets", "--segment", "thigh_right")
    pictures = [kit.keep(out / f"tets_tets_{key}.png", f"sujar_tets_{key.split('_')[0]}", about) for key, about in
                (("label", "Tets of the built-in patient cut through the bones: what each is of"), ("owner", "The same, by the segment that owns it"),
                 ("weight_thigh_right", "The same, by the weight of the right thigh: 1 in its bone, falling to 0 in others"))]
    return Found([tets_row(kit)], pictures)


def tets_row(kit):
    found = programs.ecorche("verify", kit.model())
    mesh = found["mesh"]
    return Row("figures 3, 4, 5, 11: tets by label, by segment, by a weight", "pictures of its own body; figures of quality are not stated in what we hold",
               f"{found['tets']} tets, {mesh['inverted']} inverted, {mesh['min_dihedral_deg']:.0f} to {mesh['max_dihedral_deg']:.0f} degrees; "
               f"weights {found['weights']['min']:.1e} to {found['weights']['max']:g}, {found['weights']['repaired_rows']} rows repaired",
               "scripts/render MODEL --only tets -o DIR", "Another body; which mesher theirs are by is not stated in what we hold.")


PARTS = [
    Part("preparing", "Sujar18", "Preparing a body (table 1)", table_1, timed=True),
    Part("mapping", "Sujar18", "Mapping tissues to tets (section 3.4)", mapping),
    Part("tets", "Sujar18", "Tets and weights (figures 3, 4, 5, 11)", tets),
]
