# SPDX-License-Identifier: Apache-2.0
"""Sujar18 4: frames a second over a walk (table 2), the bar (figure 7), and bodies to look at."""
import re

import programs
from reproduce.rows import Found, Part, Row, UNKNOWN, folder_of, small_or

WALK = re.compile(r"(?m)^\| (lbs|dqs|cor) +\| +(\d+) \| +([\d.]+) \| +(\d+) \| +([\d.]+) \| +(\d+) \|")

TITLES = {"lbs": "LBS", "dqs": "DQS", "cor": "CoR"}


def walk_rows(printed):
    """Of bench_runtime's walk: a row a method, with as many threads as it tried."""
    best = {}
    for name, threads, mean, mean_rate, worst, worst_rate in WALK.findall(printed):
        best[name] = (f"mean {mean_rate} a second ({float(mean):.2f} ms), worst {worst_rate} ({float(worst):.2f} ms), {threads} threads")
    if len(best) != 3:
        raise SystemExit(f"error: reproduce: bench_runtime told of {', '.join(best) or 'no method'} (expected lbs, dqs and cor)")
    theirs = {"cor": "mean 60 to 142 a second (7 to 17 ms), worst 50 (20 ms); GTX 770"}
    return [Row(f"table 2: {TITLES[name]}", theirs.get(name, UNKNOWN), best[name], "bench_runtime MODEL --only walk --clip walk.bvh",
                "Processor, not graphics card: drawing is not in it." if name == "cor" else "") for name in ("lbs", "dqs", "cor")]


def table_2(kit):
    size = small_or(kit, "small", "paper")
    case = kit.phantom(size)
    model = kit.made / f"table_1_{size}.hdf"  # table 1's own, where it was made
    if not model.exists():
        programs.ecorche("preprocess", case, "-o", model, "--mesher", "lattice")
    return Found(walk_rows(programs.call(programs.BIN / "bench_runtime", model, "--only", "walk", "--clip", case / "motion/walk.bvh")))


def bar_rows(lines):
    """pose -> method -> [tets %, occupied %, skin %] of what property_bar prints."""
    out, pose = {}, None
    for line in lines:
        words = line.split()
        if "tets %" in line:
            pose = out.setdefault(line.split("  ")[0], {})
        elif pose is not None and line.startswith("  ") and len(words) == 5:
            pose[words[0]] = [float(word) for word in words[1:4]]
    return out


def bar(kit):
    out, tets = folder_of(kit, "bar"), small_or(kit, 60_000, 200_000)
    case, model = out / "case", out / "bar.hdf"
    if not model.exists():
        programs.ecorche("phantom", "-o", case, "--size", kit.phantom_size, "--bar")
        programs.ecorche("preprocess", case, "-o", model, "--mesher", "lattice", "--max-tets", tets)
    env = {"ECORCHE_BAR_MODEL": str(model), "ECORCHE_BAR_OUT": str(out / "posed")}
    found = bar_rows(programs.call(programs.BIN / "property_bar", env=env).splitlines())
    methods, theirs = ("lbs", "dqs", "cor"), "LBS loses, DQS gains, CoR is nearest to rest; no figure is stated in what we hold"
    told = {pose: ", ".join(f"{TITLES[name]} {changes[name][0]:+.2f} %" for name in methods) + " of the tets' volume" for pose, changes in found.items()}
    rows = [Row("figure 7: 100, -100 bent, 135 degrees twisted", theirs, told["100, -100, 135 deg"], "bench/bar/run --pictures",
                "On a bar that is symmetric about its joints DQS keeps volume best; with joints off its middle line, as in a knee, it gains (next row)."),
            Row("figure 7: bent by 100 degrees, joints at the inside", theirs, told["bend 100, axis inside"], "bench/bar/run --pictures")]
    skins = [out / f"posed/{name}_skin.vtp" for name in methods]
    return Found(rows, kit.render(*skins, name="sujar_bar", suffix="row", words=("--view", "side"), about="The bar of figure 7 from the side: LBS, DQS, CoR"))


def shown(kit):
    walk = folder_of(kit, "walk")
    programs.ecorche("pose", kit.model(), "-o", walk, "--motion", kit.phantom() / "motion/walk.bvh", "--frames", "12", "--tissues", "all")
    quality = programs.ecorche("info", kit.model())
    pictures = []
    if kit.draw:
        pictures = kit.render(kit.phantom(), name="sujar_rest", suffix="front", words=("--only", "tissues"),
                              about="The built-in patient as scanned, its skin seen through")
        pictures += kit.render(walk, name="sujar_walk", suffix="side", words=("--only", "tissues"), about="The same in a frame of its walk, by CoR")
    return Found([Row("figures 1, 2, 6, 8, 12, 13, 14", "what they show is not stated in what we hold",
                      f"the built-in patient with {len(quality['tissues'])} surfaces, at rest and in a walk",
                      "ecorche pose MODEL --motion walk.bvh --frames 12 -o DIR",
                      "These pictures stand for the method, not for those figures.")], pictures)


PARTS = [
    Part("posing", "Sujar18", "Frames a second (table 2)", table_2, benches=("bench_runtime",), timed=True),
    Part("bar", "Sujar18", "What blending does to volume (figure 7)", bar),
    Part("shown", "Sujar18", "Bodies (figures 1, 2, 6, 8, 12 to 14)", shown),
]
