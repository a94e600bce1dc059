# Arguments that are wrong get one line that says what is wrong and what was meant. test_arguments.cpp tries every option.
import sys
import unittest

from program import ProgramTest, tandem

class WrongArguments(ProgramTest):
    def test_options_that_there_are_not_are_told_with_those_that_were_meant(self):
        for words, mentions in [
            (["render", self.scene, "--spp", "5"], ["--spp: no such option; did you mean --samples?", "see tandem render --help"]),
            (["render", self.scene, "--bounce=5"], ["--bounce: no such option; did you mean --bounces?"]),
            (["render", self.scene, "-samples", "5"], ["-samples: no such option; did you mean --samples?"]),
            (["render", self.scene, "--pixel", "1,1"], ["--pixel: no such option; it is one of trace"]),
            (["render", self.scene, "--qqqq"], ["--qqqq: no such option; see tandem render --help"]),
            (["--samples", "5", "render"], ["--samples: no such option"]),
        ]:
            with self.subTest(words=words):
                self.refused(tandem(*words), *mentions)

    def test_misspelt_commands_and_choices_are_told_with_those_that_were_meant(self):
        for given, meant in [("rendr", "render"), ("Verify", "verify"), ("diff", "compare"), ("benchmark", "bench")]:
            self.refused(tandem(given, self.scene), f"'{given}' is no command", f"did you mean {meant}?")
        out = self.folder / "out.exr"
        for option, given, meant in [
            ("--integrator", "pathh", "path"), ("--integrator", "nextevent", "next-event"), ("--generator", "phylox", "philox"),
            ("--sampling", "adaptiv", "adaptive"), ("--guard", "error_bound", "error-bound"), ("--fresnel", "Exact", "exact"),
            ("--backend", "vulcan", "vulkan"), ("--backend", "gpu", "vulkan"), ("--precision", "doubel", "double"),
            ("--triangle-test", "watertigth", "watertight"), ("--light-sampling", "trees", "tree"), ("--filter", "gausian", "gaussian"),
        ]:
            with self.subTest(option=option, given=given):
                self.refused(tandem("render", self.scene, "-o", out, option, given), f"did you mean {meant}?")
        self.refused(tandem("cost", self.scene, "--knob", "integrtor"), "did you mean integrator?")
        self.refused(tandem("bench", "--scene", self.scene, "--family", "memry"), "did you mean memory?")
        self.refused(tandem("stability", "--arm", "watertigh"), "did you mean watertight?")

    def test_knobs_are_known_where_they_are_only_listed(self):
        self.refused(tandem("cost", self.scene, "--knob", "nonsense", "--list"), "nonsense")
        self.assertEqual(tandem("cost", self.scene, "--knob", "bounces", "--list").returncode, 0)

    def test_empty_values_are_refused(self):
        for words, mention in [
            (["render", self.scene, "-o", ""], "-o: its value is empty"), (["render", "", "-o", "a.exr"], "an argument is empty"),
            (["render", self.scene, "-o", "a.exr", "--device", ""], "--device: its value is empty"), ([""], "an argument is empty"),
            (["cost", self.scene, "--knob", "", "--list"], "--knob: its value is empty"), (["devices", "--json="], "--json: its value"),
            (["cost", self.scene, "--knob", ",", "--list"], "--knob: ',' has an empty place"),
        ]:
            with self.subTest(words=words):
                self.refused(tandem(*words), mention)

    def test_a_short_option_is_no_name_with_an_equals_sign(self):
        self.refused(tandem("render", self.scene, f"-o={self.folder}/a.exr"), "write -o VALUE or --output=VALUE")
        self.assertEqual(list(self.folder.glob("**/*.exr")), [])

    def test_arguments_that_are_no_text_are_refused(self):
        self.refused(tandem(b"\xff"), "\\xff", "UTF-8")
        self.refused(tandem("render", self.scene, "-o", b"\xe9.exr"), "\\xe9.exr", "UTF-8")
        self.refused(tandem("render", self.scene, b"--\xff"), "\\xff", "UTF-8")


if __name__ == "__main__":
    sys.exit(unittest.main())
