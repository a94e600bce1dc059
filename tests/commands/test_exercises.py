# tandem exercise: what a student types, and that every exercise can be solved and names its planted bugs. Hostile
# submissions get their mark like others. Run by ctest with TANDEM = the program.
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

SOURCE = pathlib.Path(__file__).resolve().parents[2]
TANDEM = os.path.abspath(os.environ["TANDEM"])
THOROUGH = "TANDEM_THOROUGH" in os.environ  # a long run, as tests/thorough.h says
sys.path.insert(0, str(SOURCE / "tests" / "exercises"))
import homework  # noqa: E402

SPHERE = "float ray_sphere(vec3 origin, vec3 direction, vec3 centre, float radius)"


def run(*words, folder=None):
    return subprocess.run([TANDEM, "exercise", *map(str, words)], cwd=folder, capture_output=True, text=True, timeout=120)


def mark_of(number, text):
    """The mark of a text, as JSON."""
    with tempfile.TemporaryDirectory() as name:
        file = pathlib.Path(name) / f"{number:02}-homework.glsl"
        if isinstance(text, bytes):
            file.write_bytes(text)
        else:
            file.write_text(text)
        result = run("check", file, "--json", "-", folder=name)
        mark = json.loads(result.stdout)[0]
        assert result.returncode == {"right": 0, "wrong": 1, "undecided": 3}[mark["mark"]], result
        return mark


class Exercises(unittest.TestCase):
    def test_first_steps(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(len(run("list").stdout.splitlines()), 30)
            self.assertEqual(run("start", "3", folder=folder).stdout, "03-ray-sphere.glsl: A ray and a sphere\n")
            file = pathlib.Path(folder) / "03-ray-sphere.glsl"
            again = run("start", "3", folder=folder)
            self.assertEqual(again.returncode, 2)
            self.assertIn("not overwritten", again.stderr)
            file.write_text(file.read_text().replace("// Write it here.", "return 1.0;"))
            by_number, by_file = run("check", "3", folder=folder), run("check", file.name, folder=folder)
            self.assertEqual(by_number.returncode, 1)
            self.assertEqual(by_number.stdout, by_file.stdout)
            self.assertRegex(by_number.stdout, r"(?s)^03-ray-sphere.glsl: wrong: .* answers are off\n  at     origin = \(.*"
                                               r"\n  yours  t = 1\n  right  t = ")

    def test_wrong_answers_get_a_picture(self):
        vertical = "vec3 cosine_hemisphere(float a, float b) { return vec3(0.0, 0.0, 1.0); }"
        no_number = SPHERE + " { return sqrt(-1.0 - radius); }"
        whole = "vec3 uniform_hemisphere(float a, float b) {\n  float r = sqrt(1.0 - a * a);\n" \
                "  return vec3(r * cos(6.2831853 * b), r * sin(6.2831853 * b), a);\n}"
        for file, text, told in (("11-cosine-hemisphere.glsl", vertical, "regions"), ("03-ray-sphere.glsl", no_number, "45 degrees"),
                                 ("10-uniform-hemisphere.glsl", whole, None)):
            with self.subTest(file), tempfile.TemporaryDirectory() as name:
                (pathlib.Path(name) / file).write_text(text)
                result, picture = run("check", file, folder=name), pathlib.Path(name) / file.replace(".glsl", ".png")
                self.assertEqual(result.returncode, 0 if told is None else 1, result.stdout)
                self.assertEqual(picture.exists(), told is not None)
                if told is None:
                    continue
                self.assertIn(f"see    {picture.name}: right, yours, and the difference", result.stdout)
                self.assertIn(told, result.stdout)
                self.assertEqual(picture.read_bytes()[16:24], (588).to_bytes(4, "big") + (192).to_bytes(4, "big"))
                if file == "03-ray-sphere.glsl":
                    picture.unlink()
                    picture.mkdir()
                    again = run("check", file, folder=name)
                    self.assertEqual(again.returncode, 1)
                    self.assertIn("no picture", again.stderr)

    def test_a_step_of_a_path_shows_where_the_paths_part(self):
        steps = {
            "16-mirror.glsl": ("vec3 mirrored(vec3 d, vec3 n) { return 2.0 * dot(d, n) * n - d; }",
                               r"right goes on along \(.+\); yours goes on along \(.+\), 180 degrees apart"),
            "03-ray-sphere.glsl": (SPHERE + " { return -1.0; }", r"right meets the sphere at \(.+\); yours meets nothing"),
            "01-camera-ray.glsl": ("vec3 camera_ray(vec2 film, float field, float aspect) { return vec3(sqrt(-field)); }",
                                   r"right meets the film at \(.+, -2\); yours is not a number"),
            "17-refraction.glsl": ("vec3 refracted(vec3 d, vec3 n, float eta) { return vec3(sqrt(-eta)); }", r"right .+; yours is not a number"),
            "19-schlick.glsl": ("float schlick(float cosine, float r0) { return r0; }", None),
        }
        for file, (text, told) in steps.items():
            with self.subTest(file), tempfile.TemporaryDirectory() as name:
                (pathlib.Path(name) / file).write_text(text)
                result, picture = run("check", file, folder=name), pathlib.Path(name) / file.replace(".glsl", ".svg")
                self.assertEqual(result.returncode, 1, result.stdout)
                self.assertEqual(picture.exists(), told is not None)
                self.assertEqual("the paths part" in result.stdout, told is not None)
                if told is None:
                    continue
                self.assertRegex(result.stdout, "the paths part at vertex 0: " + told)
                drawing = xml.etree.ElementTree.parse(picture).getroot()
                lines = [line.get("stroke") for line in drawing.iter("{http://www.w3.org/2000/svg}path")]
                self.assertIn("#d33", lines)  # the right path
                self.assertEqual("#06c" in lines, file != "01-camera-ray.glsl")  # whose first ray has no direction

    def test_results_that_overflow_do_not_hide_the_cause(self):
        signature = "float power_heuristic(float own, float other)"
        mark = mark_of(25, signature + " { return own * own / (own + other); }")
        self.assertEqual(mark["errs_like"], ["only the numerator is squared"])
        self.assertRegex(mark["summary"], r"\d+ of them infinite or not a number$")
        # Where all other answers are right, the overflow itself is the cause.
        mark = mark_of(25, signature + " { return own * own / (own * own + other * other); }")
        self.assertEqual(mark["errs_like"], ["great densities overflow"])
        # A cause that two rules find is named once.
        self.assertEqual(mark_of(16, "vec3 mirrored(vec3 d, vec3 n) { return 2.0 * dot(d, n) * n - d; }")["errs_like"],
                         ["the sign is the other one"])

    def test_what_there_is_not_is_refused(self):
        for words, told in ((("check", "31"), "1 to 30"), (("start", "ray-spere"), "did you mean ray-sphere"),
                            (("check", "03-ray-sphere.glsl"), "tandem exercise start"), (("mend", "3"), "choose list"),
                            (("check",), "what is to be checked")):
            with tempfile.TemporaryDirectory() as folder:
                result = run(*words, folder=folder)
                self.assertEqual(result.returncode, 2, words)
                self.assertIn(told, result.stderr)

    def test_every_exercise_is_right_and_wrong_where_it_should_be(self):
        given = homework.read()
        slugs = list(given["exercises"])
        self.assertEqual(slugs, [line.split()[1] for line in run("list").stdout.splitlines()])
        jobs = []
        for number, slug in enumerate(slugs, 1):
            exercise = given["exercises"][slug]
            if THOROUGH or number % 3 > 0:
                jobs.append((number, homework.source(given, slug, exercise["right"][0]), None))
            if number % 3 > 0:  # scripts/measure/exercises hands in all
                continue
            cause, body = exercise["wrong"][0]
            jobs.append((number, homework.source(given, slug, body), cause))
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for (number, text, cause), mark in zip(jobs, pool.map(lambda job: mark_of(*job[:2]), jobs)):
                with self.subTest(number=number, cause=cause):
                    self.assertEqual(mark["mark"], "wrong" if cause else "right", mark)
                    if cause:
                        self.assertEqual(mark["errs_like"][0], cause)

    def test_hostile_submissions_get_a_mark(self):
        doubled = "".join(f"float f{i + 1}(float x) {{ return f{i}(x) + f{i}(x + 1.0); }}\n" for i in range(40))
        hostile = {
            "directives": f'{SPHERE} {{ return 1.0; }} /**/ # include "/etc/passwd"',
            "'layout'": f"layout(set = 0, binding = 1) buffer B {{ float x[]; }}; {SPHERE} {{ return 1.0; }}",
            "'gl_": f"{SPHERE} {{ return float(gl_GlobalInvocationID.x); }}",
            "tandem_": f"{SPHERE} {{ return tandem_given[0]; }}",
            "backslash": f"{SPHERE} {{ return 1.0; }} // \n\\\n",
            "bytes": f"// {'x' * 10_000_000}\n{SPHERE} {{ return 1.0; }}",
            "ASCII": b"\x00\xff\xfe" * 1000,
            "crashes|does not end|is more than": f"float f0(float x) {{ return sin(x); }}\n{doubled}{SPHERE} {{ return f40(radius); }}",
            "does not compile": f"{SPHERE} {{ return {'(' * 20_000}1.0{')' * 20_000}; }}",
            "are off": f"{SPHERE} {{ float a[4] = float[4](1.0, 2.0, 3.0, 4.0); int i = int(origin.x * 1e9); a[i] = 3.0;"
                       "return a[i * 7]; }",
            "answers are off": f"{SPHERE} {{ return 0.0 / (radius - radius); }}",
        }
        if not THOROUGH:  # it has 15 s of a processor
            del hostile["crashes|does not end|is more than"]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for told, mark in zip(hostile, pool.map(lambda text: mark_of(3, text), hostile.values())):
                with self.subTest(told):
                    self.assertEqual(mark["mark"], "wrong")
                    self.assertRegex(mark["summary"], told)
                    self.assertNotIn("root:", json.dumps(mark))

    def test_a_class_is_marked_by_one_command(self):
        given = homework.read()

        def answer(slug, right):
            exercise = given["exercises"][slug]
            return homework.source(given, slug, exercise["right"][0] if right else exercise["wrong"][0][1])
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "class" / "a & b" / "work").mkdir(parents=True)
            (folder / "class" / "carl").mkdir()
            (folder / "class" / "dora").mkdir()
            (folder / "class" / "a & b" / "work" / "16-mirror.glsl").write_text(answer("mirror", True))
            (folder / "class" / "carl" / "16-mirror.glsl").write_text(answer("mirror", False))
            (folder / "secret").write_text("root: 1")
            (folder / "class" / "carl" / "19-schlick.glsl").symlink_to(folder / "secret")
            result = run("mark", "class", "--junit", "marks.xml", "--json", "marks.json", folder=folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(result.stdout, "      16 19  right\na & b  +  .  1 of 2\ncarl   x  x  0 of 2\ndora   .  .  0 of 2\n")
            suites = xml.etree.ElementTree.parse(folder / "marks.xml").getroot()
            self.assertEqual([(suite.get("name"), suite.get("tests"), suite.get("failures")) for suite in suites],
                             [("a & b", "2", "1"), ("carl", "2", "2"), ("dora", "2", "2")])
            self.assertIn("errs like: the sign is the other one", suites[1][0][0].text)
            self.assertIn("the paths part at vertex 0", suites[1][0][0].text)
            self.assertNotIn("root", suites[1][1][0].text)
            self.assertEqual([student["right"] for student in json.loads((folder / "marks.json").read_text())], [1, 0, 0])

            one = run("mark", "class/a & b", "--due", "16,17", "--gradescope", "results.json", "--coderunner", "runner.json", folder=folder)
            self.assertEqual(one.returncode, 0, one.stderr)
            results = json.loads((folder / "results.json").read_text())
            self.assertEqual([results["score"], *((test["score"], test["status"]) for test in results["tests"])],
                             [1.0, (1.0, "passed"), (0.0, "failed")])
            runner = json.loads((folder / "runner.json").read_text())
            self.assertEqual(runner["fraction"], 0.5)
            self.assertEqual([row[0] for row in runner["testresults"]], ["iscorrect", True, False])

            for words, told in ((("class", "--gradescope", "x.json"), "one student"), (("class", "--due", "31"), "1 to 30"), (("secret",), "no folder"),
                                (("class", "--junit", "class/carl/16-mirror.glsl"), "16-mirror.glsl")):
                refused = run("mark", *words, folder=folder)
                self.assertEqual(refused.returncode, 2, words)
                self.assertIn(told, refused.stderr)
            self.assertIn("mirrored", (folder / "class" / "carl" / "16-mirror.glsl").read_text())


if __name__ == "__main__":
    unittest.main()
