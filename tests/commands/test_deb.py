# The Debian package of the preset `package`: what it holds and needs, and that it starts the program for this
# processor. The programs for all processors give the same bits. Run by ctest with BINARY = the build folder.
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import time
import unittest

BINARY = pathlib.Path(os.environ["BINARY"])
ROOT = pathlib.Path(tempfile.mkdtemp())
unittest.addModuleCleanup(shutil.rmtree, ROOT)
LEVELS = ["x86-64", "x86-64-v3", "x86-64-v4"]
# What GCC's manual says that -march= of these levels uses, by the names of /proc/cpuinfo.
NEEDS = {"x86-64-v3": {"avx2", "fma", "bmi2"}, "x86-64-v4": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}}


def run(*words, **options):
    return subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=300, **options)


def setUpModule():
    global deb
    result = run("cpack", "-G", "DEB", "-B", ROOT, cwd=BINARY)
    assert result.returncode == 0, result.stdout + result.stderr
    [deb] = ROOT.glob("*.deb")
    assert run("dpkg-deb", "-x", deb, ROOT / "installed").returncode == 0


def of_this_processor():
    flags = set(re.search(r"^flags\s*:(.*)$", pathlib.Path("/proc/cpuinfo").read_text(), re.M)[1].split())
    return [level for level in LEVELS if NEEDS.get(level, set()) <= flags]


class Package(unittest.TestCase):
    def field(self, name):
        return run("dpkg-deb", "-f", deb, name).stdout.strip()

    def test_it_needs_what_it_links_and_that_is_in_debian(self):
        packages = [re.split(r"[ (]", word.strip())[0] for word in self.field("Depends").split(",")]
        for needed in ("libc6", "libembree3-3", "libopenimageio2.4", "libvulkan1"):
            self.assertIn(needed, packages)
        for package in packages:
            self.assertEqual(run("dpkg-query", "-W", "-f=${Status}", package).stdout, "install ok installed", package)
        self.assertEqual(self.field("Architecture"), "amd64")

    def test_the_program_becomes_that_of_the_widest_level(self):
        with tempfile.TemporaryDirectory() as folder:
            process = subprocess.Popen([ROOT / "installed/usr/bin/tandem", "render", "glass", "-o", "image.pfm", "--time", "60"], cwd=folder,
                                       stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            started = time.monotonic()
            while (program := os.readlink(f"/proc/{process.pid}/exe")).endswith("bin/tandem") and time.monotonic() < started + 30:
                time.sleep(0.05)
            process.terminate()
            process.communicate()
            self.assertEqual(program, f"{ROOT.resolve()}/installed/usr/lib/tandem/{of_this_processor()[-1]}/tandem")

    def test_all_levels_give_the_same_bits(self):
        levels = of_this_processor()
        print("levels of this processor:", *levels)
        self.assertGreater(len(levels), 1, "this processor has one level, so nothing was compared")
        with tempfile.TemporaryDirectory() as folder:
            for scene in ("cornell-classic", "glass", "conductors", "textures", "cloud", "closed-forms/polygon-light"):
                for precision in ("single", "double", "mixed"):
                    hashes = set()
                    for level in levels:
                        image = pathlib.Path(folder, "image.pfm")
                        result = run(ROOT / "installed/usr/lib/tandem" / level / "tandem", "render", scene, "-o", image, "--backend", "cpu",
                                     "--size", 13, "--samples", 16, "--precision", precision, cwd=folder)
                        self.assertEqual(result.returncode, 0, result.stderr)
                        hashes.add(hashlib.sha256(image.read_bytes()).hexdigest())
                    self.assertEqual(len(hashes), 1, f"{scene}, {precision}")

    def test_no_program_is_left_is_told(self):
        alone = ROOT / "alone" / "bin"
        alone.mkdir(parents=True)
        shutil.copy(ROOT / "installed/usr/bin/tandem", alone)
        result = run(alone / "tandem", "--version")
        self.assertEqual(result.returncode, 2)
        self.assertRegex(result.stderr, "cannot be started .*install Tandem again")


if __name__ == "__main__":
    unittest.main()
