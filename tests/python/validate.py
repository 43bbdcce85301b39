#!/usr/bin/env python3
"""Validates JSON documents against a JSON schema with the public package `jsonschema`.

Standard input: {"schema": {...}, "documents": [...]}. Standard output: for each document the list of what is wrong.
"""

import json
import sys

from jsonschema import Draft202012Validator

request = json.load(sys.stdin)
Draft202012Validator.check_schema(request["schema"])
validator = Draft202012Validator(request["schema"])
json.dump([[error.json_path for error in validator.iter_errors(d)] for d in request["documents"]], sys.stdout)
