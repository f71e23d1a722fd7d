# SPDX-License-Identifier: Apache-2.0
"""Links of pages: the files and anchors exist, pages of docs/ stay within docs/, and files of the repository that are named exist."""
import re

from documentation.pages import DOCS, ROOT, read

# Made by a build or by a command, so not in the repository.
MADE = ("build/", "demo/")


def problems_of(page, known=None):
    """What is wrong with the page's links. `known`: pages read already, by path."""
    known = known if known is not None else {}
    for line, target in page.links():
        if re.match(r"[a-z]+:", target):
            if re.match(r"http://(?!localhost|127\.)", target):
                yield line, f"links to {target}: write https"
            continue
        file, _, anchor = target.partition("#")
        path = (page.path.parent / file).resolve() if file else page.path
        if file.startswith("../") and "/api/" in "/" + file:
            continue  # the headers' pages, which scripts/docs makes beside the site
        if not path.exists():
            yield line, f"links to {target}, which does not exist"
        elif page.path.is_relative_to(DOCS) and not path.is_relative_to(DOCS):
            yield line, f"links to {target}, which is no page of docs/: name it as code"
        elif path.is_dir():
            if page.path.is_relative_to(DOCS):
                yield line, f"links to the folder {target}: link to a page"
        elif anchor and path.suffix == ".md":
            if path not in known:
                known[path] = page if path == page.path else read(path)
            if anchor not in known[path].anchors:
                yield line, f"links to {target}: no heading of {path.name} has that anchor"


def missing_files_of(page):
    """Files of the repository that the page names as code, and that it lacks."""
    folders = {path.name for path in ROOT.iterdir() if path.is_dir() and not path.name.startswith(".")}
    for line, code in page.spans():
        for path in re.findall(r"(?<![\w./<>{}*-])((?:[\w.-]+/)+[\w.-]*)(?![\w*<>{}/-])", code):
            top = path.split("/")[0]
            if top in folders and not path.startswith(MADE) and not (ROOT / path).exists():
                yield line, f"names {path}, which the repository does not hold"
