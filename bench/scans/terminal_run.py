# SPDX-License-Identifier: Apache-2.0
"""One command of ecorche on a terminal: what it says, how long it takes, the peak of its memory, and which of its parts tell a remaining time."""
import json
import os
import pathlib
import pty
import re
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import programs  # noqa: E402

BAR = re.compile(r"(?:\r\x1b\[K)?([\w/ ]+?) +\[#* *\] +(\d+) %  ETA (\d+) s")


class Run:
    """One command on a terminal: its JSON object or its error line, seconds, memory, and the parts whose bars told a remaining time."""

    def __init__(self, *words):
        master, slave = pty.openpty()
        start = time.monotonic()
        printed = tempfile.TemporaryFile()  # no pipe: nobody reads it before the end, and a body of hundreds of tissues fills one
        process = subprocess.Popen([str(word) for word in (programs.ECORCHE, "--json", *words)], stdout=printed, stderr=slave)
        os.close(slave)
        shown = b""
        while True:
            try:
                some = os.read(master, 1 << 16)
            except OSError:  # the other end is closed
                break
            if not some:
                break
            shown += some
        os.close(master)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        self.seconds, self.mib, self.cpu = time.monotonic() - start, usage.ru_maxrss / 1024, usage.ru_utime + usage.ru_stime
        self.shown = shown.decode(errors="replace")
        self.ok = process.returncode == 0
        printed.seek(0)
        self.said = json.loads(printed.read()) if self.ok else {}
        printed.close()
        lines = [line for line in self.shown.replace("\r", "\n").splitlines() if "error: " in line]
        self.error = re.sub(r"\x1b\[K", "", lines[-1]) if lines else f"ended with {process.returncode}"
        self.bars = {name.strip() for name, _, _ in BAR.findall(self.shown)}


def fresh(path):
    shutil.rmtree(path, ignore_errors=True)
    path.with_suffix(".hdf").unlink(missing_ok=True)
    return path
