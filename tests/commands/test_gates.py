# The ready gates of scripts/gates: their commands are run as they stand, in little time, and leave the files that a
# server reads. Run by ctest with TANDEM = the program, SCENES = scenes/, BINARY = the build folder.
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

TANDEM = pathlib.Path(os.environ["TANDEM"])
SOURCE = pathlib.Path(os.environ["SCENES"]).resolve().parent
GATES = SOURCE / "scripts" / "gates"
DECIDED, UNDECIDED = 0, 3
LITTLE = {"PRESET": "smoke", "TOTAL_TIME": "6s"}  # what decides is the machine's load


class Gates(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def cases(self, junit):
        return {case.get("name"): case for case in ElementTree.parse(junit).getroot().iter("testcase")}

    def test_the_workflow_runs_and_leaves_what_it_uploads(self):
        workflow = (GATES / "github-actions.yml").read_text()
        commands = re.findall(r"^ +(?:- )?run: (.*)$", workflow, re.MULTILINE)
        gate = [command for command in commands if "tandem verify" in command]
        self.assertEqual(len(gate), 1)
        for command in commands:  # scripts that it calls are there
            for script in re.findall(r"\bscripts/\w+", command):
                self.assertTrue((SOURCE / script).exists(), script)
        for name, value in re.findall(r"^ +(PRESET|TOTAL_TIME): (\S+)$", workflow, re.MULTILINE):
            self.assertEqual({"PRESET": "driver", "TOTAL_TIME": "10min"}[name], value)
        (self.folder / "scenes").symlink_to(SOURCE / "scenes")
        program = self.folder / "build" / "release"
        program.mkdir(parents=True)
        (program / "tandem").symlink_to(TANDEM)
        result = subprocess.run(["sh", "-ec", gate[0]], cwd=self.folder, env={**os.environ, **LITTLE}, capture_output=True, text=True,
                                timeout=120)
        self.assertIn(result.returncode, [DECIDED, UNDECIDED], result.stdout + result.stderr)
        self.assertEqual(len(self.cases(self.folder / "driver.xml")), 6)
        uploaded = workflow.split("path: |\n")[1].split()
        self.assertEqual(uploaded, ["driver.xml", "driver.json", "report"])
        for file in uploaded:
            self.assertTrue((self.folder / file).exists(), file)

    def test_the_gitlab_job_runs_and_leaves_what_it_uploads(self):
        job = (GATES / "gitlab-ci.yml").read_text()
        self.assertEqual(re.findall(r"^    (PRESET|TOTAL_TIME): (\S+)$", job, re.MULTILINE), [("PRESET", "driver"), ("TOTAL_TIME", "10min")])
        commands = re.findall(r"^    - (.*)$", job, re.MULTILINE)
        for command in commands:
            for script in re.findall(r"\btandem/(scripts/\w+)", command):
                self.assertTrue((SOURCE / script).exists(), script)
        program = self.folder / "tandem" / "build" / "release"
        program.mkdir(parents=True)
        (program / "tandem").symlink_to(TANDEM)
        result = subprocess.run(["sh", "-ec", commands[-1]], cwd=self.folder, env={**os.environ, **LITTLE}, capture_output=True,
                                text=True, timeout=120)
        self.assertIn(result.returncode, [DECIDED, UNDECIDED], result.stdout + result.stderr)
        uploaded = re.search(r"paths: \[(.*)\]", job)[1].split(", ")
        self.assertIn(re.search(r"junit: (\S+)", job)[1], uploaded)
        self.assertEqual(len(self.cases(self.folder / "driver.xml")), 6)
        for file in uploaded:
            self.assertTrue((self.folder / file).exists(), file)

    def test_the_ctest_gate_fails_as_the_program_does(self):
        build, prefix = self.folder / "gate", self.folder / "installed"
        subprocess.run(["cmake", "--install", os.environ["BINARY"], "--prefix", prefix], check=True, capture_output=True, timeout=60)
        subprocess.run(["cmake", "-S", GATES / "ctest", "-B", build, "-D", f"CMAKE_PREFIX_PATH={prefix}", "-D", "TANDEM_PRESET=smoke",
                        "-D", f"TANDEM_TOTAL_TIME={LITTLE['TOTAL_TIME']}"], check=True, capture_output=True, timeout=60)
        result = subprocess.run(["ctest", "--test-dir", build, "--output-on-failure", "--output-junit", "images.xml"],
                                capture_output=True, text=True, timeout=120)
        cases = self.cases(build / "images.junit.xml")
        self.assertEqual(len(cases), 6, result.stdout)
        failed = any(case.find("failure") is not None or case.find("error") is not None or case.find("skipped") is not None
                     for case in cases.values())
        self.assertEqual(result.returncode != 0, failed, result.stdout)
        self.assertIn("images", self.cases(build / "images.xml"))


if __name__ == "__main__":
    unittest.main()
