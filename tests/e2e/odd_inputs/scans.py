# SPDX-License-Identifier: Apache-2.0
"""Odd scans: the small phantom as TotalSegmentator leaves it, with one thing wrong. Each row: its name, what writes its files into a
folder and returns the words for `ecorche new`, and what must come of it."""
import gzip
import xml.etree.ElementTree as xml

import nibabel
import numpy as np

from outcome import Prepared, Refused

TASKS = ("total", "appendicular_bones", "craniofacial_structures", "body")


class Scan:
    """Label maps by task, with their names, and the CT, all on one grid; changed in place, written at the end."""

    def __init__(self, folder, tasks=TASKS):
        self.affine = nibabel.load(folder / "ct.nii.gz").affine
        self.space = np.eye(4)  # from the phantom's own RAS
        self.exchanged = False  # left bones are named right ones
        self.ct = np.asarray(nibabel.load(folder / "ct.nii.gz").dataobj).astype("i2")
        self.maps, self.names = {}, {}
        for task in tasks:
            image = nibabel.load(folder / f"{task}.nii.gz")
            text = image.header.extensions[0].get_content().decode().rstrip("\0")
            self.maps[task] = np.asarray(image.dataobj).astype("u1")
            self.names[task] = {int(label.get("Key")): label.text for label in xml.fromstring(text).iter("Label")}

    def each(self, change):
        """Every array becomes change(array)."""
        self.ct = change(self.ct)
        self.maps = {task: change(values) for task, values in self.maps.items()}
        return self

    def part(self, low, high):
        """Between these shares of the height."""
        k = self.ct.shape[2]
        a, b = int(low * k), int(high * k)
        self.affine = self.affine.copy()
        self.affine[:3, 3] += self.affine[:3, 2] * a
        return self.each(lambda values: values[:, :, a:b])

    def where(self, name):
        """Voxels of a label; `name` may end in `*`."""
        out = np.zeros(self.ct.shape, bool)
        for task, names in self.names.items():
            for label, own in names.items():
                if own == name or (name.endswith("*") and own.startswith(name[:-1])):
                    out |= self.maps[task] == label
        return out

    def without(self, *names):
        """The labels are gone, as if nobody had segmented them."""
        for name in names:
            gone = self.where(name)
            for task in self.maps:
                if task != "body":
                    self.maps[task] = np.where(gone, 0, self.maps[task]).astype("u1")
        return self

    def only(self, *names):
        kept = np.zeros(self.ct.shape, bool)
        for name in names:
            kept |= self.where(name)
        for task in self.maps:
            if task != "body":
                self.maps[task] = np.where(kept, self.maps[task], 0).astype("u1")
        return self

    def renamed(self, change):
        self.names = {task: {label: change(name) for label, name in names.items()} for task, names in self.names.items()}
        return self

    def finer(self, along_i, along_j, along_k):
        """Every voxel as so many smaller ones, or below 1 every so many as one."""
        for axis, factor in enumerate((along_i, along_j, along_k)):
            if factor >= 1:
                self.each(lambda values: np.repeat(values, factor, axis))
            else:
                self.each(lambda values: np.take(values, range(0, values.shape[axis], round(1 / factor)), axis))
            self.affine = self.affine.copy()
            self.affine[:3, 3] += self.affine[:3, axis] * (0.5 / factor - 0.5)
            self.affine[:3, axis] /= factor
        return self

    def moved(self, matrix):
        """The body lies elsewhere, turned."""
        self.space = matrix @ self.space
        self.affine = matrix @ self.affine
        return self

    def write(self, folder, ct=True, tasks=None, kind=None, named=True, code=None):
        given = []
        if ct:
            given.append(folder / "ct.nii.gz")
            nibabel.save(self.image(self.ct, code), given[-1])
        for task in tasks or self.maps:
            image = self.image(self.maps[task] if kind is None else self.maps[task].astype(kind), code)
            if named:
                labels = "".join(f'<Label Key="{label}"><![CDATA[{name}]]></Label>' for label, name in self.names[task].items())
                image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, f"<CaretExtension><LabelTable>{labels}</LabelTable></CaretExtension>".encode()))
            given.append(folder / f"{task}.nii.gz")
            nibabel.save(image, given[-1])
        return given

    def image(self, values, code):
        out = nibabel.Nifti1Image(values, self.affine)
        if code is not None:  # a qform cannot shear
            out.header["qform_code"], out.header["sform_code"] = code
        return out


def rotation(degrees, axis):
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    out = np.eye(4)
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    out[a, a], out[a, b], out[b, a], out[b, b] = c, -s, s, c
    return out


def sheared(matrix_entry):
    out = np.eye(4)
    out[0, 2] = matrix_entry
    return out


def slanted(scan, share):
    """The same body in slices that lean: each lies farther along the rows by `share` of its height, as the affine says."""
    across, _, up = np.linalg.norm(scan.affine[:3, :3], axis=0)
    shifts = np.rint(np.arange(scan.ct.shape[2]) * share * up / across).astype(int)
    room = shifts[-1]
    scan.affine = scan.affine.copy()
    scan.affine[:3, 3] -= room * scan.affine[:3, 0]
    scan.affine[:3, 2] += share * up / across * scan.affine[:3, 0]

    def shifted(values):
        out = np.full((values.shape[0] + room, *values.shape[1:]), values.min(), values.dtype)
        for k, shift in enumerate(shifts):
            out[room - shift:room - shift + values.shape[0], :, k] = values[:, :, k]
        return out

    return scan.each(shifted)


def noise(scan, share):
    """Voxels of random labels anywhere."""
    random = np.random.default_rng(5)
    for task in ("total", "appendicular_bones"):
        where = random.random(scan.ct.shape) < share
        labels = list(scan.names[task])
        scan.maps[task] = np.where(where, random.choice(labels, scan.ct.shape), scan.maps[task]).astype("u1")
    return scan


def fused(scan):
    """Both femora as one label without a side."""
    names = scan.names["total"]
    left, right = (next(label for label, name in names.items() if name == f"femur_{side}") for side in ("left", "right"))
    scan.maps["total"][scan.maps["total"] == right] = left
    names[left] = "femur"
    return scan


def mirrored_names(scan):
    swap = {"left": "right", "right": "left"}
    scan.exchanged = True
    return scan.renamed(lambda name: "_".join(swap.get(word, word) for word in name.split("_")))


def half(scan, side):
    """One side of the body alone: the image ends in the middle."""
    middle = scan.ct.shape[0] // 2
    left_first = scan.affine[0, 0] < 0  # RAS: x to the right
    first = (side == "left") != left_first
    if first:
        return scan.each(lambda values: values[:middle])
    scan.affine = scan.affine.copy()
    scan.affine[:3, 3] += scan.affine[:3, 0] * middle
    return scan.each(lambda values: values[middle:])


def floating_labels(folder, scan, add):
    given = scan.write(folder, kind="f4")
    image = nibabel.load(given[1])
    values = np.asarray(image.dataobj) + np.float32(add) * (np.asarray(image.dataobj) > 0)
    changed = nibabel.Nifti1Image(values.astype("f4"), scan.affine)
    changed.header.extensions = image.header.extensions
    nibabel.save(changed, given[1])
    return given


def negative(folder, scan):
    scan.names["total"] = {-label: name for label, name in scan.names["total"].items()}
    scan.maps["total"] = -scan.maps["total"].astype("i2")
    return scan.write(folder, kind="i2")


def other_grid(folder, scan):
    """The CT on voxels twice as fine, the labels as they are."""
    given = scan.write(folder)
    scan.finer(2, 2, 1)
    nibabel.save(scan.image(scan.ct, None), given[0])
    return given


def elsewhere(folder, scan, tasks):
    """The CT half a metre away from its labels."""
    given = scan.write(folder, tasks=tasks)
    away = scan.affine.copy()
    away[0, 3] += 2000
    nibabel.save(nibabel.Nifti1Image(scan.ct, away), given[0])
    return given


def colours(folder, scan):
    given = scan.write(folder)
    rgb = np.stack([scan.maps["total"]] * 3, -1).astype("u1")
    kind = np.dtype([("R", "u1"), ("G", "u1"), ("B", "u1")])
    nibabel.save(nibabel.Nifti1Image(np.ascontiguousarray(rgb).view(kind)[..., 0], scan.affine), given[1])
    return given


def cut_short(folder, scan):
    given = scan.write(folder)
    data = given[1].read_bytes()
    given[1].write_bytes(data[:len(data) // 2])
    return given


def nonsense_behind_gzip(folder, scan):
    given = scan.write(folder)
    given[1].write_bytes(gzip.compress(b"no image at all" * 100))
    return given


def not_a_number(folder, scan):
    """Voxels of the CT that no scanner has."""
    given = scan.write(folder)
    values = scan.ct.astype("f4")
    values[::7, ::5, ::3] = np.nan
    nibabel.save(nibabel.Nifti1Image(values, scan.affine), given[0])
    return given


def masks(folder, scan, change=None):
    out = folder / "total"
    out.mkdir()
    for label, name in scan.names["total"].items():
        values = (scan.maps["total"] == label).astype("u1")
        nibabel.save(nibabel.Nifti1Image(values if change is None else change(name, values), scan.affine), out / f"{name}.nii.gz")
    return [*scan.write(folder, tasks=["body"]), out]


def legs(scan):
    return scan.part(0, 0.56)


ROWS = [
    ("plain_legs", lambda f, s: legs(s).write(f), Prepared()),
    ("plain_whole", lambda f, s: s.write(f), Prepared()),
    ("legs_without_ct", lambda f, s: legs(s).write(f, ct=False), Prepared()),
    ("legs_without_body", lambda f, s: legs(s).write(f, tasks=TASKS[:-1]), Prepared(said=("denser than -300 HU",))),
    ("legs_without_body_and_ct", lambda f, s: legs(s).write(f, ct=False, tasks=TASKS[:-1]), Refused(65, "nothing says where the skin is")),
    ("skin_from_labels", lambda f, s: [*legs(s).write(f, ct=False, tasks=TASKS[:-1]), "--skin-from-labels"], Prepared()),
    ("specks", lambda f, s: noise(legs(s), 0.0005).write(f), Prepared(said=("taken off",))),
    ("salt", lambda f, s: noise(legs(s), 0.03).write(f), Prepared(said=("taken off",))),
    ("oblique", lambda f, s: legs(s).moved(rotation(20, 0) @ rotation(-15, 2)).write(f), Prepared()),
    ("upside_down", lambda f, s: legs(s).moved(rotation(180, 0)).write(f), Prepared()),
    ("lying", lambda f, s: legs(s).moved(rotation(90, 0)).write(f), Prepared()),
    ("left_handed", lambda f, s: flipped(legs(s), 0).write(f), Prepared()),
    ("stored_backwards", lambda f, s: flipped(flipped(legs(s), 2), 1).write(f), Prepared()),
    ("sheared", lambda f, s: slanted(legs(s), 0.2).write(f, code=(0, 1)), Prepared(said=("degrees off right angles: resampled",))),
    ("sheared_masks", lambda f, s: masks(f, slanted(s.part(0.3, 0.56), 0.2)), Prepared(said=("/total: its axes are",))),
    ("sheared_absurdly", lambda f, s: legs(s).moved(sheared(1.5)).write(f, code=(0, 1)), Refused(65, "not orthonormal")),
    ("sheared_a_little", lambda f, s: legs(s).moved(sheared(0.001)).write(f, code=(0, 1)), Prepared()),
    ("flat_voxels", lambda f, s: half(legs(s), "left").finer(6, 6, 0.25).write(f), Prepared()),
    ("tall_voxels", lambda f, s: legs(s).finer(1, 1, 0.2).write(f), Prepared()),
    ("one_slice", lambda f, s: s.part(0.4, 0.4035).write(f), Refused(65, "has 1 layer of voxels along one axis")),
    ("three_slices", lambda f, s: s.part(0.4, 0.411).write(f), Prepared(said=("cut by the",))),
    ("one_bone_alone", lambda f, s: legs(s).only("femur_left").write(f), Prepared()),
    ("one_bone_and_its_ct", lambda f, s: legs(s).only("femur_left").write(f, tasks=["total"]), Prepared()),
    ("skull_alone", lambda f, s: s.part(0.85, 1).only("skull").write(f, tasks=["total", "body"]), Prepared()),
    ("ribs_without_sternum", lambda f, s: s.part(0.5, 0.9).without("sternum").write(f), Prepared(said=("ribs without a sternum",))),
    ("tibia_without_fibula", lambda f, s: legs(s).without("fibula").write(f), Prepared(said=("has no fibula beside it",))),
    ("thigh_without_shank", lambda f, s: legs(s).without("tibia", "fibula", "patella").write(f), Prepared(said=("hangs on",))),
    ("no_feet", lambda f, s: legs(s).without("tarsal", "metatarsal", "phalanges_feet").write(f), Prepared()),
    ("a_vertebra_missing", lambda f, s: s.part(0.5, 0.9).without("vertebrae_L3").write(f), Prepared()),
    ("no_vertebrae", lambda f, s: s.part(0.4, 0.9).without("vertebrae_*").write(f), Prepared()),
    ("cut_at_thigh_and_shank", lambda f, s: s.part(0.15, 0.4).write(f), Prepared(said=("cut by the",))),
    ("cut_at_neck_and_thigh", lambda f, s: s.part(0.4, 0.85).write(f), Prepared(said=("cut by the",))),
    ("half_the_body", lambda f, s: half(legs(s), "left").write(f), Prepared(said=("cut by the",))),
    ("one_leg_without_side", lambda f, s: half(s.part(0, 0.2), "left").write(f, tasks=["appendicular_bones", "body"]), Prepared()),
    ("one_foot_without_side", lambda f, s: half(s.part(0, 0.06), "left").only("tarsal", "metatarsal").write(f, tasks=["appendicular_bones", "body"]),
     Refused(65, "is known, but not its side")),
    ("one_foot_with_side", lambda f, s: [*half(s.part(0, 0.06), "left").only("tarsal", "metatarsal").write(f, tasks=["appendicular_bones", "body"]), "--side", "left"],
     Prepared()),
    ("empty_labels", lambda f, s: legs(s).only("nothing").write(f), Prepared(said=("of which are in view: ",))),
    ("empty_body", lambda f, s: emptied(legs(s), "body").write(f), Prepared()),
    ("small_body", lambda f, s: shrunk_body(legs(s)).write(f), Prepared(said=("of the bones outside",))),
    ("wrong_names", lambda f, s: legs(s).renamed(lambda name: "roi " + str(len(name) % 7)).write(f), Refused(65, "no label of a bone is known")),
    ("some_names_wrong", lambda f, s: legs(s).renamed(lambda name: name.replace("hip_", "thing_")).write(f), Prepared()),
    ("names_shouted", lambda f, s: legs(s).renamed(lambda name: "  " + name.upper().replace("_", " - ") + "! ").write(f), Prepared()),
    ("names_of_sides_exchanged", lambda f, s: mirrored_names(legs(s)).write(f), Prepared(said=("left and right are exchanged",))),
    ("femora_as_one_label", lambda f, s: fused(legs(s)).write(f), Prepared()),
    ("labels_without_names", lambda f, s: legs(s).write(f, named=False), Refused(65, "does not say what its labels mean, beside label maps that do")),
    ("labels_as_float", lambda f, s: floating_labels(f, legs(s), 0), Prepared()),
    ("labels_with_fractions", lambda f, s: floating_labels(f, legs(s), 0.5), Refused(65, "labels are no whole numbers")),
    ("labels_below_zero", lambda f, s: negative(f, legs(s)), Prepared()),
    ("labels_in_colours", lambda f, s: colours(f, legs(s)), Refused(65, "it is a picture in colours")),
    ("ct_on_another_grid", lambda f, s: other_grid(f, legs(s)), Prepared()),
    ("ct_elsewhere", lambda f, s: elsewhere(f, legs(s), TASKS), Prepared(said=("covers 0 % of what is labelled",))),
    ("ct_elsewhere_without_body", lambda f, s: elsewhere(f, legs(s), TASKS[:-1]), Refused(65, "nothing says where the skin is")),
    ("ct_alone", lambda f, s: legs(s).write(f, tasks=[])[:1], Prepared(said=("of which are in view: ",))),
    ("ct_with_nan", lambda f, s: not_a_number(f, legs(s)), Prepared(said=("NaN or infinite",))),
    ("ct_all_air", lambda f, s: airless(legs(s)).write(f, tasks=TASKS[:-1]), Refused(65, "nothing says where the skin is")),
    ("file_cut_short", lambda f, s: cut_short(f, legs(s)), Refused(65, "its compressed data hold")),
    ("file_of_nonsense", lambda f, s: nonsense_behind_gzip(f, legs(s)), Refused(65, "is no NIfTI")),
    ("masks_of_one_value_each", lambda f, s: masks(f, s.part(0.3, 0.56)), Prepared()),
    ("mask_with_two_values", lambda f, s: masks(f, s.part(0.3, 0.56), lambda name, v: v * (1 + (np.arange(v.shape[2]) % 2)).astype("u1") if name == "femur_left" else v),
     Refused(65, "does not say what its labels mean")),
    ("mask_of_another_size", lambda f, s: masks(f, s.part(0.3, 0.56), lambda name, v: v[:-1] if name == "femur_left" else v), Refused(65, "its voxels are not those of")),
]


def flipped(scan, axis):
    """The axis runs the other way, in the file and in its affine: the same body."""
    count = scan.ct.shape[axis]
    scan.affine = scan.affine.copy()
    scan.affine[:3, 3] += scan.affine[:3, axis] * (count - 1)
    scan.affine[:3, axis] *= -1
    return scan.each(lambda values: np.flip(values, axis))


def emptied(scan, task):
    scan.maps[task] = np.zeros_like(scan.maps[task])
    return scan


def shrunk_body(scan):
    """A body that leaves the left leg out."""
    middle = scan.ct.shape[0] // 2
    scan.maps["body"][:middle] = 0
    return scan


def airless(scan):
    scan.ct = np.full_like(scan.ct, -1000)
    return scan
