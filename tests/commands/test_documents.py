# What the documents say of this repository is so. Links and file names lead somewhere. Commands have the options that
# they are shown with. Rooms include only what HOW_TO_ADD.md lets them. README and ARCHITECTURE.md are short. Run by ctest
# with TANDEM = the program.
import fnmatch
import os
import pathlib
import re
import subprocess
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
ROOMS = ["common", "cpu_ref", "vulkan", "shaders", "scenes", "tests", "scripts"]
FILES = {path.relative_to(SOURCE).as_posix() for room in ROOMS for path in (SOURCE / room).rglob("*") if path.is_file()} | {
    path.name for path in SOURCE.iterdir() if path.is_file()}
FOLDERS = {parent.as_posix() for name in FILES for parent in pathlib.PurePath(name).parents} - {"."}
ENDS = {name.split("/", cut)[-1] for name in FILES | FOLDERS for cut in range(name.count("/") + 1)}
DOCUMENTS = sorted(name for name in FILES if name.endswith(".md"))
# Pages that scripts make quote command lines of the day on which a result was stored.
BY_HAND = [name for name in DOCUMENTS if not name.startswith("tests/records/")]
ARCHITECTURE = "common/ARCHITECTURE.md"
HOW_TO_ADD = "common/HOW_TO_ADD.md"
MADE_BY_READERS = {"scenes/first.json", "03-ray-sphere.glsl", "build/bug.py", "build/wrapper.py", "build/resident.py",
                   "build/judge.py", "build/rms.py", "build/box.py"}  # as documents tell them to

MOST_WORDS = 900       # of README.md
MOST_LINES = 100       # of ARCHITECTURE.md: two screens
MOST_IN_SENTENCE = 25  # words
ITEM = re.compile(r"^\s*(?:[-*]|\d+\.) ")
SOURCE_ENDING = r"\.(h|cpp|glsl|comp|frag|vert|r[a-z]{3,4}|py|md|cmake|in|def)$"


def text_of(name):
    return (SOURCE / name).read_text()


def expanded(pattern):
    """`materials.{h,cpp}` to both names."""
    found = re.search(r"\{([^{}]*)\}", pattern)
    if not found:
        return [pattern]
    return [name for part in found[1].split(",") for name in expanded(pattern[:found.start()] + part + pattern[found.end():])]


def is_path(token):
    """Whether a word of code speaks of a file of this repository: it begins with a room, or ends as sources do."""
    if not re.fullmatch(r"[\w.,{}*/+-]+", token) or "//" in token or token.startswith(("-", ".", "/")):
        return False
    if re.search(r"(^|/)[A-Z]+\.(?!md)", token):  # SCENE.json: any
        return False
    return token.split("/")[0] in ROOMS and "/" in token or re.search(SOURCE_ENDING, token) is not None


def exists(token, document):
    """From the root, from the document's folder, or as the end of some path (`verify/verify.cpp`)."""
    name = token.rstrip("/")
    if "*" in name:
        return any(fnmatch.fnmatchcase(path, pattern) for pattern in (name, "*/" + name) for path in FILES)
    return name in ENDS or os.path.normpath(os.path.join(os.path.dirname(document), name)) in FILES | FOLDERS


def code_of(text):
    """Blocks between fences, and what stands between backticks elsewhere."""
    blocks = re.findall(r"^```.*?\n(.*?)^```", text, re.M | re.S)
    rest = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return blocks + re.findall(r"`([^`\n]+)`", rest)


def command_lines(text):
    """`tandem COMMAND ...` in code: the command and its options."""
    for code in code_of(text):
        for line in code.splitlines():
            found = re.match(r"(?:build/release/)?tandem (plan [a-z]+|[a-z]+(?:-[a-z]+)*)\b(.*)", line.split("#")[0].strip())
            if found:
                yield found[1], re.findall(r"(?<![\w-])--[a-z][a-z-]*", found[2])


def options_of(command):
    for switch in ("--help-all", "--help"):
        result = subprocess.run([os.environ["TANDEM"], *command.split(), switch], capture_output=True, text=True, timeout=60)
        if result.returncode == 0:
            return set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", result.stdout)) | {"--help", "--help-all"}
    return None


def sentences_of(text):
    """Code is one word; blocks, tables, headings, pictures and targets of links are left out."""
    text = re.sub(r"^```.*?^```", "\n\n", text, flags=re.M | re.S)
    text = re.sub(r"`[^`\n]+`", "Code", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"^(    .*|#.*|\|.*|<.*)$", lambda line: line[0] if ITEM.match(line[0]) else "\n\n", text, flags=re.M)
    for paragraph in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", text):
        for sentence in re.split(r"(?<=[.!?])[\"')*_]*\s+(?![a-z])", ITEM.sub("", paragraph)):
            yield " ".join(sentence.split())


def words_of(sentence):
    """Those with two letters in a row, and "a" and "I": signs, figures and symbols of formulas are none."""
    return [word for word in sentence.split() if re.search(r"[^\W\d_]{2}|^\W*[aAI]\W*$", word)]


def table(text, heading):
    """Rows of the first table below a heading, as lists of cells."""
    section = text.split(f"\n## {heading}\n", 1)[1].split("\n## ")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line.startswith("|")]
    return rows[2:]


class Documents(unittest.TestCase):
    def test_links_lead_somewhere(self):
        for document in DOCUMENTS:
            if document.startswith("scripts/measure/"):  # the heads of pages in tests/records/, which are among them
                continue
            for target in re.findall(r"\]\(([^)\s]+)\)", text_of(document)):
                if re.match(r"[a-z]+:", target) or target.startswith("#"):
                    continue
                beside = SOURCE / os.path.dirname(document) / target.split("#")[0]
                self.assertTrue(beside.exists(), f"{document} links to {target}")

    def test_files_that_are_named_exist(self):
        for document in DOCUMENTS:
            for code in code_of(text_of(document)):
                for word in code.split():
                    token = re.sub(r":\d+$", "", word.strip("()[],;:'\"").rstrip("."))
                    for name in expanded(token) if is_path(token) else []:
                        self.assertTrue(name in MADE_BY_READERS or exists(name, document), f"{document} names {name}")

    def test_commands_have_the_options_that_they_are_shown_with(self):
        known = {}
        for document in BY_HAND:
            for command, options in command_lines(text_of(document)):
                if command not in known:
                    known[command] = options_of(command)
                self.assertIsNotNone(known[command], f"{document}: tandem {command}")
                for option in options:
                    self.assertIn(option, known[command], f"{document}: tandem {command}")

    def test_readme_is_short(self):
        self.assertLessEqual(len(text_of("README.md").split()), MOST_WORDS)

    def test_architecture_is_two_screens(self):
        self.assertLessEqual(len(text_of(ARCHITECTURE).splitlines()), MOST_LINES)

    def test_sentences_are_short(self):
        for document in BY_HAND + ["tests/records/README.md", "tests/records/NOTES.md"]:
            for sentence in sentences_of(text_of(document)):
                self.assertLessEqual(len(words_of(sentence)), MOST_IN_SENTENCE, f"{document}: {sentence}")

    def test_a_long_sentence_is_seen_and_code_tables_and_formulas_are_not_counted(self):
        long = "Word" + " word" * MOST_IN_SENTENCE

        def longest(text):
            return max(len(words_of(sentence)) for sentence in sentences_of(text))

        self.assertEqual(longest(f"First. {long} of two\nlines."), MOST_IN_SENTENCE + 4)
        self.assertEqual(longest(f"1. Item.\n    - {long}.\n"), MOST_IN_SENTENCE + 1)
        self.assertEqual(longest(f"See `{long}` x_1 = 3 y.\n\n| {long} |\n\n    {long}\n\n```sh\n{long}\n```\n"), 2)

    def test_rooms_include_what_they_may(self):
        named = {}  # by room: those of its row, and those that it may include
        for rooms, may_include, *_ in table(text_of(HOW_TO_ADD), "Who may include whom"):
            rooms = re.findall(r"`([^`]+)`", rooms)
            named |= {room: {*rooms, *re.findall(r"`([^`]+)`", may_include)} for room in rooms}

        def reach(room):
            found, left = set(), [room]
            while left:
                found.add(left[-1])
                left += named.get(left.pop(), set()) - found
            return found

        def room_of(path):
            folder = os.path.dirname(path)
            while folder and folder not in named:
                folder = os.path.dirname(folder)
            return folder

        for path in sorted(FILES):
            if not path.startswith(("common/", "cpu_ref/", "vulkan/", "shaders/")):
                continue
            if not re.search(r"\.(h|def|cpp|cpp\.in|glsl|comp|frag|vert|r[a-z]{3,4})$", path):
                continue
            room = room_of(path)
            self.assertTrue(room, f"{HOW_TO_ADD} has no room for {path}")
            for name in re.findall(r'^#include "([^"]+)"', text_of(path), re.M):
                target = next((x for x in (name, "shaders/" + name, os.path.join(os.path.dirname(path), name)) if x in FILES), None)
                if target and target not in reach(room):  # others are made by the build
                    self.assertIn(room_of(target), reach(room), f"{path} includes {target}")

    def test_names_are_in_the_files_where_newcomers_are_sent(self):
        for _, *cells in table(text_of(ARCHITECTURE), "Where is it?"):
            for cell in cells:
                file = None
                for token in re.findall(r"`([^`]+)`", cell):
                    if is_path(token):
                        file = token
                    elif file:
                        places = [path for path in FILES if path == file or path.endswith("/" + file)]
                        self.assertTrue(any(re.search(rf"\b{re.escape(token)}\b", text_of(path)) for path in places),
                                        f"{ARCHITECTURE}: {file} has no {token}")

    def test_comments_begin_with_what_they_speak_of(self):
        for name in sorted(FILES):
            if re.search(SOURCE_ENDING, name) and not name.endswith(".md"):
                lines = ("\n" + text_of(name)).splitlines()
                for above, line in zip(lines, lines[1:]):
                    begins = re.match(r"\s*(?://|#) (?:Of|Likewise)\b", line) and not re.match(r"\s*(?://|#)", above)
                    if begins or re.search(r"(?://|#) .*[.:;] (?:Of|Likewise)\b", line):
                        self.fail(f"{name}: begin this comment with what it speaks of: {line.strip()}")


if __name__ == "__main__":
    unittest.main()
