# SPDX-License-Identifier: Apache-2.0
"""dataset_description.json of a folder of results, as BIDS has it for derivatives."""
import json
import pathlib
import sys

sys.dont_write_bytecode = True
import record  # noqa: E402

given = json.loads(sys.argv[2])
source = pathlib.Path(given["source"])
try:
    name = json.loads((source / "dataset_description.json").read_text())["Name"]
except (OSError, ValueError, KeyError, TypeError):
    name = source.name
record.write_text(sys.argv[1], json.dumps({
    "Name": f"ecorche: {name}", "BIDSVersion": "1.8.0", "DatasetType": "derivative",
    "GeneratedBy": [{"Name": "ecorche", "Version": given["program"]["version"], "Description": f"sha256 of the program: {given['program']['sha256']}"}],
    "SourceDatasets": [{"URL": source.as_uri()}],
    "HowToAcknowledge": "For training and education, not for planning surgery."}, indent=1) + "\n")
