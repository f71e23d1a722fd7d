# SPDX-License-Identifier: Apache-2.0
# From a participant's files to a verified model, and what is said of it in the end.

# Later steps come first, so that participants are done one by one.
#
# `given` is all that a step depends on besides its input files: when it changes, the step is made again. Threads, memory and attempts change
# no result, so they are none of it.

wildcard_constraints:
    participant="sub-[0-9A-Za-z]+",
    pose="[a-z0-9_]+"

rule new:
    input: lambda wc: plan.files(wc.participant)
    output: "{participant}/steps/new.json"
    params: given=lambda wc: plan.given["new"](wc.participant)
    threads: plan.threads
    resources: **plan.resources("new")
    group: "participant"
    run: plan.run(rule, wildcards.participant, params.given, threads, resources)

rule check:
    input: lambda wc: plan.files(wc.participant) if plan.is_case(wc.participant) else f"{wc.participant}/steps/new.json"
    output: "{participant}/steps/check.json"
    params: given=lambda wc: plan.given["check"](wc.participant)
    priority: 1
    threads: plan.threads
    resources: **plan.resources("check")
    group: "participant"
    run: plan.run(rule, wildcards.participant, params.given, threads, resources)

rule repair:
    input: "{participant}/steps/check.json"
    output: "{participant}/steps/repair.json"
    params: given=lambda wc: plan.given["repair"](wc.participant)
    priority: 2
    threads: plan.threads
    resources: **plan.resources("repair")
    group: "participant"
    run: plan.run(rule, wildcards.participant, params.given, threads, resources)

rule preprocess:
    input: "{participant}/steps/repair.json"
    output: "{participant}/steps/preprocess.json"
    params: given=lambda wc: plan.given["preprocess"](wc.participant)
    priority: 3
    threads: plan.threads
    resources: **plan.resources("preprocess")
    group: "participant"
    run: plan.run(rule, wildcards.participant, params.given, threads, resources)

rule verify:
    input: "{participant}/steps/preprocess.json"
    output: "{participant}/steps/verify.json"
    params: given=lambda wc: plan.given["verify"](wc.participant)
    priority: 4
    threads: plan.threads
    resources: **plan.resources("verify")
    group: "participant"
    run: plan.run(rule, wildcards.participant, params.given, threads, resources)

rule subject:
    input:
        lambda wc: [f"{wc.participant}/steps/{name}.json" for name in plan.told(wc.participant)]
    output: "{participant}/steps/subject.json"
    params: given=lambda wc: plan.given["subject"](wc.participant)
    priority: 6
    threads: plan.threads
    resources: **plan.resources("subject")
    group: "participant"
    run: plan.run(rule, wildcards.participant, params.given, threads, resources)
