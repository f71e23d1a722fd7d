# SPDX-License-Identifier: Apache-2.0
"""Both papers by one command: writes docs/results.md with its pictures.

  scripts/reproduce [--data DIR]               every part, on the bodies that the page is of; on two quiet cores some two hours
  scripts/reproduce --only NAME,...            these parts; the others stay on the page as they are
  scripts/reproduce --size small -o PAGE.md    every part on the small phantom, to see that it runs: its figures mean nothing

The page is replaced after each part. What was found lies in a file a part beside the page's bodies, too (build/bench/reproduce/SIZE, or --made DIR).
"""
import argparse
import datetime
import json
import os
import pathlib
import sys
import time

import programs
import results
from reproduce import (bodies, gagvani_effects, gagvani_fill, gagvani_thin, page, sujar_fem, sujar_pose, sujar_prepare, sujar_study, verdicts,
                       zhang)
from reproduce.rows import Kit, to_json

PARTS = [part for group in (sujar_prepare, sujar_pose, sujar_fem, sujar_study, gagvani_thin, gagvani_fill, gagvani_effects, zhang, bodies, verdicts)
         for part in group.PARTS]
PAGE, PICTURES = programs.ROOT / "docs/results.md", "pictures/results"


def parse():
    names = ", ".join(part.name for part in PARTS)
    parser = argparse.ArgumentParser(prog="reproduce", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=pathlib.Path, help="folder of the public data sets that examples/ name")
    parser.add_argument("--size", choices=("small", "full"), default="full", help="(default: %(default)s)")
    parser.add_argument("--only", type=lambda words: words.split(","), help=f"parts, with commas between, of: {names}")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="the page (default: docs/results.md; with --size small beside its bodies)")
    parser.add_argument("--made", type=pathlib.Path, help="folder of bodies and of what was found (default: build/bench/reproduce/SIZE)")
    parser.add_argument("--no-pictures", action="store_true", help="figures alone")
    options = parser.parse_args()
    unknown = set(options.only or ()) - {part.name for part in PARTS}
    if unknown:
        parser.error(f"--only {', '.join(sorted(unknown))}: no such part (name some of: {names})")
    if options.data and not options.data.is_dir():
        parser.error(f"--data {options.data}: no such folder (give the one that holds the public data sets)")
    options.made = (options.made or programs.MADE / "reproduce" / options.size).resolve()
    options.output = (options.output or (PAGE if options.size == "full" else options.made / "results.md")).resolve()
    return options


def processor_seconds():
    """What all processes of the machine have taken together, and what this one and its children have."""
    user, nice, system, _, _, interrupts, soft, stolen = map(int, pathlib.Path("/proc/stat").read_text().split()[1:9])
    own = os.times()
    return (user + nice + system + interrupts + soft + stolen) / os.sysconf("SC_CLK_TCK"), own.user + own.system + own.children_user + own.children_system


def found_by(part, kit):
    """What a part finds, with when, by which commit, and what share of the processors others took meanwhile."""
    missing = [bench for bench in part.benches if not (programs.BIN / bench).exists()]
    if missing:
        programs.build(*missing)
    commit, start, (machine, own) = results.commit(), time.monotonic(), processor_seconds()
    found = part.find(kit)
    seconds, (machine_after, own_after) = time.monotonic() - start, processor_seconds()
    others = (machine_after - machine - (own_after - own)) / seconds / os.cpu_count()
    facts = results.machine()
    return {"date": f"{datetime.datetime.now().astimezone():%Y-%m-%d %H:%M %Z}", "commit": commit,
            "machine": f"{facts['processor']}, {facts['memory']}, {facts['compiler']}", "others": max(0, others), "seconds": seconds, "found": to_json(found)}


def put_down(options, kept):
    """Replaces the page's sections of what was found, by part."""
    options.output.parent.mkdir(parents=True, exist_ok=True)
    before = options.output.read_text() if options.output.exists() else ""
    results.replace(options.output, page.text(PARTS, kept, before, PICTURES, " --size small" if options.size == "small" else ""))


def main():
    options = parse()
    kit = Kit(options.size, options.made, options.output.parent / PICTURES, options.data and options.data.resolve(), not options.no_pictures)
    chosen = [part for part in PARTS if part.name in (options.only or [each.name for each in PARTS])]
    left_out = [part for part in chosen if part.needs_data and not kit.data]
    for part in left_out:
        print(f"{part.name}: left out, it needs --data", file=sys.stderr)
    put_down(options, {})
    for part in chosen:
        if part not in left_out:
            kept = found_by(part, kit)
            (options.made / f"found_{part.name}.json").write_text(json.dumps(kept, indent=1) + "\n")
            put_down(options, {part.name: kept})
            print(f"{part.name}: {len(kept['found']['rows'])} rows, {kept['seconds']:.0f} s", file=sys.stderr)
    print(options.output)
    return 0
