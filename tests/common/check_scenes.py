#!/usr/bin/env python3
"""Holds scenes/format/scene.schema.json against the shipped scenes and against samples that the loader is tested with too."""
import json
import pathlib
import subprocess
import sys

import jsonschema

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SCHEMA = json.loads((ROOT / "scenes" / "format" / "scene.schema.json").read_text(encoding="utf-8"))
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def merge_patch(target, patch):
    """RFC 7396."""
    if not isinstance(patch, dict):
        return patch
    result = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            result.pop(key, None)
        else:
            result[key] = merge_patch(result.get(key), value)
    return result


def check_shipped(faults):
    scenes = [path for path in sorted((ROOT / "scenes").rglob("*.json")) if not path.name.endswith((".schema.json", "catalogue.json"))]
    if len(scenes) < 7:
        faults.append(f"only {len(scenes)} scenes found")
    for path in scenes:
        for error in VALIDATOR.iter_errors(json.loads(path.read_text(encoding="utf-8"))):
            faults.append(f"{path.name}: {error.json_path}: {error.message[:200]}")
    return len(scenes)


def check_samples(faults):
    data = json.loads((ROOT / "tests" / "common" / "scene_samples.json").read_text(encoding="utf-8"))
    for sample in data["samples"]:
        accepted = VALIDATOR.is_valid(merge_patch(data["base"], sample["change"]))
        if accepted != (sample["schema"] == "accepts"):
            faults.append(f"sample '{sample['name']}': the schema {'accepts' if accepted else 'refuses'} it")
        if not accepted and "reason" not in sample:
            faults.append(f"sample '{sample['name']}': refused by the schema, yet legal for the loader")
    return len(data["samples"])


def check_generated(faults):
    for script, file in (("one_weekend", "one-weekend.json"), ("next_week", "next-week.json"), ("torus", "models/torus.obj"),
                         ("vase", "models/vase.obj"), ("marbles", "models/marbles.gltf"),
                         ("large_mesh", "models/knot.glb"), ("globe", "images/globe.pfm"), ("mosaic", "images/mosaic.pfm"),
                         ("sky", "images/sky.pfm"), ("cloud", "volumes/cloud.vol")):
        text = subprocess.run([sys.executable, ROOT / "scripts/make" / script, "-"], check=True, capture_output=True).stdout
        if text != (ROOT / "scenes" / file).read_bytes():
            faults.append(f"scenes/{file} is not what scripts/make/{script} writes")


def main():
    faults = []
    VALIDATOR.check_schema(SCHEMA)
    shipped, samples = check_shipped(faults), check_samples(faults)
    check_generated(faults)
    print("\n".join(faults) or f"{shipped} scenes and {samples} samples are as they should be")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
