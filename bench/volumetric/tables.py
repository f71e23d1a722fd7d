# SPDX-License-Identifier: Apache-2.0
"""The table and the plot of bench/volumetric/run."""
import math

COLOURS = ["#1b6ca8", "#c44536", "#3a7d44", "#8a4fa0", "#b8860b"]
# What the paper says of a voxel that does not come back, of all object voxels: in all, and off the boundary by both readings of its "of these 0.82 %".
PAPER_DIFFER, PAPER_INNER = 3.39, "0.82 or 0.028"


def row(paper, must, here, holds, what):
    verdict = "" if holds is None else "yes" if holds else "NO"
    print(f"{paper:>14} {must:>12} {here:>13} {verdict:>5}  {what}")


def limit(paper, unit, most, value, what, digits=3):
    row(paper, f"<= {most:g} {unit}", f"{value:.{digits}f} {unit}", value <= most, what)


def time_rows(t):
    size = " x ".join(map(str, t["size"]))
    limit("", "s", 0.12, t["distance"]["median_s"], f"distance transform, exact, {size} voxels, {t['object']} of the object, {t['threads']} threads")
    row("", ">= 8 x", f"{t['vtk']['times_ours']:.1f} x", t["vtk"]["times_ours"] >= 8, f"VTK's ({t['vtk']['best_s']:.2f} s) over ours; {t['vtk']['differing']} squares differ")
    row("", "", f"{t['itk']['times_ours']:.1f} x", None, f"ITK's Maurer ({t['itk']['best_s']:.2f} s) over ours; {t['itk']['differing']} squares differ")
    limit("480 s", "s", 0.4, t["in_all"]["median_s"], f"distances and thinning at TP 0.48: {t['skeletal']} voxels")
    row("", "", f"{t['thinning']['median_s']:.3f} s", None, f"thinning alone at TP 0.48 ({t['thinning_at_another_tp']['median_s']:.3f} s at 0.9)")
    limit("1 s", "ms", 5, 1000 * t["thinner"]["median_s"], f"TP 0.48 out of the {t['thinner']['from_voxels']} voxels of TP {t['thinner']['from_tp']}", 2)
    row("", "", f"{1000 * t['tree']['median_s']:.0f} ms", None, f"skeleton tree of it; <3,4,5> distances {t['chamfer']['median_s']:.3f} s")


def refill_rows(figures):
    r, losses = figures["refill"], figures["losses"]
    limit("3600 s", "s", 0.9, r["trilinear_s"], f"refill of {r['balls']} spheres (TP {r['tp']:.2f}), {' x '.join(map(str, r['size']))} sampled, "
          f"trilinear ({r['nearest_s']:.3f} s nearest)")
    limit("3", "", 2.2, r["volumes_of_memory"], "volumes of memory", 2)
    row("", "", f"{1 / r['region_s']:.1f} /s", None, f"256^3 region of it, {r['region_held']} of its voxels held")
    limit("", "s", 2, max(loss["preview_s"] for loss in losses), f"preview mesh, the longest of TP {losses[0]['tp']:.1f} to {losses[-1]['tp']:.1f}")


def region_rows(rates):
    for deformer, rate in rates.items():
        row("", ">= 10 /s" if deformer == "spheres" else "", f"{rate:.1f} /s", rate >= 10 if deformer == "spheres" else None,
            f"256^3 region at full resolution in the server, by {deformer}")


def unpose_rows(means):
    """means: deformer or its floor -> volume -> [differ %, off the boundary %], of all object voxels."""
    for by, third in (("spheres", 1), ("tets", 3)):
        for volume, (differ, inner) in means.get(by, {}).items():
            floor = means[f"{by} floor"][volume]
            row(f"{PAPER_DIFFER} %", f"<= {PAPER_DIFFER / third:.2f} %", f"{differ:.2f} %", differ <= PAPER_DIFFER / third,
                f"pose and un-pose by {by}, {volume}: differ (floor of a turn of the whole {floor[0]:.2f} %)")
            row(f"{PAPER_INNER} %", "", f"{inner:.3f} %", None, f"  off the boundary, of all ({100 * inner / max(differ, 1e-12):.1f} % of those; floor {floor[1]:.3f} %)")


def tear_rows(t):
    row("", ">= 95 %", f"{100 * t['found'] / max(t['seeded'], 1):.1f} %", t["found"] >= 0.95 * t["seeded"], f"of {t['seeded']} seeded tears found")
    limit("5 %", "%", 2, t["percent"], f"frames with visible errors: {t['err']} of {t['frames']}", 2)


def curve_rows(curves):
    for name, curve in curves.items():
        n, loss = curve["voxels_fit"], curve["loss_fit"]
        row("exponential", "", f"r2 {n['r2']:.3f}", None, f"{name}: {curve['object']} voxels; skeletal {n['a']:.3g} exp({n['b']:.2f} TP); "
            f"loss {loss['a']:.2g} exp({loss['b']:.2f} TP) %, r2 {loss['r2']:.3f}")


def shares(curves):
    print("\nskeletons with the paper's shares of the object (42298 voxels are 0.33 % of its body, 12.8 million):")
    for name, curve in curves.items():
        print(f"{name}, {curve['object']} voxels\n{'paper':>8}{'share %':>10}{'TP':>8}{'voxels':>8}{'loss %':>9}{'edges':>8}{'touching':>10}{'components':>12}")
        for at in curve["at_the_papers_shares"]:
            print(f"{at['paper']:8.0f}{at['share_percent']:10.5f}{at['tp']:8.3f}{at['voxels']:8d}{at['loss_percent']:9.3f}{at['edges']:8d}{at['touching']:10d}{at['components']:12d}")


def show(figures):
    print(f"{'paper':>14} {'must':>12} {'here':>13} {'holds':>5}  figure")
    for part, rows in (("times", time_rows), ("refill", refill_rows), ("region", region_rows), ("curves", curve_rows), ("unpose", unpose_rows), ("tears", tear_rows)):
        if part in figures:
            rows(figures[part])
    if "inputs" in figures:
        inputs(figures["inputs"])
    if "curves" in figures:
        shares(figures["curves"])


def inputs(bodies):
    print(f"\n{'input':<20}{'voxels':>22}{'edge mm':>9}{'object':>10}{'skeletal':>9}{'loss %':>8}{'thin s':>8}{'pose':>14}{'refill s':>9}{'back s':>8}"
          f"{'differ %':>10}{'inner %':>9}{'floor %':>9}{'inner %':>9}")
    for body in bodies:
        for n, pose in enumerate(body["poses"]):
            size = " x ".join(map(str, body["size"]))
            head = (f"{body['name']:<20}{size:>22}{body['voxel_mm']:>9.3f}{body['object']:>10}{body['skeletal']:>9}{body['loss_percent']:>8.2f}"
                    f"{body['thin_s']:>8.2f}") if n == 0 else " " * 86
            print(f"{head}{pose['name']:>14}{pose['refill_s']:>9.2f}{pose['back_s']:>8.2f}{pose['differ']:>10.3f}{pose['inner']:>9.4f}"
                  f"{body['floor']['differ']:>9.3f}{body['floor']['inner']:>9.4f}")


def plot(curves, path):
    """Skeletal voxels and loss along TP, both on logarithmic axes, with their exponential fits as lines."""
    width, height, left, bottom, top = 1180, 470, 70, 50, 24
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">',
           f'<rect width="{width}" height="{height}" fill="white"/>']
    panels = (("voxels_against_tp", "voxels_fit", "skeletal voxels", 0, 7, lambda p: f"10^{p}"),
              ("loss_against_tp", "loss_fit", "loss, % of the object", -2, 2, lambda p: f"{10.0 ** p:g}"))
    for panel, (values, fit, title, low, high, label) in enumerate(panels):
        x0, x1 = left + panel * width / 2, (panel + 1) * width / 2 - 16
        x = lambda tp: x0 + (x1 - x0) * tp / 1.1
        y = lambda value: height - bottom - (height - bottom - top) * (math.log10(value) - low) / (high - low)
        for power in range(low, high + 1):
            svg.append(f'<line x1="{x0}" x2="{x1}" y1="{y(10.0 ** power):.1f}" y2="{y(10.0 ** power):.1f}" stroke="#ddd"/>'
                       f'<text x="{x0 - 8}" y="{y(10.0 ** power) + 4:.1f}" text-anchor="end">{label(power)}</text>')
        for tenth in range(0, 12, 2):
            svg.append(f'<text x="{x(tenth / 10):.1f}" y="{height - bottom + 18}" text-anchor="middle">{tenth / 10}</text>')
        svg.append(f'<text x="{(x0 + x1) / 2}" y="{height - 10}" text-anchor="middle">thinness TP, voxels</text>'
                   f'<text x="{x0 - 52}" y="{height / 2}" transform="rotate(-90 {x0 - 52} {height / 2})" text-anchor="middle">{title}</text>')
        for n, (name, curve) in enumerate(curves.items()):
            colour, line = COLOURS[n % len(COLOURS)], curve[fit]
            ends = [tp for tp, value in curve[values] if line["from"] <= value <= line["to"]]
            points = " ".join(f"{x(tp):.1f},{y(max(10.0 ** low, min(10.0 ** high, line['a'] * math.exp(line['b'] * tp)))):.1f}" for tp in (ends[0], ends[-1]))
            svg.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-dasharray="5 4"/>')
            svg += [f'<circle cx="{x(tp):.1f}" cy="{y(value):.1f}" r="3.2" fill="{colour}"/>' for tp, value in curve[values] if value >= 10.0 ** low]
            svg.append(f'<text x="{x1 - 6 if panel == 0 else x0 + 10}" y="{top + 14 + 18 * n}" text-anchor="{"end" if panel == 0 else "start"}" fill="{colour}">'
                       f'{name}: {line["a"]:.2g} exp({line["b"]:.1f} TP)</text>')
    path.write_text("\n".join(svg) + "\n</svg>\n")
