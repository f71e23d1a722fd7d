# SPDX-License-Identifier: Apache-2.0
# Training sets: one job a participant, which goes on where it was.

rule sample:
    input: "{participant}/steps/verify.json"
    output: "{participant}/steps/sample.json"
    params: given=lambda wc: plan.given["sample"](wc.participant)
    priority: 5
    threads: plan.sample_threads
    resources: **plan.resources("sample")
    group: "participant"
    run: plan.run(rule, wildcards.participant, params.given, threads, resources)
