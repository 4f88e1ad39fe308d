"""The documentation builds without a warning, and every block has the stated output."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import blocks

NEEDED = ("sphinx", "myst_parser", "furo", "latex2mathml")


@pytest.mark.parametrize("page", blocks.pages(), ids=lambda page: page.stem)
def test_the_blocks_of_a_page_run_and_print_what_it_states(tmp_path: Path, page: Path) -> None:
    runner = blocks.Runner(tmp_path)
    for block in blocks.read_blocks(page):
        try:
            printed = runner.run(block)
        except Exception as error:
            raise AssertionError(f"{block.name}: {error}") from error
        wanted = block.expected.code if block.expected is not None else ""
        if block.expected is not None or block.language == "python":
            assert not (found := blocks.differs(printed, wanted)), f"{block.name}: {found}"


def test_the_documentation_builds_without_a_warning(tmp_path: Path) -> None:
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}; pip install {' '.join(missing)}")
    done = subprocess.run(
        [
            *(sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"),
            *("-d", str(tmp_path / "trees"), str(blocks.DOCS), str(tmp_path / "html")),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    index = (tmp_path / "html" / "index.html").read_text()
    assert "lostmotion" in index
    theory = (tmp_path / "html" / "theory" / "index.html").read_text()
    assert "<math" in theory
    for page in (tmp_path / "html").rglob("*.html"):
        outside = re.findall(
            r'(?:src|href)="(https?://[^"]+\.(?:js|css|woff2?))"', page.read_text()
        )
        assert not outside, f"{page.name} needs the network: {outside}"


def test_the_runner_finds_what_is_wrong(tmp_path: Path) -> None:
    assert not blocks.differs("a 1.23\nb\nc\n", "a 1.24\n...\nc\n")
    assert "expected" in blocks.differs("a 1.23\n", "a 1.25\n")
    assert "expected" in blocks.differs("a 7\n", "a 8\n")
    assert not blocks.differs("0xe2e17731 1.50.\n", "0xe2e17731 1.51.\n")
    assert "expected" in blocks.differs("0xe2e17731\n", "0xe2e17732\n")
    assert "more than expected" in blocks.differs("a\nb\n", "a\n")
    page = tmp_path / "page.md"
    page.write_text(
        "```python\nprint(1)\n```\n\n```text\n1\n```\n"
        "```{code-block} toml\n:caption: a.toml\n\nb = 1\n```\n```sh\ncat a.toml\n```\n"
        "```c\nint main(void) { return 3; }\n```\n"
    )
    found = blocks.read_blocks(page)
    assert [block.language for block in found] == ["python", "toml", "sh", "c"]
    assert found[0].expected is not None
    runner = blocks.Runner(tmp_path)
    assert [runner.run(block) for block in found[:3]] == ["1\n", "", "b = 1\n"]
    with pytest.raises(AssertionError, match="ended with 3"):
        runner.run(found[3])


def test_every_status_bit_is_in_the_table_for_the_host() -> None:
    header = (blocks.DOCS.parents[2] / "lib" / "include" / "lostmotion" / "state.h").read_text()
    bits = re.findall(r"^#define (LM_STATE_\w+) ", header, re.M)
    assert len(bits) >= 20
    page = (blocks.DOCS / "integration.md").read_text()
    rows = re.findall(r"^\| `(LM_STATE_\w+)` \| (yes)? ?\|", page, re.M)
    assert [name for name, _ in rows] == bits
    lasting = re.findall(r"^#define (LM_STATE_\w+)(?:[^#]*?)/\* lasts:", header, re.M)
    assert [name for name, lasts in rows if lasts] == lasting


def test_the_page_for_the_host_names_every_call_of_the_axis_and_nothing_else() -> None:
    folder = blocks.ROOT / "firmware_examples" / "axis"
    header = (folder / "lm_axis.h").read_text() + (folder / "lm_drive.h").read_text()
    inner = set(re.findall(r"\b(lm_axis_\w+)\(", (folder / "lm_drive.c").read_text()))
    assert {"lm_axis_open", "lm_axis_close"} <= inner
    calls = set(re.findall(r"\b(lm_(?:axis|drive)_\w+)\(", header)) - inner
    page = (blocks.DOCS / "integration.md").read_text()
    named = set(re.findall(r"\blm_(?:axis|drive)_\w+", page))
    rare = {"lm_axis_reported", "lm_axis_guide", "lm_drive_part"}  # the last two: lm_commission
    assert calls - rare <= named
    assert not (inner - {"lm_axis_feed"}) & named
    assert all(name in header for name in named)
    parts = re.split(r"^## (?=[ABC]\. )", page, flags=re.M)
    kinds = [part.partition("\n## ")[0] for part in parts[1:]]
    words = [len(part.split()) for part in (page, *kinds)]
    assert len(kinds) == 3
    assert words[0] < 3000, "too long to be read before the first start"
    assert words[0] - sum(words[1:]) + max(words[1:]) < 2250, "what one reader reads"


KINDS = {"own_loop": "power_up", "own_brake": "power_up", "cia402_host": ""}


def compile_axis(tmp_path: Path, kind: str) -> None:
    """Write the code of the page, unless it is there, and compile it with ``axis_page.c``."""
    for block in blocks.read_blocks(blocks.DOCS / "integration.md"):
        if block.caption and not (tmp_path / block.caption).exists():
            (tmp_path / block.caption).write_text(block.code)
    examples = blocks.ROOT / "firmware_examples"
    folders = ("axis", "commissioning", "glue", "joint")
    page = [f"{name}.c" for name in (kind, KINDS[kind], "requests") if name]
    copied = ["axis/lm_axis", "axis/lm_drive", "glue/cia402", "joint/sine"]
    copied += ["commissioning/lm_commission", "commissioning/commissioning"]
    words = [Path(__file__).parent / "axis_page.c", *page, *(examples / f"{x}.c" for x in copied)]
    words += [f"-I{examples / folder}" for folder in folders]
    words += [f"-DKIND={list(KINDS).index(kind)}", "-DLM_REAL_BITS=32", blocks.library(32)]
    blocks.compile_c([*words, "-o", "axis"], tmp_path)


@pytest.mark.parametrize("kind", KINDS)
def test_the_code_of_the_page_for_the_host_runs_an_axis(tmp_path: Path, kind: str) -> None:
    compile_axis(tmp_path, kind)
    blocks.run([tmp_path / "axis"], tmp_path)


def test_a_loop_whose_setpoint_is_not_at_the_motor_is_not_enabled(tmp_path: Path) -> None:
    page = {x.caption: x.code for x in blocks.read_blocks(blocks.DOCS / "integration.md")}
    right = "lm_axis_tick(a, &at, motor_rad()"
    assert right in page["own_loop.c"]
    wrong = page["own_loop.c"].replace(right, right.replace("motor_rad", "-motor_rad"))
    (tmp_path / "own_loop.c").write_text(wrong)
    compile_axis(tmp_path, "own_loop")
    blocks.run([tmp_path / "axis", "wrong"], tmp_path)


AROUND = {
    "lm_axis_turn": """#include "host.h"
#define TURN_RAD 6.28318531f
#define COUNTS_PER_TURN (-1638400)
extern int origin_counts;
extern void begin_tick(void);
void begin_tick(void) {
""",
    "tick_all": '#include "host.h"\nextern void tick_all(void);\n',
}
"""What the reader writes around the code of the reference page."""


def test_the_code_of_the_reference_page_compiles(tmp_path: Path) -> None:
    page = blocks.read_blocks(blocks.DOCS / "integration_reference.md")
    code = [block.code for block in page if block.language == "text"]
    compile_axis(tmp_path, "own_loop")
    includes = [f"-I{blocks.ROOT / 'firmware_examples' / x}" for x in ("axis", "commissioning")]
    for name, before in AROUND.items():
        (found,) = (x for x in code if name in x)
        (tmp_path / f"{name}.c").write_text(before + found + "}\n" * ("{\n" in before))
        blocks.compile_c([f"{name}.c", "-DLM_REAL_BITS=32", *includes, "-c"], tmp_path)
    # Each line replaces the one of A that begins as it does.
    (changes,) = (x for x in code if "output_loop = 1" in x)
    loop = (tmp_path / "own_loop.c").read_text()
    for line in filter(None, changes.splitlines()):
        begin = re.escape(re.split("[(={]", line)[0])
        loop, count = re.subn(rf"^( *){begin}[^;]*;.*$", rf"\g<1>{line}", loop, flags=re.M)
        assert count == 1, line
    loop = loop.replace("#include", "extern float output_rad(void);\n#include", 1)
    (tmp_path / "output.c").write_text(loop)
    unused = "-Wno-unused-const-variable"  # the motor of A
    blocks.compile_c(["output.c", "-DLM_REAL_BITS=32", unused, *includes, "-c"], tmp_path)


def test_the_decision_for_floating_point_is_on_the_page_of_costs() -> None:
    text = (blocks.DOCS / "integration_reference.md").read_text()
    page = re.sub(r"\s+", " ", text).replace(",", "")
    rows = [row.split("|")[1:-1] for row in (blocks.DOCS / "cost.md").read_text().splitlines()]
    cells = {(row[0].strip(), row[1].strip()): row for row in rows if len(row) == 17}
    standard = cells["Cortex-M0+", "standard"]
    gap = cells["Cortex-M0+", "gap only"]
    step = re.search(r"standard profile takes less than (\d+) instructions", page)
    soft = re.search(r"soft float adds less than (\d+) KB", page)
    least = re.search(r"gap profile \(less than (\d+) instructions", page)
    assert step is not None
    assert soft is not None
    assert least is not None
    assert int(standard[12].split()[-1]) < int(step[1])
    assert int(standard[4]) - int(standard[3]) < 1024 * int(soft[1])
    assert int(gap[12].split()[-1]) < int(least[1])
