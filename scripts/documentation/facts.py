# SPDX-License-Identifier: Apache-2.0
"""Tables that pages of docs/reference hold between `<!-- generated: NAME -->` and `<!-- end of generated -->`, made from the code."""
import json
import re

from documentation.pages import DOCS, ROOT


def source(path):
    return (ROOT / path).read_text(encoding="utf-8")


def metrics():
    """Every family that runtime/server/resources/metrics.cpp registers."""
    text = source("runtime/server/resources/metrics.cpp")
    text = re.sub(r'"\s*\n\s*"', "", text)
    rows = [(name, kind, words) for kind, name, words in re.findall(r'\b(counter|gauge)\("(ecorche_\w+)", "([^"]+)"\)', text)]
    rows += [(name, kind.lower(), words) for kind, name, words
             in re.findall(r'prometheus::Build(Counter|Gauge|Histogram)\(\)\s*\.Name\("(ecorche_\w+)"\)\s*\.Help\("([^"]+)"\)', text)]
    labels = {"ecorche_stage_seconds": "`stage`: " + ", ".join(f"`{stage}`" for stage in re.findall(r'\{"stage", "(\w+)"\}', text)),
              "ecorche_limits_hit_total": "`limit` (below)"}
    out = ["| metric | kind | meaning | labels |", "|---|---|---|---|"]
    out += [f"| `{name}` | {kind} | {words} | {labels.get(name, '')} |" for name, kind, words in sorted(rows)]
    return "\n".join(out)


def cpp_under(*folders):
    """The text of every source and header there."""
    paths = [path for folder in folders for kind in ("*.cpp", "*.hpp") for path in (ROOT / folder).rglob(kind)]
    return "\n".join(path.read_text(encoding="utf-8") for path in sorted(paths))


def limits_hit():
    names = re.findall(r'\b(?:hit|end_at)\(\s*"(\w+)"', cpp_under("runtime/server"))
    return ", ".join(f"`{name}`" for name in sorted(set(names))) + "."


def exit_codes():
    """ErrorKind: name, code and comment; and the status that it becomes on the wire."""
    header, code = source("core/include/ecorche/values/error.hpp"), source("core/values/error.cpp")
    out = ["| code | kind | when | status on the wire |", "|---|---|---|---|"]
    statuses, pending = {}, []
    for kind, status in re.findall(r"case ErrorKind::(\w+):|return \{StatusCode::(\w+)", code[code.index("Status to_status"):]):
        pending += [kind] if kind else []
        if status:
            statuses |= {name: status.upper() for name in pending}
            pending = []
    statuses |= {name: "INTERNAL" for name in pending}
    codes = dict(re.findall(r"case ErrorKind::(\w+):\s*return (\d+);", code))
    for kind, number, words in re.findall(r"^\s*(\w+),\s*///< (\d+): (.+)$", header, re.M):
        if codes[kind] != number:
            raise ValueError(f"error.hpp says {number} of {kind}, error.cpp {codes[kind]}")
        out.append(f"| {number} | `{kind}` | {words} | `{statuses.get(kind, 'INTERNAL')}` |")
    return "\n".join(out)


# What this server means by each; codes without a line are never sent.
STATUS_MEANS = {
    "ok": "done", "cancelled": "the server stops, or the request was given up", "unknown": "what a receiver takes an unknown number for",
    "invalid_argument": "a value of the request is wrong; its field is named", "deadline_exceeded": "nothing was heard in time",
    "not_found": "no model, session, tissue, volume, clip or subscription of that name", "already_exists": "a name is taken",
    "permission_denied": "somebody else controls the session", "resource_exhausted": "a limit is reached ([Limits](limits.md))",
    "failed_precondition": "not now: the hello, or an open model, is missing, or the model lacks what is asked for",
    "aborted": "another connection took this place", "out_of_range": "a pose's sequence is too far beyond the last",
    "unimplemented": "this server does not know or does not have it", "internal": "a bug of the server", "unavailable": "try again later",
    "data_loss": "a file is damaged", "unauthenticated": "the token is missing or wrong",
}


def status_codes():
    header = source("core/include/ecorche/values/error.hpp")
    used = set(re.findall(r"StatusCode::(\w+)", cpp_under("runtime/server", "core", "proto", "runtime/probe")))
    numbers = re.findall(r"^\s*(\w+) = (\d+),", header[header.index("enum class StatusCode"):], re.M)
    out = ["| code | name | meaning |", "|---|---|---|"]
    out += [f"| {number} | `{name.upper()}` | {STATUS_MEANS[name] if name in used or name == 'unknown' else 'not sent by this server'} |" for name, number in numbers]
    return "\n".join(out)


def schema():
    """Every key of docs/reference/skeleton.schema.json, a table for each object."""
    whole = json.loads((DOCS / "reference" / "skeleton.schema.json").read_text(encoding="utf-8"))
    out = []

    def kind(value):
        if "$ref" in value:
            name = value["$ref"].rsplit("/", 1)[1]
            return f"[{name}](#{name})" if name in linked else {"identifier": "name", "range": "[least, most]", "vector": "[x, y, z]"}.get(name, name)
        if "const" in value:
            return f"`{value['const']}`"
        if "enum" in value:
            return ", ".join(f"`{word}`" for word in value["enum"])
        if "oneOf" in value:
            return " or ".join(kind(choice) for choice in value["oneOf"])
        if value.get("type") == "array":
            if value.get("items") == whole["$defs"]["range"]["items"]:
                return "[least, most]"
            return "list of " + kind(value.get("items", {}))
        if value.get("type") == "object":
            return "{name: " + kind(value["additionalProperties"]) + "}" if isinstance(value.get("additionalProperties"), dict) else "map"
        of = value.get("type", "")
        return " or ".join(of) if isinstance(of, list) else of

    linked = {name for name, value in whole["$defs"].items() if "properties" in value} | {"point", "axis"}

    def table(title, value):
        out.append(f"### {title}\n")
        if "description" in value:
            out.append(value["description"] + "\n")
        if "properties" not in value:
            out.append(f"{kind(value)}.\n")
            return
        out.append("| key | value | meaning |\n|---|---|---|")
        inner = []
        for key, entry in value["properties"].items():
            words = entry.get("description", "")
            if key in value.get("required", []):
                words = ("Required. " + words).strip()
            if "default" in entry:
                words = f"{words} Default: `{json.dumps(entry['default'])}`.".strip()
            of = kind(entry)
            if "properties" in entry and entry.get("additionalProperties") is False:
                inner.append((f"{title} {key}" if title != "file" else key, {name: part for name, part in entry.items() if name != "description"}))
                of = f"[map](#{inner[-1][0].replace(' ', '-')})"
            cell = words.replace("|", "\\|")
            out.append(f"| `{key}` | {of} | {cell} |")
        out.append("")
        for name, part in inner:
            table(name, part)

    table("file", {name: part for name, part in whole.items() if name in ("properties", "required")})
    for name, value in whole["$defs"].items():
        if name in linked:
            table(name, value)
    return "\n".join(out).rstrip()


def structures():
    """io/case/data/structures.txt: what labels become."""
    words = {"body": "the body, inside the skin", "shell": "the skin alone", "nothing": "left out"}
    out = ["| structure | becomes | SNOMED CT | other names |", "|---|---|---|---|"]
    for line in source("io/case/data/structures.txt").splitlines():
        if not line or line.startswith("#"):
            continue
        name, becomes, code, *also = (cell.strip() for cell in line.split("|"))
        kind, _, rest = becomes.partition(" ")
        if kind == "bone":
            becomes = f"bone of `{rest.replace('_*', '_left`, `' + rest.replace('_*', '_right'))}`"
        elif kind == "background":
            becomes = f"{rest}, behind others"
        becomes = words.get(becomes, becomes)
        coarse = " (coarse)" if name.startswith("~") else ""
        out.append(f"| `{name.lstrip('~')}`{coarse} | {becomes} | {code} | {', '.join(f'`{word}`' for word in ' '.join(also).split())} |")
    return "\n".join(out)


TABLES = {"structures": structures, "metrics": metrics, "limits_hit": limits_hit, "exit_codes": exit_codes, "status_codes": status_codes, "schema": schema}


def filled(text):
    """A page's text with every generated part made anew."""
    def make(found):
        return f"<!-- generated: {found[1]} -->\n{TABLES[found[1]]()}\n<!-- end of generated -->"
    return re.sub(r"<!-- generated: (\w+) -->\n.*?<!-- end of generated -->", make, text, flags=re.S)


def pages():
    """{path under docs/reference: text} of the pages that hold such parts."""
    folder = DOCS / "reference"
    out = {}
    for path in folder.glob("*.md"):
        text = path.read_text(encoding="utf-8")
        if "<!-- generated: " in text:
            out[path.name] = filled(text)
    return out
