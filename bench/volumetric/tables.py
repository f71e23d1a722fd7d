# SPDX-License-Identifier: Apache-2.0
"""The tables and the plot of bench/volumetric/run."""
import math

from table import Table

COLOURS = ["#1b6ca8", "#c44536", "#3a7d44", "#8a4fa0", "#b8860b"]
# What the paper says of a voxel that does not come back, of all object voxels: in all, and off the boundary by both readings of its "of these 0.82 %".
PAPER_DIFFER, PAPER_INNER = 3.39, "0.82 or 0.028"


def row(table, paper, must, here, holds, what):
    table.row(what, paper, must, here, "" if holds is None else "yes" if holds else "NO")


def limit(table, paper, unit, most, value, what, digits=3):
    row(table, paper, f"<= {most:g} {unit}", f"{value:.{digits}f} {unit}", value <= most, what)


def time_rows(table, t):
    size = " x ".join(map(str, t["size"]))
    limit(table, "", "s", 0.12, t["distance"]["median_s"], f"distance transform, exact, {size} voxels, {t['object']} of the object, {t['threads']} threads")
    row(table, "", ">= 8 x", f"{t['vtk']['times_ours']:.1f} x", t["vtk"]["times_ours"] >= 8, f"VTK's ({t['vtk']['best_s']:.2f} s) over ours; {t['vtk']['differing']} squares differ")
    row(table, "", "", f"{t['itk']['times_ours']:.1f} x", None, f"ITK's Maurer ({t['itk']['best_s']:.2f} s) over ours; {t['itk']['differing']} squares differ")
    limit(table, "480 s", "s", 0.4, t["in_all"]["median_s"], f"distances and thinning at TP 0.48: {t['skeletal']} voxels")
    row(table, "", "", f"{t['thinning']['median_s']:.3f} s", None, f"thinning alone at TP 0.48 ({t['thinning_at_another_tp']['median_s']:.3f} s at 0.9)")
    limit(table, "1 s", "ms", 5, 1000 * t["thinner"]["median_s"], f"TP 0.48 out of the {t['thinner']['from_voxels']} voxels of TP {t['thinner']['from_tp']}", 2)
    row(table, "", "", f"{1000 * t['tree']['median_s']:.0f} ms", None, f"skeleton tree of it; <3,4,5> distances {t['chamfer']['median_s']:.3f} s")


def refill_rows(table, figures):
    r, losses = figures["refill"], figures["losses"]
    limit(table, "3600 s", "s", 0.9, r["trilinear_s"], f"refill of {r['balls']} spheres (TP {r['tp']:.2f}), {' x '.join(map(str, r['size']))} sampled, "
          f"trilinear ({r['nearest_s']:.3f} s nearest)")
    limit(table, "3", "", 2.2, r["volumes_of_memory"], "volumes of memory", 2)
    row(table, "", "", f"{1 / r['region_s']:.1f} /s", None, f"256^3 region of it, {r['region_held']} of its voxels held")
    limit(table, "", "s", 2, max(loss["preview_s"] for loss in losses), f"preview mesh, the longest of TP {losses[0]['tp']:.1f} to {losses[-1]['tp']:.1f}")


def region_rows(table, rates):
    for deformer, rate in rates.items():
        row(table, "", ">= 10 /s" if deformer == "spheres" else "", f"{rate:.1f} /s", rate >= 10 if deformer == "spheres" else None,
            f"256^3 region at full resolution in the server, by {deformer}")


def unpose_rows(table, means):
    """means: deformer or its floor -> volume -> [differ %, off the boundary %], of all object voxels."""
    for by, third in (("spheres", 1), ("tets", 3)):
        for volume, (differ, inner) in means.get(by, {}).items():
            floor = means[f"{by} floor"][volume]
            row(table, f"{PAPER_DIFFER} %", f"<= {PAPER_DIFFER / third:.2f} %", f"{differ:.2f} %", differ <= PAPER_DIFFER / third,
                f"pose and un-pose by {by}, {volume}: differ (floor of a turn of the whole {floor[0]:.2f} %)")
            row(table, f"{PAPER_INNER} %", "", f"{inner:.3f} %", None, f"off the boundary, {volume}, of all ({100 * inner / max(differ, 1e-12):.1f} % of those; floor {floor[1]:.3f} %)")


def tear_rows(table, t):
    row(table, "", ">= 95 %", f"{100 * t['found'] / max(t['seeded'], 1):.1f} %", t["found"] >= 0.95 * t["seeded"], f"of {t['seeded']} seeded tears found")
    limit(table, "5 %", "%", 2, t["percent"], f"frames with visible errors: {t['err']} of {t['frames']}", 2)


def curve_rows(table, curves):
    for name, curve in curves.items():
        n, loss = curve["voxels_fit"], curve["loss_fit"]
        row(table, "exponential", "", f"r2 {n['r2']:.3f}", None, f"{name}: {curve['object']} voxels; skeletal {n['a']:.3g} exp({n['b']:.2f} TP); "
            f"loss {loss['a']:.2g} exp({loss['b']:.2f} TP) %, r2 {loss['r2']:.3f}")


def shares(curves):
    print("\nSkeletons with the paper's shares of the object (42298 voxels are 0.33 % of its body, 12.8 million):")
    for name, curve in curves.items():
        table = Table((f"{name}, {curve['object']} voxels: paper", 8), "share %", "TP", "voxels", "loss %", "edges", "touching", "components")
        for at in curve["at_the_papers_shares"]:
            table.row(f"{at['paper']:.0f}", f"{at['share_percent']:.5f}", f"{at['tp']:.3f}", at["voxels"], f"{at['loss_percent']:.3f}", at["edges"], at["touching"],
                      at["components"])


def show(figures):
    table = Table(("figure", 90), ("paper", 14), ("must", 10), ("here", 12), "holds")
    for part, rows in (("times", time_rows), ("refill", refill_rows), ("region", region_rows), ("curves", curve_rows), ("unpose", unpose_rows), ("tears", tear_rows)):
        if part in figures:
            rows(table, figures[part])
    if "curves" in figures:
        shares(figures["curves"])


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
