# SPDX-License-Identifier: Apache-2.0
"""Building for another processor or system, from this tree."""
import os
import subprocess
import sys
import time

JOBS = os.environ.get("JOBS", str(os.cpu_count()))


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    assert done.returncode == 0, f"{words}: {done.returncode}\n{done.stdout[-6000:]}"
    return done.stdout


def build(source, libraries, preset):
    """Fetches or builds what is linked (scripts/LIBRARIES), then the preset; returns its folder."""
    begin = time.monotonic()
    run(source / "scripts" / libraries)
    linked = time.monotonic()
    run("cmake", "--preset", preset, "-Wno-dev", cwd=source)
    run("cmake", "--build", "--preset", preset, "-j", JOBS, cwd=source)
    print(f"{libraries} in {linked - begin:.0f} s, {preset} in {time.monotonic() - linked:.0f} s", file=sys.stderr)
    return source / "build" / preset


def unit_tests(build, least, **options):
    """Runs the unit tests of a build; at least so many executables."""
    said = run("ctest", "--test-dir", build, "--output-on-failure", "--no-tests=error", "-j", JOBS, "-R", "^unit_", **options)
    passed = sum(" Passed " in line for line in said.splitlines())
    assert passed >= least, said
    return passed
