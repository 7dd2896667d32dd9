#!/usr/bin/env python3
"""Checks docs/scene.schema.json, and by it the scenes of samples/ and the examples of docs/scenes.md; what is wrong must not pass.
Usage: schema_test.py SOURCE_FOLDER. Skipped (status 77) without python3-jsonschema."""
import copy
import glob
import json
import os
import re
import sys

try:
    from jsonschema import Draft202012Validator
except ImportError:
    print("skipped: needs python3-jsonschema 4 or later")
    sys.exit(77)


def load(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def wrong(good):
    """Scenes with one fault each, by what is wrong."""
    def changed(change):
        scene = copy.deepcopy(good)
        change(scene)
        return scene
    first = lambda scene: scene["texels"][0]["objects"][0]
    return {
        "unknown key": changed(lambda s: s.update(objets=[])),
        "another format": changed(lambda s: s.update(format="texel-shape")),
        "another version": changed(lambda s: s.update(version=2)),
        "objects and texels": changed(lambda s: s.update(objects=[{"input": "ground"}])),
        "neither": changed(lambda s: s.pop("texels")),
        "no inputs": changed(lambda s: s.pop("inputs")),
        "a bad name": changed(lambda s: s["texels"][0].update(name="../x")),
        "a bad colour": changed(lambda s: s["inputs"].update(x={"file": "a", "materials": {"*": {"kd": "red"}}})),
        "a bad unit": changed(lambda s: s["inputs"].update(x={"file": "a", "unit": "parsec"})),
        "scale 0": changed(lambda s: first(s).update(transform={"scale": 0})),
        "a short vector": changed(lambda s: first(s).update(transform={"translate": [1, 2]})),
        "a matrix and more": changed(lambda s: first(s).update(transform={"matrix": [1] * 12, "scale": 2})),
        "13 numbers": changed(lambda s: first(s).update(transform={"matrix": [1] * 13})),
        "both kinds of instances": changed(lambda s: first(s).update(instances=[{}], instances_file="p.csv")),
        "input and objects": changed(lambda s: first(s).update(objects=[{"input": "ground"}])),
        "texel in a recipe": changed(lambda s: s["texels"][0].update(recipe={"texel": "a"})),
    }


def main(root):
    schema = json.loads(load(os.path.join(root, "docs/scene.schema.json")))
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    scenes = {os.path.relpath(path, root): json.loads(load(path)) for path in sorted(glob.glob(os.path.join(root, "samples/*/*.json")))}
    scenes = {path: scene for path, scene in scenes.items() if scene.get("format") == "texel-scene"}
    examples = [json.loads(text) for text in re.findall(r"```json\n(.*?)```", load(os.path.join(root, "docs/scenes.md")), re.DOTALL)]
    assert scenes and examples, "nothing to check"
    for i, example in enumerate(examples):
        scenes["docs/scenes.md, example %d" % (i + 1)] = example
    faults = ["%s: %s" % (path, error.message) for path, scene in scenes.items() for error in validator.iter_errors(scene)]
    faults += ["passes with %s" % what for what, scene in wrong(examples[0]).items() if validator.is_valid(scene)]
    print("\n".join(faults) if faults else "schema: good, %d scenes" % len(scenes))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
