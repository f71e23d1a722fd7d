#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes what Debian wants in /usr/share/doc/PACKAGE: copyright, changelog.gz, changelog.Debian.gz; into FOLDER/COMPONENT.

usage: papers.py FOLDER VERSION MAINTAINER ON|OFF    the last: whether units under the AGPL are in
"""
import datetime
import email.utils
import gzip
import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMPONENTS = ("command", "library", "development", "pages", "python")
# They hold what CGAL, CHOLMOD and TetGen ask for: the program, and its static libraries.
WITH_AGPL = ("command", "development")
HEAD = """Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: ecorche
Upstream-Contact: The ecorche maintainers
"""
APACHE = """License: Apache-2.0
 On Debian systems the text of the Apache License, version 2.0, is in
 /usr/share/common-licenses/Apache-2.0.
"""
AGPL_UNITS = ("preprocess/tet/cgal", "preprocess/tet/tetgen", "preprocess/check/cgal", "preprocess/weights/cholmod")


def stanza(files, license_name, owner="2026 The ecorche maintainers"):
    return f"\nFiles: {files}\nCopyright: {owner}\nLicense: {license_name}\n"


def indented(text):
    """As the format wants the text of a licence: each line one to the right, empty ones as a point."""
    return "".join(f" {line.rstrip()}\n" if line.strip() else " .\n" for line in text.strip().splitlines())


def agpl_files():
    """Those whose first line says so."""
    for path in (*(path for unit in AGPL_UNITS for path in (ROOT / unit).rglob("*.?pp")), *(ROOT / "app").glob("*.?pp")):
        if "AGPL-3.0-or-later" in path.read_text(encoding="utf-8").splitlines()[0]:
            yield str(path.relative_to(ROOT))


def copyright_of(component, gpl):
    out = HEAD
    agpl = gpl and component in WITH_AGPL
    if agpl:
        out += ("Comment: Most of it is under the Apache License. The units that use CGAL, CHOLMOD and\n TetGen, and so the program as a whole, are under the"
                " GNU Affero General Public\n License.\n")
    out += stanza("*", "Apache-2.0")
    if agpl:
        out += stanza("\n ".join(sorted(agpl_files())), "AGPL-3.0-or-later")
    viewer = ROOT / "build" / "viewer" / "licences.txt"
    if component == "command" and viewer.exists():
        out += stanza("build/viewer/*", "those-of-the-viewer", "the authors of what the viewer is bundled from, named in the licence")
    out += "\n" + APACHE
    if agpl:
        out += "\nLicense: AGPL-3.0-or-later\n" + indented((ROOT / "LICENSES" / "AGPL-3.0-or-later.txt").read_text(encoding="utf-8"))
    if component == "command" and viewer.exists():
        out += "\nLicense: those-of-the-viewer\n" + indented(viewer.read_text(encoding="utf-8"))
    return out


def main(folder, version, maintainer, gpl):
    when = datetime.datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), datetime.timezone.utc)
    debian = (f"ecorche ({version}-1) bookworm; urgency=medium\n\n  * Version {version}: see changelog.gz beside this file.\n\n"
              f" -- {maintainer}  {email.utils.format_datetime(when)}\n")
    for component in COMPONENTS:
        into = pathlib.Path(folder, component)
        into.mkdir(parents=True, exist_ok=True)
        (into / "copyright").write_text(copyright_of(component, gpl == "ON"), encoding="utf-8")
        for name, text in (("changelog.gz", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")), ("changelog.Debian.gz", debian)):
            (into / name).write_bytes(gzip.compress(text.encode(), 9, mtime=0))


main(*sys.argv[1:])
