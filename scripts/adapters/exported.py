"""What the adapters of pbrt, Mitsuba and Tungsten share: `tandem export` gives the scene, a program makes one image of it.

Environment: $TANDEM is the program tandem, and each adapter names the variable of its own. Without, they are looked for on PATH.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile


def program(variable, name):
    found = os.environ.get(variable) or shutil.which(name)
    if not found or not shutil.which(found):
        sys.exit(f"there is no {found or name}: put {name} on PATH, or name the program in ${variable}")
    return found


def run(command, **more):
    """Its last words are those of the adapter when it fails."""
    result = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", **more)
    if result.returncode != 0:
        sys.exit(result.stdout[-4000:] or f"{command[0]} ended with status {result.returncode}")
    return result.stdout


def adapter(text, variable, name, target, image_of):
    """image_of(program, scene file of the target, image, arguments) has the image made."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=pathlib.Path, help="a scene file of Tandem")
    for number in ("width", "height", "samples", "seed", "bounces", "threads"):
        parser.add_argument(number, type=int)
    parser.add_argument("out", type=pathlib.Path, help="the image to write")
    arguments = parser.parse_args()
    tandem, renderer = program("TANDEM", "tandem"), program(variable, name)
    with tempfile.TemporaryDirectory() as folder:
        scene = pathlib.Path(folder) / f"scene.{target}"
        run([tandem, "export", arguments.scene, "--to", target, "-o", scene, "--size", f"{arguments.width}x{arguments.height}",
             "--bounces", arguments.bounces])
        image = pathlib.Path(folder) / ("image" + arguments.out.suffix)
        said = image_of(renderer, scene, image, arguments)
        if not image.is_file():  # they end with status 0 after some errors
            sys.exit(said[-4000:] or f"{name} wrote no image")
        shutil.copyfile(image, arguments.out)
