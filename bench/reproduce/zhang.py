# SPDX-License-Identifier: Apache-2.0
"""The measures of Zhang, Zhao and Unberath 2026 (arXiv 2607.02156): a scaffold's distance to the skin, bones within it, radiographs.

Their scaffold is a template that was fitted to the patient; ours is the patient's own tets. What we hold of them is their abstract, so how each
measure is defined there in detail is not known: ours is said here.
"""
import pathlib

import numpy as np

import programs
from reproduce import surfaces
from reproduce.rows import Found, Part, Row, folder_of, small_or

POSES = ("lib:sitting", "lib:arms_up", "lib:lithotomy")
TWICE = " Below theirs, in one pose at least; a place that the skin encloses twice, where parts overlap, counts as outside."
BODIES = ("bodyparts3d", "icrp110_female", "visible_human_male", "right_leg", "arm", "knee")


def posed(model, out, bones, *words):
    programs.ecorche("pose", model, "-o", out, "--tissues", ",".join(("skin", *bones)), "--format", "stl", *words)
    return out


def enclosed(folder, bones):
    """The share of bones' vertices that lie within the skin of a posed folder."""
    skin = surfaces.read(folder / "skin.stl")
    points = np.concatenate([surfaces.some_vertices(folder / f"{bone}.stl") for bone in bones])
    return float(surfaces.inside(points, skin).mean())


def shape_rows(kit, name, model, poses):
    """Chamfer distance and enclosure of one body, as scanned and in poses."""
    info = programs.ecorche("info", model)
    bones = [tissue["name"] for tissue in info["tissues"] if tissue["group"] == "bone"]
    out = folder_of(kit, "zhang") / name
    rest = kit.made / "rest.yaml"
    rest.write_text(f"ecorche_pose: 1\nskeleton: {info['skeleton']}\n")
    posed(model, out, bones, "--pose", rest, "--tets")
    there, back = surfaces.apart(surfaces.boundary(out / "body.vtu"), surfaces.read(out / "skin.stl"))
    held = enclosed(out, bones)
    rows = [Row(f"{name}: scaffold to skin, chamfer", "15.8 ± 4.0 mm, three subjects", f"{(there + back) / 2:.2f} mm (to the skin {there:.2f}, from it {back:.2f})",
                "ecorche pose MODEL --tets --tissues skin -o DIR",
                "Nothing is fitted here: our scaffold is made from the same skin, theirs is a template. Mean of both ways."),
            Row(f"{name}: bones within the skin, as scanned", "95.9 ± 1.8 %", f"{100 * held:.1f} % of their vertices",
                "ecorche pose MODEL --tissues all -o DIR",
                "Bones and skin are of one scan." + (" Below theirs; in a part of a body bones end where the skin is cut." if held < 0.959 else ""))]
    shares = {pose: enclosed(posed(model, out, bones, "--pose", pose), bones) for pose in poses}
    said = ", ".join(f"{pathlib.Path(str(pose).split(':')[-1]).stem.replace('_', ' ')} {100 * share:.1f} %" for pose, share in shares.items())
    return rows + [Row(f"{name}: bones within the skin, posed", "94.4 % over unseen poses", said, "ecorche pose MODEL --pose POSE --tissues all -o DIR",
                       "Poses are ours." + (TWICE if min(shares.values()) < 0.944 else ""))]


def radiograph(kit, model, view, *words):
    """Line integrals of attenuation, from 0 on."""
    from PIL import Image  # with the packages of the tests

    out = folder_of(kit, "zhang") / f"{view}{'_surfaces' if words else ''}.png"
    pixels = small_or(kit, 128, 512)
    programs.ecorche("radiograph", model, "-o", out, "--view", view, "--size", "700,1900", "--sid", 6000, "--pixels", f"{pixels // 2},{pixels}",
                     "--window", "0,12", *words)
    return out, np.asarray(Image.open(out), float) / 65535


def alike(a, b, edge=0):
    """SSIM (Wang04: Gaussian of 1.5 pixels, k of 0.01 and 0.03) and PSNR in dB of two pictures from 0 to 1. `edge` pixels are left out of SSIM."""
    from scipy.ndimage import gaussian_filter

    mean = lambda x: gaussian_filter(x, 1.5, truncate=10 / 3)  # noqa: E731
    ma, mb, c1, c2 = mean(a), mean(b), 0.01 ** 2, 0.03 ** 2
    va, vb, ab = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    ssim = ((2 * ma * mb + c1) * (2 * ab + c2)) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
    error = float(np.mean((a - b) ** 2))
    return float(ssim[edge:len(ssim) - edge, edge:ssim.shape[1] - edge].mean()), 10 * np.log10(1 / error) if error else float("inf")


def radiographs(kit):
    model, rows, shown = kit.model(), [], []
    for view in ("ap", "lateral_left"):
        (scan, a), (made, b) = radiograph(kit, model, view), radiograph(kit, model, view, "--surfaces")
        ssim, psnr = alike(a, b)
        shown += [scan, made]
        rows.append(Row(f"radiographs, recomposed as scanned, {view.replace('_', ' ')}", "SSIM 0.872 ± 0.016, PSNR 18.5 ± 1.4 dB",
                        f"SSIM {ssim:.3f}, PSNR {psnr:.1f} dB", f"ecorche radiograph MODEL --view {view} --surfaces -o made.png",
                        "The built-in patient: its CT was made from the same surfaces, so a real one would be less alike."))
    rows.append(Row("radiographs, the CT itself carried", "-", "the scan's own, to the bit: at rest nothing is sampled anew", "ecorche radiograph MODEL -o scan.png",
                    "Theirs recompose segmented parts; here the CT follows the tets (section 4 of Sujar18)."))
    if not kit.draw:
        return Found(rows)
    return Found(rows, [kit.row_of(shown, "zhang_radiographs", "From the front and from the left: through the CT, and through the surfaces alone (line integrals)")])


def phantom(kit):
    return Found(shape_rows(kit, "built-in patient", kit.model(), POSES[:1] if kit.small else POSES))


def real(kit):
    rows = []
    for body in BODIES if not kit.small else BODIES[-1:]:
        made = programs.MADE / "bodies" / f"{body}.hdf"  # bench/bodies' own, where they were made
        model = made if made.exists() else programs.example_model(body, kit.data)
        stated = sorted((programs.ROOT / "examples" / body / "poses").glob("*.yaml"))
        rows += shape_rows(kit, body, model, stated[:small_or(kit, 1, 2)])
    return Found(rows)


PARTS = [
    Part("enclosure", "Zhang26", "Skin and bones: the built-in patient", phantom),
    Part("radiographs", "Zhang26", "Radiographs: the built-in patient", radiographs),
    Part("enclosure_real", "Zhang26", "Skin and bones: public bodies", real, needs_data=True),
]
