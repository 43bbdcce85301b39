#!/usr/bin/env python3
"""Whether pictures and pages are well-formed, by Python's XML parser and html5lib.

Reads a JSON array of paths on standard input, prints a JSON array of {"errors": [...], "elements": n}.
"""

import json
import os
import sys
import xml.etree.ElementTree as ET

try:
    import html5lib
except ImportError:
    if os.environ.get("BENCH_REQUIRE_PYTHON") == "1":
        raise
    html5lib = None


def svg(path):
    try:
        return {"errors": [], "elements": sum(1 for _ in ET.parse(path).iter())}
    except ET.ParseError as error:
        return {"errors": [str(error)], "elements": 0}


def html(path):
    with open(path, "rb") as file:
        if html5lib is None:
            print("pages are not checked: pip install html5lib", file=sys.stderr)
            return {"errors": [], "elements": file.read().count(b"<")}
        parser = html5lib.HTMLParser(strict=False)
        tree = parser.parse(file.read(), transport_encoding="utf-8")
    errors = [f"line {place[0]}: {name} {details}" for place, name, details in parser.errors]
    elements = list(tree.iter())
    ids = [e.get("id") for e in elements if e.get("id")]
    errors += [f"id {i} twice" for i in set(ids) if ids.count(i) > 1]
    links = [e.get("href") for e in elements if e.get("href")]
    errors += [f"{link} leads nowhere" for link in links if not (link.startswith("#") and link[1:] in ids)]
    return {"errors": errors[:20], "elements": len(elements)}


if __name__ == "__main__":
    json.dump([svg(path) if path.endswith(".svg") else html(path) for path in json.load(sys.stdin)], sys.stdout)
