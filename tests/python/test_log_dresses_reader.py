"""One recording in formats of many programs is read as the clean copy, or refused in one line."""

from __future__ import annotations

import datetime
import gzip
import io
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, parse_map, read_campaign

NAMES = ("run", "time_s", "torque_Nm", "input_angle_rad", "output_angle_rad", "temperature_C")
START = datetime.datetime(2025, 4, 17, 23, 59, 55, tzinfo=datetime.timezone.utc)
EPOCH_MS = round(START.timestamp() * 1000)

Rows = list[list[str]]
Dress = Callable[[], "str | bytes"]


def rows() -> Rows:
    """Two loops of forty samples, with the digits that a logger writes."""
    made = []
    for i in range(80):
        torque = 40 * np.sin(2 * np.pi * (i % 40) / 40)
        angle = 0.007 + torque / 3e4 + 2e-5 * np.cos(i)
        cells = (f"{torque:.5f}", "0.700000", f"{angle:.8f}", f"{23 + i // 40}.5")
        made.append([str(1 + i // 40), f"{0.1 * i:.3f}", *cells])
    return made


def table(
    names: Sequence[str] = NAMES,
    separator: str = ",",
    end: str = "\n",
    body: Rows | None = None,
    comma: bool = False,
) -> str:
    """Write rows below their names."""
    body = rows() if body is None else body
    if comma:
        body = [[cell.replace(".", ",") for cell in row] for row in body]
    return end.join(separator.join(row) for row in [list(names), *body]) + end


def change(column: int, of: Callable[[int, str], str]) -> Rows:
    """Rows with another text in one column."""
    made = rows()
    for i, row in enumerate(made):
        row[column] = of(i, row[column])
    return made


def named(column: int, name: str, of: Callable[[int, str], str]) -> str:
    """Write rows with another name and other texts in one column."""
    names = [*NAMES[:column], name, *NAMES[column + 1 :]]
    return table(names, body=change(column, of))


def scaled(column: int, name: str, factor: float, digits: int = 12) -> str:
    """Write a column in another unit."""
    return named(column, name, lambda _, cell: f"{float(cell) * factor:.{digits}g}")


def stamps(form: Callable[[datetime.datetime], str], name: str = "timestamp") -> str:
    """Write the time as dates."""
    return named(1, name, lambda i, _: form(START + datetime.timedelta(milliseconds=100 * i)))


def two_clocks(sec: str, rest: str, ns: int) -> str:
    """Write the time as seconds and their fractions."""
    made = rows()
    for i, row in enumerate(made):
        total_ms = EPOCH_MS + 100 * i
        row[1:2] = [str(total_ms // 1000), str(total_ms % 1000 * 1_000_000 // ns)]
    return table([NAMES[0], sec, rest, *NAMES[2:]], body=made)


def inserted(line: int, *texts: str, end: str = "") -> str:
    """Write the clean copy with inserted lines."""
    lines = table().splitlines()
    lines[line:line] = texts
    return "\n".join(lines) + "\n" + end


def in_lines(change_line: Callable[[str], str]) -> str:
    """Write the clean copy, every line changed."""
    return "\n".join(map(change_line, table().splitlines())) + "\n"


def padded() -> str:
    """Write columns aligned by blanks."""
    return "\n".join("".join(f"{cell:>18}" for cell in row) for row in [list(NAMES), *rows()])


UNITLESS = ("run", "time", "torque", "input_angle", "output_angle", "temperature")
UNITS = ("-", "s", "N.m", "rad", "rad", "°C")
LABELLED = (
    "Run",
    "Time [s]",
    "Torque [N·m]",
    "Input angle (rad)",
    "OUTPUT-ANGLE/rad",
    "Temperature, °C",
)

SAME: dict[str, Dress] = {
    "semicolons": lambda: table(separator=";"),
    "semicolons and decimal commas": lambda: table(separator=";", comma=True),
    "tabs": lambda: table(separator="\t"),
    "tabs and decimal commas": lambda: table(separator="\t", comma=True),
    "bars": lambda: table(separator="|"),
    "blanks": lambda: table(separator=" "),
    "columns aligned by blanks": padded,
    "blanks behind commas": lambda: table(separator=", "),
    "carriage returns": lambda: table(end="\r\n"),
    "carriage returns alone": lambda: table(end="\r"),
    "two carriage returns": lambda: table(end="\r\r\n"),
    "no end of the last line": lambda: table().rstrip(),
    "a line sep=;": lambda: "sep=;\n" + table(separator=";", comma=True),
    "a comma in a name of semicolons": lambda: table(
        [*NAMES[:5], "temperature_C", "note, free"], ";", body=[[*r, "x"] for r in rows()]
    ),
    "quotes round all": lambda: in_lines(lambda s: ",".join(f'"{c}"' for c in s.split(","))),
    "quoted decimal commas between commas": lambda: table(
        body=[[f'"{cell.replace(".", ",")}"' for cell in row] for row in rows()]
    ),
    "a separator in a quoted name": lambda: table(
        [*NAMES, '"note, or none"'], body=[[*r, '"a, b"'] for r in rows()]
    ),
    "whole lines in quotes": lambda: in_lines(lambda s: f'"{s}"'),
    "UTF-8 with a mark": lambda: b"\xef\xbb\xbf" + table().encode(),
    "UTF-16 with a mark": lambda: table().encode("utf-16"),
    "UTF-16 little-endian": lambda: table().encode("utf-16-le"),
    "UTF-16 big-endian": lambda: table().encode("utf-16-be"),
    "UTF-32": lambda: table().encode("utf-32"),
    "Windows-1252": lambda: table([*NAMES[:5], "temperature (°C)"]).encode("cp1252"),
    "gzip with the file name of a text": lambda: gzip.compress(table().encode()),
    "gzip of two members": lambda: gzip.compress(table().encode()[:999])
    + gzip.compress(table().encode()[999:]),
    **{
        f"comments behind {sign}": lambda sign=sign: f"{sign} made by hand\n{sign} 2024\n{table()}"
        for sign in ("#", "%", "//", ";", "'", "!", '"')
    },
    "a header behind a comment sign": lambda: "# " + table(),
    "keys and values": lambda: f"Logger: XYZ 3000\nSerial: 12\nDate: 2024-01-02 10:11\n\n{table()}",
    "keys and values with separators": lambda: f"Logger,XYZ\nRate,100\nName,a,b,c,d,e\n\n{table()}",
    "LabVIEW": lambda: "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\n\n"
    + table(separator="\t"),
    "a long preamble": lambda: "".join(f"channel {i} of 300\n" for i in range(300)) + table(),
    "units in a row": lambda: table(UNITLESS, body=[list(UNITS), *rows()]),
    "units in brackets in a row": lambda: table(
        UNITLESS, body=[[f"[{u}]" for u in UNITS], *rows()]
    ),
    "units above the names": lambda: ",".join(UNITS) + "\n" + table(UNITLESS),
    "units in brackets and a blank line": lambda: table(
        UNITLESS, body=[[f"({u})" for u in UNITS], [""], *rows()]
    ),
    "names over groups": lambda: ",,load,motor,joint,joint\n" + table(),
    "names as plots have them": lambda: table(LABELLED, ";"),
    "the unit behind every number": lambda: named(2, "torque", lambda _, c: f"{c} Nm"),
    "names twice": lambda: table([*NAMES, "x", "x"], body=[[*r, "1", "2"] for r in rows()]),
    "no names": lambda: table([*NAMES, "", ""], body=[[*r, "", ""] for r in rows()]),
    "commas at the ends of rows": lambda: table(body=[[*r, ""] for r in rows()]),
    "commas at the ends of all lines": lambda: in_lines(lambda s: s + ",,"),
    "a number before every row": lambda: table(body=[[str(i), *r] for i, r in enumerate(rows())]),
    "blank lines": lambda: table(end="\n\n"),
    "rows of separators at the end": lambda: table() + ",,,,,\n,,,,,\n",
    "a message": lambda: inserted(50, "ESP_ERROR: brownout detected"),
    "a message of as many fields": lambda: inserted(50, "E,(1),wifi,lost,no,ip"),
    "the header again": lambda: inserted(60, ",".join(NAMES)),
    "a torn line at the end": lambda: table() + "2,39.9,-3.7",
    "NULs at the end": lambda: table().encode() + b"\0" * 300,
    "a torn line and NULs": lambda: table().encode() + b"2,39.9,-3" + b"\0" * 300,
    "an open quote": lambda: inserted(40, '"'),
    "dates with T and Z": lambda: stamps(lambda t: t.strftime("%Y-%m-%dT%H:%M:%S.%fZ")),
    "dates with a blank": lambda: stamps(lambda t: t.strftime("%Y-%m-%d %H:%M:%S.%f"), "Time"),
    "dates with an offset": lambda: stamps(
        lambda t: t.astimezone(datetime.timezone(datetime.timedelta(hours=2))).isoformat()
    ),
    "dates with the day first": lambda: stamps(lambda t: t.strftime("%d.%m.%Y %H:%M:%S.%f")),
    "dates of America": lambda: stamps(lambda t: t.strftime("%m/%d/%Y %I:%M:%S.%f %p")),
    "times of day over midnight": lambda: stamps(lambda t: t.strftime("%H:%M:%S.%f"), "time"),
    "epoch in s": lambda: named(1, "timestamp", lambda i, _: f"{(EPOCH_MS + 100 * i) / 1000:.1f}"),
    "epoch in ms": lambda: named(1, "timestamp", lambda i, _: str(EPOCH_MS + 100 * i)),
    "epoch in ns, no unit": lambda: named(
        1, "stamp", lambda i, _: f"{EPOCH_MS + 100 * i}000000"
    ),
    "epoch in ns": lambda: named(1, "stamp_ns", lambda i, _: f"{EPOCH_MS + 100 * i}000000"),
    "ROS stamps": lambda: two_clocks("header.stamp.sec", "header.stamp.nanosec", 1),
    "C stamps": lambda: two_clocks("tv_sec", "tv_usec", 1000),
    "sec and nsec": lambda: two_clocks("sec", "nsec", 1),
    "torque in in-lb": lambda: scaled(2, "Torque [in-lb]", 1 / 0.1129848290276167),
    "torque in oz-in": lambda: scaled(2, "torque_oz-in", 1 / 0.007061551814226044),
    "angle in degrees": lambda: scaled(3, "Input angle (degrees)", 180 / np.pi),
    "angle in mdeg": lambda: scaled(4, "output_angle_mdeg", 180e3 / np.pi),
    "temperature in Kelvin": lambda: named(
        5, "Temperature [Kelvin]", lambda _, c: f"{float(c) + 273.15:.2f}"
    ),
    "torque in capitals": lambda: table([*NAMES[:2], "TORQUE_NM", *NAMES[3:]]),
    "a serial monitor": lambda: in_lines(lambda s: f"12:34:56.789 -> {s}"),
}  # fmt: skip

TORN = {"2,39.9,-3.7"}


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """Read the clean copy."""
    file = tmp_path_factory.mktemp("clean") / "log.csv"
    file.write_text(table())
    return read_campaign(file, ratio=100)


def read(tmp_path: Path, text: str | bytes, *maps: str) -> Campaign:
    """Read a text."""
    file = tmp_path / "log.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_campaign(file, ratio=100, mapping=parse_map(maps))


@pytest.mark.parametrize("dress", SAME)
def test_a_dress_is_read_as_the_clean_copy(tmp_path: Path, clean: Campaign, dress: str) -> None:
    campaign = read(tmp_path, SAME[dress]())
    assert [run.label for run in campaign.runs] == [1, 2]
    for quantity in clean.quantities():
        found, wanted = campaign.column(quantity), clean.column(quantity)
        if quantity == "time":
            found, wanted = found - found[0], wanted - wanted[0]
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9, err_msg=quantity)


@pytest.mark.parametrize(
    ("dress", "says"),
    [
        ("a message", "line 51 ('ESP_ERROR: brownout detected') does not fit the header"),
        ("a message of as many fields", "no numbers in line 51"),
        ("the header again", "no numbers in line 61"),
        ("a torn line at the end", "line 82 ('2,39.9,-3.7')"),
        ("NULs at the end", "line 82 ('NUL bytes')"),
        ("an open quote", "line 41"),
        ("epoch in ms", "interpreted as ms since 1970: it begins at 2025-04-17T23:59:55 UTC"),
        ("times of day over midnight", "passes midnight"),
    ],
)
def test_what_is_set_aside_is_named_by_its_line(tmp_path: Path, dress: str, says: str) -> None:
    findings = read(tmp_path, SAME[dress]()).findings
    assert any(says in str(finding) and finding.count for finding in findings), findings


def thousands(values: Sequence[int], mark: str, name: str = "x") -> str:
    """Write torques in mN m with separators of thousands."""
    lines = [f"{i}\t{v:,}\t{v * 1e-6:.6f}".replace(",", mark) for i, v in enumerate(values)]
    return f"time_s\ttorque_mNm\tlost_motion_{name}\n" + "\n".join(lines) + "\n"


LOOP = [round(4000 * np.sin(0.1 * i)) for i in range(100)]


@pytest.mark.parametrize("mark", [",", "'", " ", "\u00a0", "\u202f"])
def test_separators_of_thousands_are_found_by_the_rest_of_the_file(
    tmp_path: Path, mark: str
) -> None:
    campaign = read(tmp_path, thousands(LOOP, mark, "rad"))
    np.testing.assert_allclose(campaign.column("torque"), np.array(LOOP) / 1000)


def test_points_that_separate_thousands_are_found_by_decimal_commas(tmp_path: Path) -> None:
    text = thousands(LOOP, ",", "rad").replace(".", ";").replace(",", ".").replace(";", ",")
    campaign = read(tmp_path, text)
    np.testing.assert_allclose(campaign.column("torque"), np.array(LOOP) / 1000)
    np.testing.assert_allclose(campaign.column("lost_motion"), np.array(LOOP) * 1e-6)


@pytest.mark.parametrize(
    ("rows_", "found"),
    [
        ([f"{i};{1000 + 7 * i:,};{i % 9}" for i in range(30)], "which is 1.000 or 1000"),
        ([f"{i};{1 + i % 5},{100 + i};{i % 9}" for i in range(30)], "which is 1.100 or 1100"),
    ],
)
def test_an_ambiguous_separator_is_refused_with_both_readings(
    tmp_path: Path, rows_: list[str], found: str
) -> None:
    with pytest.raises(InputError, match=rf"torque_mNm: found '.*' in line 2, {found}, expected"):
        read(tmp_path, "time_s;torque_mNm;lost_motion_rad\n" + "\n".join(rows_) + "\n")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("# a\n# b\n\nT;M\n0;1\n1;2\n", r"no such column \(there are T, M; header: line 4\)"),
        ("0,1,2\n1,2,3\n2,3,4\n", "columns are numbered.*--map COLUMN=time_s"),
        ("PAR1" + "x" * 99, "a Parquet file with the file name of a text"),
        ("PK\x03\x04" + "x" * 99, "a ZIP archive or a spreadsheet"),
        (table([*NAMES[:2], "torque_Nm", "torque_Nm", *NAMES[4:]]), "the column twice"),
        (table(["run", "time_s", "torque_Nm"]), "6 fields in line 2, expected 3, as in the header"),
        (named(1, "time", lambda i, _: str(EPOCH_MS // 1000 + 86400 * i)), "steps of 8.64e"),
        (named(1, "timestamp", lambda i, c: c), "no such column"),
        (table(UNITLESS[:1] + NAMES[1:], body=[["-", "s", "mNm", "rad", "rad", "C"], *rows()]),
         "Nm in the name and mNm beside it"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused_in_one_line(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("prefix", ["k", "m", "M", "n", "G"])
@pytest.mark.parametrize("maps", [(), ("trq=torque_Nm",)])
def test_a_prefix_without_a_unit_is_not_left_out(
    tmp_path: Path, prefix: str, maps: tuple[str, ...]
) -> None:
    """As instruments with SPICE numbers write them: 39.9k is no torque of 39.9 N m."""
    names = [*NAMES[:2], "trq" if maps else "torque_Nm", *NAMES[3:]]
    text = table(names, body=change(2, lambda i, cell: f"{cell}{prefix}"))
    with pytest.raises(InputError, match=f"Nm in the name and {prefix} beside it, expected a torq"):
        read(tmp_path, text, *maps)
    if maps:  # a divisor states what the numbers are
        assert read(tmp_path, text, "trq=torque_Nm/1000").rows == 80


@pytest.mark.parametrize(
    "word", ["", "NaN", "#N/A", "NULL", "ovf", "OL", "--", "inf", "-1.#IND", "1.#QNAN", "OVERLOAD"]
)
def test_words_for_no_number_are_missing(tmp_path: Path, word: str) -> None:
    campaign = read(tmp_path, table(body=change(2, lambda i, c: word if i == 45 else c)))
    assert campaign.rows == 79
    (finding,) = (f for f in campaign.findings if f.kind == "nan")
    assert (finding.column, finding.run, finding.count) == ("torque_Nm", 2, 1)


def test_a_map_names_stamps_of_any_kind(tmp_path: Path, clean: Campaign) -> None:
    wanted = clean.column("time") - clean.column("time")[0]
    dates = stamps(lambda t: t.isoformat(), "when")
    for target in ("time_s", "time", "time_iso"):
        found = read(tmp_path, dates, f"when={target}").column("time")
        np.testing.assert_allclose(found - found[0], wanted, atol=1e-9)
    text = two_clocks("a", "b", 1)
    found = read(tmp_path, text, "a=time_s", "b=time_ns").column("time")
    np.testing.assert_allclose(found - found[0], wanted, atol=1e-9)


def test_runs_that_blank_lines_part_are_runs_where_the_clock_starts_again(tmp_path: Path) -> None:
    body = [[f"{0.1 * (i % 40):.1f}", *row[2:]] for i, row in enumerate(rows())]
    text = table(NAMES[1:], body=[*body[:40], [""], *body[40:]])
    campaign = read(tmp_path, text)
    assert [(run.label, len(run)) for run in campaign.runs] == [(1, 40), (2, 40)]
    assert any(finding.kind == "runs" for finding in campaign.findings)
    (run,) = read(tmp_path, table(NAMES[1:], body=[r[1:] for r in rows()], end="\n\n")).runs
    assert (run.label, len(run)) == ("log", 80)


def test_a_nanosecond_of_an_epoch_is_not_lost(tmp_path: Path) -> None:
    ticks = 1_744_700_000_000_000_000 + np.cumsum(np.arange(80) % 7 + 1_000_000)
    text = named(1, "stamp_ns", lambda i, _: str(ticks[i]))
    found = read(tmp_path, text).column("time")
    np.testing.assert_array_equal(found, (ticks - ticks[0]) / 1e9)


def test_a_gzip_beyond_the_bound_is_refused_before_it_is_inflated(tmp_path: Path) -> None:
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb") as stream:
        stream.write((",".join(NAMES) + "\n").encode())
        for _ in range(40):
            stream.write(b"1,0,0,0,0,0\n" * 90_000)
    with pytest.raises(InputError, match="a gzip that contains more than 32 MiB"):
        read(tmp_path, packed.getvalue())


def test_a_minus_sign_behind_digits_is_a_sign_only_where_no_other_is_in_front(
    tmp_path: Path,
) -> None:
    """Among signs in front of the digits it is a torn number, and counts as missing."""
    behind = change(2, lambda _, cell: f"{cell[1:]}-" if cell.startswith("-") else cell)
    (tmp_path / "behind.csv").write_text(table(body=behind))
    campaign = read_campaign([tmp_path / "behind.csv"], ratio=100)
    assert min(campaign.runs[0].columns["torque"]) < -39
    torn = change(2, lambda i, cell: cell[:5] + "-" if i == 5 else cell)
    (tmp_path / "torn.csv").write_text(table(body=torn))
    campaign = read_campaign([tmp_path / "torn.csv"], ratio=100)
    assert [f.kind for f in campaign.findings if f.column == "torque_Nm"][:1] == ["text"]


def test_columns_of_one_name_are_read_once_where_they_are_the_same(tmp_path: Path) -> None:
    """A scope writes the clock beside every channel."""
    names = [*NAMES, "time_s"]
    twice = [[*row, row[1]] for row in rows()]
    (tmp_path / "twice.csv").write_text(table(names, body=twice))
    assert read_campaign([tmp_path / "twice.csv"], ratio=100).rows == 80
    for row in (7, 60):  # of the first cells, or of all
        apart = [list(cells) for cells in twice]
        apart[row][-1] = "0.75"
        (tmp_path / "apart.csv").write_text(table(names, body=apart))
        with pytest.raises(
            InputError, match="two clocks with different times, expected one clock; or a file"
        ):
            read_campaign([tmp_path / "apart.csv"], ratio=100)


def test_milliseconds_beside_a_stamp_belong_to_it(tmp_path: Path) -> None:
    stamps = [START + datetime.timedelta(milliseconds=100 * i) for i in range(80)]
    body = [
        [row[0], f"{at:%Y/%m/%d %H:%M:%S}", f"{at.microsecond // 1000}", *row[2:]]
        for row, at in zip(rows(), stamps, strict=True)
    ]
    (tmp_path / "log.csv").write_text(table(["run", "Date&Time", "ms", *NAMES[2:]], body=body))
    campaign = read_campaign([tmp_path / "log.csv"], ratio=100)
    np.testing.assert_allclose(np.diff(campaign.runs[0].time_s), 0.1, atol=1e-9)
