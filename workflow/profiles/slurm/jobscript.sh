#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# properties = {properties}
# The Snakemake of a group's job would put one more around each step, which needs none (scripts/step_forks.py): here it is told so.
sed 's/ -m snakemake /&--force-use-threads /' <<'END_OF_JOB' | sh
{exec_job}
END_OF_JOB
