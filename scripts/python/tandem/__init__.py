"""Verdicts of the program `tandem` on numpy images, files and renderers.

    import tandem
    result = tandem.compare(mine, reference)        # arrays or files
    result = tandem.verify("cornell-classic", candidate=render, size=32, time=30)
    print(result.verdict, result.sentence, result.report)

The program does the work. It is $TANDEM, else the `tandem` on the PATH. Images are linear Rec. 709 radiance, rows from the
top. With pytest, the fixture `render_verdict` fails a test by the verdict's sentence (tandem.pytest_plugin).
"""
from tandem.judge import NoDevice, Result, compare, verify

__all__ = ["NoDevice", "Result", "compare", "verify"]
