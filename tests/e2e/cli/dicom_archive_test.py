#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A real archive, Debian's Orthanc on loopback, takes a posed series and its segmentation by C-STORE, finds both by C-FIND, and gives
them back by C-GET and by REST as they were sent."""
import json
import pathlib
import shutil
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.request

import pydicom

from posed_files import MODEL, run

ORTHANC = shutil.which("Orthanc") or "/usr/sbin/Orthanc"


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def same(a, b):
    """But for the group of the file itself."""
    a, b = pydicom.dcmread(a), pydicom.dcmread(b)
    return a == b


class Archive(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.dicom, self.http = free_port(), free_port()
        settings = {"Name": "test", "StorageDirectory": str(self.folder / "store"), "IndexDirectory": str(self.folder / "index"),
                    "DicomPort": self.dicom, "HttpPort": self.http, "DicomAet": "ARCHIVE", "RemoteAccessAllowed": False,
                    "AuthenticationEnabled": False, "Plugins": [], "DicomAlwaysAllowEcho": True, "DicomAlwaysAllowStore": True,
                    "DicomAlwaysAllowFind": True, "DicomAlwaysAllowGet": True, "DicomCheckCalledAet": False}
        (self.folder / "orthanc.json").write_text(json.dumps(settings))
        log = open(self.folder / "log", "w")
        self.addCleanup(log.close)
        archive = subprocess.Popen([ORTHANC, str(self.folder / "orthanc.json")], stdout=log, stderr=log)
        self.addCleanup(archive.wait)
        self.addCleanup(archive.terminate)
        for _ in range(300):
            try:
                self.rest("/system")
                return
            except OSError:
                self.assertIsNone(archive.poll(), (self.folder / "log").read_text()[-2000:])
                time.sleep(0.2)
        self.fail("Orthanc does not answer")

    def rest(self, path, data=None):
        with urllib.request.urlopen(f"http://127.0.0.1:{self.http}{path}", data, timeout=30) as answer:
            return answer.read()

    def tool(self, *words):
        done = subprocess.run([*map(str, words)], capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def test_it_takes_finds_and_gives_back(self):
        posed = self.folder / "posed"
        done = run("pose", MODEL, "-o", posed, "--pose", "lib:arms_up", "--volumes", "ct,labels", "--volume-format", "dicom")
        self.assertEqual(done.returncode, 0, done.stderr)
        sent = {pydicom.dcmread(path, stop_before_pixels=True).SOPInstanceUID: path
                for path in [*(posed / "ct.dicom").iterdir(), posed / "labels.dcm"]}
        self.tool("storescu", "-R", "-aec", "ARCHIVE", "+sd", "+r", "+sp", "*.dcm", "127.0.0.1", self.dicom, posed)
        self.assertEqual(json.loads(self.rest("/statistics"))["CountInstances"], len(sent))
        data = pydicom.dcmread(posed / "labels.dcm", stop_before_pixels=True)
        peer = ("-aec", "ARCHIVE", "-S", "-k", "QueryRetrieveLevel=SERIES", "-k", f"StudyInstanceUID={data.StudyInstanceUID}")
        found = self.tool("findscu", "-v", *peer, "-k", "SeriesInstanceUID", "-k", "Modality", "127.0.0.1", self.dicom)
        self.assertIn(data.SeriesInstanceUID, found)
        self.assertIn("[CT]", found)
        self.assertIn("[SEG ]", found)
        got = self.folder / "got"
        got.mkdir()
        for modality in ("CT", "SEG"):
            series = data.SeriesInstanceUID if modality == "SEG" else pydicom.dcmread(posed / "ct.dicom" / "IM0001.dcm").SeriesInstanceUID
            self.tool("getscu", *peer, "-k", f"SeriesInstanceUID={series}", "-od", got, "127.0.0.1", self.dicom)
        back = {pydicom.dcmread(path, stop_before_pixels=True).SOPInstanceUID: path for path in got.iterdir()}
        self.assertEqual(set(back), set(sent))
        for uid in [data.SOPInstanceUID, *list(sent)[:5]]:
            self.assertTrue(same(sent[uid], back[uid]), uid)
        for one in json.loads(self.rest("/instances"))[:3]:
            path = self.folder / "one.dcm"
            path.write_bytes(self.rest(f"/instances/{one}/file"))
            self.assertTrue(same(sent[pydicom.dcmread(path).SOPInstanceUID], path))


if __name__ == "__main__":
    unittest.main()
