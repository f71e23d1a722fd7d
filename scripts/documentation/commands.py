# SPDX-License-Identifier: Apache-2.0
"""Pages of the subcommands, made from their help: {path under docs/reference: text}."""
import re

from documentation import program

NOTICE = "<!-- SPDX-License-Identifier: Apache-2.0 -->\n<!-- Made by scripts/reference from `ecorche {} --help`. Edit app/{}.cpp, then run it again. -->\n"
# Where a page of its own says more than an option's line can.
MORE = {
    "check": [("Findings", "check.md#findings"), ("the case", "case.md")], "repair": [("Repairing", "check.md#repairing")],
    "rig": [("Joints found from the bones", "skeleton.md#joints-found-from-the-bones")],
    "preprocess": [("Meshers", "meshers.md"), ("the model", "model.md"), ("the case", "case.md")],
    "info": [("the certificate", "model.md#ecorchequality-the-certificate")], "verify": [("the model", "model.md")],
    "pose": [("the posed folder", "posed_folder.md"), ("Quality", "quality.md"), ("the pose", "pose.md"), ("Motion", "motion.md")],
    "unpose": [("what unpose reads", "posed_folder.md#what-unpose-reads"), ("the round trip", "posed_folder.md#the-round-trip")],
    "motion": [("Motion", "motion.md")], "probe": [("Points", "points.md")], "radiograph": [("Radiographs", "radiograph.md")], "export": [("what export writes", "motion.md#what-export-writes")],
    "cohort": [("Cohorts", "cohort.md")], "report": [("Cohorts", "cohort.md#the-group")],
    "thin": [("Thinning", "volumetric.md#thinning")], "refill": [("Refilling", "volumetric.md#refilling")],
    "tears": [("Tears", "volumetric.md#tears")], "path": [("Paths and contacts", "volumetric.md#paths-and-contacts")],
    "contact": [("Paths and contacts", "volumetric.md#paths-and-contacts")],
    "deformers": [("By tets or by spheres", "volumetric.md#by-tets-or-by-spheres")],
    "serve": [("Protocol", "protocol.md"), ("Limits", "limits.md"), ("HTTP", "http.md")], "stream": [("Protocol", "protocol.md")],
}


def pages():
    out = {f"commands/{name}.md": page_of(name) for name in program.subcommands()}
    out["commands/index.md"] = index()
    return out


def cell(text):
    return text.replace("|", "\\|").replace("<", "&lt;").strip()


def spaced(text):
    """Long numbers in groups: 1048576 as 1 048 576."""
    return re.sub(r"(?<![\d.])\d{5,}(?![\d.])", lambda number: f"{int(number[0]):,}".replace(",", " "), text)


def table(options, positional=False):
    out = [f"| {'argument' if positional else 'option'} | value | meaning |\n|---|---|---|"]
    for option in options:
        value = ", ".join(f"`{choice}`" for choice in option.type.split("|")) if option.type else ""
        words = cell(option.text)
        if option.range:
            words += f"; {spaced(option.range)}"
        if option.required:
            words += ". **Required**"
        elif option.default:
            words += f". Default: `{option.default}`"
        names = ", ".join(f"`{name}`" for name in option.names)
        out.append(f"| {names} | {value} | {words} |")
    return "\n".join(out) + "\n"


def page_of(name):
    page = program.page(name)
    out = [NOTICE.format(name, name), f"# ecorche {name}\n", f"{page.about[0].upper()}{page.about[1:]}.\n", f"```text\n{page.usage}\n```\n"]
    if page.positionals:
        out += ["## Arguments\n", table(page.positionals, positional=True)]
    for group in page.groups:
        options = [option for option in group.options if "--help" not in option.names]
        if options:
            out += [f"## {group.title}\n", table(options)]
    out.append("Options of every command (`--json`, `--threads`, `--fail-on-warn`): [Commands](index.md#options-of-every-command).\n")
    if page.notes:
        out += ["## Notes\n", *(cell(note) + "\n" for note in page.notes)]
    out += ["## Example\n", f"```text\n{page.example}\n```\n", "## Exit codes\n",
            "0: done. 1: with `--fail-on-warn`, something was warned of. All others: [Exit codes](../errors.md#exit-codes).\n"]
    if name in MORE:
        out += ["## More\n", *(f"- [{title}](../{target})" for title, target in MORE[name]), ""]
    return "\n".join(out)


def index():
    page = program.page(None)
    out = [NOTICE.format("", "main").replace(" --help`", "--help`"), "# Commands\n", "```text\n" + page.usage + "\n```\n",
           "| command | does |\n|---|---|"]
    out += [f"| [`{name}`]({name}.md) | {cell(words)} |" for name, words in program.subcommands().items()]
    out += ["\n## Options of every command\n"]
    out += [table([option for option in group.options]) for group in page.groups]
    out += ["Results go to stdout, everything else to stderr. Exit codes: [Exit codes and errors](../errors.md).\n"]
    return "\n".join(out)
