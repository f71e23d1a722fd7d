#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds the tree against the house rules of CONVENTIONS.md: arrows between folders, licences, file sizes.

usage: check_house.py SOURCE_FOLDER [BUILD_FOLDER_OF_THE_APACHE_BUILD]
"""
import functools
import pathlib
import re
import subprocess
import sys

# What a folder may include. The longest matching prefix of a file's path decides; its own folder is always allowed.
ARROWS = {
    "core/values": [],
    "core/platform": ["core/values"],
    "core/files": ["core/values"],
    "core/linear": [],
    "core/geometry": ["core/values"],
    "core/kinematics": ["core/values", "core/linear"],
    "core/solve": ["core/values"],
    "core/elastic": ["core/values", "core/solve"],
    "core/model_file": ["core/values", "core/files"],
    "io/surface": ["core/values", "core/files"],
    "io/image": ["core/values", "core/files", "core/linear"],
    "io/motion": ["core/values", "core/files", "io/surface"],
    "io/case": ["core/values", "core/files", "core/kinematics", "io/surface", "io/image"],
    "phantom": ["core/values"],
    "preprocess": ["core"],
    "proto": ["core/values"],
    "runtime": ["core/values", "core/linear", "core/kinematics", "core/elastic", "core/solve", "core/geometry"],
    "runtime/server/net": ["core", "proto"],
    "runtime/server/resources": ["core", "proto", "runtime/server/net"],
    "runtime/server/schedule": ["core", "runtime/server/net", "runtime/server/resources"],
    "runtime/server/session": ["runtime", "core", "proto", "runtime/server/net", "runtime/server/resources",
                               "runtime/server/schedule"],
    "runtime/server/registry": ["runtime", "core", "proto", "runtime/server/net", "runtime/server/resources",
                                "runtime/server/schedule", "runtime/server/session"],
    "runtime/server/handlers": ["runtime", "core", "proto", "runtime/server/net", "runtime/server/resources",
                                "runtime/server/schedule", "runtime/server/session", "runtime/server/registry"],
    "runtime/server": ["runtime", "core", "proto", "runtime/server/net", "runtime/server/resources",
                       "runtime/server/schedule", "runtime/server/session", "runtime/server/registry",
                       "runtime/server/handlers"],
    "clients/cpp": ["proto", "core/values"],
    "clients/c": ["core", "preprocess/thin", "runtime", "io/case", "proto", "clients/cpp"],
    "app": ["core", "io", "phantom", "preprocess", "runtime", "proto", "clients"],
}
# What systems do each in their own way; its headers name nothing of any system. core/values needs none of it.
PLATFORM = "core/platform"
POSIX = re.compile(r"#include <((arpa|linux|net|netinet|sys)/\S+|(aio|alloca|dirent|dlfcn|execinfo|fcntl|fnmatch|ftw|glob|grp|ifaddrs|"
                   r"link|malloc|mqueue|netdb|poll|pthread|pwd|sched|semaphore|signal|spawn|strings|syslog|termios|ucontext|unistd|"
                   r"wordexp)\.h|csignal)>|\"/(proc|dev)/")
POSIX_ALLOWED = (PLATFORM + "/", "tests/", "bench/")
# core/values knows the standard library and Eigen only; three of its headers not even Eigen (ITK brings its own).
PLAIN_HEADERS = {f"core/include/ecorche/values/{name}.hpp" for name in ("image", "error", "context")}
# Where public headers belong: <ecorche/wire/framing.hpp> is of proto.
PUBLIC = {"values": "core/values", "files": "core/files", "kinematics": "core/kinematics", "model_file": "core/model_file",
          "io": "io/case", "preprocess": "preprocess", "runtime": "runtime", "wire": "proto", "v1": "proto", "client": "clients/cpp",
          "version.hpp": "core/values", "ecorche.h": "clients/c", "ecorche_client.h": "clients/c"}
FOREIGN_IN_VALUES = re.compile(r"#include <(hdf5|H5|yaml|tbb|spdlog|fmt|fstream|filesystem|thread|mutex)")
# Units that link GPL or AGPL libraries carry that licence themselves; nothing else may include those libraries.
GPL_UNITS = ("preprocess/tet/cgal/", "preprocess/tet/tetgen/", "preprocess/weights/cholmod/",
             "preprocess/check/cgal/", "bench/preprocess/cgal_parallel.cpp")
GPL_INCLUDE = re.compile(r'#include [<"](CGAL/|tetgen|suitesparse/|cholmod)')
GPL_LIBRARIES = re.compile(r"lib(tet|cholmod|CGAL|gmp|mpfr)[.\-]", re.I)
SPDX = re.compile(r"SPDX-License-Identifier: (Apache-2\.0|AGPL-3\.0-or-later)")
# Papers are cited in comments, by one or two authors and two digits of the year; CONVENTIONS.md says which they are.
COMMENT = re.compile(r"//.*|#[^!i].*|\"\"\".*")
CITED = re.compile(r"\b(?!Int|UInt|Float|Oct|Bip|Split)[A-Z][a-z]{2,}(?:[A-Z][a-z]{2,})?\d\d\b")
CODE = {".hpp", ".cpp", ".h", ".ts", ".py", ".proto", ".cmake", ".sh", ".cs", ".hlsl", ".compute", ".shader"}
MAX_LINES = 400


def tracked(root):
    out = subprocess.run(["git", "-C", root, "ls-files", "--cached", "--others", "--exclude-standard"],
                         check=True, capture_output=True, text=True).stdout
    return [path for path in out.splitlines() if (root / path).is_file()]


def folder_of(path):
    public = re.match(r"(?:.*/include/)?ecorche/([^/]+)", path)
    if public:
        return PUBLIC.get(public.group(1))
    matches = [folder for folder in ARROWS if path.startswith(folder + "/")]
    return max(matches, key=len) if matches else None


def check_arrows(path, text):
    folder = folder_of(path)
    if folder is None:
        return
    for number, line in enumerate(text.splitlines(), 1):
        match = re.match(r'\s*#include (?:"([^"]+)"|<(ecorche/[^>]+)>)', line)
        if not match:
            continue
        target = match.group(1) or match.group(2)
        if match.group(1) and "/include/ecorche/" in path:
            yield f"{path}:{number}: a public header includes public headers only, as <ecorche/...>, not {target}"
        own = folder_of(target)
        if match.group(2):
            if own is None:
                yield f"{path}:{number}: {target} belongs to no folder that PUBLIC names"
                continue
            target = own + "/"
        allowed = own == folder or (own == PLATFORM and folder != "core/values") or any(target.startswith(to + "/") for to in ARROWS[folder])
        # `runtime` -> `runtime/server` would turn the arrow round, although the path starts alike; and who may
        # include `runtime` may not for that include the server's folders, which are named one by one.
        if allowed and own and own != folder and own not in ARROWS[folder]:
            if own.startswith(folder + "/") or (folder.startswith("runtime") and own.startswith("runtime/server")):
                allowed = False
        if not allowed:
            yield f"{path}:{number}: {folder} may not include {target}"


@functools.cache
def conventions(root):
    path = root / "CONVENTIONS.md"
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def check_file(root, path):
    text = (root / path).read_text(encoding="utf-8", errors="replace")
    suffix = pathlib.Path(path).suffix
    first = text.splitlines()[0] if text else ""
    is_code = suffix in CODE or path.endswith("CMakeLists.txt") or first.startswith("#!")
    if not is_code:
        return
    head = "\n".join(text.splitlines()[:4])
    spdx = SPDX.search(head)
    if not spdx:
        yield f"{path}:1: no SPDX-License-Identifier line (Apache-2.0 or AGPL-3.0-or-later)"
    if suffix in {".hpp", ".cpp"}:
        yield from check_arrows(path, text)
        gpl_unit = path.startswith(GPL_UNITS)
        if GPL_INCLUDE.search(text) and not gpl_unit:
            yield f"{path}: includes a GPL or AGPL library outside of {', '.join(GPL_UNITS)}"
        if gpl_unit and GPL_INCLUDE.search(text) and spdx and spdx.group(1) != "AGPL-3.0-or-later":
            yield f"{path}:1: uses a GPL or AGPL library: AGPL-3.0-or-later"
        if not path.startswith(POSIX_ALLOWED) and (posix := POSIX.search(text)):
            yield f"{path}: {posix.group(0)} is of POSIX systems: only {PLATFORM} knows them"
        if folder_of(path) == "core/values" and FOREIGN_IN_VALUES.search(text):
            yield f"{path}: core/values is plain data: no files, threads, HDF5, YAML or logs"
        if path in PLAIN_HEADERS and "<Eigen" in text:
            yield f"{path}: is seen by ITK, which brings its own Eigen: std::array and std::span only"
    papers = conventions(root)
    for cited in {name for comment in COMMENT.findall(text) for name in CITED.findall(comment)}:
        if f"| {cited} |" not in papers:
            yield f"{path}: cites {cited}, which CONVENTIONS.md does not name"
    lines = text.count("\n")
    if lines > MAX_LINES and suffix in {".hpp", ".cpp", ".py", ".ts"}:
        yield f"{path}: {lines} lines, more than {MAX_LINES}: one idea a file"


def check_linked(build):
    """What the Apache build's command links, followed by the loader."""
    binary = build / "bin" / "ecorche"
    out = subprocess.run(["readelf", "-d", binary], check=True, capture_output=True, text=True).stdout
    for needed in re.findall(r"\(NEEDED\).*\[(.+)\]", out):
        if GPL_LIBRARIES.search(needed):
            yield f"{binary.name}: the Apache build links {needed}"


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    paths = tracked(root)
    problems = [problem for path in paths for problem in check_file(root, path)]
    if len(sys.argv) > 2:
        problems += check_linked(pathlib.Path(sys.argv[2]))
    print("\n".join(problems))
    print(f"{len(paths)} files, {len(problems)} problems")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
