#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Turns a case, a model or a posed folder into PNG pictures.

  scripts/render CASE_FOLDER -o DIR     the patient from the front and the side: skin translucent over all tissues; volume slices
  scripts/render MODEL.hdf -o DIR       the same, and the tets cut by a plane: by label, by owning segment, by one weight
                                        (Sujar18 figures 3, 4, 5, 11)
  scripts/render POSED_FOLDER -o DIR    what `ecorche pose` wrote: tissues, volume slices, the posed tets by det F
  scripts/render A.vtp B.vtp ... -o DIR surfaces side by side, one picture (Sujar18 figure 7)

Every picture written is named on stdout, one a line.
"""
import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))

import bodies  # noqa: E402
import scene  # noqa: E402
import slices  # noqa: E402


def parse():
    parser = argparse.ArgumentParser(prog="render", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", type=pathlib.Path, help="a case folder, a model, a posed folder, or surface files")
    parser.add_argument("-o", "--out", required=True, type=pathlib.Path, help="folder for the pictures, made where absent")
    parser.add_argument("--name", help="how the pictures' names begin (default: the input's name)")
    parser.add_argument("--height", type=int, default=1200, help="pixels (default %(default)s)")
    parser.add_argument("--segment", help="whose weight is drawn on a model (default: the third of the skeleton)")
    parser.add_argument("--cut", type=float, help="y of the cutting plane through a model, mm (default: the middle)")
    parser.add_argument("--view", choices=sorted(scene.VIEWS), default="front",
                        help="from where surfaces side by side are seen (default %(default)s)")
    return parser.parse_args()


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
        save(scene.row_of_surfaces([bodies.read_surface(path) for path in args.paths], args.view, args.height), "row")
    elif len(args.paths) != 1:
        raise SystemExit("error: render: several inputs must all be surfaces (name one case, model or posed folder)")
    else:
        body = bodies.read(first)
        if body.tissues:
            for view in ("front", "side"):
                save(scene.translucent(body, view, args.height), view)
        for volume in body.volumes:
            save(slices.three_planes(volume, args.height), f"slice_{volume.name}")
        if body.tets is not None:
            for key, picture in scene.tet_cuts(body, args.cut, args.segment, args.height):
                save(picture, key)
    for path in written:
        print(path)


if __name__ == "__main__":
    main()
