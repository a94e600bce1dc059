# `tandem bench --arm-library`: the template as it stands, libraries that err, crash and hang, and what is made of the results. Run
# by ctest with TANDEM = the program, SCENES = the folder of the shipped scenes.
import csv
import json
import pathlib
import re
import subprocess
import sys
import unittest

from program import ProgramTest, tandem

SOURCE = pathlib.Path(__file__).resolve().parents[2]
HERE = SOURCE / "vulkan/bench/own_arms"
TEMPLATE = (HERE / "template.c").read_text()
FINE, DISAGREE, UNUSABLE, UNDECIDED = range(4)
RUN_OF_MANY = "{ return fill((State*)state, commands, 1024); }"
ON_THIRD_MAKE = "static int made = 0; if (++made > 4) "  # two arms at two amounts of work were made before


class OwnArmsTest(ProgramTest):
    def compiled(self, *changes, name="my.so", text=TEMPLATE, flags=()):
        """The template with parts replaced, compiled as its first lines say."""
        for old, new in changes:
            self.assertIn(old, text)
            text = text.replace(old, new)
        source = self.folder / "my.c"
        source.write_text(text)
        result = subprocess.run(["cc", "-shared", "-fPIC", f"-I{HERE}", *flags, "-o", self.folder / name, source, "-lvulkan"],
                                capture_output=True, text=True, timeout=60)
        self.assertEqual(result.returncode, 0, result.stderr)
        return self.folder / name

    def bench(self, library, *options, time=3, replicates=2):
        return tandem("bench", "--arm-library", library, "--time", time, "--replicates", replicates, *options)


class Template(OwnArmsTest):
    def test_it_is_short_and_free_of_warnings(self):
        self.assertLessEqual(len(TEMPLATE.splitlines()), 50)
        self.compiled(flags=["-std=c17", "-Wall", "-Wextra", "-Werror"])
        header = self.folder / "header.cpp"
        header.write_text("#include <tandem/arm.h>\n")
        subprocess.run(["c++", "-std=c++20", "-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only", f"-I{HERE}", header],
                       check=True, timeout=60)

    def test_it_is_measured(self):
        out, table = self.folder / "my.json", self.folder / "my.csv"
        result = self.bench(self.compiled(), "--json", out, "--csv", table)
        self.assertEqual(result.returncode, FINE, result.stderr)
        for words in ("fills: Does it matter how many commands fill a buffer?", "one-fill", "baseline", "identical",
                      "Verdict on this device"):
            self.assertIn(words, result.stdout)
        report = json.loads(out.read_text())
        arms = [(arm["arm"], arm["workload"]["name"], arm["identity"]) for arm in report["arms"]]
        self.assertEqual(arms, [(arm, work, "identical") for work in ("65536 bytes", "1048576 bytes")
                                for arm in ("one-fill", "many-fills")])
        for arm in report["arms"]:  # recorded arms are timed by phases, too
            self.assertLessEqual({"total", "record", "submit", "wait"}, arm["milliseconds"].keys())
        self.check_table(report, table)
        page = self.folder / "my.html"
        made = subprocess.run([sys.executable, SOURCE / "scripts/report", out], capture_output=True, text=True, timeout=60)
        self.assertEqual(made.returncode, 0, made.stderr)
        text = page.read_text()
        self.assertIn("fills: Does it matter", text)
        self.assertEqual(text.count('class="forest"'), 2)  # an amount of work each

    def check_table(self, report, table):
        with table.open(newline="") as file:
            rows = list(csv.DictReader(file))
        alike = [row for row in rows if row["arm"] == "many-fills" and row["workload"] == "65536 bytes"]
        self.assertEqual([row["replicate"] for row in alike], ["1", "2", "all"])
        self.assertEqual({row["work [work unit]"] for row in alike}, {"65536"})
        arm = next(arm for arm in report["arms"] if (arm["arm"], arm["workload"]["name"]) == ("many-fills", "65536 bytes"))
        self.assertAlmostEqual(float(alike[2]["ratio to baseline [1]"]), arm["ratio"], places=5)
        times = sorted(float(row["time a run [ms]"]) for row in alike)
        self.assertAlmostEqual(times[1], (times[0] + times[2]) / 2, delta=1e-4 * times[1])  # two replicates, and between them
        self.assertEqual(alike[2]["verdict"], arm["verdict"])

    def test_a_slower_arm_is_called_slower(self):
        # The same bytes, thirty times.
        many = "{ for (int i = 0; i < 30; ++i) fill((State*)state, commands, 1); return NULL; }"
        result = self.bench(self.compiled((RUN_OF_MANY, many), ("{65536, 1048576}", "{16777216}"), ("2, sizes", "1, sizes")),
                            time=6, replicates=3)
        self.assertEqual(result.returncode, FINE, result.stderr)
        self.assertRegex(result.stdout, r"many-fills is slower than one-fill at 16777216 bytes: \+\d+")

    def test_arms_that_submit_by_themselves_are_timed_as_a_whole(self):
        library = self.compiled(("static const char* result", "static const char* nothing(void* state) { (void)state; return NULL; }\n"
                                "static const char* result"), ("record_one, NULL, result", "NULL, nothing, NULL"),
                               ("record_many, NULL, result", "NULL, nothing, NULL"))
        out = self.folder / "my.json"
        result = self.bench(library, "--json", out, time=2)
        self.assertEqual(result.returncode, FINE, result.stderr)
        self.assertEqual({key for arm in json.loads(out.read_text())["arms"] for key in arm["milliseconds"]}, {"total"})
        self.assertIn("nothing-to-compare", result.stdout)

    def test_it_is_listed_and_resumed(self):
        library = self.compiled()
        listed = tandem("bench", "--arm-library", library, "--list")
        self.assertEqual(listed.returncode, FINE, listed.stderr)
        self.assertIn("1024 commands, a part each", listed.stdout)
        out, more = self.folder / "my.json", self.folder / "more.json"
        self.assertEqual(self.bench(library, "--json", out, "--processes", 2).returncode, FINE)
        result = self.bench(library, "--resume", out, "--json", more, "--narrow", 0.0001)
        self.assertEqual(result.returncode, FINE, result.stderr)
        self.assertGreater(len(json.loads(more.read_text())["raw"]), len(json.loads(out.read_text())["raw"]))
        other = self.compiled((RUN_OF_MANY, RUN_OF_MANY.replace("1024", "128")), name="other.so")
        self.refused(self.bench(other, "--resume", more), "/device/arm_library_hash")


class Refusals(OwnArmsTest):
    def test_what_is_no_library(self):
        self.refused(self.bench(self.folder / "none.so"), "none.so", "no such file")
        self.refused(self.bench(self.scene), "scene.json", "cannot be loaded")
        self.refused(self.bench(self.compiled(("tandem_arm_library(void)", "other(void)"))), "exports no tandem_arm_library()")

    def test_what_the_header_does_not_allow(self):
        for change, mention in [
                (("TANDEM_ARM_VERSION,", "7,"), "is of version 7 of <tandem/arm.h>; this program has version 1"),
                (("10, 2, arms", "10, 1, arms"), "fewer than two arms"),
                (('"many-fills"', '"one-fill"'), "two arms are called 'one-fill'"),
                (("{65536, 1048576}", "{65536, 4096}"), "ascending"),
                (("record_many, NULL", "NULL, NULL"), "needs record() or run()"),
                (("return &library", "return NULL"), "returned null")]:
            with self.subTest(mention):
                self.refused(self.bench(self.compiled(change)), "my.so", mention)

    def test_extensions_that_the_device_lacks(self):
        library = self.compiled(("arms, 0, NULL", "arms, 1, names"),
                               ("static const TandemArmLibrary", 'static const char* const names[] = {"VK_NO_such"};\n'
                                "static const TandemArmLibrary"))
        self.refused(self.bench(library), "has no VK_NO_such", status=4)

    def test_options_that_make_no_sense_beside_it(self):
        library = self.compiled()
        for options in (["--family", "memory"], ["--size", "8x8"], ["--self-test"], ["--method", "thesis"], ["--validation", "--list"],
                        ["--list", "--csv", self.folder / "a.csv"]):
            with self.subTest(options[0]):
                self.refused(tandem("bench", "--arm-library", library, *options))
        self.refused(tandem("bench", "--validation"), "--arm-library")
        self.refused(self.bench(library, "--arm", "many-fils"), "many-fills")
        self.refused(self.bench(library, "--csv", library), "would overwrite")

    def test_arms_whose_results_differ(self):
        out = self.folder / "my.json"
        library = self.compiled((RUN_OF_MANY, "{ State* s = (State*)state; fill(s, commands, 1);"
                                "vkCmdFillBuffer(commands, s->buffer, 4096, 4, 9); return NULL; }"))
        result = self.bench(library, "--json", out)
        self.refused(result, "many-fills: its result is not that of one-fill", "byte 4096 of 65536", status=DISAGREE)
        self.assertEqual(result.stdout, "")
        self.assertFalse(out.exists())

    def test_an_arm_that_says_why_it_failed(self):
        self.refused(self.bench(self.compiled((RUN_OF_MANY, '{ (void)state, (void)commands; return "out of luck"; }'))),
                     "many-fills: record() failed: out of luck")

    def test_an_arm_that_this_device_cannot_run(self):
        library = self.compiled(("static const char* result", 'static const char* never(const TandemDevice* on) { (void)on; '
                                'return "it has no such thing"; }\nstatic const char* result'),
                               ('"1024 commands, a part each", NULL', '"1024 commands, a part each", never'))
        result = self.bench(library, time=1)
        self.assertEqual(result.returncode, FINE, result.stderr)
        self.assertIn("not-applicable: it has no such thing", result.stdout)


class Crashes(OwnArmsTest):
    def measured_before(self, result, out):
        """One replicate of both arms at both amounts of work is told of, and stored."""
        self.assertIn("many-fills", result.stdout)
        raw = json.loads(out.read_text())["raw"]
        self.assertEqual([len(one["arms"]) for one in raw], [2, 2])

    def test_a_crash_takes_no_result_with_it(self):
        for what, mention in [("*(volatile int*)0 = 1;", r"many-fills: make\(\): the program was ended by signal 11"),
                              ("exit(5);", r"many-fills: make\(\): the program ended with status 5")]:
            with self.subTest(mention):
                out = self.folder / "my.json"
                library = self.compiled(("    s->device = on->device;", "    s->device = on->device; " + ON_THIRD_MAKE + "++again;"),
                                       ("static const char* make", "static int again = 0;\nstatic const char* make"),
                                       ("    s->size = (VkDeviceSize)work;", f"    s->size = (VkDeviceSize)work; if (again > 1) {{ {what} }}"))
                result = self.bench(library, "--json", out, "--narrow", 0.0001, time=4, replicates=3)
                self.assertEqual(result.returncode, UNUSABLE, result.stdout + result.stderr)
                self.assertRegex(result.stderr, mention)
                self.assertEqual(len(result.stderr.splitlines()), 1)
                self.measured_before(result, out)

    def test_a_hang_takes_no_result_with_it(self):
        out = self.folder / "my.json"
        library = self.compiled(("    s->device = on->device;", "    s->device = on->device; " + ON_THIRD_MAKE + "for (;;) {}"))
        result = self.bench(library, "--json", out, "--narrow", 0.0001, time=4, replicates=3)
        self.assertEqual(result.returncode, UNDECIDED, result.stdout + result.stderr)
        self.assertRegex(result.stderr, r"my\.so: one-fill: make\(\): had not returned when --time was over")
        self.measured_before(result, out)


class Layer(OwnArmsTest):
    def test_the_layer_is_asked_on_demand(self):
        result = tandem("bench", "--arm-library", self.compiled(), "--validation")
        if result.returncode == 4 and "is not installed" in result.stderr:
            self.skipTest("there is no validation layer")
        self.assertEqual(result.returncode, FINE, result.stderr)
        self.assertEqual(len(re.findall("runs, its result is the first arm's", result.stdout)), 4)
        self.assertIn("The validation layer is silent.", result.stdout)
        wrong = self.compiled(("VK_BUFFER_USAGE_TRANSFER_DST_BIT", "VK_BUFFER_USAGE_TRANSFER_SRC_BIT"))
        self.refused(tandem("bench", "--arm-library", wrong, "--validation"), "the Vulkan validation layer reports:", "vkCmdFillBuffer")


if __name__ == "__main__":
    unittest.main()
