# SPDX-License-Identifier: Apache-2.0
"""Building for another processor or system, from this tree."""
import os
import subprocess


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    assert done.returncode == 0, f"{words}: {done.returncode}\n{done.stdout[-6000:]}"
    return done.stdout


def build(source, libraries, preset):
    """Fetches or builds what is linked (scripts/LIBRARIES), then the preset; returns its folder."""
    run(source / "scripts" / libraries)
    run("cmake", "--preset", preset, "-Wno-dev", cwd=source)
    run("cmake", "--build", "--preset", preset, "-j", os.environ.get("JOBS", os.cpu_count()), cwd=source)
    return source / "build" / preset


def unit_tests(build, least, **options):
    """Runs the unit tests of a build; at least so many executables."""
    said = run("ctest", "--test-dir", build, "--output-on-failure", "--no-tests=error", "-R", "^unit_", **options)
    passed = sum(" Passed " in line for line in said.splitlines())
    assert passed >= least, said
    return passed
