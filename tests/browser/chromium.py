"""The browser of the tests: its path, and a page opened in it without clicks."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next(filter(None, map(shutil.which, BROWSERS)), None)
DRIVER = shutil.which("chromedriver")

needs_browser = pytest.mark.skipif(
    BROWSER is None, reason="no Chromium: apt install chromium chromium-driver"
)
needs_driver = pytest.mark.skipif(
    not (BROWSER and DRIVER),
    reason="no Chromium with chromedriver: apt install chromium chromium-driver",
)

WIDTHS = (1280, 400)

SPEC = """
[search]
objectives = ["lost_motion", "stiffness", "cost"]
seed = 1
evaluations = 12000
workers = 1
[search.fixed]
"teeth.module_mm" = 0.25
[search.range]
"generator.deflection_mm" = [0.21, 0.28]
"teeth.flexspline_shift" = [2, 5]
"teeth.shift_difference" = [-0.4, 0.4]
"flexspline.rim_thickness_mm" = [0.45, 0.8]
"generator.type" = {choose = ["discs", "cosine"]}
[search.limits]
safety_factor_min = 1.0
"""
"""A search of a few seconds with three objectives."""


def open_page(page: Path, width: int, profile: Path) -> tuple[str, list[str]]:
    """Open a page without a network; returns its content and the errors of the browser."""
    done = subprocess.run(
        [
            str(BROWSER),
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            f"--user-data-dir={profile}",
            f"--window-size={width},900",
            "--enable-logging=stderr",
            "--dump-dom",
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]
