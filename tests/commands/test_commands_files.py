# Files and streams as a user meets them. Nothing that was read is overwritten. What cannot be written is known before
# the work. A reader that goes away harms no file. Names with control characters are shown escaped.
import json
import os
import pathlib
import pty
import resource
import shutil
import signal
import struct
import subprocess
import sys
import time
import unittest

from program import SPHERE, TANDEM, THOROUGH, ProgramTest, at_work, tandem

# A scene that reads a file of every kind.
FILES = ["scene.json", "model.obj", "model.gltf", "model.bin", "cloud.vol", "sky.pfm", "skin.pfm"]
CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]


def pfm(width, height, value):
    return f"PF\n{width} {height}\n-1.0\n".encode() + struct.pack("<f", value) * (width * height * 3)


def write_scene(folder, name="scene.json"):
    """Writes a scene and all that it reads; returns its path."""
    (folder / "model.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (folder / "model.bin").write_bytes(b"".join(struct.pack("<fff", *corner) for corner in CORNERS))
    (folder / "model.gltf").write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "model.bin"}]}))
    (folder / "cloud.vol").write_bytes(b"VOL\x03" + struct.pack("<5i6ff", 1, 1, 1, 1, 1, 5, 5, 5, 6, 6, 6, 1))
    (folder / "sky.pfm").write_bytes(pfm(2, 1, 0.5))
    (folder / "skin.pfm").write_bytes(pfm(1, 1, 0.5))
    scene = json.loads(json.dumps(SPHERE))
    scene["film"] = {"width": 8, "height": 8}
    scene["background"] = {"image": "sky.pfm", "colour_space": "linear"}
    scene["textures"] = {"skin": {"kind": "image", "file": "skin.pfm", "colour_space": "linear"}}
    scene["media"] = {"cloud": {"scattering": [1, 1, 1], "grid": {"file": "cloud.vol"}}}
    scene["materials"]["skin"] = {"kind": "diffuse", "colour": {"texture": "skin"}}
    scene["materials"]["cloud"] = {"kind": "boundary", "interior": "cloud"}
    scene["entities"] += [
        {"material": "grey", "primitives": [{"obj": {"file": "model.obj"}}]}, {"material": "skin", "primitives": [{"gltf": {"file": "model.gltf"}}]},
        {"material": "cloud", "primitives": [{"sphere": {"centre": [5.5, 5.5, 5.5], "radius": 0.5}}]}]
    (folder / name).write_text(json.dumps(scene))
    return folder / name


class FilesTest(ProgramTest):
    part_bytes = noisy_bytes = None

    def setUp(self):
        super().setUp()
        self.scene = write_scene(self.folder)
        self.catalogue = self.folder / "catalogue.json"
        self.write_case(self.folder, "a", "hard.json")
        self.images = [self.folder / f"{name}.pfm" for name in "abcd"]
        for i, path in enumerate(self.images):
            path.write_bytes(pfm(8, 8, 0.5 + 1e-3 * i))
        self.part = self.write_part()
        (self.folder / "noisy.exr").write_bytes(self.noisy())

    def write_part(self):
        """A part of a render; one for all tests."""
        path = self.folder / "part.exr"
        if FilesTest.part_bytes is None:
            self.assertEqual(tandem("render", self.scene, "-o", path, "--range", "0:1").returncode, 0)
            FilesTest.part_bytes = path.read_bytes()
        path.write_bytes(FilesTest.part_bytes)
        return path

    def noisy(self):
        """The bytes of an image with features; one for all tests."""
        if FilesTest.noisy_bytes is None:
            path = self.folder / "made.exr"
            self.assertEqual(tandem("render", self.scene, "-o", path, "--samples", "4", "--aov", "albedo,normal,depth").returncode, 0)
            FilesTest.noisy_bytes = path.read_bytes()
            path.unlink()
        return FilesTest.noisy_bytes

    def write_case(self, folder, name, file):
        """A catalogue of one hard case, and its scene."""
        scene = json.loads((self.folder / "scene.json").read_text()) | {"expect": {"radiance": [1, 1, 1], "formula": "none"}}
        (folder / file).write_text(json.dumps(scene))
        (folder / "catalogue.json").write_text(json.dumps({"cases": [{
            "id": name, "name": name, "subject": "images", "scene": file, "samples": 1, "bound": "a", "bound_ulp": 1e9,
            "source": "a"}]}))

    def commands(self, scene=None):
        """Each command with its scene: arguments, and the options that name an output with the ending of that."""
        scene, text = scene or self.scene, {"--json": ".json"}
        verdict = {"--json": ".json", "--junit": ".xml", "--report": ""}
        pair = ["--reference", "cpu", "--candidate", "cpu"]
        return {
            "render": (["render", scene, "--samples", "1"], {"-o": ".exr", "--json": ".json", "--resume": ".exr"}),
            "verify": (["verify", scene, *pair, "--oracle", "none", "--samples", "64"], verdict),
            "export": (["export", scene, "--to", "gltf"], {"-o": ".gltf", "--json": ".json"}),
            "effects": (["effects", scene, "--backend", "cpu", "--time", "1"], text),
            "trace": (["trace", scene, "--pixel", "4,4", "--backends", "cpu"], text),
            "cost": (["cost", scene, "--time", "1", "--size", "4", "--knob", "bounces", "--no-cache"],
                     {"--json": ".json", "--resume": ".samples"}),
            "bench": (["bench", "--scene", scene, "--list"], text),
            "stability": (["stability", "--catalogue", self.catalogue, "--backend", "cpu", "--precision", "single"], text),
        }

    def every_command(self):
        a, b, c, d = self.images
        rest = self.commands()
        rest["compare"] = (["compare", a, c, "vs", b, d], {"--json": ".json", "--junit": ".xml", "--report": ""})
        rest["merge"] = (["merge", self.part], {"-o": ".exr", "--json": ".json"})
        rest["denoise"] = (["denoise", self.folder / "noisy.exr"], {"-o": ".exr", "--json": ".json"})
        rest["judges"] = (["judges", a, b], {"--json": ".json"})
        rest["devices"] = (["devices"], {"--json": ".json"})
        return rest

    def snapshot(self):
        return {path.name: path.read_bytes() for path in self.folder.iterdir() if path.is_file()}

    def needed(self, outputs, but=()):
        """Fresh values of the options that a command cannot do without."""
        return [word for option in ["-o"] if option in outputs and option not in but for word in (option, self.folder / "new.exr")]


class OutputsSpareInputs(FilesTest):
    def refuse(self, command, option, name, read):
        arguments, outputs = self.commands()[command]
        with self.subTest(command=command, option=option, name=name):
            self.refused(tandem(*arguments, option, name, *self.needed(outputs, [option])), read, "which is read")

    def test_no_output_overwrites_a_file_that_was_read(self):
        before = self.snapshot()
        for name in FILES:
            self.refuse("render", "--json", self.folder / name, name)
        self.refuse("render", "-o", self.folder / "sky.pfm", "sky.pfm")
        for command, (_, outputs) in self.commands().items():
            for option in outputs.keys() - {"-o", "--report"}:
                self.refuse(command, option, self.folder / "model.bin", "model.bin")
        self.refuse("stability", "--json", self.catalogue, "catalogue.json")
        self.assertEqual(self.snapshot(), before)

    def test_nor_by_a_link_or_another_spelling(self):
        (self.folder / "also").symlink_to(self.folder)
        (self.folder / "hard.pfm").hardlink_to(self.folder / "sky.pfm")
        (self.folder / "soft.pfm").symlink_to("sky.pfm")
        (self.folder / "chain.pfm").symlink_to("soft.pfm")
        before = self.snapshot()
        for name in ("hard.pfm", "soft.pfm", "chain.pfm", "also/sky.pfm", "./also/also/soft.pfm"):
            self.refuse("render", "-o", self.folder / name, "sky.pfm")
        self.refuse("verify", "--junit", os.path.relpath(self.folder / "sky.pfm"), "sky.pfm")
        self.assertEqual(self.snapshot(), before)

    def test_images_that_are_compared_and_results_of_bench_are_spared(self):
        images, before = self.images, self.snapshot()
        (self.folder / "hard").hardlink_to(images[3])
        for option in ("--json", "--junit"):
            for image in (*images, self.folder / "hard"):
                self.refused(tandem("compare", images[0], images[2], "vs", images[1], images[3], option, image), "which is read")
        self.refused(tandem("bench", "--compare", images[0], images[1], "--json", images[1]), "which is read")
        (self.folder / "hard").unlink()
        self.assertEqual(self.snapshot(), before)

    def test_files_of_a_report_spare_inputs_too(self):
        report = self.folder / "report"
        report.mkdir()
        (report / "report.json").hardlink_to(self.scene)
        verify, _ = self.commands()["verify"]
        self.refused(tandem(*verify, "--report", report), "report.json", "which is read")
        self.refused(tandem(*verify, "--report", self.folder, "--json", self.folder / "report.json"), "--json", "--report")
        scene = write_scene(self.folder, "report.json")
        self.refused(tandem("verify", scene, "--report", self.folder), "report.json", "which is read")
        sky = self.folder / "01-scene-p.png"
        sky.hardlink_to(self.folder / "sky.pfm")
        self.refused(tandem(*verify, "--report", self.folder), "01-scene-p.png", "which is read")

    def test_nor_by_a_link_that_is_made_while_it_works(self):
        before = self.snapshot()
        for option, other in (("-o", []), ("--json", ["-o", self.folder / "image.exr"])):
            output = self.folder / "late.exr"
            with subprocess.Popen([TANDEM, "render", self.scene, option, output, *other, "--size", "64", "--samples",
                                   "100000000"], stderr=subprocess.PIPE, text=True) as running:
                at_work(running)
                output.symlink_to(self.folder / "sky.pfm")
                running.send_signal(signal.SIGINT)
                _, errors = running.communicate(timeout=60)
            self.assertEqual(running.returncode, 2, errors)
            self.assertIn("sky.pfm, which was read; it is left as it is", errors)
            output.unlink()
            (self.folder / "image.exr").unlink(missing_ok=True)
        self.assertEqual(self.snapshot(), before)

    def test_a_file_to_go_on_from_is_no_scene(self):
        cost, _ = self.commands()["cost"]
        samples = self.folder / "cost.samples"
        for _ in range(2):  # it is read, and written again
            self.assertIn(tandem(*cost, "--resume", samples).returncode, (0, 3))  # a busy machine has no second for all
            self.assertTrue(samples.is_file())
        self.refused(tandem(*cost, "--resume", self.scene), "which is read")
        reference = self.folder / "cost.reference"
        reference.write_text("samples of hours")
        self.refused(tandem(*cost, "--reference", reference, "--json", reference), "which is read")


class OutputsAreKnownBefore(FilesTest):
    def refuse_everywhere(self, path_of, *mentions, but=()):
        before = self.snapshot()
        for command, (arguments, outputs) in self.every_command().items():
            for option, ending in outputs.items():
                if option in but:
                    continue
                with self.subTest(command=command, option=option):
                    result = tandem(*arguments, option, path_of(ending), *self.needed(outputs, [option]))
                    self.refused(result, *mentions)
                    self.assertEqual(result.stdout, "")  # nor had any work begun
        self.assertEqual(self.snapshot(), before)

    def test_an_output_in_a_folder_that_is_not_there(self):
        self.refuse_everywhere(lambda ending: self.folder / "none" / f"x{ending}", "none", but=["--report"])

    def test_names_that_are_no_text(self):
        self.refuse_everywhere(lambda ending: os.fsencode(self.folder) + b"/\xff" + ending.encode(), "\\xff", "UTF-8")
        for command, (arguments, outputs) in self.commands(os.fsencode(self.folder) + b"/sc\xe9ne.json").items():
            if command != "stability":
                with self.subTest(command=command):
                    self.refused(tandem(*arguments, *self.needed(outputs)), "sc\\xe9ne.json", "UTF-8")

    def test_an_output_that_cannot_be_made_for_another_reason(self):
        (self.folder / "folder.exr").mkdir()
        (self.folder / "loop.exr").symlink_to("loop2.exr")
        (self.folder / "loop2.exr").symlink_to("loop.exr")
        arguments, _ = self.commands()["render"]
        for name, *mentions in (
                (self.folder / "folder.exr", "is a folder"), ("/proc/x.exr", "/proc/x"), (self.folder / "loop.exr", "leads nowhere"),
                (self.folder / ("x" * 300 + ".exr"), "File name too long"), (f"{self.folder}/none/x.exr", "create the folder first")):
            for option in ("-o", "--json"):
                with self.subTest(option=option, name=name):
                    result = tandem(*arguments, option, name, *([] if option == "-o" else ["-o", self.folder / "new.exr"]))
                    self.refused(result, *mentions)
                    self.assertFalse((self.folder / "new.exr").exists())
        verify, _ = self.commands()["verify"]
        for option in ("--json", "--junit"):
            for name in ("/dev/full", f"{self.folder}/new/", f"{self.folder}/"):
                result = tandem(*verify, option, name)
                self.refused(result, name)
                self.assertEqual(result.stdout, "")
        for name in ("/proc/x", self.scene, "/dev/null"):
            self.refused(tandem(*verify, "--report", name), name.name if name is self.scene else name)

    def test_a_long_name_that_the_folder_takes_is_written(self):
        out = self.folder / ("x" * 251 + ".pfm")
        self.assertEqual(tandem("render", self.scene, "--samples", "1", "-o", out).returncode, 0)
        self.assertTrue(out.exists())

    def test_one_file_for_two_outputs(self):
        same = self.folder / "same.exr"
        (self.folder / "link.exr").symlink_to("same.exr")  # which is not there yet
        spellings, turn = [f"{self.folder}/./same.exr", self.folder / "link.exr"], 0
        for command, (arguments, outputs) in self.every_command().items():
            for first in outputs:
                for second in outputs:
                    if first >= second or "--report" in (first, second):
                        continue
                    turn = 1 - turn
                    for spelling in spellings if THOROUGH else [spellings[turn]]:
                        with self.subTest(command=command, first=first, second=second, spelling=spelling):
                            result = tandem(*arguments, first, same, second, spelling, *self.needed(outputs, [first, second]))
                            self.refused(result, first, second, "two outputs")
                            self.assertFalse(same.exists())

    def test_the_file_that_a_stream_goes_to_is_no_other_output(self):
        for command, (arguments, outputs) in self.every_command().items():
            for option in outputs.keys() - {"--report", "-o"}:
                with self.subTest(command=command, option=option), open(self.folder / "log", "w") as log:
                    result = subprocess.run([TANDEM, *map(os.fsencode, [*arguments, option, self.folder / "log", *self.needed(outputs)])],
                                            stdout=log, stderr=subprocess.PIPE, text=True, timeout=60)
                    self.refused(result, "standard output")

    def test_a_dash_is_standard_output_for_json_alone(self):
        for command, (arguments, outputs) in self.every_command().items():
            for option in outputs.keys() - {"--json", "-o"}:
                with self.subTest(command=command, option=option):
                    self.refused(tandem(*arguments, option, "-", *self.needed(outputs)), option, "./-")
        self.refused(tandem("render", self.scene, "-o", "-"), "-")

    def test_a_link_to_a_file_that_is_not_there_yet_stays_a_link(self):
        (self.folder / "link.json").symlink_to("real.json")
        self.assertEqual(tandem("devices", "--json", self.folder / "link.json").returncode, 0)
        self.assertTrue((self.folder / "link.json").is_symlink())
        self.assertIn("devices", json.loads((self.folder / "real.json").read_text()))

    def test_a_file_that_is_replaced_keeps_its_permissions(self):
        out = self.folder / "out.json"
        out.write_text("old")
        out.chmod(0o640)
        self.assertEqual(tandem("devices", "--json", out).returncode, 0)
        self.assertEqual(out.stat().st_mode & 0o777, 0o640)

    def test_endings_are_known_before_the_scene_is_read(self):
        for name in ("x", "x.jpg", "x.exr.bak", ".exr"):
            self.refused(tandem("render", "absent.json", "-o", self.folder / name), "unknown kind of image")

    def test_cost_makes_no_folder_of_references_before_it_begins(self):
        out = self.folder / "cost.json"
        self.refused(tandem("cost", self.scene, "--references", "/dev/null", "--json", out), "/dev/null", "choose another folder")
        self.assertFalse(out.exists())
        references = self.folder / "made" / "references"
        self.refused(tandem("cost", self.scene, "--references", references, "--knob", "magic"), "magic")
        self.assertFalse((self.folder / "made").exists())

    def test_pipes_are_refused_where_files_are_read(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        for command in (["render", pipe, "-o", self.folder / "out.exr"], ["bench", "--compare", pipe, pipe],
                        ["cost", self.scene, "--resume", pipe], ["stability", "--catalogue", pipe]):
            with self.subTest(command=command[0]):
                self.refused(tandem(*command), "is not a regular file")

    def test_a_program_without_its_image_module_says_so_before_it_works(self):
        if not (pathlib.Path(TANDEM).parent / "libtandem_images.so").exists():
            self.skipTest("built without OpenImageIO")
        program = self.folder / "alone" / "tandem"
        program.parent.mkdir()
        shutil.copy(TANDEM, program)
        render = [program, "render", self.scene, "--size", "4", "--samples", "1000000000", "-o"]
        result = subprocess.run([*render, self.folder / "a.exr"], capture_output=True, text=True, timeout=60)
        self.refused(result, "a.exr", "libtandem_images.so", "build or install Tandem whole")
        render[render.index("1000000000")] = "1"
        self.assertEqual(subprocess.run([*render, self.folder / "a.pfm"], timeout=60, capture_output=True).returncode, 0)


class FullDisks(FilesTest):
    @staticmethod
    def limit(size):
        return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    def test_a_full_disk_leaves_the_old_files_and_no_new_ones(self):
        for command, (arguments, outputs) in self.every_command().items():
            for option, ending in outputs.items():
                endings = (".png", ".exr", ".pfm") if option == "-o" else (ending,)
                for ending in endings:
                    old = self.folder / f"old{ending}"
                    fresh = option in ("--report", "--resume")  # the one is a folder, the other is read first
                    if not fresh:
                        old.write_text("old!")
                    with self.subTest(command=command, option=option, ending=ending):
                        result = tandem(*arguments, option, old, *self.needed(outputs, [option]), preexec_fn=self.limit(4))
                        self.refused(result, "old", "File too large")
                        if not fresh:
                            self.assertEqual(old.read_text(), "old!")
                            old.unlink()
                        self.assertFalse(old.exists())
                        self.assertEqual([name for name in self.snapshot() if name.startswith(".") or name.startswith("new")], [])

    def test_an_output_that_fails_takes_no_other_with_it(self):
        verify, _ = self.commands()["verify"]
        out = {option: self.folder / name for option, name in (("--json", "out.json"), ("--junit", "out.xml"), ("--report", "out"))}
        words = [word for pair in out.items() for word in pair]
        self.assertIn(tandem(*verify, *words).returncode, (0, 3))
        junit = out["--junit"].stat().st_size
        self.assertLess(junit, out["--json"].stat().st_size)
        for path in out["--report"].iterdir():
            path.unlink()
        out["--report"].rmdir()
        for path in (out["--json"], out["--junit"]):
            path.unlink()
        result = tandem(*verify, *words, preexec_fn=self.limit(junit + 64))
        self.refused(result, "out.json", "File too large")
        self.assertEqual([path.name for path in out.values() if path.exists()], ["out.xml"])

    def test_text_that_standard_output_does_not_take_is_told(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([TANDEM, "devices"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
        self.refused(result, "standard output", "No space left")


class Streams(FilesTest):
    def test_json_goes_to_standard_output_and_the_text_to_the_other(self):
        for command, (arguments, outputs) in self.every_command().items():
            with self.subTest(command=command):
                result = tandem(*arguments, "--json", "/dev/stdout" if command == "trace" else "-", *self.needed(outputs))
                self.assertIn(result.returncode, (0, 1, 3), result.stderr)
                self.assertIsInstance(json.loads(result.stdout), dict)
                self.assertNotEqual(result.stderr, "")

    def test_a_reader_that_goes_away_loses_no_file_and_changes_no_status(self):
        reader, writer = os.pipe()
        os.close(reader)
        self.addCleanup(os.close, writer)
        for command, (arguments, outputs) in self.every_command().items():
            files = {option: self.folder / f"kept-{command}{option}{ending}" for option, ending in outputs.items()}
            words = [TANDEM, *map(os.fsencode, [*arguments, *(word for pair in files.items() for word in pair)])]
            with self.subTest(command=command):
                status = subprocess.run(words, stdout=writer, stderr=writer, timeout=120).returncode
                self.assertIn(status, (0, 1, 3))
                for path in files.values():
                    self.assertTrue(path.exists())
                self.assertIsInstance(json.loads(files["--json"].read_text()), dict)
        verify, _ = self.commands()["verify"]
        self.assertEqual(subprocess.run([TANDEM, *map(os.fsencode, verify)], stdout=writer, stderr=subprocess.DEVNULL).returncode,
                         tandem(*verify).returncode)

    def test_a_closed_descriptor_gets_no_file(self):
        for descriptors in ((0,), (1,), (2,), (0, 1, 2)):
            out = self.folder / "out.pfm"
            process = subprocess.run([TANDEM, "render", self.scene, "--samples", "1", "-v", "-o", out], timeout=60,
                                     preexec_fn=lambda: [os.close(descriptor) for descriptor in descriptors])
            self.assertEqual(process.returncode, 0)
            self.assertTrue(out.read_bytes().startswith(b"PF\n8 8\n"))

    def test_a_pipe_that_nobody_reads_any_more_is_told(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        with subprocess.Popen([TANDEM, "devices", "--json", pipe], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                              text=True) as running:
            with open(pipe):
                pass  # opened and closed
            self.assertIn(running.wait(timeout=60), (0, 2))  # the text may have gone into the pipe in time

    def test_a_second_interrupt_ends_the_program_at_once(self):
        pipe = self.folder / "pipe.json"
        os.mkfifo(pipe)  # nobody reads: the program waits to open it, where it heeds no wish to stop
        with subprocess.Popen([TANDEM, "devices", "--json", pipe], stdout=subprocess.DEVNULL) as running:
            try:
                at_work(running, 60.0)  # or it waits
                for _ in range(2):  # one wish, told twice
                    running.send_signal(signal.SIGINT)
                    time.sleep(0.1)
                self.assertIsNone(running.poll())
                time.sleep(1.0)
                running.send_signal(signal.SIGINT)
                self.assertEqual(running.wait(timeout=10), -signal.SIGINT)
            finally:
                running.kill()

    def test_a_hang_up_keeps_what_was_rendered_unless_it_is_ignored(self):
        out = self.folder / "out.pfm"
        render = [TANDEM, "render", self.scene, "-o", out, "--time", "100"]
        with subprocess.Popen(render, stdout=subprocess.PIPE, text=True) as running:
            at_work(running)
            running.send_signal(signal.SIGHUP)
            self.assertEqual(running.wait(timeout=30), 0)
            self.assertIn("stopped early", running.stdout.read())
        self.assertTrue(out.exists())
        with subprocess.Popen(render, stdout=subprocess.PIPE, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)) as running:
            at_work(running)
            running.send_signal(signal.SIGHUP)
            time.sleep(1.0)
            self.assertIsNone(running.poll())
            running.kill()


class Names(FilesTest):
    STRANGE = "a\nb\x1b[31m\tc"

    def assert_plain(self, text):
        self.assertNotRegex(text, "[\x00-\x09\x0b-\x1f\x7f]")
        self.assertNotRegex(text, r"(?m)^b(\\x1b|\x1b)")  # a line that a name has begun

    def test_control_characters_in_names_are_escaped_in_every_message(self):
        strange = self.folder / self.STRANGE
        strange.mkdir()
        scene = write_scene(strange, f"{self.STRANGE}.json")
        text = json.loads(scene.read_text())
        for section in ("materials", "textures", "media"):
            text[section][self.STRANGE] = next(iter(text[section].values()))
        text["entities"][0] |= {"name": self.STRANGE, "material": self.STRANGE}
        scene.write_text(json.dumps(text))
        self.catalogue = strange / "catalogue.json"
        self.write_case(strange, self.STRANGE, f"{self.STRANGE}hard.json")
        for command, (arguments, outputs) in self.commands(scene).items():
            words = [word for option, ending in outputs.items() for word in (option, strange / f"{self.STRANGE}out{option}{ending}")]
            with self.subTest(command=command):
                result = tandem(*arguments, "-v", *words)
                self.assertIn(result.returncode, (0, 1, 3), result.stderr)
                self.assert_plain(result.stdout + result.stderr)
                absent = tandem(*[strange / "absent" if word in (scene, self.catalogue) else word for word in arguments], *words)
                self.refused(absent, "a\\x0ab\\x1b[31m\\x09c")
                self.assert_plain(absent.stderr)
        image = strange / f"{self.STRANGE}.exr"
        result = tandem("compare", image, "vs", image)
        self.assert_plain(result.stdout + result.stderr)
        for words in (["render", scene, "-o", image, "--integrator", self.STRANGE], [self.STRANGE], ["render", f"--{self.STRANGE}"],
                      ["bench", "--family", self.STRANGE], ["cost", scene, "--knob", self.STRANGE], ["render", scene, "-o", strange],
                      ["render", scene, "-o", image, "--backend", self.STRANGE], ["stability", "--case", self.STRANGE],
                      ["render", scene, "-o", image, "--backend", "vulkan", "--device", self.STRANGE],
                      ["trace", scene, "--pixel", self.STRANGE], ["verify", scene, "--margin", self.STRANGE]):
            result = tandem(*words)
            self.assertIn(result.returncode, (2, 4), words)
            self.assertEqual(len(result.stderr.strip().split("\n")), 1, result.stderr)
            self.assert_plain(result.stderr)


class Terminals(FilesTest):
    def shown(self, **variables):
        """What a terminal gets of a render of some time."""
        terminal, end = pty.openpty()
        environment = {key: value for key, value in os.environ.items() if key != "NO_COLOR"} | variables
        running = subprocess.Popen([TANDEM, "render", self.scene, "-o", self.folder / "out.pfm", "--time", "1"], stdout=end,
                                   stderr=end, env=environment)
        os.close(end)
        text = b""
        try:
            while chunk := os.read(terminal, 4096):
                text += chunk
        except OSError:
            pass  # the other end is closed
        os.close(terminal)
        self.assertEqual(running.wait(timeout=30), 0)
        return text

    def test_only_a_terminal_that_moves_its_cursor_gets_escapes(self):
        self.assertIn(b"\x1b[K", self.shown(TERM="xterm"))
        self.assertNotIn(b"\x1b", self.shown(TERM="dumb"))
        self.assertNotIn(b"\x1b", self.shown(TERM="xterm", NO_COLOR="1"))
        self.assertIn(b"\x1b[K", self.shown(TERM="xterm", NO_COLOR=""))


if __name__ == "__main__":
    sys.exit(unittest.main())
