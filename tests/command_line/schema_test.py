"""JSON Schemas and tables of keys: what is shipped is what the program prints, and what a schema says of a file is what
`proxarm check` says of it. The judge is python3-jsonschema: hundreds of files of each kind, spoilt at random in one place,
must get the same verdict from both. Where the reader alone refuses, it must be for what a schema can't know (UNKNOWABLE).
"""
import copy
import json
import math
import os
import random
import re
import shutil
import unittest

import jsonschema
import yaml
from harness import SOURCE, ProgramTest

KINDS = {"cell": ["models/cells", "models/schema/specimens/cell"], "hand": ["sim/hands", "models/schema/specimens/hand"],
         "scene": ["scenes", "models/schema/specimens/scene"], "sensor": ["models/sensors", "models/schema/specimens/sensor"],
         "tool": ["scenes/tools", "models/schema/specimens/tool"], "drive": ["models/drives", "models/schema/specimens/drive"]}
MUTATIONS = int(os.environ.get("PROXARM_MUTATIONS", "400"))  # of each kind
SEED = int(os.environ.get("PROXARM_SEED", "19"))

# What only the reader knows: the start of what it says, "KEY: found …, expected …", or what it expected. Anything else that
# it refuses a schema must refuse too.
UNKNOWABLE = {
    "files": r"expected (a readable file|a mesh)|column|header|no such file",
    "names": r"expected (a (bus|line) of this cell|one of this cell's|the joint of one|a name that no|a joint that no|one of those of|"
             r"a name of its own|a signal of|a message of|a whole number from \d+ to \d+$)|^sensor\.settings",
    "bounds that are other keys' values":
        r"^(drives\[\d+\]\.(homing\.(speed|slow_speed|acceleration|angle)_\w+|max_torque_Nm|feedback)|start_rad(\[\d+\])?|matrix(\[\d+\])?|"
        r"limits\.\w+(\[\d+\])?\.max(\[\d+\])?|(.*\.)?(byte|from|to|register|id|identifier|polynomial|initial)|"
        r"(settings\.\w+|base_id)\.(min|max|default)|frames\[\d+\]\.(bytes|starts_with)|control\.(on|off)): |"
        r"expected (0 \(a classic bus\), or|\[lowest|angles whose counts|an angle in the range|a time (after|at least)|at least two periods|a setting of|a rate )",
    "what doesn't go together":
        r"expected (registers (of its own|among)|bits |the bits that say|identifiers that|no register above|another |a node that is free|the same as|a control word|"
        r"offset_m, turn_rad or both|amplitude_m, amplitude_rad or both|a rotation of at most|turning_stiffness_Nm_per_rad above|0 of a hand without|"
        r"exactly one value|at most (one value|121|\d+ bytes)|fd: true|a classic bus|false: bus|a first frame|a sample that|a checksum|a counter|"
        r"bytes that hold|a poll of|no rate for|off: drives|stop_1 or stop_0|none: drives|the key `dbc`|one (of|that)|a last point|a drive on CAN|"
        r"32 for a float|a number that ends|up to 256 bytes)|unknown key|format:",
    "the arm, and what runs": r"^(default_period_s: )?bus |expected (a joint of|a link of|a range within the URDF's|a mass|a timestep|a start|a start pose)",
    "geometry": r"expected (a direction|axes of nonzero|a physical inertia|an invertible matrix|a closed mesh|less than half of how thick|a number other than 0|a shape, in W)|"
                r"leads out of the proxy's (plane|space)",
}

# The same where drives have keys from defaults: what each of them must have, and what follows from a key that isn't in it.
UNKNOWABLE_WITH_DEFAULTS = r"^drives\[\d+\].*: found nothing|expected no `"


class Loader(yaml.SafeLoader):
    """YAML 1.2's core schema, which the reader and editors go by: `on` is a text, 1e5 a number."""


Loader.yaml_implicit_resolvers = {}
for tag, pattern, first in (("bool", r"true|false", "tf"), ("null", r"null|~|", "n~"),
                            ("int", r"[-+]?[0-9]+|0x[0-9a-fA-F]+", "-+0123456789"),
                            ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", "-+.0123456789")):
    Loader.add_implicit_resolver(f"tag:yaml.org,2002:{tag}", re.compile(f"^(?:{pattern})$"), list(first))
Loader.add_constructor("tag:yaml.org,2002:float", lambda loader, node: float(node.value))


def with_text_keys(value):
    if isinstance(value, dict):
        return {str(key): with_text_keys(entry) for key, entry in value.items()}
    return [with_text_keys(entry) for entry in value] if isinstance(value, list) else value


def load(text):
    return with_text_keys(yaml.load(text, Loader))


def schema(kind):
    return json.loads((SOURCE / f"models/schema/{kind}.json").read_text())


def places(value, path=()):
    """Paths of all values."""
    yield path
    for key, entry in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(entry, (*path, key))


def parts(node, instance):
    """The schemas that hold for an instance: a schema, and what its conditions and alternatives bring."""
    if not isinstance(node, dict):
        return
    yield node
    for branch in node.get("allOf", []):
        if jsonschema.Draft202012Validator(branch["if"]).is_valid(instance):
            yield from parts(branch["then"], instance)
    for one in node.get("anyOf", []):
        yield from parts(one, instance)


def bounds(root, instance, path):
    """The least and the greatest numbers that the schema names for the value of a path."""
    now, value = [root], instance
    for key in path:
        below = []
        for node in now:
            for part in parts(node, value):
                below.append(part.get("items") if isinstance(key, int) else part.get("properties", {}).get(key))
        now, value = [node for node in below if node], value[key]
    return [part[name] for node in now for part in parts(node, value)
            for name in ("minimum", "exclusiveMinimum", "maximum", "enum") if name in part]


def spoil(rng, root, document):
    """One mutation; what it is, and the document."""
    spoilt = copy.deepcopy(document)
    path = rng.choice([path for path in places(spoilt) if path])
    parent = spoilt
    for key in path[:-1]:
        parent = parent[key]
    key, value = path[-1], parent[path[-1]]
    ways = ["remove", "type", "edge"] + (["unknown"] if isinstance(value, dict) else [])
    way = rng.choice(ways)
    if way == "remove":
        del parent[key]
    elif way == "unknown":
        value["unknown_key"] = 1
    elif way == "type" or isinstance(value, (dict, list, str, bool)):
        parent[key] = rng.choice([{}, [], {"a": 1}, [1], True, "words here", -1, 1.5, ""])
    else:
        limits = [limit for limit in bounds(root, document, path) if not isinstance(limit, (str, list))] or [0]
        limit = rng.choice(limits)
        whole = isinstance(value, int) and isinstance(limit, int)
        parent[key] = rng.choice([limit] + ([limit - 1, limit + 1] if whole else
                                           [math.nextafter(limit, -math.inf), math.nextafter(limit, math.inf)]))
    now = parent.get(key, "-") if isinstance(parent, dict) else ""
    return f"{way} {'.'.join(map(str, path))}: {now}", spoilt


class Schema(ProgramTest):
    def tree(self):
        root = self.folder / "tree"
        if not root.exists():
            for part in ("models", "scenes", "sim/hands"):
                shutil.copytree(SOURCE / part, root / part, ignore=shutil.ignore_patterns("*.cpp", "*.hpp"))
        return root

    def documents(self, kind):
        return [file for folder in KINDS[kind] for file in sorted((self.tree() / folder).glob("*.yaml"))]

    def verdicts(self, files):
        """By file: what `check` says against it, if anything. Errors without a line are none of the file's form."""
        outcome = self.call("check", "--states", "1", *files, timeout=1200)
        said = {str(file): "" for file in files}
        for line in outcome.err.splitlines():
            if found := re.match(r"proxarm: (\S+?\.yaml)(:\d+)?(:\d+)?: (.*)", line):
                if found[2] and found[1] in said:
                    said[found[1]] = found[4]
        return said

    def test_what_is_shipped_is_what_is_printed(self):
        page = (SOURCE / "docs/reference/keys.md").read_text()
        for kind in KINDS:
            with self.subTest(kind=kind):
                self.assertEqual(self.call("schema", kind).out, (SOURCE / f"models/schema/{kind}.json").read_text(),
                                 "models/schema/make writes it anew")
                self.assertIn(self.call("schema", kind, "--markdown").out, page, "models/schema/make writes it anew")
                jsonschema.Draft202012Validator.check_schema(schema(kind))

    def test_arguments_are_refused_clearly(self):
        for arguments, said in ((("schema",), "kind"), (("schema", "cell", "--json"), "--json"),
                                (("schema", "cells"), "expected cell, drive, hand, scene, sensor or tool")):
            outcome = self.call(*arguments)
            self.assertEqual(outcome.status, 2)
            self.assertIn(said, outcome.err)

    def test_shipped_files_and_specimens_fit(self):
        for kind in KINDS:
            judge = jsonschema.Draft202012Validator(schema(kind))
            files = self.documents(kind)
            self.assertGreaterEqual(len(files), 5)
            for file in files:
                with self.subTest(file=file.name):
                    mistakes = judge.iter_errors(load(file.read_text()))
                    self.assertEqual([f"{mistake.json_path}: {mistake.message}" for mistake in mistakes], [])

    def test_examples_in_the_docs_fit(self):
        fitting = 0
        for page in (SOURCE / "docs").rglob("*.md"):
            for block in re.findall(r"^```yaml\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL):
                if "…" in block:
                    continue  # one line of a file
                document = load(block)
                keys = set(document)
                kind = "scene" if keys & {"media", "guide", "space"} else "hand" if "waypoints" in keys else None
                if kind:
                    jsonschema.Draft202012Validator(schema(kind)).validate(document)
                    fitting += 1
        self.assertGreaterEqual(fitting, 3)

    def agree(self, kind):
        rng = random.Random(f"{SEED} {kind}")
        root = schema(kind)
        judge = jsonschema.Draft202012Validator(root)
        documents = [(file, load(file.read_text())) for file in self.documents(kind)]
        spoilt = {}
        for i in range(MUTATIONS):
            file, document = rng.choice(documents)
            what, mutant = spoil(rng, root, document)
            if kind == "tool" and not set(mutant) & set(root["properties"]) - {"name"}:
                continue  # without a shape it is no tool's file
            path = file.with_name(f"mutant_{i}.yaml")
            path.write_text(yaml.safe_dump(mutant, sort_keys=False, allow_unicode=True))
            unknowable = list(UNKNOWABLE.values())
            if set(mutant) & {"drive_defaults", "simulation_defaults"}:
                unknowable.append(UNKNOWABLE_WITH_DEFAULTS)
            spoilt[str(path)] = (f"{file.name}: {what}", judge.is_valid(mutant), "|".join(unknowable))
        said = self.verdicts(list(spoilt))
        refused_by_both = 0
        for path, (what, fits, unknowable) in spoilt.items():
            with self.subTest(mutation=what, seed=SEED):
                if not fits:
                    self.assertNotEqual(said[path], "", "the schema refuses what the program takes")
                    refused_by_both += 1
                elif said[path]:
                    self.assertTrue(re.search(unknowable, said[path]),
                                    f"the program refuses what the schema takes: {said[path]}")
        self.assertGreater(refused_by_both, MUTATIONS / 4)

    def test_cells_get_the_same_verdict(self):
        self.agree("cell")

    def test_hands_get_the_same_verdict(self):
        self.agree("hand")

    def test_scenes_get_the_same_verdict(self):
        self.agree("scene")

    def test_sensors_get_the_same_verdict(self):
        self.agree("sensor")

    def test_tools_get_the_same_verdict(self):
        self.agree("tool")

    def test_drives_get_the_same_verdict(self):
        self.agree("drive")


if __name__ == "__main__":
    unittest.main()
