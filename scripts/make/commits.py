"""Of which commit a result is, and whether that makes it evidence. Imported by scripts/measure, make/accuracy_pages.py and
make/accuracy_picture."""
import functools
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
CLEAN = re.compile("[0-9a-f]{7,40}")


def git(*words):
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True)


@functools.cache
def commit_fault(commit):
    """Why a result of that commit is no evidence; empty: it is."""
    if not CLEAN.fullmatch(commit or ""):
        return f"commit '{commit or ''}' is not a clean one"
    if not (ROOT / ".git").exists() or git("rev-parse", "--is-shallow-repository").stdout.strip() != "false":
        return ""  # there is no history to look in
    known = git("merge-base", "--is-ancestor", commit, "HEAD")
    return "" if known.returncode == 0 else f"commit {commit} is not in the history"


def same_commit(one, other):
    """Whether both are clean and one: older results have fewer digits than the program tells."""
    return bool(CLEAN.fullmatch(one) and CLEAN.fullmatch(other)) and (one.startswith(other) or other.startswith(one))


def commit_of(program):
    """What the program tells of itself in the JSON of a render. Raises OSError where it renders nothing."""
    with tempfile.TemporaryDirectory() as folder:
        image, told = pathlib.Path(folder) / "image.pfm", pathlib.Path(folder) / "told.json"
        words = [program, "render", ROOT / "scenes/cornell-classic.json", "-o", image, "--size", 1, "--samples", 1, "--json", told]
        result = subprocess.run(list(map(str, words)), capture_output=True, text=True)
        if result.returncode != 0:
            raise OSError(f"{program} render: {result.stderr.strip()[-500:]}")
        return json.loads(told.read_text()).get("git", "unknown")


def changed():
    """Whether the checkout has changes; results that a run has just stored do not count."""
    return (ROOT / ".git").exists() and bool(git("status", "--porcelain", "--", ":!tests/records").stdout.strip())


def commit_to_store(program, any_state=False):
    """The program's commit. Raises OSError where nothing of it is to be stored. Scenes and scripts are the checkout's, so that must
    have no changes either."""
    commit = commit_of(program)
    if any_state:
        return commit
    if fault := commit_fault(commit):
        raise OSError(f"{program}: {fault}: commit, build and measure again")
    if changed():
        raise OSError("there are changes that are not committed: commit and build first")
    return commit


def check_told(told, commit):
    """Of the JSON of a render. Raises OSError where another program wrote it: the program was built anew meanwhile."""
    if told.get("git", "unknown") != commit:
        raise OSError(f"the program was of commit {commit} and is of {told.get('git', 'unknown')} now: measure again")


def faults_of(path, stored):
    """A line for each (name, commit) of a stored file that is no evidence."""
    return [f"{path}: {name}: {fault}" for name, commit in stored if (fault := commit_fault(commit))]


def printed(script, faults):
    """Whether there were any."""
    for fault in faults:
        print(f"{script}: {fault}", file=sys.stderr)
    return bool(faults)
