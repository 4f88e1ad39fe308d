"""The workbench in a real browser: real clicks on a real server, no display needed."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
import tarfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from chromium import BROWSER, DRIVER, SPEC, TESTS, WIDTHS, needs_driver
from workbench_server import answer, opener, serving

sys.path.insert(0, str(TESTS / "python"))
from small_campaigns import DRIVE, gap, write
from small_campaigns import campaign as small_campaign

PATIENCE_S = 300.0
"""Time limit of a diagnosis on a busy machine."""

NOISE_ARCSEC = 1.5
"""Noise of the angle in the campaign of the rig."""

TABS = (
    "Drive",
    "Columns",
    "Measured",
    "Where it fails",
    "Residual plots",
    "Effects",
    "Confounded",
    "Next run",
    "Design",
    "Export",
)


WORST_CELL = """
const plot = document.querySelector('.map .js-plotly-plot');
const {x, z} = plot._fullData[0], {xaxis, yaxis} = plot._fullLayout;
let most = 0, place = null;
z.forEach((row, j) => row.forEach((mean, i) => {
  if (!(mean > most)) return;
  most = mean;
  place = [xaxis._offset + xaxis.d2p((x[i] + x[i + 1]) / 2), yaxis._offset + yaxis.d2p(j + 0.5)];
}));
return place;
"""
"""Position of the map's cell with the largest value above the model."""

DRAWN_S = 10.0
"""Charts are drawn again for a new width; a machine that diagnoses meanwhile takes its time."""

PICTURES = "return [...document.images].filter((one) => one.naturalWidth > 0).length;"
"""Number of pictures that the browser has drawn."""

PICTURES_KEPT = os.environ.get("LOSTMOTION_PICTURES", "")
"""Folder for the pictures of every tab, for somebody to look at."""

DOTS = ".front .scatterlayer path.point"
"""Designs of a front."""


def command(*words: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command of the package."""
    return subprocess.run(
        [sys.executable, "-m", "lostmotion", *map(str, words)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign with a radial gap that grows with the temperature hidden in it."""
    folder = tmp_path_factory.mktemp("campaign")
    subprocess.run(
        [sys.executable, "-m", "rig", "write", "--effect", "thermal_gap", "--sigma", "4",
         "--seed", "3", "--drive", "2", "--plan", "third", "--name", "joint", "-o", folder],
        check=True, cwd=TESTS, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    return folder


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of the same kind that is diagnosed at once."""
    folder = tmp_path_factory.mktemp("short")
    (folder / "joint.toml").write_text(DRIVE)
    write(small_campaign(runs=8, rows=250, add=gap), folder / "joint.csv")
    return folder


class View:
    """The browser, with the actions of a user."""

    def __init__(self, driver: Any, downloads: Path) -> None:
        self.driver = driver
        self.downloads = downloads

    def size(self, width: int, height: int = 900) -> None:
        self.driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
        )

    def scheme(self, name: str) -> None:
        """Prefer light or dark mode, like the settings of a system."""
        features = [{"name": "prefers-color-scheme", "value": name}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})

    def wait(self, what: Callable[[], Any], why: str) -> Any:
        """Wait until a condition holds; elements may be redrawn meanwhile."""
        from selenium.common.exceptions import WebDriverException

        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            with contextlib.suppress(WebDriverException, AttributeError, ValueError):
                found = what()
                if found:
                    return found
            time.sleep(0.1)
        raise AssertionError(f"waited {PATIENCE_S:.0f} s for {why}; the page: {self.text('body')}")

    def all(self, selector: str) -> list[Any]:
        return list(self.driver.find_elements("css selector", selector))

    def text(self, selector: str) -> str:
        found = self.all(selector)
        return str(found[0].text) if found else ""

    def press(self, label: str, selector: str = "button") -> None:
        """Click the element with a text, once it can be clicked."""

        def click() -> bool:
            for one in self.all(selector):
                if one.get_attribute("textContent").strip() == label and one.is_enabled():
                    self.driver.execute_script("arguments[0].scrollIntoView({block:'center'})", one)
                    one.click()
                    return True
            return False

        self.wait(click, f"something to press called {label}")

    def press_on(self, selector: str) -> None:
        """Click the first element of a selector, once it can be clicked."""

        def click() -> bool:
            one = self.all(selector)[0]
            self.driver.execute_script("arguments[0].scrollIntoView({block:'center'})", one)
            one.click()
            return True

        self.wait(click, f"something to press at {selector}")

    def turn_to(self, tab: str) -> None:
        def shown() -> bool:
            return any(p.is_displayed() for p in self.all(f"section[aria-label='{tab}']"))

        def turned() -> bool:
            # A page that is being redrawn ignores a click; a user clicks again.
            self.press(tab, ".q-tab")
            end = time.monotonic() + 5.0
            while not shown() and time.monotonic() < end:
                time.sleep(0.1)
            return shown()

        self.wait(turned, tab)

    def type(self, label: str, text: str) -> None:
        """Write into the field with a label, as with the keyboard."""
        from selenium.webdriver.common.keys import Keys

        def write() -> bool:
            field = self.all(f"input[aria-label='{label}']")[0]
            field.send_keys(Keys.CONTROL, "a")
            field.send_keys(Keys.DELETE, text, Keys.TAB)
            return bool(field.get_attribute("value") == text)

        self.wait(write, label)

    def point(self, element: Any, x: float | None = None, y: float | None = None) -> None:
        """Click on an element, or on a position within it: charts react to the pointer above
        them."""
        from selenium.webdriver import ActionChains

        self.driver.execute_script("arguments[0].scrollIntoView({block:'center'})", element)
        size = element.size
        across = 0 if x is None else round(x - size["width"] / 2)
        down = 0 if y is None else round(y - size["height"] / 2)
        actions = ActionChains(self.driver)
        actions.move_to_element_with_offset(element, across, down).pause(0.2).click().perform()

    def idle(self) -> None:
        self.wait(lambda: not self.all(".job button"), "the end of the work")

    def rms(self) -> float:
        return float(self.text("#rms"))

    def floor(self) -> float:
        return float(re.search(r"(?:noise floor|repeatability)\s+([\d.]+)", self.text(".rail"))[1])  # type: ignore[index]


@pytest.fixture
def view(tmp_path: Path) -> Iterator[View]:
    from selenium import webdriver

    downloads = tmp_path / "downloads"
    downloads.mkdir()
    options = webdriver.ChromeOptions()
    options.binary_location = str(BROWSER)
    for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(word)
    options.add_argument(f"--user-data-dir={tmp_path / 'profile'}")
    options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(str(DRIVER)))
    try:
        shown = View(driver, downloads)
        shown.size(1280)
        yield shown
        faults = [
            line["message"] for line in driver.get_log("browser") if line["level"] == "SEVERE"
        ]
        assert not [fault for fault in faults if "socket.io" not in fault]
    finally:
        driver.quit()


@needs_driver
def test_a_hidden_effect_is_found_added_and_exported(
    view: View, campaign: Path, tmp_path: Path
) -> None:
    with serving(tmp_path) as address:
        view.driver.get(address)
        # --- dropped files are loaded
        view.wait(lambda: view.all("input[type=file]"), "the place to drop files")[0].send_keys(
            f"{campaign / 'joint.toml'}\n{campaign / 'joint.csv.gz'}"
        )
        view.wait(lambda: "11 runs, 16400 samples" in view.text(".top"), "the recordings")
        view.idle()

        # --- where it fails: a warm run of the map is picked
        view.turn_to("Where it fails")
        place = view.wait(lambda: view.driver.execute_script(WORST_CELL), "the map")
        view.point(view.all(".map .js-plotly-plot")[0], *place)
        told = view.wait(lambda: view.text("#cell"), "what lies in the cell")
        assert "thermal gap" in told
        assert re.search(r"mean by run", told, re.IGNORECASE)
        view.wait(lambda: view.all(".map"), "the map")[0].send_keys("\ue012")  # arrow left
        view.wait(lambda: view.text("#cell") not in ("", told), "the cell beside it")

        # --- which effect is missing
        view.turn_to("Effects")
        view.wait(lambda: view.driver.execute_script(PICTURES) > 0, "the pictures of the effects")
        assert "may be confounded with" in view.text("#panel-effects")
        view.press("Find what is missing")
        view.wait(lambda: view.text("#verdict") == "Missing: thermal gap.", "the verdict")
        view.idle()

        # --- ticked: the error falls; undone: it is restored
        view.wait(lambda: view.all("#tick-kinematic_error"), "the list")[0].click()
        view.wait(lambda: "kinematic error" in view.text(".rail"), "an effect that is not there")
        view.idle()
        before = view.rms()
        view.press("Undo the last")
        view.wait(lambda: "kinematic error" not in view.text(".rail"), "the undoing")
        view.wait(lambda: view.all("#tick-thermal_gap:not([aria-disabled=true])"), "the list")
        view.all("#tick-thermal_gap")[0].click()
        view.wait(lambda: view.rms() < 0.5 * before, "the fall of the error")
        view.idle()
        after = view.rms()
        assert after == pytest.approx(NOISE_ARCSEC, rel=0.1)
        view.wait(
            lambda: "+ thermal gap" in view.all("#ladder")[0].get_attribute("textContent"),
            "the ladder beside the panels",
        )

        # --- two confounded effects
        view.turn_to("Confounded")
        view.press("Compare")
        view.wait(lambda: "separated by" in view.text("#rivals").lower(), "the two effects")
        view.idle()

        # --- the controller's files equal those of the commands
        view.turn_to("Export")
        view.press("params.h")
        header = view.downloads / "params.h"
        view.wait(header.is_file, "the download")
    fitted, params = tmp_path / "fitted.toml", tmp_path / "params.h"
    done = command(
        "fit", campaign / "joint.toml", campaign / "joint.csv.gz", "--add", "thermal_gap",
        "-o", fitted, "--json", "-", folder=tmp_path,
    )  # fmt: skip
    assert json.loads(done.stdout)["ladder"][-1]["rms_arcsec"] == pytest.approx(after, abs=0.006)
    command("export", fitted, "-o", params, "--set", "period_us=500", folder=tmp_path)
    assert header.read_text() == params.read_text()
    assert "1 effect;" in command("export", fitted, "-o", params, folder=tmp_path).stdout


@needs_driver
def test_a_search_is_stopped_and_resumed_with_the_same_end(view: View, tmp_path: Path) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC)

    def share() -> float:
        done, whole = re.search(r"(\d+) of (\d+)", view.text("#live")).groups()  # type: ignore[union-attr]
        return int(done) / int(whole)

    with serving(tmp_path) as address:
        view.driver.get(address)
        view.turn_to("Design")
        view.type("spec, a file", "spec.toml")
        view.press("Start")
        view.wait(lambda: share() > 0.1, "some progress")
        view.press("Stop")
        view.wait(lambda: "stopped" in view.text("#live"), "the stop")
        assert share() < 0.9
        assert (tmp_path / "spec_run" / "best.toml").is_file()
        view.press("Resume")
        view.wait(lambda: "finished" in view.text("#live"), "the end")
        dots = view.wait(lambda: view.all(DOTS), "the front")
        front = (tmp_path / "spec_run" / "front.csv").read_text()
        assert len(dots) == len(front.splitlines()) - 1
        view.point(dots[-1])
        view.wait(lambda: "Margins" in view.text("#design"), "the design behind a dot")
        view.press("drive file", "#design button")
        view.wait(lambda: list(view.downloads.glob("design_*.toml")), "the download")
        view.press("Load into the workbench")
        view.wait(lambda: view.text(".top .what"), "the drive")
    (drive,) = view.downloads.glob("design_*.toml")
    assert command("predict", drive, "--quiet", folder=tmp_path).returncode == 0
    command("design", "spec.toml", "-o", "whole", "--quiet", folder=tmp_path)
    assert (tmp_path / "whole" / "front.csv").read_text() == front


@needs_driver
def test_a_page_that_was_busy_or_suspended_is_unchanged(view: View, tmp_path: Path) -> None:
    with serving(tmp_path) as address:
        view.driver.get(address)
        view.turn_to("Design")
        view.type("spec, a file", "half-written.toml")
        view.driver.execute_script(
            "const end = Date.now() + arguments[0]; while (Date.now() < end);", 15_000
        )
        time.sleep(5)  # lost elements would have been redrawn by now
        assert view.driver.execute_script(
            "return [...document.querySelectorAll('input')].map(one => one.value)"
        ).count("half-written.toml") == 1  # fmt: skip


@needs_driver
def test_long_work_leaves_the_page_alive_and_can_be_stopped(
    view: View, campaign: Path, tmp_path: Path
) -> None:
    with serving(tmp_path, campaign / "joint.toml", campaign / "joint.csv.gz") as address:
        view.driver.get(address)
        view.turn_to("Effects")
        view.press("Find what is missing")
        view.wait(lambda: "diagnosing: " in view.text(".job"), "what is done now")
        begin = time.monotonic()
        view.turn_to("Drive")
        assert time.monotonic() - begin < 5
        for width in reversed(WIDTHS):
            look(view, "Busy", width)
        view.press("Stop")
        view.wait(lambda: "diagnosing: stopped" in view.text(".message"), "the stop")
        view.turn_to("Effects")
        view.press("Find what is missing")
        view.wait(lambda: view.text("#verdict"), "the verdict")


@needs_driver
def test_a_bad_file_gets_the_message_of_the_command_line(
    view: View, short: Path, tmp_path: Path
) -> None:
    drive = (short / "joint.toml").read_text()
    (tmp_path / "drive.toml").write_text(drive)
    (tmp_path / "bad.toml").write_text(drive.replace("T2_Nm = 25", 'T2_Nm = "soft"'))
    (tmp_path / "bad.csv").write_text("time_s,torque_Nm\n0,1\n1,2\n")
    (tmp_path / "plan.csv").write_text("time_s\n0\n")

    def said(*words: str) -> str:
        done = command(*words, folder=tmp_path)
        assert done.returncode == 2
        return done.stderr.removeprefix("lostmotion: ").strip()

    with serving(tmp_path) as address:
        view.driver.get(address)
        view.type("drive file", "bad.toml")
        view.press("Load")
        expected = said("predict", "bad.toml")
        view.wait(lambda: view.text(".message") == expected, "the message")
        view.type("drive file", "drive.toml")
        view.type("recordings, files or folders", "bad.csv")
        view.press("Load")
        expected = said("compare", "drive.toml", "bad.csv")
        view.wait(lambda: view.text(".message") == expected, "the message")
        view.idle()
        # A dropped file has no folder to name.
        view.all("input[type=file]")[0].send_keys(str(tmp_path / "bad.toml"))
        dropped = said("predict", "bad.toml")
        view.wait(lambda: view.text(".message").endswith(dropped), "the message")
        view.turn_to("Design")
        view.type("spec, a file", "bad.toml")
        view.press("Start")
        expected = said("design", "bad.toml", "-o", "run")
        view.wait(lambda: view.text("#panel-design .message") == expected, "the message")
    assert sorted(p.name for p in tmp_path.iterdir() if p.suffix in (".csv", ".toml")) == [
        "bad.csv", "bad.toml", "drive.toml", "plan.csv",
    ]  # fmt: skip


@needs_driver
def test_what_is_loaded_stays_when_what_follows_cannot_be(
    view: View, short: Path, tmp_path: Path
) -> None:
    (tmp_path / "notes.txt").write_text("no recording\n")
    with serving(tmp_path, short / "joint.toml", short / "joint.csv") as address:
        view.driver.get(address)
        loaded = view.wait(lambda: view.text("#rms"), "the comparison")
        view.type("recordings, files or folders", "nothing.csv")
        view.press("Load")
        view.wait(lambda: "nothing.csv: found no such file" in view.text(".message"), "the message")
        view.idle()
        assert view.text("#rms") == loaded
        assert "8 runs, 2000 samples" in view.text(".top")
        view.all("input[type=file]")[0].send_keys(str(tmp_path / "notes.txt"))
        view.wait(lambda: "expected .toml, .csv, .gz, .parquet" in view.text(".message"), "a word")
        assert view.text("#rms") == loaded


NAMELESS = """
return [...document.querySelectorAll('button, input:not([type=file]), a[href], [role=combobox],' +
    '[role=checkbox], [role=tab], [tabindex="0"]')].filter(e => {
  if (!e.checkVisibility()) return false;
  const label = e.getAttribute('aria-label') || e.textContent.trim() || e.title ||
    (e.labels && [...e.labels].map(l => l.textContent.trim()).join('')) ||
    (e.closest('label') && e.closest('label').textContent.trim()) ||
    (e.closest('[aria-label]') && e.closest('[aria-label]').getAttribute('aria-label'));
  return !label;
}).map(e => e.outerHTML.slice(0, 200));
"""
"""Controls without a name for a screen reader."""


@needs_driver
def test_the_example_is_loaded_and_explored_by_the_keyboard_alone(
    view: View, tmp_path: Path
) -> None:
    from selenium.webdriver.common.keys import Keys

    def focus_on(name: str) -> Any:
        """Press TAB until the element with a name has the focus."""
        for _ in range(60):
            view.driver.switch_to.active_element.send_keys(Keys.TAB)
            active = view.driver.switch_to.active_element
            label = active.get_attribute("aria-label") or active.get_attribute("textContent")
            if (label or "").strip() == name:
                return active
        raise AssertionError(f"TAB never came to {name}")

    with serving(tmp_path) as address:
        view.driver.get(address)
        view.wait(lambda: "Load the example" in view.text("body"), "the page")
        focus_on("Load the example").send_keys(Keys.ENTER)
        view.wait(lambda: "31 runs" in view.text(".top"), "the recordings")
        view.idle()
        for tab in TABS:
            view.turn_to(tab)
            view.wait(lambda: not view.driver.execute_script(NAMELESS), "names of the controls")
        view.turn_to("Drive")
        tabs = view.driver.switch_to.active_element
        tabs.send_keys(Keys.ARROW_RIGHT)
        view.driver.switch_to.active_element.send_keys(Keys.ENTER)
        view.wait(lambda: view.all("#panel-measured figure"), "the panel beside it")


TEXTS = """
const out = [], width = innerWidth;
const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walk.nextNode()) {
  const node = walk.currentNode, parent = node.parentElement;
  const seen = parent.checkVisibility({visibilityProperty: true, opacityProperty: true});
  if (!node.data.trim() || !seen) continue;
  if (parent.closest('title, script, style, .q-tabs, .scroll, .material-icons, .q-icon')) continue;
  const range = document.createRange();
  range.selectNodeContents(node);
  for (const box of range.getClientRects())
    if (box.width > 1 && box.height > 1)
      out.push([box.left, box.top + scrollY, box.right, box.bottom + scrollY, node.data.trim(),
        parent.closest('svg') ? 1 : 0]);
}
return [out, document.documentElement.scrollWidth, width];
"""
"""Boxes of every visible line of text."""

CUT = """
return [...document.querySelectorAll('body *')].filter(e => {
  if (!e.checkVisibility()) return false;
  // A ripple runs over a button for a moment after it was pressed.
  if (e.closest('svg, .scroll, .q-tabs, input, .q-field, .q-uploader, .q-ripple')) return false;
  const style = getComputedStyle(e);
  return style.overflowX != 'visible' && e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0;
}).map(e => e.className + ': ' + e.textContent.slice(0, 60));
"""


def overlapping(boxes: list[list[Any]]) -> list[tuple[str, str]]:
    """Pairs of texts that overlap by more than the slack of a line."""
    found = []
    for a, b in itertools.combinations(boxes, 2):
        across = min(a[2], b[2]) - max(a[0], b[0])
        up = min(a[3], b[3]) - max(a[1], b[1])
        if across > 2 and up > 0.45 * min(a[3] - a[1], b[3] - b[1]):
            found.append((a[4][:40], b[4][:40]))
    return found


def faults(view: View) -> list[str]:
    """Texts that are wider than the page, cut off, or on top of other text."""
    boxes, whole, inner = view.driver.execute_script(TEXTS)
    found = [f"the page is {whole} px wide in place of {inner}"] if whole > inner else []
    found += [f"cut off: {box[4]}" for box in boxes if box[0] < -1 or box[2] > inner + 1]
    found += [f"{a} on top of {b}" for a, b in overlapping(boxes)]
    found += [f"wider than its place: {one}" for one in view.driver.execute_script(CUT)]
    return found


def look(view: View, name: str, width: int) -> None:
    """Take a picture of a page without faults, once it has been drawn for its width."""
    view.size(width)
    view.driver.execute_script("scrollTo(0, 0)")
    height = view.driver.execute_script("return document.documentElement.scrollHeight")
    view.size(width, min(max(height, 900), 6000))
    end = time.monotonic() + DRAWN_S
    time.sleep(0.3)
    while (found := faults(view)) and time.monotonic() < end:
        time.sleep(0.1)
    if PICTURES_KEPT:
        view.driver.save_screenshot(f"{PICTURES_KEPT}/{name.replace(' ', '_')}_{width}.png")
    assert not found, f"{name} at {width}: {found}"
    view.size(width)


@pytest.fixture(scope="module")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The accessibility checker axe-core from npm's registry."""
    if shutil.which("npm") is None:
        pytest.skip("no npm: apt install npm (the accessibility checker comes from its registry)")
    folder = tmp_path_factory.mktemp("axe")
    done = subprocess.run(
        ["npm", "pack", "--loglevel=error", "axe-core@4"], cwd=folder, capture_output=True,
        text=True, check=False, timeout=120,
    )  # fmt: skip
    if done.returncode != 0:
        said = " ".join(done.stderr.split())
        pytest.skip(f"npm did not fetch the accessibility checker axe-core: {said:.80}")
    with tarfile.open(folder / done.stdout.strip().splitlines()[-1]) as archive:
        script = archive.extractfile("package/axe.min.js")
        assert script is not None
        return script.read().decode()


AXE = """
const done = arguments[0];
axe.run({runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa']}).then(result => done(
  result.violations.map(one => one.id + ': ' + one.nodes.map(node => node.html).join(' ... '))));
"""
"""Violations of the guidelines for accessible pages (WCAG 2.1, levels A and AA)."""


AT_REST = """
const dark = document.body.classList.contains('body--dark');
return dark === (arguments[0] === 'dark') && !document.getAnimations().length;
"""
"""Whether the page has the colours of a scheme, and no transition is running."""


SCHEMES = dict(zip(WIDTHS, ("light", "dark"), strict=True))
"""Colours in which a page is checked at a width: each page has been seen in both."""


def keeps_the_guidelines(view: View, where: str, scheme: str) -> None:
    """Check a page with axe-core, in light or in dark colours."""
    view.scheme(scheme)
    view.wait(partial(view.driver.execute_script, AT_REST, scheme), f"the {scheme} colours")
    assert view.driver.execute_async_script(AXE) == [], f"{where}, {scheme}"


@needs_driver
def test_every_tab_fits_and_keeps_the_guidelines_for_accessible_pages_at_either_width(
    view: View, short: Path, tmp_path: Path, axe: str
) -> None:
    (tmp_path / "spec.toml").write_text(SPEC.replace("12000", "1000"))
    reference = TESTS / "data" / "drives" / "reference_a.toml"

    with serving(tmp_path) as address:
        view.driver.get(address)
        view.driver.execute_script(axe)
        for width in WIDTHS:
            view.size(width)
            for tab in TABS:
                view.turn_to(tab)
                look(view, f"Empty {tab}", width)
                if width == WIDTHS[-1]:
                    keeps_the_guidelines(view, f"empty {tab} at {width}", SCHEMES[width])
        # The button, which the keyboard reaches, opens the file dialog.
        view.driver.execute_script(
            "HTMLInputElement.prototype.click = function () { window.picked = this.type }"
        )
        view.press("Choose files")
        view.wait(
            lambda: view.driver.execute_script("return window.picked") == "file", "the dialog"
        )
        view.type("drive file", "/a/folder/with/a/long/name/that/does/not/exist/joint.toml")
        view.press("Load")
        view.wait(lambda: "no such file" in view.text(".message"), "the message")
        for width in WIDTHS:
            look(view, "Refused", width)
        view.driver.get("about:blank")  # otherwise it reports that the server ends
    with serving(tmp_path, short / "joint.toml", short / "joint.csv") as address:
        view.driver.get(address)
        view.turn_to("Effects")
        view.press("Find what is missing")
        view.wait(lambda: view.text("#verdict"), "the verdict")
        view.idle()
        view.wait(lambda: view.all("#tick-thermal_gap:not([aria-disabled=true])"), "the list")
        view.all("#tick-thermal_gap")[0].click()
        view.wait(lambda: "thermal gap" in view.text(".rail"), "the fit")
        view.idle()
        view.turn_to("Confounded")
        view.press("Compare")
        view.wait(lambda: view.text("#rivals"), "the two effects")
        view.idle()
        view.turn_to("Design")
        view.type("spec, a file", "spec.toml")
        view.press("Start")
        view.wait(lambda: "finished" in view.text("#live"), "the end of the search")
        view.point(view.wait(lambda: view.all(DOTS), "the front")[0])
        view.wait(lambda: "Margins" in view.text("#design"), "the design behind a dot")
        view.driver.execute_script(axe)
        for width in WIDTHS:
            view.size(width)
            for tab in TABS:
                view.turn_to(tab)
                view.idle()
                look(view, tab, width)
                keeps_the_guidelines(view, f"{tab} at {width}", SCHEMES[width])
        view.type("drive file", str(reference))
        view.type("recordings, files or folders", "")
        view.press("Load")
        view.wait(lambda: "design" in view.text(".top .what").lower(), "the drawn drive")
        view.idle()
        for width in WIDTHS:
            view.size(width)
            view.turn_to("Drive")
            look(view, "Drawn", width)


# --- without a browser -------------------------------------------------------------------------


def test_only_this_machine_is_served(tmp_path: Path) -> None:
    with serving(tmp_path) as address:
        place = address.removeprefix("http://").partition("/")[0]
        port = int(place.partition(":")[2])
        own, top = opener(address), f"http://{place}/"
        assert answer(top, own) == 200
        assert answer(top, own, Host="evil.example") == 403
        assert answer(top, own, Origin="http://evil.example") == 403
        assert answer(top, own, Origin=f"http://{place}") == 200
        assert answer(f"{top}numbers/none.csv", own) == 404
        for other in {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None)}:
            if not other.startswith("127.") and ":" not in other:
                with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
                    socket.create_connection((other, port), timeout=2)
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["none.toml"], "none.toml: found no such file"),
        (["--port", "99999"], "--port: found '99999', expected an integer from 0 to 65535"),
        (["--json", "-"], "--json: found '-'"),
    ],
)
def test_bad_usage_is_one_line(tmp_path: Path, words: list[str], expected: str) -> None:
    done = command("workbench", *words, "--no-browser", folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"lostmotion: {expected}")
    assert done.stderr.count("\n") == 1


def test_a_taken_port_is_refused(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        done = command("workbench", "--no-browser", "--port", port, folder=tmp_path)
    assert (done.returncode, done.stderr) == (
        2,
        f"lostmotion: --port: found {port}, which is taken, expected a free port\n",
    )


def test_without_its_library_one_line_states_how_to_get_it(tmp_path: Path) -> None:
    code = "import sys; sys.modules['nicegui'] = None; from lostmotion.cli import main; "
    done = subprocess.run(
        [sys.executable, "-c", code + "sys.exit(main(['workbench']))"],
        capture_output=True, text=True, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (
        1,
        "lostmotion: the workbench needs NiceGUI: pip install nicegui\n",
    )


SHOWN = """
return arguments[0].closest('.q-field').textContent.replace('arrow_drop_down', '').trim();
"""
"""Text that a select shows."""

OWN_NAMES = {"time_s": "TIME", "torque_Nm": "Load cell", "lost_motion_rad": "POSITION", "run": "nr"}

MAPPED = (
    ("TIME", "time", "s"),
    ("Load cell", "torque", "Nm"),
    ("POSITION", "lost motion", "rad"),
    ("nr", "run", ""),
)
"""Columns of the recording with its own names, what they are, and their units."""


@needs_driver
def test_columns_with_other_names_are_mapped_in_the_table(
    view: View, tmp_path: Path, axe: str
) -> None:
    (tmp_path / "drive.toml").write_text(DRIVE)
    write(small_campaign(runs=8, rows=250), tmp_path / "data.csv")
    head, _, rest = (tmp_path / "data.csv").read_text().partition("\n")
    names = [OWN_NAMES.get(name, name) for name in head.split(",")]
    (tmp_path / "own.csv").write_text(",".join(names) + "\n" + rest)

    def choose(label: str, option: str) -> None:
        control = f"#panel-columns [aria-label='{label}']"

        def shown() -> bool:
            text = view.driver.execute_script(SHOWN, view.all(control)[0])
            return bool(text == option)

        def chosen() -> bool:
            # A list that opens while its row is redrawn is lost; a user opens it again.
            if shown():
                return True
            view.press_on(control)
            end, clicked = time.monotonic() + 5.0, False
            while time.monotonic() < end and not (clicked and shown()):
                for one in [] if clicked else view.all(".q-item"):
                    if one.text.strip() == option:
                        one.click()
                        clicked = True
                        break
                time.sleep(0.1)
            return shown()

        view.wait(chosen, f"{option} in {label}")

    def fits_and_keeps_the_guidelines() -> None:
        for width in WIDTHS:
            view.size(width)
            keeps_the_guidelines(view, str(width), SCHEMES[width])
            assert not view.driver.execute_script(CUT), width
        view.size(WIDTHS[0])

    with serving(tmp_path) as address:
        view.driver.get(address)
        view.type("drive file", "drive.toml")
        view.type("recordings, files or folders", "own.csv")
        view.press("Load")
        # Columns that cannot be read open the table.
        view.wait(lambda: "missing: torque_Nm" in view.text("#panel-columns"), "the columns")
        view.idle()
        view.driver.execute_script(axe)
        fits_and_keeps_the_guidelines()
        choose("Load cell is", "torque")
        view.wait(lambda: "no unit; expected a torque" in view.text("tr.fault"), "the reason")
        focused = "return document.activeElement.id"
        view.wait(lambda: view.driver.execute_script(focused) == "take-2", "the focus to return")
        for column, quantity, unit in MAPPED:
            choose(f"{column} is", quantity)
            if unit:
                view.wait(lambda c=column: view.all(f"[aria-label='unit of {c}']"), "the units")
                choose(f"unit of {column}", unit)
        view.wait(lambda: "7 of 7 columns are used" in view.text("#panel-columns"), "the columns")
        fits_and_keeps_the_guidelines()
        pasted = view.text(".paste")
        view.press("Load with these columns")
        rms = view.wait(view.rms, "the comparison")
    words = shlex.split(pasted)
    assert words[:3] == ["lostmotion", "check", "own.csv"]
    assert command(*words[1:], folder=tmp_path).returncode == 0
    done = command("compare", "drive.toml", *words[2:], "--json", "-", folder=tmp_path)
    assert json.loads(done.stdout)["rms_arcsec"] == pytest.approx(rms, abs=0.006)
