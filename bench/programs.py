# SPDX-License-Identifier: Apache-2.0
"""The programs that benches run, and the built-in bodies that many of them take, made once under build/bench."""
import importlib.machinery
import importlib.util
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = ROOT / "build/release/bin"
ECORCHE = BIN / "ecorche"
MADE = ROOT / "build/bench"


def call(*words, **more):
    """What the program prints; where it fails, its last words, and the end of the bench."""
    done = subprocess.run(list(map(str, words)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more)
    if done.returncode != 0:
        said = "\n".join((done.stderr or done.stdout).strip().splitlines()[-20:])
        raise SystemExit(f"error: {pathlib.Path(words[0]).name} ended with {done.returncode}: {said}")
    return done.stdout


def ecorche(*words):
    """The one JSON object that the command prints."""
    return json.loads(call(ECORCHE, "--json", *words))


def show(*words, **more):
    """Lets a program print for the bench; its exit code, 0 or, where something asked does not hold, 1."""
    code = subprocess.run(list(map(str, words)), **more).returncode
    if code not in (0, 1):
        raise SystemExit(f"error: {pathlib.Path(words[0]).name} ended with {code} (see above)")
    return code


def bench(name):
    """The bench `name` as a module."""
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / "bench" / name / "run"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


def build(*targets, **settings):
    """Brings the release build up to date, benches and all that `targets` names."""
    given = [f"-D{name}={value}" for name, value in settings.items() if value]
    call("cmake", "--preset", "release", "-Wno-dev", "-DECORCHE_BENCH=ON", *given, cwd=ROOT)
    call("cmake", "--build", "--preset", "release", "--target", "ecorche", *targets, cwd=ROOT)


def phantom(size="paper"):
    """The case of the built-in patient."""
    case = MADE / size
    if not (case / "truth.yaml").exists():  # written last
        print(f"making the phantom, size {size}", file=sys.stderr)
        ecorche("phantom", "-o", case, "--size", size)
    return case


def paper_model():
    model = MADE / "paper.hdf"
    if not model.exists():
        ecorche("preprocess", phantom(), "-o", model, "--mesher", "lattice")
    return model


def spheres_model():
    """The same body with a volumetric skeleton, of the thinness of Gagvani01."""
    model = MADE / "paper_spheres.hdf"
    if not model.exists():
        ecorche("preprocess", phantom(), "-o", model, "--mesher", "lattice", "--spheres", 0.48)
    return model


def standard_model(tets):
    """Of the standard phantom, at most so many tets."""
    model = MADE / f"standard_{tets}.hdf"
    if not model.exists():
        ecorche("preprocess", phantom("standard"), "-o", model, "--mesher", "lattice", "--max-tets", tets)
    return model


def outdated(made, *sources):
    """Whether a file is missing, or older than a file that it was made of, or than one in a folder of them."""
    files = [file for source in sources for file in ([source] if source.is_file() else source.rglob("*"))]
    return not made.exists() or any(file.stat().st_mtime > made.stat().st_mtime for file in files)


def example_model(body, data, tets=300_000):
    """The model of examples/BODY, whose files lie in the folder `data`; made anew where the example has changed."""
    model = MADE / "examples" / f"{body}_{tets}.hdf"
    if outdated(model, ROOT / "examples" / body):
        model.parent.mkdir(parents=True, exist_ok=True)
        ecorche("preprocess", ROOT / "examples" / body, "-o", model, "--data", data, "--max-tets", tets)
    return model


def given_model(path):
    """`path`, or where there is none the paper phantom's model."""
    if path is None:
        return paper_model()
    if not path.exists():
        raise SystemExit(f"error: {path}: no such model (give one that 'ecorche preprocess' wrote)")
    return path.resolve()
