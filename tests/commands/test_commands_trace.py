#!/usr/bin/python3
"""Runs `tandem trace` as a user would."""
import json
import unittest
from xml.etree import ElementTree

from program import SCENES, ProgramTest, tandem

SVG = "{http://www.w3.org/2000/svg}"


class Trace(ProgramTest):
    def test_trace_tells_a_path_vertex_by_vertex(self):
        report = self.folder / "path.json"
        result = tandem("trace", self.scene, "--size", "16", "--pixel", "8,8", "--sample", "3", "--seed", "4", "--backends",
                        "cpu,oracle", "--json", report)
        self.assertEqual(result.returncode, 0, result.stderr)
        for mention in ("vertex 0", "primitive 0 of \"ball\"", "scattered", "left the scene", "the same path"):
            self.assertIn(mention, result.stdout)
        told = json.loads(report.read_text())
        self.assertEqual((told["pixel"], told["sample"], told["seed"]), ([8, 8], 3, 4))
        for trace in told["traces"]:
            first = trace["vertices"][0]
            self.assertEqual(first["event"], "scattered")
            self.assertAlmostEqual(first["t"], 3, delta=0.05)  # from 4 to a ball of radius 1
            self.assertAlmostEqual(first["normal"][2], 1, delta=0.1)
            self.assertEqual(first["weight"], [0.5, 0.5, 0.5])
            self.assertEqual(trace["radiance"], [0.25, 0.25, 0.25])  # grey of the ball and of the sky
        comparison, = told["comparisons"]
        self.assertIsNone(comparison["first_divergence"])
        self.assertLess(comparison["vertices"][0]["position_ulp"], 64)

    def test_trace_refuses_what_it_cannot_follow(self):
        self.refused(tandem("trace", self.scene, "--pixel", "16,0", "--backends", "cpu"), "--pixel 16,0", "16 x 16")
        self.refused(tandem("trace", self.scene, "--pixel", "1,1", "--backends", "cpu", "--integrator", "bidirectional"),
                     "no single path")
        self.refused(tandem("trace", self.scene, "--pixel", "1,1", "--backends", "gpu"), "gpu")
        self.refused(tandem("trace", self.scene), "--pixel")
        trace = ["trace", self.scene, "--pixel", "1,1"]
        for sample in ["-1", "18446744073709551615", "1.5"]:
            self.refused(tandem(*trace, "--sample", sample), "--sample")
        self.refused(tandem(*trace, "--accumulation", "plain"), "--accumulation")
        self.refused(tandem(*trace, "--backends", "vulkan", "--precision", "double"), "--precision", "cpu")
        self.refused(tandem(*trace, "--backends", "cpu,oracle", "--vulkan-precision", "double"), "--vulkan-precision")
        self.refused(tandem(*trace, "--backends", "cpu", "--device", "0"), "--device")

    def test_the_picture_has_each_vertex_where_the_path_has_it(self):
        picture, report = self.folder / "path.svg", self.folder / "path.json"
        result = tandem("trace", SCENES / "nested-glass.json", "--size", "64", "--pixel", "32,20", "--backends", "cpu", "--svg",
                        picture, "--json", report)
        self.assertEqual(result.returncode, 0, result.stderr)
        vertices = [v for v in json.loads(report.read_text())["traces"][0]["vertices"] if v["t"] is not None]
        self.assertGreaterEqual(len(vertices), 4)
        root = ElementTree.parse(picture).getroot()
        dots = {dot.get("class"): (float(dot.get("cx")), float(dot.get("cy"))) for dot in root.iter(SVG + "circle")}
        # From above, all are moved and scaled alike.
        (x0, z0), (x1, z1) = (v["position"][::2] for v in vertices[:2])
        (a0, b0), (a1, b1) = dots["plan-0"], dots["plan-1"]
        scale = ((a1 - a0) ** 2 + (b1 - b0) ** 2) ** 0.5 / ((x1 - x0) ** 2 + (z1 - z0) ** 2) ** 0.5
        for i, vertex in enumerate(vertices):
            x, z = vertex["position"][::2]
            self.assertAlmostEqual(dots[f"plan-{i}"][0], a0 + scale * (x - x0), delta=0.5)
            self.assertAlmostEqual(dots[f"plan-{i}"][1], b0 + scale * (z - z0), delta=0.5)
        # In the image, the first lies within its pixel.
        pixel, = [rect for rect in root.iter(SVG + "rect") if rect.get("id") == "pixel"]
        for centre, edge, length in zip(dots["image-0"], ("x", "y"), ("width", "height")):
            self.assertGreaterEqual(centre, float(pixel.get(edge)) - 0.01)
            self.assertLessEqual(centre, float(pixel.get(edge)) + float(pixel.get(length)) + 0.01)

    def test_the_picture_can_be_read(self):
        def drawn(scene, pixel, *options):
            picture = self.folder / "drawn.svg"
            result = tandem("trace", scene, "--pixel", pixel, "--backends", "oracle", "--svg", picture, *options)
            self.assertEqual(result.returncode, 0, result.stderr)
            root = ElementTree.parse(picture).getroot()
            return {panel.get("id"): panel for panel in root.iter(SVG + "svg") if panel.get("id")}
        # The edge that the two triangles of a quad share is not drawn; that of a fold is.
        flat, apart = [[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0.5], [0, 1, 0]]
        for other, edges in (([[0, 0, 0], [1, 1, 0], [0, 1, 0]], 4), (apart, 6), ([[0, 0, 0], [1, 1, 0], [0, 1, 0.5]], 5)):
            panels = drawn(self.changed("/entities/0/primitives", [{"triangle": flat}, {"triangle": other}]), "0,0")
            outlines, = [path for path in panels["image"].iter(SVG + "path") if path.get("stroke") == "#bbb"]
            self.assertEqual(outlines.get("d").count("L"), edges)
        # Vertices that lie together have numbers that do not lie upon each other.
        panels = drawn(SCENES / "nested-glass.json", "160,100")
        for panel in panels.values():
            places = [(float(text.get("x")), float(text.get("y"))) for text in panel.iter(SVG + "text")]
            self.assertGreaterEqual(len(places), 6)
            for i, a in enumerate(places):
                self.assertTrue(all(abs(a[0] - b[0]) >= 8 or abs(a[1] - b[1]) >= 12 for b in places[:i]), places)
        # Many spheres do not make it slow to open.
        drawn(SCENES / "one-weekend.json", "30,20", "--size", "64")
        self.assertLess((self.folder / "drawn.svg").stat().st_size, 1_000_000)
        self.assertIn("camera", [text.text for text in panels["plan"].iter(SVG + "text")])

    def test_the_picture_is_no_file_that_is_read_and_has_a_folder(self):
        trace = ["trace", self.scene, "--pixel", "1,1", "--backends", "cpu", "--svg"]
        self.refused(tandem(*trace, self.scene), "would overwrite")
        self.refused(tandem(*trace, self.folder / "absent/path.svg"), "absent")


if __name__ == "__main__":
    unittest.main()
