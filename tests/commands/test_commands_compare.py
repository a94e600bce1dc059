# `tandem compare` on the files of other renderers: formats, parts and layers of EXR files, channels and metadata. Run by ctest
# with TANDEM = the program, SCENES = the folder of the shipped scenes.
import subprocess
import unittest

import numpy

from program import SCENES, ProgramTest, tandem

WIDE = ("--margin", "5%", "--tile-margin", "50%")  # what 256 samples a pixel decide


def oiiotool(*words):
    subprocess.run(["oiiotool", *map(str, words)], check=True, capture_output=True, text=True, timeout=60)


class Files(ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.images = []

    def setUp(self):
        super().setUp()
        self.exr = [self.folder / f"{seed}.exr" for seed in range(1, 5)]
        for seed, file in enumerate(self.exr, 1):
            if seed > len(self.images):
                result = tandem("render", SCENES / "cornell-classic.json", "-o", file, "--size", 32, "--samples", 256, "--seed", seed)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.images.append(file.read_bytes())
            file.write_bytes(self.images[seed - 1])

    def compare(self, *words, status=0):
        result = tandem("compare", *words, *WIDE)
        self.assertEqual(result.returncode, status, result.stdout + result.stderr)
        return result.stdout + result.stderr

    def parts(self, name, *parts):
        """A multi-part file: (part, file, channels as oiiotool's --ch has them)."""
        words = [word for part, file, channels in parts for word in (file, "--ch", channels, "--attrib", "oiio:subimagename", part)]
        oiiotool(*words, "--siappendall", "-o", self.folder / name)
        return self.folder / name

    def values(self, exr):
        """R, G, B of an EXR file, (32, 32, 3), by way of a raw float PFM."""
        pfm = exr.with_suffix(".pfm")
        seed = exr.stem
        result = tandem("render", SCENES / "cornell-classic.json", "-o", pfm, "--size", 32, "--samples", 256, "--seed", seed)
        self.assertEqual(result.returncode, 0, result.stderr)
        return numpy.frombuffer(pfm.read_bytes()[-32 * 32 * 3 * 4:], "<f4").reshape(32, 32, 3)[::-1]

    def test_every_format_is_read_as_linear_light(self):
        for ending, how in (("hdr", []), ("tif", ["-d", "float"]), ("png", ["--tocolorspace", "sRGB", "-d", "uint8"]), ("npy", None),
                            ("pfm", None)):
            with self.subTest(ending):
                files = [file.with_suffix("." + ending) for file in self.exr]
                for exr, file in zip(self.exr, files):
                    if ending == "npy":
                        numpy.save(file, numpy.ascontiguousarray(self.values(exr)))
                    elif ending == "pfm":
                        self.values(exr)
                    else:
                        oiiotool(exr, "--ch", "R,G,B", *how, "-o", file)
                told = self.compare(*files[:2], "vs", *files[2:])
                self.assertEqual("values of 8 bits are decoded to linear light from sRGB" in told, ending == "png", told)
                if ending != "png":  # which cuts the lamp off
                    self.compare(*files[:2], "vs", *self.exr[2:])

    def test_the_parts_of_an_exr_are_its_layers(self):
        a, b, c = self.exr[:3]
        variance = "R=variance.R,G=variance.G,B=variance.B"
        whole = self.parts("parts.exr", ("rgba", a, "R,G,B"), ("variance", a, variance), ("count", a, "count"))
        self.assertEqual(self.compare(whole, b).splitlines()[0].split(":", 1)[1], self.compare(a, b).splitlines()[0].split(":", 1)[1])
        # The image is found by its part's name, also behind others.
        behind = self.parts("behind.exr", ("albedo", c, "R,G,B"), ("beauty", a, "R,G,B"), ("variance", a, variance), ("count", a, "count"))
        self.compare(behind, b)

    def test_parts_of_another_size_are_left_out(self):
        a, b = self.exr[:2]
        oiiotool(b, "--ch", "R,G,B", "--crop", "8x8+0+0", "-o", self.folder / "small.exr")
        variance = "R=variance.R,G=variance.G,B=variance.B"
        self.compare(self.parts("parts.exr", ("beauty", a, "R,G,B"), ("small", self.folder / "small.exr", "R,G,B"),
                                ("variance", a, variance), ("count", a, "count")), b)

    def test_a_layer_is_chosen_by_its_name(self):
        a, b, c = self.exr[:3]
        both = self.parts("both.exr", ("C", a, "R,G,B,count,variance.R,variance.G,variance.B"), ("albedo", c, "R,G,B"))
        self.refused(tandem("compare", both, b), "has 2 layers of R, G and B", "--layer")
        self.compare(both, b, "--layer-a", "C")
        self.refused(tandem("compare", both, b, "--layer-a", "albedo"), "has no channels variance")
        self.refused(tandem("compare", both, b, "--layer-a", "normal"), "normal.R", "its layers are C, C.variance, albedo")
        self.refused(tandem("compare", a, b, "--layer", "C"), "its layers are plain R, G, B, variance")

    def test_help_says_what_is_looked_for(self):
        told = " ".join(tandem("compare", "--help").stdout.split())
        for word in ("EXR", "HDR", "TIFF", "PNG", "PFM", "NumPy", "variance.R", "samplesPerPixel", "tandem:seed", "sRGB"):
            self.assertIn(word, told)


if __name__ == "__main__":
    unittest.main()
