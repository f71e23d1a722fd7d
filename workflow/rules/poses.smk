# SPDX-License-Identifier: Apache-2.0
# The library of poses: one rule, one job a pose, so that another pose is made without touching those that are there.

rule pose:
    input:
        "{participant}/steps/verify.json",
        lambda wc: plan.pose_files(wc.pose)
    output: "{participant}/steps/pose-{pose}.json"
    params: given=lambda wc: plan.given["pose"](wc.pose)
    priority: 5
    threads: plan.threads
    resources: **plan.resources("pose")
    group: "participant"
    run: plan.run(f"pose-{wildcards.pose}", wildcards.participant, params.given, threads, resources)
