# SPDX-License-Identifier: Apache-2.0
"""A scan of 512 x 512 x 700 voxels, as hospitals have it, in the forms that programs write: the phantom in a scanner's field of view."""
import pathlib
import shutil
import sys

import nibabel
import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[2] / "tests/unit/io"), str(pathlib.Path(__file__).resolve().parents[1])]
import dicom_made  # noqa: E402
import programs  # noqa: E402

SIZE, SPACING = (512, 512, 700), (1.22, 1.22, 2.5)  # voxels, mm: a whole body in a field of view of 625 mm
FINE = 1.22  # mm: the phantom's own voxels, of which every second layer or so is taken
AIR, NOISE = -1000, 12  # HU
FORMS = ("multilabel", "masks", "dicom")
# TotalSegmentator's task, and its file in `--ml` form.
TASKS = ("total", "appendicular_bones", "craniofacial_structures", "body")


def sampled(values, steps, outside):
    """Nearest neighbours of an array on the grid of SIZE, in whose middle it lies along j."""
    at = [np.rint(np.arange(n) * step).astype(int) for n, step in zip(SIZE, steps)]
    at[1] = at[1] - (at[1][-1] - (values.shape[1] - 1)) // 2
    inside = [(a >= 0) & (a < n) for a, n in zip(at, values.shape)]
    out = np.full(SIZE, outside, values.dtype)
    out[np.ix_(*inside)] = values[np.ix_(*(a[i] for a, i in zip(at, inside)))]
    return out


def names_of(image):
    """Those in its header, as TotalSegmentator writes them: id to name."""
    import xml.etree.ElementTree as xml
    text = image.header.extensions[0].get_content()
    text = text.decode() if isinstance(text, bytes) else text
    return {int(label.get("Key")): label.text for label in xml.fromstring(text.rstrip("\0")).iter("Label")}


def save(path, values, affine, like=None):
    image = nibabel.Nifti1Image(values, affine)
    if like is not None:
        image.header.extensions = like.header.extensions
    nibabel.save(image, path)


class LargeScan:
    """Voxels and names by task, in memory; `write` puts a form of it into a folder."""

    def __init__(self, folder):
        source = pathlib.Path(folder) / "phantom"
        programs.ecorche("phantom", "-o", source, "--size", "standard", "--voxel", FINE, "--scan", "totalsegmentator_ml")
        images = {task: nibabel.load(source / f"{task}.nii.gz") for task in (*TASKS, "ct")}
        own = images["ct"].affine
        steps = np.array(SPACING) / np.abs(np.diag(own)[:3])
        self.affine = own.copy()
        self.affine[:3, :3] = np.sign(own[:3, :3]) * np.diag(SPACING)
        noise = np.random.default_rng(1).normal(0, NOISE, SIZE).astype("i2")
        self.ct = sampled(np.asarray(images["ct"].dataobj).astype("i2"), steps, AIR) + noise
        self.maps = {task: sampled(np.asarray(images[task].dataobj).astype("u1"), steps, 0) for task in TASKS}
        self.names = {task: names_of(images[task]) for task in TASKS}
        self.images = images
        shutil.rmtree(source)

    def labels(self):
        """How many labels have voxels."""
        return sum(len(np.unique(values)) - 1 for values in self.maps.values())

    def write(self, form, folder):
        """Returns what `ecorche new` is given."""
        folder = pathlib.Path(folder)
        folder.mkdir(parents=True)
        if form == "dicom":
            return self.write_dicom(folder)
        ct = folder / "ct.nii.gz"
        save(ct, self.ct, self.affine)
        given = [ct]
        for task, values in self.maps.items():
            if form == "multilabel":
                given.append(folder / f"{task}.nii.gz")
                save(given[-1], values, self.affine, self.images[task])
                continue
            given.append(folder / task)
            given[-1].mkdir()
            for label, name in self.names[task].items():
                save(given[-1] / f"{name}.nii.gz", (values == label).astype("u1"), self.affine)
        return given

    def write_dicom(self, folder):
        """The CT as a series; its bones and organs as one DICOM SEG; no body, which is then found in the CT."""
        to_lps = np.diag([-1, -1, 1, 1]) @ self.affine
        dicom_made.write_series(folder / "ct", self.ct, to_lps)
        segments, pieces, frames = [], [], []
        for task in TASKS[:-1]:
            for label, name in self.names[task].items():
                mask = self.maps[task] == label
                planes = np.flatnonzero(mask.any((0, 1)))
                if not len(planes) or (task, name) == ("craniofacial_structures", "skull"):
                    continue
                segments.append(dicom_made.segment(len(segments) + 1, name, ("272673000", "Bone structure")))
                for k in planes:  # 512 x 512 bits are whole bytes: frames may be packed one by one
                    pieces.append(np.packbits(mask[:, :, k].T.ravel(), bitorder="little").tobytes())
                    frames.append(dicom_made.item(
                        PlanePositionSequence=[dicom_made.item(ImagePositionPatient=dicom_made.text((to_lps @ [0, 0, k, 1])[:3]))],
                        SegmentIdentificationSequence=[dicom_made.item(ReferencedSegmentNumber=len(segments))]))

        def fill(data):
            data.SegmentSequence, data.PerFrameFunctionalGroupsSequence = segments, frames
            data.NumberOfFrames, data.PixelData = len(frames), b"".join(pieces)
        first = {1: np.pad(np.ones((1, 1, 1), "u1"), [(0, n - 1) for n in (*SIZE[:2], 1)])}
        dicom_made.write_segmentation(folder / "segmentation.dcm", first, segments[:1], to_lps, change=fill)
        return [folder / "ct", folder / "segmentation.dcm"]
