"""The fixture `render_verdict`: a test that fails by the verdict's sentence, and names the report.

    def test_box(render_verdict):
        render_verdict.verify("cornell-classic", candidate=render, size=32, time=30, margin="5%")

    def test_image(render_verdict):
        render_verdict.compare("now.exr", "golden.exr")

Images that are not shown to agree fail the test: disagreement, and undecided too, as nothing was shown. Without a usable
Vulkan device it is skipped. The report is in the test's tmp_path, or in a folder of `--tandem-reports FOLDER`.
"""
import pathlib
import re

import pytest

import tandem


def pytest_addoption(parser):
    parser.addoption("--tandem-reports", metavar="FOLDER", type=pathlib.Path,
                     help="keep the reports of tandem's verdicts here (default: each test's temporary folder)")


class RenderVerdict:
    def __init__(self, folder):
        self._folder, self._count = folder, 0

    def compare(self, a, b, **options):
        """tandem.compare, which must agree. Returns the Result."""
        return self._agree(tandem.compare, a, b, **options)

    def verify(self, scene, candidate="vulkan", reference="cpu", **options):
        """tandem.verify, which must agree. Returns the Result."""
        return self._agree(tandem.verify, scene, candidate, reference, **options)

    def _agree(self, judge, *sides, **options):
        __tracebackhide__ = True
        self._count += 1
        options.setdefault("report", self._folder / f"verdict{self._count}")
        try:
            result = judge(*sides, **options)
        except tandem.NoDevice as error:
            pytest.skip(str(error))
        if not result.agrees:
            pytest.fail(str(result), pytrace=False)
        return result


@pytest.fixture
def render_verdict(request, tmp_path):
    kept = request.config.getoption("--tandem-reports")
    return RenderVerdict(kept.resolve() / re.sub(r"[^\w.-]+", "_", request.node.nodeid) if kept else tmp_path)
