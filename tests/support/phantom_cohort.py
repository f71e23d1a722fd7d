# SPDX-License-Identifier: Apache-2.0
"""A cohort of phantoms, grown by seed, some of them deliberately broken; for tests and for bench/cohort."""
import concurrent.futures
import json
import pathlib
import shutil
import subprocess

BROKEN = {  # how: (what is done to the case, exit code of the step that sees it)
    "typo": (lambda case: replace(case / "case.yaml", "segment: pelvis}", "segment: pelviss}"), 78),
    "lost": (lambda case: (case / "bones" / "femur_left.stl").unlink(), 66),
    "cut": (lambda case: cut(case / "skin.stl"), 65),
}


def replace(path, old, new):
    text = path.read_text()
    assert old in text, (path, old)
    path.write_text(text.replace(old, new))


def cut(path):
    """A copy that ended too early."""
    path.write_bytes(path.read_bytes()[:1000])


def make(ecorche, folder, count, broken=("typo",), voxel=12, size="small", first_seed=1, workers=2):
    """BIDS tree FOLDER with sub-01, sub-02, ...; the last ones are broken as named. Returns {name: exit code
    expected, 0 where sound}. What is there already is not made again."""
    folder = pathlib.Path(folder)
    names = [f"sub-{i + 1:02d}" for i in range(count)]
    wanted = json.dumps({"Name": "phantoms", "BIDSVersion": "1.8.0", "Phantoms": [count, list(broken), voxel, size, first_seed]})
    description = folder / "dataset_description.json"  # written last
    if description.exists() and description.read_text() == wanted:
        return expected_of(names, broken)
    shutil.rmtree(folder, ignore_errors=True)

    def one(at):
        case = folder / names[at]
        subprocess.run([ecorche, "--threads", "1", "phantom", "-o", case, "--size", size, "--voxel", str(voxel), "--vary", "--seed", str(first_seed + at)],
                       check=True, stdout=subprocess.DEVNULL)
        shutil.rmtree(case / "motion")  # what no step reads is no input

    # Broken ones are seen before their body matters: copies of the first will do.
    sound = count - len(broken)
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        list(pool.map(one, range(sound)))
    for name in names[sound:]:
        shutil.copytree(folder / names[0], folder / name)
    for name, how in zip(names[sound:], broken):
        BROKEN[how][0](folder / name)
    (folder / "participants.tsv").write_text("participant_id\tseed\n" + "".join(f"{name}\t{first_seed + at}\n" for at, name in enumerate(names)))
    description.write_text(wanted)
    return expected_of(names, broken)


def expected_of(names, broken):
    return dict.fromkeys(names, 0) | {name: BROKEN[how][1] for name, how in zip(names[len(names) - len(broken):], broken)}
