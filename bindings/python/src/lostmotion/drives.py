"""Drive files (TOML). The reader is strict: anything ambiguous is an error.

A file has ``[drive]`` and exactly one of ``[catalogue]`` (a drive from a data sheet) and
``[design]`` (a drive from a drawing). It may also have ``[columns]`` (a column map for recordings),
``[recordings]`` (locked side and torque constant of the motor), ``[fit]`` and ``[[effect]]``
(results of a fit). Keys have their unit as a suffix; any unit of the right dimension is accepted.
"""

from __future__ import annotations

import itertools
import logging
import math
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lostmotion import flank_points, structs, units
from lostmotion.catalogue import WIND_UP_MAX_RAD, Catalogue
from lostmotion.combined_tolerances import COMBINED, spelled_out
from lostmotion.core import core, library_effects, value_ranges
from lostmotion.errors import InputError, did_you_mean
from lostmotion.files import TEXT_BYTES_MAX, read_bytes, write_whole
from lostmotion.friction import FORMS
from lostmotion.keys import Key, TableEntry, as_in_file, key_label, read_keys
from lostmotion.recordings.protocol import FREE, SIDES, Protocol
from lostmotion.structs import Design, Entry

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

LOG = logging.getLogger(__name__)

LEAST_TORQUE_NM, MOST_TORQUE_NM = 1e-6, float(core().lib.LM_TORQUE_LIMIT_MAX_NM)
"""Limits of drive torques: upper bound of the library, and a millionth of the torque of the
smallest gear.
"""

MOST_RATED_NM = MOST_TORQUE_NM / 2
"""The controller's torsion curve extends to twice the rated torque."""

DRIVE_KEYS = (
    Key("name", kind="text"),
    Key("ratio", required=True, low=-1000, high=1000),
    Key("rated_torque", "Nm", required=True, low=LEAST_TORQUE_NM, high=MOST_RATED_NM),
)

CATALOGUE_KEYS = (
    Key("T1", "Nm", required=True, low=LEAST_TORQUE_NM, high=MOST_TORQUE_NM),
    Key("T2", "Nm", required=True, low=LEAST_TORQUE_NM, high=MOST_TORQUE_NM),
    Key("K1", "Nm_per_rad", required=True, low=1e-3, high=1e12),
    Key("K2", "Nm_per_rad", required=True, low=1e-3, high=1e12),
    Key("K3", "Nm_per_rad", required=True, low=1e-3, high=1e12),
    Key("hysteresis", "rad", low=0, high=0.1),
    Key("lost_motion", "rad", low=0, high=0.1),
)

CHAINS: dict[str, dict[str, tuple[Key, ...]]] = {
    "radial_chain": structs.RADIAL_KINDS,
    "torsion_chain": structs.TORSION_KINDS,
    "tolerance": structs.TOLERANCE_KINDS,
}
"""Arrays of tables under [design] and the kinds of their entries."""

SECTIONS = (
    "drive",
    "catalogue",
    "design",
    "columns",
    "recordings",
    "characterization",
    "fit",
    "effect",
)


@dataclass(frozen=True)
class FreePlay:
    """A side clearance, an effect of a drive file that every torsion curve of a fit contains.

    A fit has only the sum of both, because recordings do not separate them. A controller has both
    as they are in the file.

    Attributes
    ----------
    step_rad : float
        Angle from the middle to one end.
    within_Nm : float
        Torque that closes it.
    """

    step_rad: float
    within_Nm: float

    def table(self) -> dict[str, Any]:
        """``[[effect]]`` table of a drive file."""
        return {"name": FREE_PLAY, "gap_rad": self.step_rad, "takeup_Nm": self.within_Nm}


FREE_PLAY = "free_play"
"""Name of the effect."""


@dataclass(frozen=True)
class Drive:
    """A drive as its file describes it.

    Attributes
    ----------
    catalogue, design
        Exactly one of them is present.
    columns : dict
        Column map for recordings of this drive.
    protocol : Protocol
        Which side was locked in them.
    fit, effects
        Results of a fit, as in the file.
    document : dict
        The file itself; `write_drive` writes it back.
    """

    file: str
    name: str
    ratio: float
    rated_torque_Nm: float
    catalogue: Catalogue | None = None
    design: Design | None = None
    columns: dict[str, str] = field(default_factory=dict)
    protocol: Protocol = FREE
    fit: dict[str, Any] | None = None
    effects: list[dict[str, Any]] = field(default_factory=list)
    document: dict[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Summarise the drive."""
        kind = "catalogue" if self.catalogue is not None else "design"
        names = ", ".join(str(table.get("name")) for table in self.effects)
        return (
            f"<Drive {self.name!r} of {self.file}: {kind}, ratio {self.ratio:g}, "
            f"{self.rated_torque_Nm:g} Nm{', fitted' if self.fit else ''}"
            f"{', with ' + names if names else ''}>"
        )

    @property
    def free_play(self) -> FreePlay | None:
        """Free play among the effects, if any."""
        c = core()
        for index, table in enumerate(self.effects):
            if table["name"] == FREE_PLAY:
                ranges = value_ranges(c, library_effects(c)[FREE_PLAY])
                return FreePlay(*effect_values(self.file, f"effect[{index}]", table, ranges))
        return None


def read_drive(file: str | Path) -> Drive:
    """Read a drive file.

    Raises
    ------
    InputError
        Unknown keys, wrong units, wrong types and impossible values: file, key, found, expected.
    """
    drive = parse_drive(read_toml(file, "a drive file"), str(file))
    LOG.info("read %s: %s, %s", file, drive.name, "bought" if drive.catalogue else "a design")
    return drive


def read_toml(file: str | Path, expected: str) -> dict[str, Any]:
    """Read a TOML file, with or without byte order mark and with any line ends.

    Raises
    ------
    InputError
        When it cannot be read or is no TOML; `expected` states what kind of file it should be.
    """
    raw = read_bytes(file, expected, TEXT_BYTES_MAX)
    try:
        return tomllib.loads(raw.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise InputError(file, "", "bytes that are not UTF-8", f"TOML ({expected})") from None
    except RecursionError:
        raise InputError(file, "", "tables nested too deeply", f"TOML ({expected})") from None
    except ValueError as error:  # not TOML, or a number with thousands of digits
        raise InputError(file, "", str(error), f"TOML ({expected})") from None


def parse_drive(document: dict[str, Any], file: str = "drive") -> Drive:
    """Parse the tables of a drive file; `file` is for messages."""
    for section in document:
        if section not in SECTIONS:
            raise InputError(
                file,
                section,
                "an unknown table" if isinstance(document[section], (dict, list)) else "a key",
                "one of the tables " + ", ".join(SECTIONS) + did_you_mean(section, SECTIONS),
            )
    if "characterization" in document:
        _characterization(file, document["characterization"])
    if "drive" not in document:
        raise InputError(file, "drive", "no such table", "[drive] with ratio and rated torque")
    head = read_keys(file, "drive", document["drive"], DRIVE_KEYS)
    ratio = head["ratio"].value
    if abs(ratio) <= 1:
        raise InputError(file, "drive.ratio", as_in_file(ratio), "more than 1 or less than -1")
    rated = head["rated_torque"].value
    if ("catalogue" in document) == ("design" in document):
        found = "both" if "design" in document else "neither"
        raise InputError(
            file, "catalogue, design", found, "exactly one of [catalogue] and [design]"
        )
    catalogue = design = None
    if "catalogue" in document:
        catalogue = _catalogue(file, document["catalogue"], rated)
    else:
        design = _design(file, document["design"], ratio, rated)
        structs.make_drive(design)
    name = head["name"].value if "name" in head else Path(file).stem
    return Drive(
        file,
        name,
        ratio,
        rated,
        catalogue,
        design,
        _columns(file, document.get("columns", {})),
        _protocol(file, document.get("recordings", {})),
        _fit(file, document["fit"]) if "fit" in document else None,
        _effects(file, document.get("effect", []), _fitted_effects(document.get("fit"))),
        document,
    )


def _catalogue(file: str, table: Any, rated_Nm: float) -> Catalogue:
    values = read_keys(file, "catalogue", table, CATALOGUE_KEYS)
    number = {name: value.value for name, value in values.items()}
    if number["T2"] <= number["T1"]:
        raise InputError(
            file,
            values["T2"].place,
            f"{number['T2']:.6g} Nm",
            f"more than T1, {number['T1']:.6g} Nm",
        )
    stated: list[Any] = [number.get(key.name) for key in CATALOGUE_KEYS]
    sheet = Catalogue(*stated)
    turned = float(sheet.angle(rated_Nm))
    if turned > WIND_UP_MAX_RAD:
        softest = min(("K1", "K2", "K3"), key=number.__getitem__)
        raise InputError(
            file,
            values[softest].place,
            f"{number[softest]:.6g} Nm/rad, and a drive that winds up by {turned:.3g} rad at "
            f"its rated torque of {rated_Nm:.6g} Nm",
            f"less than {WIND_UP_MAX_RAD:g} rad; data sheets often state a power of ten in the "
            "table head: 0.81 under '10^4 Nm/rad' is 8100",
        )
    return sheet


def _design(file: str, table: Any, ratio: float, rated: float) -> Design:
    sections = [name for name in structs.FIELDS if name]
    tolerances: dict[str, TableEntry] = {}
    top = read_keys(file, "design", table, structs.FIELDS[""], tables=(*sections, *CHAINS))
    values = {
        structs.field_path("", key): top[key.name] for key in structs.FIELDS[""] if key.name in top
    }
    for section in sections:
        if section not in table and section not in ("teeth", "generator"):
            continue
        if section not in table:
            raise InputError(file, f"design.{section}", "no such table", f"[design.{section}]")
        keys = structs.FIELDS[section]
        more = flank_points.KEYS if section == "flank" else ()
        extra = flank_points.TOLERANCES if section == "flank" else ()
        read = read_keys(file, f"design.{section}", table[section], [*keys, *extra], tables=more)
        tolerances |= {key.name: read[key.name] for key in extra if key.name in read}
        values |= {
            structs.field_path(section, key): read[key.name] for key in keys if key.name in read
        }
    chains = {name: _chain(file, name, table) for name in CHAINS}
    flanks = [
        flank_points.read_points(file, table.get("flank", {}), gear, tolerances)
        for gear in flank_points.PREFIXES
    ]
    own, rigid = (None if flank is None else flank.points for flank in flanks)
    design = Design(
        file,
        ratio,
        rated,
        values,
        chains["radial_chain"],
        chains["torsion_chain"],
        chains["tolerance"],
        own,
        rigid,
        tuple(itertools.chain.from_iterable(flank.remarks for flank in flanks if flank)),
    )
    for gear, points in (("flexspline", design.points), ("rigid", design.rigid_points)):
        kind = values.get(f"teeth.{gear}_flank")
        if (kind is not None and kind.value == "points") != (points is not None):
            key = f"{flank_points.PREFIXES[gear]}points"
            raise InputError(
                file,
                flank_points.place_of(gear),
                "no points" if points is None else "points",
                f"{key}, or {key}_file, and teeth.{gear}_flank = 'points'",
            )
    generator = values["generator.type"]
    angle = "generator.contact_half_angle_rad"
    if generator.value in ("discs", "rollers", "ring") and angle not in values:
        raise InputError(
            file,
            "design.generator.contact_half_angle_deg",
            "nothing",
            f"this key, an angle, for a wave generator of type '{generator.value}'",
        )
    return design


def tolerance_chain(file: str, design: Mapping[str, Any]) -> list[Entry]:
    """Entries of [[design.tolerance]] of a [design], one per link."""
    return _chain(file, "tolerance", design) or []


def _chain(file: str, name: str, table: Mapping[str, Any]) -> list[Entry] | None:
    if name not in table:
        return None
    place = f"design.{name}"
    if not isinstance(table[name], list):
        raise InputError(file, place, as_in_file(table[name]), f"tables [[{place}]]")
    kinds = CHAINS[name]
    entries = []
    for index, entry in enumerate(table[name]):
        if not isinstance(entry, Mapping):
            raise InputError(file, f"{place}[{index}]", as_in_file(entry), f"a table [[{place}]]")
    teeth = table.get("teeth", {})
    for at, entry in spelled_out(file, place, table[name], teeth):
        known = (*kinds, *COMBINED) if name == "tolerance" else tuple(kinds)
        if "kind" not in entry:
            raise InputError(file, f"{at}.kind", "nothing", "one of " + ", ".join(known))
        kind = entry["kind"]
        if not isinstance(kind, str) or kind not in kinds:
            hint = did_you_mean(kind, known) if isinstance(kind, str) else ""
            raise InputError(
                file, f"{at}.kind", as_in_file(kind), "one of " + ", ".join(known) + hint
            )
        head = (Key("kind", kind="text"), Key("name", kind="text"))
        entries.append(Entry(kind, at, read_keys(file, at, entry, (*head, *kinds[kind]))))
    return entries


def _columns(file: str, table: Any) -> dict[str, str]:
    if not isinstance(table, Mapping):
        raise InputError(file, "columns", as_in_file(table), "a table")
    for column, target in table.items():
        if not isinstance(target, str):
            raise InputError(
                file, f"columns.{column}", as_in_file(target), "a name with unit, as text"
            )
    return dict(table)


RECORDING_KEYS = (
    Key("locked", kind="choice", choices=SIDES),
    Key("torque_constant", "Nm_per_A", low=1e-6, high=1e3),
)
"""Keys of [recordings]."""


def _protocol(file: str, table: Any) -> Protocol:
    values = read_keys(file, "recordings", table, RECORDING_KEYS)
    number = {name: value.value for name, value in values.items()}
    return Protocol(number.get("locked"), number.get("torque_constant"))


CHARACTERIZATION_KEYS = (
    Key("data_fingerprint", kind="text"),
    Key("loops", kind="integer", low=0),
    Key("samples", kind="integer", low=1),
)
"""Keys that `characterize` writes about the recordings, in addition to their figures."""


def _characterization(file: str, table: Any) -> None:
    place = "characterization"
    read_keys(file, place, table, CHARACTERIZATION_KEYS, tables=("standard_errors", "assumptions"))
    _numbers(file, f"{place}.standard_errors", table.get("standard_errors", {}))
    lines = table.get("assumptions", [])
    if not isinstance(lines, list) or not all(isinstance(line, str) for line in lines):
        raise InputError(file, f"{place}.assumptions", as_in_file(lines), "an array of texts")


KNOT = "knot_{}_Nm"
SLOPE = "slope_{}_rad_per_Nm"
PLAY_RADIUS = "play_radius_{}_Nm"
PLAY_WIDENING = "play_widening_{}"
PLAY_SHARE = "play_share_{}"
PLAY_OUTSIDE = "play_outside_{}_rad_per_Nm"

PLAY_ENVELOPE = "play_envelope_Nm"
PLAY_KNEE = "play_envelope_knee_Nm"
"""Gain of the operators' envelope over the torque, and its knee torque."""

NUMBERED = (KNOT, SLOPE, PLAY_RADIUS, PLAY_WIDENING, PLAY_SHARE, PLAY_OUTSIDE)
"""Values of a fit that come in rows, numbered from 1."""

FIT_KEYS = (
    Key("data_fingerprint", kind="text"),
    Key("friction", kind="choice", choices=FORMS),
    Key("rms", "arcsec", low=0),
    Key("heldout_rms", "arcsec", low=0),
    Key("noise_floor", "arcsec", low=0),
    Key("samples", kind="integer", low=1),
)


def _fit(file: str, table: Any) -> dict[str, Any]:
    """Check that values, standard errors and covariance have the same parameters.

    Values that were not estimated have no standard error; the covariance is that of the values with
    one, in the order of ``[fit.standard_errors]``.
    """
    tables = ("values", "standard_errors", "covariance", "ranges")
    read_keys(file, "fit", table, FIT_KEYS, tables=tables)
    _ranges(file, table.get("ranges", {}))
    if "values" not in table:
        raise InputError(file, "fit.values", "no such table", "[fit.values]")
    values = _numbers(file, "fit.values", table["values"])
    _whole(file, values)
    estimated = list(values)
    if "standard_errors" in table:
        errors = _numbers(file, "fit.standard_errors", table["standard_errors"])
        estimated = list(errors)
        unknown = [name for name in errors if name not in values]
        if unknown:
            raise InputError(
                file,
                "fit.standard_errors",
                ", ".join(unknown),
                "keys of [fit.values]: " + ", ".join(values),
            )
    if "covariance" in table:
        rows = table["covariance"]
        size = len(estimated)
        if not (
            isinstance(rows, list)
            and len(rows) == size
            and all(isinstance(row, list) and len(row) == size for row in rows)
        ):
            raise InputError(
                file, "fit.covariance", as_in_file(rows), f"{size} rows of {size} numbers"
            )
        for i, row in enumerate(rows):
            for j, value in enumerate(row):
                _finite(file, f"fit.covariance[{i}][{j}]", value)
    return dict(table)


FIT_RANGES = ("torque_Nm", "temperature_C", "cycles", "input_velocity_rad_per_s")
"""Conditions whose range a fit states in ``[fit.ranges]``, least and greatest."""


def _ranges(file: str, table: Any) -> None:
    if not isinstance(table, dict):
        raise InputError(file, "fit.ranges", as_in_file(table), "a table")
    for key, ends in table.items():
        place = f"fit.ranges.{key}"
        if key not in FIT_RANGES:
            raise InputError(file, place, "an unknown key", ", ".join(FIT_RANGES))
        if not (isinstance(ends, list) and len(ends) == 2):
            raise InputError(file, place, as_in_file(ends), "two numbers: least and greatest")
        for i, end in enumerate(ends):
            _finite(file, f"{place}[{i}]", end)
        if ends[0] > ends[1]:
            raise InputError(file, place, as_in_file(ends), "the least first")


def _whole(file: str, values: Mapping[str, float]) -> None:
    """Check that the torsion curve and the operators of a fit are complete."""
    rows: dict[str, list[float]] = {}
    for pattern in NUMBERED:
        row = rows[pattern] = numbered(values, pattern)
        start = pattern.partition("{")[0]
        known = {pattern.format(i + 1) for i in range(len(row))}
        stray = [key for key in values if key.startswith(start) and key not in known]
        if stray:
            wanted = pattern.format(len(row) + 1)
            raise InputError(
                file,
                f"fit.values.{stray[0]}",
                "a gap in the numbering before it",
                f"{wanted} first",
            )
    knots, slopes, radii, widening, shares, outside = rows.values()
    if len(widening) not in (0, len(radii)):
        found = f"{len(radii)} radii of operators, {len(widening)} widenings"
        raise InputError(file, "fit.values", found, "a widening for each radius, or none")
    if any(not 0 <= value < 1 for value in widening):
        found = f"{next(value for value in widening if not 0 <= value < 1):g}"
        raise InputError(file, f"fit.values.{PLAY_WIDENING.format(1)}", found, "0 to below 1")
    # Operators that grow with the load follow the constant ones, by radius, then by growth.
    constant = len(radii) - sum(value > 0 for value in widening)
    growing = zip(radii[constant:], widening[constant:], strict=True)
    rising: tuple[tuple[list[Any], str], ...] = (
        ([0.0, *knots], KNOT.format(1)),
        ([0.0, *radii[:constant]], PLAY_RADIUS.format(1)),
        (list(growing), PLAY_WIDENING.format(constant + 1)),
    )
    for row, key in rising:
        if any(b <= a for a, b in itertools.pairwise(row)):
            raise InputError(
                file, f"fit.values.{key}", "numbers that do not rise", "rising numbers"
            )
    if (knots or slopes) and len(slopes) != len(knots) + 1:
        found = f"{len(slopes)} slopes and {len(knots)} knots"
        raise InputError(file, "fit.values", found, "one slope more than knots")
    for i, slope in enumerate(slopes):
        if slope < 0:
            raise InputError(file, f"fit.values.{SLOPE.format(i + 1)}", f"{slope:g}", "0 or more")
    if len(shares) != len(radii) or len(outside) not in (0, len(radii)):
        found = f"{len(radii)} radii of operators, {len(shares)} shares, {len(outside)} outside"
        raise InputError(file, "fit.values", found, "a share for each radius")
    envelope, knee = (values.get(key) for key in (PLAY_ENVELOPE, PLAY_KNEE))
    if (envelope is None) != (knee is None):
        found = f"{PLAY_KNEE if envelope is None else PLAY_ENVELOPE} alone"
        raise InputError(file, "fit.values", found, f"both {PLAY_ENVELOPE} and {PLAY_KNEE}")
    if envelope is not None and envelope < 0:
        raise InputError(file, f"fit.values.{PLAY_ENVELOPE}", f"{envelope:g}", "0 or more")
    if knee is not None and knee <= 0:
        raise InputError(file, f"fit.values.{PLAY_KNEE}", f"{knee:g}", "more than 0")


def numbered(values: Mapping[str, float], pattern: str) -> list[float]:
    """Values of a row of a fit in their order: `KNOT` gives all knots."""
    found: list[float] = []
    while (key := pattern.format(len(found) + 1)) in values:
        found.append(float(values[key]))
    return found


def row_names(pattern: str, count: int) -> list[str]:
    """Names of the values of a row of a fit."""
    return [pattern.format(i + 1) for i in range(count)]


def _fitted_effects(table: Any) -> set[str]:
    """Fitted effects in the file, including user effects; their keys are ``effect.value``."""
    values = table.get("values") if isinstance(table, Mapping) else None
    return {key.partition(".")[0] for key in values if "." in key} if values else set()


def _effects(file: str, tables: Any, fitted: set[str]) -> list[dict[str, Any]]:
    if not isinstance(tables, list):
        raise InputError(file, "effect", as_in_file(tables), "tables [[effect]]")
    seen: set[str] = set()
    c = core()
    known = library_effects(c)
    for index, table in enumerate(tables):
        at = f"effect[{index}]"
        if not isinstance(table, Mapping):
            raise InputError(file, at, as_in_file(table), "a table [[effect]]")
        name = table.get("name")
        if not isinstance(name, str) or (name not in known and name not in fitted):
            hint = did_you_mean(name, known) if isinstance(name, str) else ""
            found = "nothing" if name is None else as_in_file(name)
            raise InputError(file, f"{at}.name", found, f"the name of an effect{hint}")
        if name in seen:
            raise InputError(file, f"{at}.name", as_in_file(name), "each effect once")
        seen.add(name)
        for key, value in table.items():
            if key == "formula":
                if not isinstance(value, str):
                    raise InputError(file, f"{at}.formula", as_in_file(value), "text")
            elif key != "name":
                _finite(file, f"{at}.{key}", value)
    for index, table in enumerate(tables):
        if table["name"] in known:
            ranges = value_ranges(c, known[table["name"]])
            effect_values(file, f"effect[{index}]", table, ranges)
    return [dict(table) for table in tables]


def effect_values(
    file: str, place: str, table: Mapping[str, Any], ranges: Sequence[tuple[str, float, float]]
) -> list[float]:
    """Values of an ``[[effect]]`` table in the units and the order of `ranges`.

    `ranges` has the name with unit and the bounds of every value of the effect.

    Raises
    ------
    InputError
        For a value that is missing, unknown, out of bounds or of another dimension.
    """
    keys = []
    for written, low, high in ranges:
        name, unit = units.split_unit(written)
        keys.append(Key(name, unit.symbol if unit else "", required=True, low=low, high=high))
    rest = {key: value for key, value in table.items() if key not in ("name", "formula")}
    values = read_keys(file, place, rest, keys)
    return [float(values[key_label(key, keys)].value) for key in keys]


def _numbers(file: str, place: str, table: Any) -> dict[str, float]:
    if not isinstance(table, Mapping):
        raise InputError(file, place, as_in_file(table), "a table of numbers")
    return {key: _finite(file, f"{place}.{key}", value) for key, value in table.items()}


def _finite(file: str, place: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InputError(file, place, as_in_file(value), "a finite number")
    return float(value)


def write_drive(drive: Drive, file: str | Path) -> None:
    """Write a drive file atomically; it reads back as the same numbers."""
    write_whole(file, format_toml(drive.document))


def format_toml(document: Mapping[str, Any]) -> str:
    """Format the tables of a drive file as TOML; numbers keep every digit."""
    lines: list[str] = []
    _format_table(document, (), lines)
    return "\n".join(lines).strip() + "\n"


def _format_table(table: Mapping[str, Any], path: tuple[str, ...], lines: list[str]) -> None:
    nested: list[tuple[str, Any]] = []
    for key, value in table.items():
        tables = isinstance(value, list) and value and all(isinstance(v, Mapping) for v in value)
        if isinstance(value, Mapping) or tables:
            nested.append((key, value))
        else:
            lines.append(f"{_key(key)} = {_format_value(value)}")
    for key, value in nested:
        name = ".".join(_key(part) for part in (*path, key))
        for entry in value if isinstance(value, list) else [value]:
            lines.append("")
            lines.append(f"[[{name}]]" if isinstance(value, list) else f"[{name}]")
            _format_table(entry, (*path, key), lines)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _quote(key)


def _quote(text: str) -> str:
    escapes = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
    return (
        '"'
        + "".join(
            escapes.get(c, c if ord(c) >= 32 and ord(c) != 127 else f"\\u{ord(c):04x}")
            for c in text
        )
        + '"'
    )


def _format_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return _quote(value)
    if isinstance(value, Sequence):
        return "[" + ", ".join(_format_value(entry) for entry in value) + "]"
    if isinstance(value, Mapping):
        pairs = (f"{_key(key)} = {_format_value(entry)}" for key, entry in value.items())
        return "{" + ", ".join(pairs) + "}"
    return str(value)
