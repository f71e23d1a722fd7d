#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""preprocess --report: one page that a browser opens with nothing else, and that says what the model says."""
import base64
import html.parser
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])


def pixels(png):
    """Width, height and the inflated rows of a PNG, every chunk's checksum checked."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, data, size = 8, b"", None
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at : at + 8])
        body = png[at + 8 : at + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack(">I", png[at + 8 + length : at + 12 + length])[0]
        if kind == b"IHDR":
            size = struct.unpack(">II", body[:8])
        data += body if kind == b"IDAT" else b""
        at += 12 + length
    return (*size, zlib.decompress(data))


class Page(html.parser.HTMLParser):
    """Tags that must close do, and nothing is fetched from elsewhere."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.images, self.words = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            assert name not in ("href", "onload", "onclick"), (tag, name)
            if name == "src":
                assert value.startswith("data:image/png;base64,"), value[:40]
                self.images.append(base64.b64decode(value.split(",")[1], validate=True))
        assert tag not in ("script", "link", "iframe", "object")
        if tag in ("table", "figure", "div", "svg", "ol", "p", "span", "style", "title"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag in ("table", "figure", "div", "svg", "ol", "p", "span", "style", "title"):
            assert self.open.pop() == tag, tag

    def handle_data(self, data):
        self.words.append(data)


class Report(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def run_ecorche(self, report):
        return subprocess.run([ECORCHE, "--json", "preprocess", CASE, "-o", self.folder / "m.hdf", "--voxel", "8",
                               "--mesher", "lattice", "--report", report], capture_output=True, text=True, timeout=120)

    def test_the_page_agrees_with_the_model(self):
        path = self.folder / "r.html"
        done = self.run_ecorche(path)
        self.assertEqual(done.returncode, 0, done.stderr)
        report = json.loads(done.stdout)
        text = path.read_text(encoding="utf-8")
        page = Page(text)
        self.assertEqual(page.open, [])
        words = " ".join(page.words)
        self.assertIn(f"{report['tets']} tets, {report['nodes']} nodes, {report['segments']} segments", words)
        for stage in report["stages"]:
            self.assertIn(stage["name"], words)
        rows = json.loads(subprocess.run([ECORCHE, "--json", "info", "--certificate", self.folder / "m.hdf"],
                                         capture_output=True, text=True, timeout=60).stdout)["certificate"]
        for row in rows:
            self.assertRegex(text, rf"<tr><td>{row['figure']}<td class='n'>{re.escape('%.6g' % row['value'])}<td>")
        self.assertEqual(len(page.images), 7 + sum("<li>" in line for line in text.splitlines()))
        for image in page.images:
            width, height, data = pixels(image)
            self.assertEqual(len(data), height * (1 + 3 * width))
            self.assertGreater(len(set(data)), 20, "a picture shows something")
        self.assertLess(len(text), 3_000_000)

    def test_what_cannot_be_written_is_said_before_the_work(self):
        blocker = self.folder / "file"
        blocker.write_text("in the way")
        for code, report, part in ((64, self.folder / "r.pdf", "does not end in .html"), (73, blocker / "r.html", "r.html")):
            done = self.run_ecorche(report)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(part, done.stderr)
            self.assertRegex(done.stderr, r"(?m)^error: .+: .+ \(.+\)$")
            self.assertFalse((self.folder / "m.hdf").exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
