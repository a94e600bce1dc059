# Blender's Cycles by scripts/adapters/cycles.py and by the script that tandem export writes. Status 77 where there is no blender.
import json
import pathlib
import shutil
import sys
import unittest

from program import SCENES, SPHERE, ProgramTest, tandem

ADAPTER = pathlib.Path(__file__).resolve().parents[2] / "scripts/adapters/cycles.py"
GOLD = {"eta": [0.143, 0.375, 1.442], "k": [3.983, 2.386, 1.603]}
GLASS = {"kind": "specular", "colour": [0.9, 0.7, 0.5], "translucent": True}

# Every lobe that nodes sample, and media, in rows of sheared balls under a sky of two colours.
MATERIALS = {
    "smooth gold": {"kind": "conductor", **GOLD},
    "rough gold": {"kind": "conductor", **GOLD, "roughness": 0.6},
    "fuzzy mirror": {"kind": "specular", "colour": [0.8, 0.6, 0.4], "fuzz": 0.4},
    "rough glass": {**GLASS, "alpha": 0.3, "roughness": 0.5},
    "fuzzy glass": {**GLASS, "alpha": 0.5, "fuzz": 0.2, "fresnel": "schlick", "refractive_index": 1.3},
    "glowing glass": {"kind": "emissive", "radiance": [1.5, 0.5, 0.2], "colour": [0.9, 0.5, 0.3], "translucent": True, "alpha": 0.7},
    "ink in glass": {**GLASS, "alpha": 0, "interior": "ink"},
    "milk": {"kind": "boundary", "interior": "milk"},
}
BALLS = {
    "film": {"width": 24, "height": 24},
    "camera": {"position": [0, 9, 5], "target": [0, 0, 0], "up": [0, 1, 0], "vertical_field_degrees": 30},
    "background": {"down": [0.2, 0.5, 1], "up": [1, 0.7, 0.4]},
    "render": {"bounces": 64},
    "media": {"ink": {"absorption": [0.3, 0.6, 0.9]}, "milk": {"scattering": [0.5, 1, 2], "absorption": 0.2, "anisotropy": 0.6}},
    "materials": MATERIALS | {"floor": {"kind": "diffuse", "colour": [0.6, 0.5, 0.4]}},
    "entities": [{"material": "floor", "primitives": [{"quad": {"corner": [-9, -1.01, 9], "edges": [[18, 0, 0], [0, 0, -18]]}}]}] +
                [{"material": name, "transform": [{"matrix": [0.8, 0, 0.3, 0, 0, 0.8, 0, 0, 0, 0, 0.8, 0, 0, 0, 0, 1]}, {"translate": [1.8 * (i % 3) - 1.8, 0, 1.8 * (i // 3) - 1.8]}],
                  "primitives": [{"sphere": {"centre": [0, 0, 0], "radius": 1}}]} for i, name in enumerate(MATERIALS)],
}


class CyclesTest(ProgramTest):
    def verify(self, scene, margin, script=ADAPTER, *more):
        return tandem("verify", scene, "--reference", "cpu", "--oracle", "none", "--time", "60", "--margin", margin, *more, "--candidate",
                      f"exec:blender --background --factory-startup --python {script}")

    def exported(self, scene):
        script = self.folder / "scene.py"
        result = tandem("export", scene, "--to", "blender", "-o", script)
        self.assertEqual(result.returncode, 0, result.stderr)
        return script

    def test_every_lobe_of_the_export_agrees(self):
        scene = self.write(BALLS)
        result = self.verify(scene, "1%", self.exported(scene))
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_a_metal_is_told_from_one_that_absorbs_a_tenth_less(self):
        plate = SCENES / "closed-forms/gold-plate.json"
        result = self.verify(plate, "0.1%", ADAPTER, "--size", "16")
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        scene = json.loads(plate.read_text())
        scene["materials"]["gold"]["k"] = [0.9 * k for k in GOLD["k"]]
        result = self.verify(plate, "0.1%", self.exported(self.write(scene, "other.json")), "--size", "16")
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)

    def test_what_cycles_does_otherwise_is_refused(self):
        for pointer, value, reason in (
                ("/materials/grey", {"kind": "rough-diffuse", "colour": [0.5] * 3, "roughness": 0.3}, "Cycles' fit of Oren and Nayar's model is another one"),
                ("/materials/grey", {**GLASS, "priority": 1}, "Cycles knows no priorities"),
                ("/render", {"bounces": 4, "ray_min": 0.1}, "render has 'ray_min'")):
            result = self.verify(self.changed(pointer, value), "5%")
            self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
            self.assertIn(reason, result.stdout)


if __name__ == "__main__":
    if not shutil.which("blender"):
        print("skipped: there is no blender")
        sys.exit(77)
    unittest.main()
