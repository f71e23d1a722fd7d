# SPDX-License-Identifier: Apache-2.0
"""What a part of the reproduction is made of, and what every part has at hand."""
import dataclasses
import json
import pathlib
import subprocess
import typing

import programs

UNKNOWN = "not stated in what we hold"


@dataclasses.dataclass
class Row:
    """One figure of a paper beside ours."""

    where: str  # in the paper
    theirs: str
    ours: str
    command: str
    differs: str = ""  # one sentence, where ours is worse or the data is another


@dataclasses.dataclass
class Picture:
    file: str  # beside the page
    about: str


@dataclasses.dataclass
class Found:
    rows: typing.List[Row]
    pictures: typing.List[Picture] = dataclasses.field(default_factory=list)


class Part(typing.NamedTuple):
    """Rows that are found together. `benches` are programs that the default build leaves out; `timed` parts want a quiet machine."""

    name: str
    paper: str
    title: str
    find: typing.Callable
    benches: tuple = ()
    timed: bool = False
    needs_data: bool = False


class Kit:
    """The size that was asked for, folders, and bodies made once.

    Of `small` every part runs on the small phantom, in seconds; of `full` on what the papers' figures are of, as near as we have it."""

    def __init__(self, size, made, pictures, data=None, draw=True):
        self.small, self.made, self.folder, self.data, self.draw = size == "small", made, pictures, data, draw
        self.phantom_size = "small" if self.small else "standard"
        made.mkdir(parents=True, exist_ok=True)

    def phantom(self, size=None):
        size = size or self.phantom_size
        case = self.made / f"phantom_{size}"
        if not (case / "truth.yaml").exists():  # written last
            programs.ecorche("phantom", "-o", case, "--size", size)
        return case

    def model(self, tets=None, spheres=True):
        """The phantom of this size, prepared. With spheres: thinned at TP 0.48 in voxels of 6 mm (small), 4 mm (full)."""
        tets = tets or (40_000 if self.small else 100_000)
        model = self.made / f"phantom_{self.phantom_size}_{tets}{'_spheres' if spheres else ''}.hdf"
        if not model.exists():
            words = ("--spheres", 0.48, "--voxel", 6 if self.small else 4) if spheres else ()
            programs.ecorche("preprocess", self.phantom(), "-o", model, "--mesher", "lattice", "--max-tets", tets, *words)
        return model

    def pose(self, name, joints):
        """A pose file of the phantom: joint -> angle -> degrees."""
        rows = "".join(f"  {joint}: {{{', '.join(f'{angle}_deg: {value}' for angle, value in angles.items())}}}\n" for joint, angles in joints.items())
        file = self.made / f"{name}.yaml"
        file.write_text(f"ecorche_pose: 1\nskeleton: phantom\njoints:\n{rows}")
        return file

    def render(self, *paths, name, suffix, about, words=()):
        """The picture that scripts/render makes of `paths`, as [Picture], smaller; [] without pictures."""
        if not self.draw:
            return []
        out = self.made / "pictures"
        # Its own words: where several pictures are made, the one of that suffix.
        subprocess.run([str(programs.ROOT / "scripts/render"), *map(str, paths), "-o", str(out), "--name", name, "--height", "800", *map(str, words)],
                       check=True, stdout=subprocess.DEVNULL)
        return [self.keep(out / f"{name}_{suffix}.png", name, about)]

    def keep(self, path, name, about):
        """A picture put beside the page: at most 1200 wide, of 128 colours."""
        from PIL import Image  # only where pictures are made

        image = Image.open(path).convert("RGB")
        image.thumbnail((1200, 1200))
        self.folder.mkdir(parents=True, exist_ok=True)
        image.quantize(128).save(self.folder / f"{name}.png", optimize=True)
        return Picture(f"{name}.png", about)

    def row_of(self, files, name, about):
        """Pictures side by side, as high as the lowest, put beside the page."""
        from PIL import Image

        pictures = [Image.open(file) for file in files]
        # Sixteen bits of grey become eight.
        pictures = [picture.point(lambda value: value / 256).convert("L") if picture.mode.startswith("I") else picture for picture in pictures]
        height = min(picture.height for picture in pictures)
        pictures = [picture.convert("RGB").resize((round(picture.width * height / picture.height), height)) for picture in pictures]
        whole, at = Image.new("RGB", (sum(picture.width + 12 for picture in pictures) - 12, height), (247, 247, 245)), 0
        for picture in pictures:
            whole.paste(picture, (at, 0))
            at += picture.width + 12
        file = self.made / f"{name}.png"
        whole.save(file)
        return self.keep(file, name, about)


def number(value, digits=2):
    """A figure as it is read: of thousands whole, else `digits` behind the point."""
    return f"{value:,.0f}".replace(",", " ") if abs(value) >= 1000 else f"{value:.{digits}f}"


def to_json(found):
    return json.loads(json.dumps(dataclasses.asdict(found)))


def from_json(data):
    return Found([Row(**row) for row in data["rows"]], [Picture(**picture) for picture in data["pictures"]])


def small_or(kit, small, full):
    return small if kit.small else full


def folder_of(kit, name):
    out = kit.made / name
    out.mkdir(parents=True, exist_ok=True)
    return pathlib.Path(out)
