# SPDX-License-Identifier: Apache-2.0
"""A process and all that it started."""
import os
import pathlib
import signal


def below(root):
    """A process and all below it."""
    found = [root]
    for parent in found:
        for task in pathlib.Path(f"/proc/{parent}/task").glob("*/children"):
            try:
                found += [int(word) for word in task.read_text().split()]
            except OSError:
                pass
    return found


def alive(process):
    try:
        return pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def kill_all(root):
    """At once."""
    for one in below(root):
        try:
            os.kill(one, signal.SIGKILL)
        except ProcessLookupError:
            pass
