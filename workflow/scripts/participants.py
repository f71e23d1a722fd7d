# SPDX-License-Identifier: Apache-2.0
"""Who is in a cohort: a BIDS tree, or a table participants.tsv with the columns participant_id, files and options."""
import csv
import dataclasses
import os
import pathlib
import re
import shlex

import yaml

ID = re.compile(r"^sub-[0-9A-Za-z]+$")
IMAGES = (".nii", ".nii.gz", ".nrrd", ".mha", ".seg.nrrd")
NOTHING = ("", "n/a")


class Refused(Exception):
    """One line: WHERE: WHAT (HOW TO MEND); `code` is the exit code of its kind."""

    def __init__(self, where, what, mend, code=78):
        super().__init__(f"{where}: {what} ({mend})")
        self.code = code


@dataclasses.dataclass
class Participant:
    id: str
    sources: list  # paths as the command line is given them: one case, or the files of a scan
    options: list  # words for `ecorche preprocess`
    data: str = ""  # the folder of a case's files with `root: data`

    @property
    def is_case(self):
        return len(self.sources) == 1 and (self.sources[0].name.endswith(".yaml") or (self.sources[0] / "case.yaml").is_file()
                                           or not self.sources[0].exists() and not self.sources[0].name.endswith(IMAGES))

    def files(self):
        """Every file that a source holds or a case names, those that exist, in an order that is always the same."""
        out = []
        for source in self.sources:
            folder = source.parent if source.name == "case.yaml" else source
            out += inside(folder) if folder.is_dir() else [source]
        if self.is_case:
            out += [path for named in self.named(self.case) for path in (inside(named) if named.is_dir() else [named])]
        return [path for path in dict.fromkeys(out) if path.is_file()]

    @property
    def case(self):
        return self.sources[0] if self.sources[0].name.endswith(".yaml") else self.sources[0] / "case.yaml"

    def named(self, case):
        """What a case names elsewhere: below the folder of data, or by a way out of its own folder. Its faults are for `ecorche check` to tell."""
        try:
            entries = [yaml.safe_load(case.read_text())]
        except (OSError, UnicodeDecodeError, yaml.YAMLError):
            return []
        out = []
        while entries:
            entry = entries.pop()
            entries += entry.values() if isinstance(entry, dict) else entry if isinstance(entry, list) else []
            if isinstance(entry, dict):
                root = self.data if entry.get("root") == "data" else case.parent
                out += [pathlib.Path(os.path.normpath(os.path.join(root, entry[key]))) for key in ("file", "table") if root and isinstance(entry.get(key), str)]
        return sorted({path for path in out if not path.is_relative_to(case.parent)})


def inside(folder):
    return [path for path in sorted(folder.rglob("*")) if path.is_file() and not hidden(path, folder)]


def hidden(path, folder):
    return any(part.startswith(".") for part in path.relative_to(folder).parts)


def read_table(path, validate):
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise Refused(path, error.strerror.lower(), "name a BIDS folder, or a table participants.tsv", 66) from None
    except UnicodeDecodeError:
        raise Refused(path, "is no UTF-8 text", "write it as tab-separated UTF-8", 65) from None
    rows = list(csv.reader(text.splitlines(), delimiter="\t"))
    if not rows or "participant_id" not in rows[0]:
        raise Refused(f"{path}:1", "has no column participant_id", "write a line of names with tabs between: participant_id, files, options")
    out, seen = [], {}
    for number, cells in enumerate(rows[1:], 2):
        if not any(cells):
            continue
        if len(cells) > len(rows[0]):
            raise Refused(f"{path}:{number}", f"holds {len(cells)} cells, the first line names {len(rows[0])}", "put tabs between cells only")
        row = {name: cell.strip() for name, cell in zip(rows[0], cells)}
        row = {name: cell for name, cell in row.items() if cell not in NOTHING}
        said = validate(row)
        if said:
            raise Refused(f"{path}:{number}", said, "see docs/reference/cohort.md")
        if row["participant_id"] in seen:
            raise Refused(f"{path}:{number}", f"{row['participant_id']} stands in line {seen[row['participant_id']]} too", "name each participant once")
        seen[row["participant_id"]] = number
        out.append(row)
    return out


def in_tree(bids, name):
    """What the tree holds of a participant: a case, or every image of sub-XX and of its derivatives, tables of names beside them."""
    folder = bids / name
    for case in (folder / "case.yaml", folder / "case" / "case.yaml"):
        if case.is_file():
            return [case]
    sessions = sorted(path.name for path in folder.glob("ses-*"))
    if len(sessions) > 1:
        raise Refused(folder, f"holds {len(sessions)} sessions ({', '.join(sessions)})", "name the files of one in the column files of participants.tsv", 65)
    folders = [folder, *sorted(bids.glob(f"derivatives/*/{name}"))]
    found = [path for under in folders for path in sorted(under.rglob("*")) if path.name.endswith(IMAGES) and path.is_file()]
    tables = [path for under in folders[1:] for path in sorted(under.rglob("*_dseg.tsv"))]
    return found + tables


def read(bids, validate, labels=(), data=""):
    """All participants, or those of `labels` (with or without sub-), by name. Throws Refused."""
    bids = pathlib.Path(bids)
    if not bids.exists():
        raise Refused(bids, "does not exist", "name a BIDS folder, or a table participants.tsv", 66)
    table = bids if bids.is_file() else bids / "participants.tsv"
    root = table.parent
    rows = read_table(table, validate) if table.is_file() else []
    if bids.is_dir() and not table.is_file():
        rows = [{"participant_id": path.name} for path in sorted(bids.glob("sub-*")) if path.is_dir() and ID.match(path.name)]
    if not rows:
        raise Refused(bids, "names no participant", "give it folders sub-01, sub-02, ..., or a table participants.tsv", 66)
    wanted = {label if label.startswith("sub-") else f"sub-{label}" for label in labels}
    unknown = sorted(wanted - {row["participant_id"] for row in rows})
    if unknown:
        raise Refused("--participant-label", f"{bids} has no {unknown[0]}", f"one of {', '.join(row['participant_id'] for row in rows[:8])}{', ...' if len(rows) > 8 else ''}")
    out = []
    for row in sorted(rows, key=lambda row: row["participant_id"]):
        name = row["participant_id"]
        if wanted and name not in wanted:
            continue
        given = [root / word.strip() for word in row["files"].split(";") if word.strip()] if "files" in row else in_tree(root, name)
        # Nothing there: the path that was looked for stands for it, so that the step that reads it says what is missing.
        sources = [path.resolve() for path in given or [root / name / "case.yaml"]]
        out.append(Participant(name, sources, shlex.split(row.get("options", "").replace("=", " ")), data))
    return out
