# SPDX-License-Identifier: Apache-2.0
"""A page of Markdown as the checks see it: headings with their anchors, links, spans of code, fenced blocks, directives.

A directive is an HTML comment `<!-- docs-test: ... -->`; scripts/documentation/run.py says what each does.
"""
import dataclasses
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


@dataclasses.dataclass
class Block:
    line: int
    language: str
    text: str
    directives: list = dataclasses.field(default_factory=list)  # those between the block before and this one


@dataclasses.dataclass
class Page:
    path: pathlib.Path
    text: str
    blocks: list
    prose: list       # (line, text) of everything outside of blocks and comments
    anchors: set
    directives: list  # all of them, as written

    @property
    def name(self):
        return str(self.path.relative_to(ROOT)) if self.path.is_relative_to(ROOT) else self.path.name

    def links(self):
        """(line, target) of every link and picture."""
        for line, text in self.prose:
            bare = re.sub(r"`+[^`]*`+", "", text)
            for target in re.findall(r"\]\(([^()\s]+)(?: \"[^\"]*\")?\)", bare) + re.findall(r'(?:src|href)="([^"]+)"', bare):
                yield line, target

    def spans(self):
        """(line, code) of every `span` of code."""
        for line, text in self.prose:
            for code in re.findall(r"(?<!`)`([^`]+)`(?!`)", text):
                yield line, code.replace("\\|", "|")

    def commands(self):
        """The blocks of shell that run."""
        return [block for block in self.blocks if block.language == "sh"]


def slug(heading):
    """The anchor of a heading, as GitHub and mkdocs.yml's slugify make it."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    text = re.sub(r"[`*]|(?<!\w)_|_(?!\w)", "", text) if "`" not in heading else re.sub(r"[`*]", "", text)
    text = re.sub(r"<[a-z/][^>]*>", "", text) if "`" not in heading else text
    return re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", "-")


def read(path):
    path = pathlib.Path(path).resolve()
    text = path.read_text(encoding="utf-8")
    blocks, prose, anchors, directives, pending = [], [], set(), [], []
    fence, block, comment = None, None, None
    for number, line in enumerate(text.splitlines(), 1):
        if comment is not None:  # within a comment of several lines
            end = line.find("-->")
            comment += "\n" + (line if end < 0 else line[:end])
            if end < 0:
                continue
            _directive(comment, directives, pending)
            comment = None
            continue
        opened = re.match(r"\s*(`{3,}|~{3,})\s*([\w+-]*)", line)
        if fence is None and opened:
            fence, block = opened[1], Block(number, opened[2], "", pending)
            pending = []
        elif fence is not None:
            if line.strip().startswith(fence) and not line.strip().strip(fence[0]):
                blocks.append(block)
                fence = None
            else:
                block.text += line + "\n"
        else:
            line, comment = _without_comments(line, directives, pending)
            prose.append((number, line))
            heading = re.match(r"#{1,6} (.+?)(?: #+)?$", line)
            if heading:
                anchors.add(slug(heading[1]))
            anchors |= set(re.findall(r'\bid="([^"]+)"', line))
    if fence is not None:
        raise ValueError(f"{path}:{block.line}: a block that begins here never ends")
    if comment is not None:
        raise ValueError(f"{path}: a comment never ends")
    return Page(path, text, blocks, prose, anchors, directives)


def _without_comments(line, directives, pending):
    """The line without its comments, and the beginning of one that goes on below (None: there is none)."""
    while (begin := line.find("<!--")) >= 0:
        end = line.find("-->", begin)
        if end < 0:
            return line[:begin], line[begin + 4:]
        _directive(line[begin + 4:end], directives, pending)
        line = line[:begin] + line[end + 3:]
    return line, None


def _directive(comment, directives, pending):
    said = re.match(r"\s*docs-test:\s*(.*)", comment, re.S)
    if said:
        directives.append(said[1].rstrip())
        pending.append(said[1].rstrip())


def all_pages():
    """README, the other pages at the root, and docs/."""
    return [read(path) for path in sorted(ROOT.glob("*.md")) + sorted(DOCS.rglob("*.md"))]
