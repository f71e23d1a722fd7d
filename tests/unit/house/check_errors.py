#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every message of an Error is asserted by some test, or stands below with the reason why none does, or in unasserted.txt: a list
that may only get shorter.

A call site is `Error(ErrorKind::...` or a call of one of the functions that throw one (FAILING); its message is what it says in
string literals up to the semicolon, in pieces, since places and numbers come between. It counts as asserted where a literal of the
tests holds one of its pieces of at least SHORTEST letters (the longest one, where all are shorter), or is held by one.
usage: check_errors.py SOURCE [--list]     (--list: what unasserted.txt should hold now, where several changes meet)
"""
import pathlib
import re
import sys

FOLDERS = ("app", "core", "io", "preprocess", "runtime", "phantom", "proto", "clients/cpp")
SHORTEST = 9
CALL = re.compile(r"\b(?:Error\((?:ErrorKind|[a-z_:]*kind\b)|(?:throw|return) Error\(|(?:refuse|fail|usage|unfit|unexpected|refuse_size|fail_unknown|fail_count)\()")
LITERAL = re.compile(r'"((?:[^"\\]|\\.)*)"')

# file: {piece of the message: why no test raises it}
CALLER = "a mistake of the calling code, which no input makes"
SIZE = "takes an input of gigabytes"
EXCEPTIONS = {
    "app/stream.cpp": {"a frame of another topology": "takes a server that breaks the protocol", "which was not sent": "takes a server that breaks the protocol"},
    "clients/cpp/client.cpp": {"this is the server's answer": "hands on what a server says", "no answer within": "takes a server that never answers"},
    "core/kinematics/retarget.cpp": {"ask for a frame of the clip": CALLER},
    "core/model_file/guard.cpp": {"was replaced while it was opened": "takes a race between two system calls",
                                  "is filtered": "HDF5 filters chunks only, and chunks are refused before"},
    "core/solve/eigen_solver.cpp": {"solve before factor": CALLER},
    "core/values/image.cpp": {"scalars are ": CALLER},
    "io/image/itk_images.cpp": {"ITK reads its voxels as ": "our own reader of the header refuses such types before"},
    "io/image/segmentation.cpp": {"layers differ in grid or type": CALLER},
    "io/surface/stl.cpp": {"more triangles than can be counted": SIZE},
    "phantom/body.cpp": {"no part ": CALLER},
    "phantom/volume.cpp": {"too many parts for 8-bit labels": CALLER},
    "preprocess/tet/cgal/cgal_mesher.cpp": {"CGAL found no tet": "no body is known that does it: empty ones are refused before"},
    "preprocess/tet/lattice/lattice_mesher.cpp": {"it shares its only tet": "no body is known that does it"},
    "preprocess/voxel/voxelize.cpp": {"more bones than 16-bit labels": SIZE},
    "preprocess/weights/cholmod/cholmod_solver.cpp": {"status ": CALLER, "solve before factor": CALLER},
    "proto/framing.cpp": {"do not make a frame": CALLER},
}


def without_comments(text):
    return re.sub(r"//[^\n]*", "", text)


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
                words = [piece for piece in pieces_of(call) if re.search("[A-Za-z]{2}", piece)]
                if words:
                    yield path.relative_to(source).as_posix(), text.count("\n", 0, match.start()) + 1, words


def asserted(source):
    out = set()
    for path in (source / "tests").rglob("*"):
        if path.suffix in (".py", ".cpp", ".hpp") and "house" not in path.parts:
            text = re.sub(r'"\s*\n\s*"', "", path.read_text())
            out.update(a or b for a, b in re.findall(r'"((?:[^"\\\n]|\\.)*)"|\'((?:[^\'\\\n]|\\.)*)\'', text))
    return [literal.replace('\\"', '"') for literal in out if len(literal) >= 5]


def is_asserted(words, literals):
    long = [word.strip() for word in words if len(word.strip()) >= SHORTEST] or [max(words, key=len).strip()]
    for word in long:
        if any(word in literal or (len(literal) >= SHORTEST and literal in word) for literal in literals):
            return True
    # A literal may begin in the middle of a piece and go on over the number behind it; or end in the middle of one.
    def overlap(word, literal):
        most = range(SHORTEST, min(len(word), len(literal)) + 1)
        return any(word.endswith(literal[:k]) or word.startswith(literal[-k:]) for k in most)
    return any(overlap(word, literal) for word in long for literal in literals)


def missing(source, listed="tests/unit/house/unasserted.txt"):
    """The messages that nothing asserts, and the exceptions that nothing needs; and how many messages there are."""
    literals = asserted(source)
    sites = list(call_sites(source))
    known = source / listed
    unasserted, met = known.read_text().splitlines() if known.is_file() else [], set()
    out, unused = [], {(path, piece) for path, pieces in EXCEPTIONS.items() for piece in pieces}
    for path, line, words in sites:
        excuses = {(path, piece) for piece in EXCEPTIONS.get(path, ()) if any(piece in word for word in words)}
        unused -= excuses
        if not excuses and not is_asserted(words, literals):
            name = f"{path}: {' ... '.join(words)}"
            if name in unasserted:
                met.add(name)
            else:
                out.append(f"{path}:{line}: {' ... '.join(words)}")
    out += [f"{name}: is asserted now, or gone: take it out of unasserted.txt" for name in unasserted if name not in met]
    out += [f"{path}: no message says '{piece}' any more: take the exception out" for path, piece in sorted(unused)]
    return out, len(sites)


def main():
    if sys.argv[2:] == ["--list"]:
        print("\n".join(sorted({re.sub(r"^([^:]+):\d+: ", r"\1: ", line) for line in missing(pathlib.Path(sys.argv[1]), "none")[0]})))
        return 0
    out, sites = missing(pathlib.Path(sys.argv[1]))
    print("\n".join(out))
    print(f"{sites} messages, {len(out)} of them asserted by no test or excused in vain, {sum(map(len, EXCEPTIONS.values()))} excused")
    return 1 if out else 0


if __name__ == "__main__":
    sys.exit(main())
