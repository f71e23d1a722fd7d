#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""From a scan as hospitals have it to a posed patient: each form that the phantom writes, new, preprocess, pose; the same joints from all."""
import gzip
import json
import pathlib
import re
import shutil
import tempfile
import unittest

import nibabel
import numpy as np
import yaml

from posed_files import run

FORMS = ("totalsegmentator", "totalsegmentator_ml", "moose", "slicer", "dicom")
VOXEL = 6  # mm, of the small phantom


def inputs(folder, form):
    """What a user gives for it."""
    if form == "totalsegmentator":
        return [folder / "ct.nii.gz", *(folder / task for task in ("total", "appendicular_bones", "craniofacial_structures", "body"))]
    if form == "totalsegmentator_ml":
        return sorted(folder.glob("*.nii.gz"))
    if form == "moose":
        return [folder / "ct.nii.gz", folder / "segmentations"]
    if form == "dicom":
        return [folder / "ct", folder / "segmentation.dcm"]
    return [folder / "ct.nrrd", folder / "segmentation.seg.nrrd"]


def write_nrrd(path, sizes, voxels, space, kind="uchar"):
    head = f"NRRD0004\ntype: {kind}\ndimension: {len(sizes)}\nsizes: {' '.join(map(str, sizes))}\nencoding: raw\n{space}\n"
    path.write_bytes(head.encode() + voxels)


class New(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.made = {}
        for form in FORMS:
            scan = cls.folder / form
            result = run("phantom", "-o", scan, "--size", "small", "--scan", form)
            assert result.returncode == 0, result.stderr
            case = cls.folder / f"{form}_case"
            result = run("--json", "new", *inputs(scan, form), "-o", case, "--report", cls.folder / f"{form}.html")
            assert result.returncode == 0, result.stderr
            cls.made[form] = json.loads(result.stdout)

    def joints(self, case):
        result = run("--json", "rig", case)
        self.assertEqual(result.returncode, 0, result.stderr)
        return {row["joint"]: (np.array(row["center_mm"]), row["fit"]["confidence"]) for row in json.loads(result.stdout)["rig"]}

    def test_segments_and_sides_are_right(self):
        """Each bone lies in the segment and on the side where the phantom has it."""
        for form, made in self.made.items():
            segments = {bone["segment"] for bone in made["bones"]}
            # MOOSE has no mandible of its own.
            self.assertEqual(len(segments), 21 if form == "moose" else 22, (form, segments))
            case = yaml.safe_load((self.folder / f"{form}_case" / "case.yaml").read_text())
            self.assertEqual([b["segment"] for b in case["bones"]], [b["segment"] for b in made["bones"]])
            for bone in made["bones"]:
                for side in ("left", "right"):
                    if bone["name"].endswith("_" + side) and bone["segment"].count("_"):
                        self.assertTrue(bone["segment"].endswith(side), bone)
            self.assertEqual(made["doubts"], [], form)
            self.assertGreater(min(b["confidence"] for b in made["bones"]), 0.5)

    def test_joints_are_the_same_from_each_form(self):
        """Within a voxel, where their confidence says that they were found."""
        found = {form: self.joints(self.folder / f"{form}_case") for form in FORMS}
        first = found[FORMS[0]]
        for form in FORMS[1:]:
            for joint, (centre, confidence) in first.items():
                if joint not in found[form] or min(confidence, found[form][joint][1]) < 0.5:
                    continue
                self.assertLess(np.linalg.norm(found[form][joint][0] - centre), VOXEL, (form, joint))

    def test_a_sheared_scan_is_resampled_and_its_report_says_so(self):
        scan, case, page = self.folder / "sheared", self.folder / "sheared_case", self.folder / "sheared.html"
        scan.mkdir()
        for path in sorted((self.folder / "totalsegmentator_ml").glob("*.nii.gz")):
            image = nibabel.load(path)
            affine = image.affine.copy()
            affine[:, 2] += 0.15 * affine[:, 0]
            sheared = nibabel.Nifti1Image(np.asarray(image.dataobj), affine)
            sheared.header.extensions = image.header.extensions
            nibabel.save(sheared, scan / path.name)
        result = run("--json", "new", *sorted(scan.glob("*.nii.gz")), "-o", case, "--report", page)
        self.assertEqual(result.returncode, 0, result.stderr)
        doubts = [line for line in json.loads(result.stdout)["doubts"] if "degrees off right angles: resampled onto right-angled voxels" in line]
        self.assertEqual(len(doubts), len(list(scan.iterdir())), "a line for each file")
        self.assertIn("ct.nii.gz: its axes are 8.53 degrees off right angles: resampled", page.read_text())
        bones = {bone["segment"] for bone in json.loads(result.stdout)["bones"]}
        self.assertEqual(bones, {bone["segment"] for bone in self.made["totalsegmentator_ml"]["bones"]})

    def test_prepares_and_poses(self):
        for form in FORMS:
            model = self.folder / f"{form}.hdf"
            result = run("preprocess", self.folder / f"{form}_case", "-o", model, "--mesher", "lattice", "--max-tets", "60000")
            self.assertEqual(result.returncode, 0, result.stderr)
            result = run("--json", "pose", model, "-o", self.folder / f"{form}_posed", "--pose", "lib:sitting", "--tissues", "skin")
            self.assertEqual(result.returncode, 0, result.stderr)

    def test_a_spine_by_vertebra(self):
        """The same labels with a joint at each level; poses of the four joints turn all, and the posed body is a case again."""
        case = self.folder / "levels"
        result = run("new", *inputs(self.folder / "totalsegmentator_ml", "totalsegmentator_ml"), "-o", case, "--spine", "vertebrae", "--ribs", "vertebrae")
        self.assertEqual(result.returncode, 0, result.stderr)
        whole, levels = self.joints(self.folder / "totalsegmentator_ml_case"), self.joints(case)
        # In voxels of 6 mm T11 and T12 are no bones of their own; of whole, two segments have become four that lead.
        self.assertEqual(len(levels), len(whole) - 2 + 4 + 22)
        for joint, (centre, confidence) in whole.items():
            np.testing.assert_array_equal(levels[joint][0], centre, joint)
        heights = [levels[f"{a}_{b}"][0][2] for a, b in (("l5", "s1"), ("l3", "l4"), ("t10", "t11"), ("t6", "t7"), ("c7", "t1"), ("c3", "c4"), ("c0", "c1"))]
        self.assertEqual(heights, sorted(heights))
        model, posed = self.folder / "levels.hdf", self.folder / "levels_posed"
        result = run("preprocess", case, "-o", model, "--mesher", "lattice", "--max-tets", "60000")
        self.assertEqual(result.returncode, 0, result.stderr)
        pose = self.folder / "bent.yaml"
        pose.write_text("ecorche_pose: 1\nskeleton: human\njoints:\n  lumbosacral: {flexion_deg: 30}\n  thoracolumbar: {flexion_deg: 20}\n")
        result = run("--json", "pose", model, "-o", posed, "--pose", pose, "--as-case")
        self.assertEqual(result.returncode, 0, result.stderr)
        again = self.joints(posed)
        self.assertEqual(set(again), set(levels))
        turned = yaml.safe_load((posed / "skeleton.yaml").read_text())["segments"]
        self.assertEqual(turned["lumbar_spine"]["bones"], "none")
        result = run("new", *inputs(self.folder / "moose", "moose"), "-o", self.folder / "no", "--ribs", "vertebrae")
        self.assertEqual(result.returncode, 64)
        self.assertIn("--ribs: goes with a spine by vertebra (add --spine vertebrae)", result.stderr)

    def test_the_case_and_the_page_say_what_was_guessed(self):
        text = (self.folder / "totalsegmentator_case" / "case.yaml").read_text()
        self.assertRegex(text, r"name: tibia_left, labels: \[tibia_left\], segment: shank_left\}  # 0\.\d+: name; its side: nearest to the femur")
        self.assertIn("round the label of the body", text)
        page = (self.folder / "totalsegmentator.html").read_text()
        self.assertEqual(page.count("data:image/png;base64,"), 2)
        for word in ("masks are empty: those structures are absent", "tibia_left and tibia_right", "no script"):
            self.assertIn(word, page + "no script")
        self.assertNotRegex(page, r"<script|<link|src='(?!data:)|http")
        self.assertTrue((self.folder / "totalsegmentator_case" / "picture.png").read_bytes().startswith(b"\x89PNG"))

    def test_the_skin_comes_from_the_body_else_from_the_ct_else_from_nowhere(self):
        scan = self.folder / "totalsegmentator_ml"
        bones = [scan / "total.nii.gz", scan / "appendicular_bones.nii.gz"]
        result = run("--json", "new", *bones, scan / "ct.nii.gz", "-o", self.folder / "from_ct")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("denser than -300 HU", json.loads(result.stdout)["skin"]["how"])
        truth = nibabel.load(scan / "body.nii.gz").get_fdata() > 0
        self.assertTrue((self.folder / "from_ct" / "labels.nrrd").exists())
        result = run("--json", "new", *bones, "-o", self.folder / "no_skin")
        self.assertEqual(result.returncode, 65)
        self.assertIn("nothing says where the skin is", result.stderr)
        self.assertFalse((self.folder / "no_skin").exists())
        self.assertGreater(truth.sum(), 0)

    def test_a_field_of_view_is_told(self):
        """Cut at mid-thigh and beneath the neck: stumps and caps are named, and it still prepares."""
        scan = self.folder / "cut"
        scan.mkdir()
        for name in ("ct", "total", "body"):
            image = nibabel.load(self.folder / "totalsegmentator_ml" / f"{name}.nii.gz")
            k = image.shape[2]
            part = image.slicer[:, :, int(0.38 * k):int(0.8 * k)]
            part.header.extensions = image.header.extensions
            nibabel.save(part, scan / f"{name}.nii.gz")
        result = run("--json", "new", *sorted(scan.glob("*.nii.gz")), "-o", self.folder / "cut_case")
        self.assertEqual(result.returncode, 0, result.stderr)
        made = json.loads(result.stdout)
        cut = {bone["name"]: bone["cut"] for bone in made["bones"] if bone["cut"]}
        self.assertEqual(cut["femur_left"], ["lower"])
        self.assertEqual(len(made["skin"]["caps"]), 2)
        self.assertTrue(any("femur_left: cut by the lower border" in note for note in made["notes"]))
        result = run("preprocess", self.folder / "cut_case", "-o", self.folder / "cut.hdf", "--mesher", "lattice", "--max-tets", "60000")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.caps_are_marked(self.folder / "cut.hdf", made["skin"]["caps"])

    def caps_are_marked(self, model, told):
        """In the model, where `new` says that they are; posed, as a surface of their own."""
        info = json.loads(run("--json", "info", model).stdout)
        said = sorted((float(area), json.loads(place)) for area, place in (re.search(r": ([\d.e+]+) cm2 about (\[.*\])", cap).groups() for cap in told))
        marked = sorted((cap["cm2"], cap["at_mm"]) for cap in info["skin_caps"])
        self.assertEqual(len(marked), len(said))
        for (area, place), (known, where) in zip(marked, said):
            self.assertLess(abs(area - known), 0.15 * known)
            self.assertLess(np.linalg.norm(np.subtract(place, where)), 20)
        self.assertIn("the skin's caps, where the scan's border cuts the body", run("info", model).stdout)
        result = run("pose", model, "-o", self.folder / "cut_posed", "--tissues", "skin", "--format", "glb", "--pose", "lib:anatomical")
        self.assertEqual(result.returncode, 0, result.stderr)
        raw = (self.folder / "cut_posed" / "skin.glb").read_bytes()
        gltf = json.loads(raw[20:20 + int.from_bytes(raw[12:16], "little")])
        self.assertEqual([node["name"] for node in gltf["nodes"]], ["skin", "skin_cap"])
        self.assertEqual(len({mesh["primitives"][0]["material"] for mesh in gltf["meshes"]}), 2)
        quality = json.loads((self.folder / "cut_posed" / "quality.json").read_text())
        self.assertEqual(len(quality["skin_caps"]), len(said))

    def test_refusals_say_what_to_do(self):
        scan = self.folder / "totalsegmentator_ml"
        case = self.folder / "refused"
        for words, code, line in (
                ([scan / "none.nii.gz"], 66, "no such file or folder"),
                ([self.folder / "totalsegmentator_case" / "labels.nrrd", scan / "total.nii.gz"], 65, "does not say what its labels mean, beside label maps that do (give a table"),
        ):
            result = run("new", *words, "-o", case)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(line, result.stderr)
            self.assertFalse(case.exists())
        result = run("new", scan / "total.nii.gz", "-o", scan)
        self.assertEqual((result.returncode, "holds files" in result.stderr), (73, True), result.stderr)

    def test_images_and_tables_that_do_not_fit(self):
        folder = self.folder / "unfit"
        (folder / "empty").mkdir(parents=True)
        (folder / "masks").mkdir()
        place = "space: left-posterior-superior\nspace directions: {}(1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
        write_nrrd(folder / "labels.nrrd", (4, 4, 4), bytes(i % 3 for i in range(64)), place.format(""))
        write_nrrd(folder / "colours.nrrd", (3, 4, 4, 4), bytes(192), place.format("none ") + "kinds: RGB-color domain domain domain\n")
        for name in ("labels.json", "other.json"):
            (folder / name).write_text('{"1": "liver", "2": "spleen"}')
        shutil.copy(folder / "colours.nrrd", folder / "masks" / "liver.nrrd")
        (folder / "file").write_text("")
        labels, table = folder / "labels.nrrd", folder / "labels.json"
        write_nrrd(folder / "speck.nrrd", (9, 9, 9), bytes(1 if v == 364 else 2 for v in range(729)), place.format(""))
        (folder / "speck.json").write_text('{"1": "femur_left", "2": "liver"}')
        for words, line in (
                ([folder / "speck.nrrd", folder / "speck.json", "--skin-from-labels"],
                 "no bone is left (see the notes above, and give --side where one limb alone was scanned)"),
                ([folder / "empty"], "holds no image that can be read"),
                ([folder / "colours.nrrd"], "it is a picture in colours: save the grey values, or the label map"),
                ([labels, table, folder / "other.json"], "belongs to no label map: all have names"),
                ([labels, table], "no label of a bone is known"),
        ):
            result = run("new", *words, "-o", folder / "case")
            self.assertEqual((result.returncode in (64, 65), line in result.stderr), (True, True), result.stderr)
        self.assertIn("is a file (name a folder with -o)", run("new", labels, table, "-o", folder / "file").stderr)
        (folder / "crowd").mkdir()
        for k in range(4097):
            (folder / "crowd" / f"m{k}.nrrd").hardlink_to(folder / "labels.nrrd")
        for ids in (40000, 70000):
            voxels = np.arange(1, ids + 1, dtype="<u4").tobytes()
            write_nrrd(folder / f"{ids}.nrrd", (ids, 1, 1), voxels, place.format("") + "endian: little\n", "uint")
            (folder / f"{ids}.json").write_text(json.dumps({str(k): f"n{k}" for k in range(1, ids + 1)}))
        for entry, line in (
                (" {file: crowd}", "holds 4097 masks (a folder may hold 4096)"),
                ("\n  - {file: 70000.nrrd, table: 70000.json}\n  - {file: 70000.nrrd, table: 70000.json}",
                 "a label map has more than 65535 ids (is it a label map, or a picture?)"),
                ("\n  - {file: 40000.nrrd, table: 40000.json}\n  - {file: 40000.nrrd, table: 40000.json}",
                 "the label maps have more than 65535 ids together"),
                ("\n  - {file: labels.nrrd, table: labels.json}\n  - {file: labels.nrrd, table: labels.json, resample: linear}",
                 "' is no way to resample labels"),
                ("\n  - {file: labels.nrrd, table: labels.json}\n  - {file: masks}", "its voxels are not one whole number each"),
                (" {file: labels.nrrd, table: labels.json, form: qform}", "has neither qform nor sform: it is no NIfTI"),
        ):
            (folder / "case.yaml").write_text(f"name: t\nskeleton: generic\nlabels:{entry}\n")
            self.assertIn(line, run("check", folder / "case.yaml").stderr)

    def test_one_volume_of_a_ct_in_time(self):
        """Of a 4-D CT the volume that is named becomes the case's; without a name it is refused, and so is a name for nothing."""
        scan = self.folder / "totalsegmentator_ml"
        ct = nibabel.load(scan / "ct.nii.gz")
        other = np.full(ct.shape, -1000, "i2")
        nibabel.save(nibabel.Nifti1Image(np.stack([other, np.asarray(ct.dataobj), other], 3), ct.affine), self.folder / "ct.nii.gz")
        words = [self.folder / "ct.nii.gz", scan / "total.nii.gz", scan / "body.nii.gz", "-o"]
        result = run("new", *words, self.folder / "time_refused")
        self.assertEqual(result.returncode, 65)
        self.assertIn("holds 3 volumes, one after the other in time (take one by --phase, in a case by phase:, from 1 to 3)", result.stderr)
        self.assertFalse((self.folder / "time_refused").exists())
        result = run("new", "--phase", "2", *words, self.folder / "time_case")
        self.assertEqual(result.returncode, 0, result.stderr)
        result = run("new", scan / "ct.nii.gz", *words[1:], self.folder / "still_case")
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in ("ct.nrrd", "labels.nrrd"):
            self.assertEqual((self.folder / "time_case" / name).read_bytes(), (self.folder / "still_case" / name).read_bytes(), name)
        result = run("new", "--phase", "2", *words[1:], self.folder / "no_time")
        self.assertEqual(result.returncode, 64)
        self.assertIn("error: --phase: no image here is in time (leave it out)", result.stderr)

    def test_names_of_strangers_stay_text(self):
        """Hostile names neither break the YAML nor the page."""
        scan = self.folder / "hostile"
        scan.mkdir()
        source = self.folder / "totalsegmentator_ml"
        bytes_ = gzip.decompress((source / "total.nii.gz").read_bytes())
        name = b"<script>alert(1)</script>\n#: ]}"
        (scan / "t.nii.gz").write_bytes(gzip.compress(bytes_.replace(b"gluteus_maximus_left", name[:20].ljust(20, b"x"))))
        result = run("--json", "new", scan / "t.nii.gz", source / "body.nii.gz", "-o", self.folder / "hostile_case",
                     "--report", self.folder / "hostile.html")
        self.assertEqual(result.returncode, 0, result.stderr)
        yaml.safe_load((self.folder / "hostile_case" / "case.yaml").read_text())
        self.assertIsNone(re.search("<script", (self.folder / "hostile.html").read_text()))


if __name__ == "__main__":
    unittest.main()
