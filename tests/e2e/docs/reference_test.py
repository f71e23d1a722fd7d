#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""scripts/reference reads help pages as they are printed, and what is made anew differs from a page that was changed by hand."""
import pathlib
import sys
import unittest
from unittest import mock

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "scripts"))

from documentation import commands, facts, messages, program  # noqa: E402

HELP = """pose a model
Usage: ecorche pose [OPTIONS] MODEL

Positionals:
  MODEL PATH                      a model

Options:
  -h,--help                       Print this help message and exit
  -o,--output PATH (required)     where to
  --max UINT:UINT in [0 - 1048576]=65536
                                  at most
  --voxel FLOAT:0, or 0.2 to 20=0 edge
  --kind cor|lbs=cor              how


Limits:
  --real-time                     first

What it does is <told> here.

Example: ecorche pose a.hdf -o b
Also: --json, --threads N (ecorche --help).
"""


class Reference(unittest.TestCase):
    def setUp(self):
        patch = mock.patch.object(program, "help_of", lambda command=None: HELP)
        patch.start()
        self.addCleanup(patch.stop)
        for cached in (program.page, program.options_of):
            cached.cache_clear()
            self.addCleanup(cached.cache_clear)

    def test_a_help_page(self):
        page = program.page("pose")
        self.assertEqual((page.about, page.usage, page.example), ("pose a model", "ecorche pose [OPTIONS] MODEL", "ecorche pose a.hdf -o b"))
        self.assertEqual([(group.title, len(group.options)) for group in page.groups], [("Options", 5), ("Limits", 1)])
        self.assertEqual(page.notes, ["What it does is <told> here."])
        _, output, most, voxel, kind = page.groups[0].options
        self.assertEqual((output.names, output.required, output.text), (["-o", "--output"], True, "where to"))
        self.assertEqual((most.type, most.range, most.default, most.text), ("UINT", "0 to 1048576", "65536", "at most"))
        self.assertEqual((voxel.type, voxel.range, voxel.default), ("FLOAT", "0, or 0.2 to 20", "0"))
        self.assertEqual((kind.type, kind.default), ("cor|lbs", "cor"))
        self.assertEqual(program.options_of("pose"), {"-h", "--help", "-o", "--output", "--max", "--voxel", "--kind", "--real-time"})

    def test_its_page(self):
        text = commands.page_of("pose")
        for row in ("| `-o`, `--output` | `PATH` | where to. **Required** |", "| `--max` | `UINT` | at most; 0 to 1 048 576. Default: `65536` |",
                    "| `--kind` | `cor`, `lbs` | how. Default: `cor` |", "| `MODEL` | `PATH` | a model |", "What it does is &lt;told> here."):
            self.assertIn(row, text)

    def test_tables_are_made_anew(self):
        text = "Before.\n<!-- generated: exit_codes -->\n| 64 | by hand |\n<!-- end of generated -->\nAfter.\n"
        made = facts.filled(text)
        self.assertNotIn("by hand", made)
        self.assertIn("| 64 | `usage` |", made)
        self.assertTrue(made.startswith("Before.\n") and made.endswith("\nAfter.\n"))
        self.assertEqual(facts.filled(made), made)

    def test_every_message_has_a_page(self):
        pages = messages.pages()
        self.assertIn("[PoseUpdate](stream.md#poseupdate) = 15", pages["messages/index.md"])
        self.assertIn("| `pose_sequence` = ", pages["messages/stream.md"])
        self.assertIn("([Deltas](../protocol.md#deltas))", pages["messages/common.md"])


if __name__ == "__main__":
    unittest.main()
