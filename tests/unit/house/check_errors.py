#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every message of an Error is asserted by some test, or stands below with the reason why none does.

A call site is `Error(ErrorKind::...` or a call of one of the functions that throw one (FAILING); its message is what it says in
string literals up to the semicolon, in pieces, since places and numbers come between. Names of options are no message. A literal of
the tests (no comment, no docstring) holds one of its pieces of at least SHORTEST letters (the longest one, where all are shorter), is
held by one, or meets the end of one; and since two messages may share words, a literal asserts only one of those that it fits best,
as often as it stands in the tests. Each message so has a line of its own.
usage: check_errors.py SOURCE
"""
import ast
import collections
import pathlib
import re
import sys

FOLDERS = ("app", "core", "io", "preprocess", "runtime", "phantom", "proto", "clients/cpp")
SHORTEST = 9
START = 5
CALL = re.compile(r"\b(?:Error\((?:ErrorKind|[a-z_:]*kind\b)|(?:throw|return) Error\(|(?:refuse|refuse_track|fail|usage|usage_error|unfit|unexpected|refuse_size|fail_unknown|fail_count)\()")
LITERAL = re.compile(r'"((?:[^"\\]|\\.)*)"')

# file: {piece of the message: why no test raises it}
CALLER = "a mistake of the calling code, which no input makes"
SIZE = "takes an input of gigabytes"
DISK = "takes a disk that fails between two calls"
RIGHTS = "takes a user without rights, and CI runs as root"
EXCEPTIONS = {
    "app/report/cohort.cpp": {"cannot be read": DISK},
    "core/platform/other_program.cpp": {"cannot be started: ": "takes a machine without room for one process more", "cannot be waited for: ": CALLER},
    "app/whole_poses.cpp": {"mend the pose file": "what was read can be posed, and where the root stands is left out"},
    "app/serve.cpp": {"this kernel cannot": "takes a Linux before 6.4"},
    "app/stream.cpp": {"a frame of another topology": "takes a server that breaks the protocol", "which was not sent": "takes a server that breaks the protocol"},
    "core/kinematics/retarget.cpp": {"ask for a frame of the clip": CALLER},
    "core/model_file/guard.cpp": {"was replaced while it was opened": "takes a race between two system calls",
                                  "is filtered": "HDF5 filters chunks only, and chunks are refused before"},
    "core/model_file/writer.cpp": {"cannot be made: ": "takes a file that was made a moment ago and cannot be opened"},
    "core/solve/eigen_solver.cpp": {"solve before factor": CALLER},
    "core/values/image.cpp": {"scalars are ": CALLER},
    "io/image/itk_images.cpp": {"check the disk": "our own reader of the header refuses such files before",
                                 "ITK reads its voxels as ": "our own reader of the header refuses such types before"},
    "app/scan/scan_case.cpp": {"there are more than 65534": "takes some forty label maps of 2048 labels each"},
    "io/image/dicom_attributes.cpp": {"DCMTK: ": CALLER, "cannot write: ": DISK},
    "io/image/dicom_data_set.cpp": {"is cut": "the parser says before that it is longer than the file"},
    "io/image/dicom_image.cpp": {"holds more than 2^33 bytes of voxels": SIZE},
    "io/image/dicom_pixels.cpp": {"cannot be opened any more": "takes a race between two system calls", "cannot be read": DISK},
    "io/image/dicom_segmentation.cpp": {"its planes span more than 2^33 bytes": SIZE},
    "io/image/image_file.cpp": {"cannot be opened": RIGHTS},
    "io/image/mask_folder.cpp": {"cannot be listed": RIGHTS},
    "io/image/nifti_names.cpp": {"labels with names are written as .nii.gz": CALLER, "cannot be written": DISK},
    "io/image/segmentation.cpp": {"layers differ in grid or type": CALLER},
    "io/surface/stl.cpp": {"more triangles than can be counted": SIZE},
    "phantom/body.cpp": {"no part ": CALLER},
    "phantom/volume.cpp": {"too many parts for 8-bit labels": CALLER},
    "preprocess/tet/cgal/cgal_mesher.cpp": {"CGAL found no tet": "no body is known that does it: empty ones are refused before"},
    "preprocess/tet/lattice/clipper.cpp": {"it shares its only tet": "no body is known that does it"},
    "preprocess/voxel/voxelize.cpp": {"more bones than 16-bit labels": SIZE},
    "preprocess/weights/cholmod/cholmod_solver.cpp": {"status ": CALLER, "solve before factor": CALLER},
    "runtime/server/session/recording_file.cpp": {"flushed": DISK, "renamed": DISK},
    "proto/framing.cpp": {"do not make a frame": CALLER},
}


RAW = re.compile(r'R"\((.*?)\)"', re.S)
TOKEN = re.compile(r"""("(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)')|//[^\n]*""")


def without_comments(text):
    """Nor without quotes that are letters: the one of '"' begins no string."""
    return TOKEN.sub(lambda token: "" if not token.group(1) else "' '" if token.group(1) == "'\"'" else token.group(1), text)


def statement(text, start):
    """From `start` to the semicolon that ends it, strings respected."""
    i, quoted = start, False
    while i < len(text):
        c = text[i]
        if quoted:
            i += c == "\\"
            quoted = c != '"'
        elif c == '"':
            quoted = True
        elif c == ";" or (c == "{" and i > start):
            break
        i += 1
    return text[start:i]


def pieces_of(call):
    joined = re.sub(r'"\s*\n\s*"', "", call)
    return [piece.encode().decode("unicode_escape") for piece in LITERAL.findall(joined)]


# A function that throws what it is told about: what its message says around the first piece.
FRAMES = {"fail_unknown": "unknown {} '", "unexpected": "expected {}, "}


def call_sites(source):
    for folder in FOLDERS:
        for path in sorted((source / folder).rglob("*.[ch]pp")):
            text = without_comments(path.read_text())
            for match in CALL.finditer(text):
                line_start = text.rfind("\n", 0, match.start()) + 1
                if re.match(r"\s*(\[\[noreturn\]\]|inline|void|explicit|static)\b", text[line_start:]):
                    continue  # a declaration or definition
                call = statement(text, match.start())
                if re.search(r"\bwhat\b", call):
                    continue  # hands on what its caller says
                words = [piece for piece in pieces_of(call) if re.search("[A-Za-z]{2}", piece) and not piece.startswith("--")]
                frame = FRAMES.get(match.group().rstrip("("))
                if words and frame:
                    words[0] = frame.format(words[0])
                if words:
                    yield path.relative_to(source).as_posix(), text.count("\n", 0, match.start()) + 1, words


def python_literals(text):
    tree = ast.parse(text)
    documented = (ast.Module, ast.FunctionDef, ast.ClassDef)
    docstrings = {id(node.body[0].value) for node in ast.walk(tree) if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)}
    return [node.value for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings]


def cpp_literals(text):
    raw = RAW.findall(text)
    text = re.sub(r"(?m)^#include.*$", "", without_comments(RAW.sub('""', text)))
    return raw + [literal.replace('\\"', '"') for literal in LITERAL.findall(re.sub(r'"\s*\n\s*"', "", text))]


def asserted(source):
    """How often each literal stands in the tests."""
    out = collections.Counter()
    for path in (source / "tests").rglob("*"):
        if path.suffix in (".py", ".cpp", ".hpp") and "house" not in path.parts:
            out.update(python_literals(path.read_text()) if path.suffix == ".py" else cpp_literals(path.read_text()))
    return collections.Counter({literal: count for literal, count in out.items() if len(literal) >= 5})


def overlap(word, literal):
    """Letters that both share: one within the other, or the end of one and the beginning of the other."""
    if word in literal:
        return len(word)
    if literal in word:
        return len(literal) if len(literal) >= SHORTEST else 0
    return max((k for k in range(SHORTEST, min(len(word), len(literal)))
                if word.endswith(literal[:k]) or word.startswith(literal[-k:])), default=0)


def fits(words, literals):
    """For each literal, the rows of `words` that it fits best."""
    pieces = [[word.strip() for word in row if len(word.strip()) >= SHORTEST] or [max(row, key=len).strip()] for row in words]
    of_start = collections.defaultdict(set)  # every stretch of the pieces, by its first letters: most literals meet none
    for row, parts in enumerate(pieces):
        for part in parts:
            for at in range(max(1, len(part) - START + 1)):
                of_start[part[at:at + START]].add(row)
    out = {}
    for literal in literals:
        rows = set().union(*(of_start.get(literal[at:at + n], set()) for n in range(1, START + 1)
                             for at in range(len(literal) - n + 1) if n == START or literal[at:at + n] in of_start))
        shared = {row: sum(overlap(part, literal) for part in pieces[row]) for row in rows}
        most = max(shared.values(), default=0)
        if most > 0:
            out[literal] = [row for row, letters in shared.items() if letters == most]
    return out


def assertions(words, literals):
    """The rows of `words` that have a literal of their own: a matching of most rows, by augmenting ways."""
    fitting = fits(words, literals)
    owner = {}

    def give(literal, seen):
        for row in fitting[literal[0]]:
            if row not in seen:
                seen.add(row)
                if row not in owner or give(owner[row], seen):
                    owner[row] = literal
                    return True
        return False

    for literal, rows in sorted(fitting.items(), key=lambda item: (len(item[1]), item[0])):
        for copy in range(min(literals[literal], len(rows))):
            give((literal, copy), set())
    return set(owner)


def missing(source):
    """The messages that nothing asserts, and the exceptions that nothing needs; and how many messages there are."""
    sites = list(call_sites(source))
    out, unused, needed = [], {(path, piece) for path, pieces in EXCEPTIONS.items() for piece in pieces}, []
    for site in sites:
        excuses = {(site[0], piece) for piece in EXCEPTIONS.get(site[0], ()) if any(piece in word for word in site[2])}
        unused -= excuses
        if not excuses:
            needed.append(site)
    met = assertions([words for _, _, words in needed], asserted(source))
    out = [f"{path}:{line}: {' ... '.join(words)}" for row, (path, line, words) in enumerate(needed) if row not in met]
    out += [f"{path}: no message says '{piece}' any more: take the exception out" for path, piece in sorted(unused)]
    return out, len(sites)


def main():
    out, sites = missing(pathlib.Path(sys.argv[1]))
    print("\n".join(out))
    print(f"{sites} messages, {len(out)} of them asserted by no test or excused in vain, {sum(map(len, EXCEPTIONS.values()))} excused")
    return 1 if out else 0


if __name__ == "__main__":
    sys.exit(main())
