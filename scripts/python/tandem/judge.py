"""compare() and verify(): the command line of `tandem`, and its JSON as a Result."""
import contextlib
import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import tempfile

import numpy

from tandem.images import save_image
from tandem.serve import Served

FINE, DISAGREE, UNUSABLE_INPUT, UNDECIDED, NO_DEVICE = range(5)  # exit statuses of the program


class NoDevice(RuntimeError):
    """There is no usable Vulkan device on this machine."""


@dataclasses.dataclass(frozen=True)
class Result:
    """What the program decided.

    verdict: "agree" (shown to be equal within the margins), "disagree" (a difference is sure) or "undecided" (neither was
        shown). "failed": the candidate gave no images, or Vulkan's validation layer reports messages.
    sentence: one line that says where and how much.
    report: the folder of report.json and the pictures, or None; `tandem-report FOLDER` makes a page of it.
    numbers: the scene's entry of `tandem --json`. Its keys carry their units: "relative_difference" is (candidate -
        reference) / reference of the image's mean, "margin_relative", "minimum_detectable_relative", "seconds"…
    """
    verdict: str
    sentence: str
    report: "pathlib.Path | None"
    numbers: dict

    @property
    def agrees(self):
        return self.verdict == "agree"

    def __str__(self):
        return self.sentence + (f"\nreport: {self.report} (tandem-report {self.report} makes a page)" if self.report else "")


def program():
    """The path of the program. Raises FileNotFoundError."""
    wanted = os.environ.get("TANDEM", "tandem")
    found = shutil.which(wanted)
    if not found:
        raise FileNotFoundError(f"there is no program {wanted}; install Tandem, or set TANDEM to the path of its program")
    return found


def compare(a, b, *, variance_of_a="sample", variance_of_b="sample", report=None, **options):
    """Decides whether the images `a` and `b` of any two renderers agree.

    a, b: one image, or a list of images of independent seeds. An image is a file (EXR, HDR, TIFF, PFM, PNG, NPY) or an
        array of floats of shape (height, width, 3). An array of shape (n, height, width, 3) is n images.
        One image alone must tell its noise: a file by variance channels, an array by the shape (height, width, 6). Its
        last three are the variances of the pixels' means.
    variance_of_a, variance_of_b: whether the variance channels of files hold that of one "sample" or of the pixel's "mean".
    report: a folder to write pictures and report.json into.
    options: those of `tandem compare`, as margin="1%", tile_margin="10%", same_estimator=True.

    Returns a Result. Raises ValueError for unusable images and options.
    """
    with tempfile.TemporaryDirectory(prefix="tandem-") as folder:
        sides = []
        for name, images, variance_of in (("a", a, variance_of_a), ("b", b, variance_of_b)):
            files, arrays = _files_of(images, name, pathlib.Path(folder))
            sides.append(files)
            options[f"variance_of_{name}"] = "mean" if arrays else variance_of
        return _run("compare", [*sides[0], "vs", *sides[1]], options, report, folder, contextlib.nullcontext())


def verify(scene, candidate="vulkan", reference="cpu", *, report=None, **options):
    """Decides whether two renderers agree on a scene.

    scene: a scene file, or the name of a shipped scene ("cornell-classic", "closed-forms/polygon-light").
    candidate: "vulkan", "cpu", "exec:COMMAND", or a callable
        render(scene, width, height, samples, seed, first_sample) -> array
        scene: the path of the scene's JSON file. width, height: pixels. samples: of each pixel. seed: a number from 0 to
        2**31 - 1, another one for each image. first_sample: for renderers that draw the numbers of MODEL.md section 3.
        The array is linear radiance of shape (height, width, 3), or (height, width, 6) with the variances of one sample
        behind. It is called in this thread, so it may use what lives here. --time does not interrupt it.
    reference: what is trusted: "cpu", "vulkan", "oracle" or "exec:COMMAND".
    report: a folder to write pictures and report.json into.
    options: those of `tandem verify`, as size=32, time=30 (seconds), margin="5%", follows_model=True.

    Returns a Result. Raises ValueError for unusable scenes and options, NoDevice, and what the callable raises.
    """
    with tempfile.TemporaryDirectory(prefix="tandem-") as folder:
        follows = bool(callable(candidate) and options.pop("follows_model", False))
        serving = Served(candidate, follows, folder) if callable(candidate) else contextlib.nullcontext()
        options |= {"candidate": serving.command if callable(candidate) else candidate, "reference": reference}
        return _run("verify", [os.fspath(scene)], options, report, folder, serving)


def _files_of(images, name, folder):
    """The files of a side, and whether they were arrays."""
    if isinstance(images, (str, os.PathLike)) or isinstance(images, numpy.ndarray) and images.ndim == 3:
        images = [images]
    files = []
    arrays = 0
    for i, image in enumerate(images):
        if not isinstance(image, (str, os.PathLike)):
            file = folder / f"{name}{i + 1}.npy"
            save_image(file, image)
            arrays += 1
            image = file
        files.append(os.fspath(image))
    if arrays not in (0, len(files)):
        raise ValueError(f"{name}: holds files and arrays; give one kind")
    return files, arrays > 0


def _words(options):
    for key, value in options.items():
        option = "--" + key.replace("_", "-")
        if value is True:
            yield option
        elif value is not None and value is not False:
            yield from (option, os.fspath(value) if isinstance(value, os.PathLike) else str(value))


def _run(command, words, options, report, folder, serving):
    figures, log = pathlib.Path(folder, "figures.json"), pathlib.Path(folder, "log")
    options |= {"json": figures, "report": report}
    with open(log, "w+", encoding="utf-8", errors="replace") as errors:
        process = subprocess.Popen([program(), command, *words, *_words(options)], stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=errors)
        try:
            with serving as served:
                if served:
                    served.answer_while(process)
            status = process.wait()
        finally:
            if process.poll() is None:
                process.terminate()
                process.wait()
        errors.seek(0)
        told = errors.read().strip().removeprefix("tandem: ").replace(f"{folder}/", "")  # arrays have no names but a1.npy, b1.npy…
    if status == NO_DEVICE:
        raise NoDevice(told)
    if not figures.exists():
        raise ValueError(told) if status == UNUSABLE_INPUT else RuntimeError(told or f"tandem ended with status {status}")
    numbers = json.loads(figures.read_text())
    scene = numbers["scenes"][0]
    sentence, verdict = f"{scene['scene']}: {scene['sentence']}".replace(f"{folder}/", ""), scene["verdict"]
    layer = [message["messages"] for message in numbers["validation_layer"]]
    if layer:
        sentence += "; the Vulkan validation layer reports: " + " ".join(layer)
    if scene["failure"] or layer:
        verdict = "failed"
    return Result(verdict, sentence, pathlib.Path(report) if report is not None else None, scene)
