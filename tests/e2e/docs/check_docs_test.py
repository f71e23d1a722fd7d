#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The checks of scripts/check_docs see bad pages, and let good ones pass."""
import pathlib
import shutil
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "scripts"))

from documentation import links, names, pages, run  # noqa: E402

# Written so that this file holds no such option: names of other files count as known.
NO_OPTION = "--" + "colour-of-bones"
GOOD = """# A page
## The `--model` way, and /VTKHDF: more
Another [page](#the---model-way-and-vtkhdf-more), `ecorche pose MODEL -o DIR`, `--max-tets 9`, `pose MODEL --unfold`, `docs/index.md`.

| `export MODEL -o FILE` | writes |
|---|---|

<!-- docs-test: needs=phantom -->
```sh
cd patient
here=$PWD
```
<!-- docs-test: run
touch "$here/made"
-->
```sh
ls made
ecorche check . >../checked  # the same shell, in the same folder
```
<!-- docs-test: fails=64 -->
```sh
ecorche check skin.stl
```
<!-- docs-test: skip=needs a network that tests do not have -->
```sh
exit 1
```
```text
not run
```
"""


class Checks(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.addCleanup(run.clean)

    def page(self, text, name="page.md"):
        path = self.folder / name
        path.write_text(text)
        return pages.read(path)

    def found(self, check, text):
        return [f"{line}: {what}" for line, what in check(self.page(text))]

    def one(self, check, text, words):
        found = self.found(check, text)
        self.assertEqual(len(found), 1, found)
        self.assertIn(words, found[0])

    def test_a_good_page_passes(self):
        for check in (links.problems_of, links.missing_files_of, names.problems_of, names.measurement_words_of, run.problems_of):
            self.assertEqual(self.found(check, GOOD), [], check)

    def test_links(self):
        self.one(links.problems_of, "\nsee [it](none.md)\n", "2: links to none.md, which does not exist")
        self.one(links.problems_of, "![it](none.png)\n", "none.png")
        self.one(links.problems_of, "# Here\n[it](#there)\n", "2: links to #there: no heading")
        (self.folder / "other.md").write_text("# One\n")
        self.one(links.problems_of, "[it](other.md#two)\n", "no heading of other.md has that anchor")
        self.assertEqual(self.found(links.problems_of, "[it](other.md#one)\n"), [])
        self.one(links.missing_files_of, "`bench/nothing/run --data DIR`\n", "1: names bench/nothing/run")

    def test_a_page_of_docs_stays_there(self):
        page = pages.read(pages.DOCS / "index.md")
        page.prose.append((99, "[code](../CMakeLists.txt)"))
        self.assertEqual([line for line, what in links.problems_of(page)], [99])

    def test_names(self):
        self.one(names.problems_of, f"`ecorche pose M {NO_OPTION}`\n", "which ecorche pose does not have")
        self.one(names.problems_of, f"`{NO_OPTION}`\n", "which neither ecorche nor a script has")
        self.one(names.problems_of, "`ecorche prose M`\n", "the subcommand 'prose'")
        self.one(names.problems_of, "| `check CASE --max-tets 9` | x |\n", "names --max-tets, which ecorche check does not have")
        self.one(names.problems_of, f"\n```sh\ncd x\nA=1 ecorche pose \\\n  {NO_OPTION}\n```\n", "4: names")
        self.one(names.measurement_words_of, "It was tried without success.\n", "tried without")
        self.one(names.measurement_words_of, "what each is judged by\n", "judged")

    def test_commands(self):
        self.one(run.problems_of, "```sh\ntrue\n```\n\n```sh\ntrue\nfalse | true\n```\n", "5: the block that begins here fails with 1")
        self.one(run.problems_of, "```sh\nls patient\n```\n", "No such file")
        self.one(run.problems_of, "<!-- docs-test: fails=3 -->\n```sh\nexit 4\n```\n", "ended with 4")
        self.one(run.problems_of, "<!-- docs-test: needs=moon -->\n", "needs 'moon'")
        self.one(run.problems_of, "<!-- docs-test: skip -->\n", "unknown directive")
        self.one(run.problems_of, "```bash\ntrue\n```\n", "write sh")

    def test_what_runs_beside(self):
        serve = "<!-- docs-test: background=7099 -->\n```sh\npython3 -m http.server 7099 --bind 127.0.0.1\n```\n"
        ask = "```sh\npython3 -c 'import urllib.request; print(urllib.request.urlopen(\"http://127.0.0.1:7099\").status)'\n```\n"
        self.assertEqual(self.found(run.problems_of, serve + ask), [])
        self.one(run.problems_of, ask, "refused")

    def test_a_block_that_never_ends(self):
        with self.assertRaisesRegex(ValueError, "2: a block"):
            self.page("\n```sh\ntrue\n")


if __name__ == "__main__":
    unittest.main()
