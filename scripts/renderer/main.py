#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Turns a case, a model or a posed folder into PNG pictures.

  scripts/render CASE_FOLDER -o DIR     the patient from the front and the side: skin translucent over all tissues; volume slices
  scripts/render MODEL.hdf -o DIR       the same, and the tets cut through the bones: by label, by owning segment, by one weight
                                        (Sujar18 figures 3, 4, 5, 11)
  scripts/render POSED_FOLDER -o DIR    what `ecorche pose` wrote: tissues, volume slices, the posed tets by det F
  scripts/render A.vtp B.vtp ... -o DIR surfaces side by side, one picture (Sujar18 figure 7)
  scripts/render A.nrrd B.nrrd ... -o DIR   volumes rendered, a picture each, and all of them as one animated PNG; with --beside
                                        side by side in one picture instead
  scripts/render SKELETON.vtp -o DIR    what `ecorche thin` wrote: its voxels by the segment that they hang on, and its tree
                                        (Gagvani01 figure 2); a model's spheres are drawn so too, within the skin

Every picture written is named on stdout, one a line.
"""
import argparse
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))

import annotate  # noqa: E402
import bodies  # noqa: E402
import scene  # noqa: E402
import skeletons  # noqa: E402
import slices  # noqa: E402
import volumes  # noqa: E402


def parse():
    parser = argparse.ArgumentParser(prog="render", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", type=pathlib.Path, help="a case folder, a model, a posed folder, surface files, or volumes")
    parser.add_argument("-o", "--out", required=True, type=pathlib.Path, help="folder for the pictures, made where absent")
    parser.add_argument("--name", help="how the pictures' names begin (default: the input's name)")
    parser.add_argument("--height", type=int, default=1200, help="pixels (default %(default)s)")
    parser.add_argument("--segment", help="whose weight is drawn on a model (default: the third of the skeleton)")
    parser.add_argument("--plane", choices=sorted(scene.PLANES), default="coronal", help="that cuts tets (default %(default)s)")
    parser.add_argument("--cut", type=float, help="where in the scan it does, mm (default: coronal through all bones, else in the middle)")
    parser.add_argument("--only", choices=("tissues", "volumes", "tets"), help="of a case, a model or a posed folder: these pictures alone")
    parser.add_argument("--beside", action="store_true", help="volumes side by side")
    parser.add_argument("--grey", action="store_true", help="volumes of bytes are grey values, not labels")
    parser.add_argument("--view", choices=sorted(scene.VIEWS), default="front",
                        help="from where surfaces side by side are seen (default %(default)s)")
    parser.add_argument("--around", type=place, metavar="X,Y,Z,R", help="of a case, a model or a posed folder: only what lies within R of a place, LPS mm, from "
                        "--view, without words")
    return parser.parse_args()


def place(text):
    numbers = [float(word) for word in text.split(",")]
    if len(numbers) != 4 or not numbers[3] > 0:
        raise argparse.ArgumentTypeError(f"{text}: not four numbers, the last above 0 (give x,y,z and a radius in mm)")
    return numbers


def main():
    args = parse()
    args.out.mkdir(parents=True, exist_ok=True)
    first = args.paths[0]
    name = args.name or first.resolve().stem
    written = []

    def save(picture, suffix):
        path = args.out / f"{name}_{suffix}.png"
        picture.save(path)
        written.append(path)

    if all(path.suffix in bodies.SURFACES for path in args.paths):
        surfaces = [bodies.read_surface(path) for path in args.paths]
        if len(surfaces) == 1 and skeletons.is_skeleton(surfaces[0]):
            for view in ("front", "side"):
                save(skeletons.draw(surfaces[0], view, args.height), f"skeleton_{view}")
        else:
            save(scene.row_of_surfaces(surfaces, args.view, args.height), "row")
    elif all(path.suffix == ".nrrd" for path in args.paths):
        frames = volumes.rendered(args.paths, args.view, args.height, args.grey)
        if args.beside:
            save(slices.picture(annotate.beside(frames, [path.stem for path in args.paths], args.view)), "beside")
        else:
            for number, frame in enumerate(frames):
                save(slices.picture(frame), f"{number:04d}")
            written.append(volumes.animated(frames, args.out / f"{name}_clip.png"))
    elif len(args.paths) != 1:
        raise SystemExit("error: render: several inputs must all be surfaces or all volumes (name one case, model or posed folder)")
    else:
        body = bodies.read(first)
        if args.around:
            save(scene.around(body, args.view, args.height, args.around[:3], args.around[3]), args.view)
            print(written[0])
            return
        if body.tissues and args.only in (None, "tissues"):
            for view in ("front", "side"):
                save(scene.translucent(body, view, args.height), view)
        for volume in body.volumes if args.only in (None, "volumes") else ():
            save(slices.three_planes(volume, args.height, f"{body.name}: {volume.name}"), f"slice_{volume.name}")
        if body.tets is not None and args.only in (None, "tets"):
            for key, picture in scene.tet_cuts(body, args.plane, args.cut, args.segment, args.height):
                save(picture, key)
        if first.suffix == ".hdf" and args.only is None:
            skins = [tissue.surface for tissue in body.tissues if tissue.group == "skin"]
            for spheres, data in skeletons.of_model(first):
                for view in ("front", "side"):
                    save(skeletons.draw(data, view, args.height, skins), f"spheres_{spheres}_{view}")
    for path in written:
        print(path)


if __name__ == "__main__":
    main()
