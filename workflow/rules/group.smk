# SPDX-License-Identifier: Apache-2.0
# One page, one table and one JSON about everybody; and what BIDS asks of a folder of results.

rule group:
    input: plan.group_input()
    output: "group.html", "group.tsv", "group.json"
    params: given=plan.given["group"]()
    resources: **plan.resources("group")
    log: ".cohort/group.log"
    shell: f"{plan.ecorche_q} report group . {' '.join(plan.group_names() + plan.unfinished())} > {{log}} 2>&1 || {{{{ cat {{log}} >&2; exit 1; }}}}"

rule description:
    output: "dataset_description.json"
    params: given=plan.given["description"]()
    shell: f"{plan.python} {plan.scripts}/description.py {{output}} {{params.given:q}}"
