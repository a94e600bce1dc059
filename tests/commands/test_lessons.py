# The lessons of scenes/lessons/: every command runs, and what the lesson says it prints is what it prints. Run by ctest with
# TANDEM = the program.
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
LESSONS = sorted((SOURCE / "scenes" / "lessons").glob("[0-9][0-9]-*.md"))
MOST_LINES = 600  # of the tracer that the lessons explain


def blocks_of(text):
    """The fenced blocks: (sh or text, content)."""
    return re.findall(r"^```(\w*)\n(.*?)^```", text, re.M | re.S)


STATUSES = {"disagree": 1, "undecided": 3}


def script_of(block):
    """A block of which every line must succeed, but those that end in `# disagree` or `# undecided`."""
    lines = []
    for line in block.replace("\\\n", " ").splitlines():
        command, _, comment = line.partition("    # ")
        status = STATUSES.get(comment)
        lines.append(f"status=0; {command} || status=$?; [ $status = {status} ] || exit 1$status" if status else command)
    return "\n".join(lines)


def pattern_of(line):
    """`…` stands for what differs from run to run."""
    return ".*".join(map(re.escape, line.strip().split("…")))


class Lessons(unittest.TestCase):
    def run_blocks(self, lesson):
        """Runs the blocks of a lesson in a folder of its own; returns how many lines of output were compared."""
        compared = 0
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for room in ("scenes", "scripts", "cpu_ref"):
                os.symlink(SOURCE / room, folder / room)
            (folder / "build" / "release").mkdir(parents=True)
            os.symlink(os.path.abspath(os.environ["TANDEM"]), folder / "build" / "release" / "tandem")
            environment = os.environ | {"PATH": f"{folder}/build/release:{os.environ['PATH']}"}
            output = ""
            for kind, block in blocks_of(lesson.read_text()):
                if kind == "sh":
                    result = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", script_of(block)], cwd=folder, env=environment,
                                            capture_output=True, text=True, timeout=300)
                    self.assertEqual(result.returncode, 0, f"{lesson.name}: {block}{result.stdout}{result.stderr}")
                    output = result.stdout
                else:
                    self.assertEqual(kind, "text", f"{lesson.name}: a block is neither sh nor text")
                    shown = [line for line in block.splitlines() if line.strip()]
                    printed = [line for line in output.splitlines() if line.strip()]
                    self.assertEqual(len(shown), len(printed), f"{lesson.name} shows\n{block}printed was\n{output}")
                    for line, actual in zip(shown, printed):
                        self.assertRegex(actual.strip(), f"^{pattern_of(line)}$", lesson.name)
                        compared += 1
        return compared

    def test_lessons_have_their_parts(self):
        self.assertGreaterEqual(len(LESSONS), 6)
        for number, lesson in enumerate(LESSONS, 1):
            text = lesson.read_text()
            with self.subTest(lesson.name):
                self.assertTrue(text.startswith(f"# {number}. "))
                self.assertEqual(len(re.findall(r"^!\[.+\]\(pictures/\d\d\.png\)$", text, re.M)), 1)
                self.assertEqual(text.count("<details><summary>Answer</summary>\n\n"), 3)
                self.assertIn("```sh\n", text)
                self.assertIn(lesson.name, (lesson.parent / "README.md").read_text())

    def test_the_tracer_can_be_read_in_one_sitting(self):
        lines = sum(len(path.read_text().splitlines()) for path in (SOURCE / "cpu_ref" / "first_tracer").glob("*.h"))
        self.assertLessEqual(lines, MOST_LINES)

    def test_the_page_has_all_within(self):
        with tempfile.TemporaryDirectory() as name:
            page = pathlib.Path(name) / "lessons.html"
            subprocess.run([sys.executable, SOURCE / "scripts" / "make" / "lessons", "-o", page], check=True, capture_output=True)
            text = page.read_text()
        self.assertEqual(text.count("data:image/png"), len(LESSONS))
        self.assertEqual(sorted(re.findall(r'data-panels="(\d)"', text)), list("223333344"))  # the others are plots, or of two sizes
        for target in re.findall(r'(?:src|href)="([^"]+)"', text):
            self.assertTrue(target.startswith("data:") or f'id="{target[1:]}"' in text, target)


def test_of(lesson):
    def test(self):
        begun = time.monotonic()
        self.assertGreaterEqual(self.run_blocks(lesson), 1)
        print(f"{lesson.name}: {time.monotonic() - begun:.1f} s")
    return test


for path in LESSONS:
    setattr(Lessons, f"test_commands_of_{path.stem.replace('-', '_')}", test_of(path))

if __name__ == "__main__":
    unittest.main()
