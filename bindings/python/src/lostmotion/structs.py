"""Convert a design to the struct `lm_drive`, the input of the C library."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

from lostmotion import units
from lostmotion.core import Bits, Core, core
from lostmotion.errors import InputError, LibraryError
from lostmotion.flank_points import Points, flank_points
from lostmotion.generated_flexspline import generated_points
from lostmotion.keys import Key, Kind, TableEntry, as_in_file
from lostmotion.tolerance_classes import ToleranceClass, limit_deviations, read_class

MEASURES = ("", "deg", "arcmin", "modules", "pitch diameters", "rim thicknesses", "face widths")
"""Unit of the range of a design key, by the value of `lm_key_measure`; "" is the unit of the
key."""


def _names(name_of: Callable[[int], Any]) -> tuple[str, ...]:
    """Names of an enumeration of the library, by its values."""
    ffi = core().ffi
    names = (ffi.string(name_of(value)).decode() for value in itertools.count())
    return tuple(itertools.takewhile(bool, names))


DEFORMATIONS = _names(core().lib.lm_deformation_name)
"""By the value of `lm_deformation`."""

GENERATORS = _names(core().lib.lm_generator_name)
"""By the value of `lm_generator_type`."""

FLANKS = _names(core().lib.lm_flank_name)
"""By the value of `lm_flank_kind`."""

DISTRIBUTIONS = _names(core().lib.lm_distribution_name)
"""By the value of `lm_distribution`."""

ZONES = _names(core().lib.lm_zone_name)
"""By the value of `lm_gap_zone`."""


@dataclass(frozen=True)
class DesignKey(Key):
    """A key of a table under [design], as listed by the library.

    Attributes
    ----------
    section : str
        The table; "" is [design] itself.
    meaning : str
        One sentence without a full stop.
    range : str
        Permitted values, in words.
    default : float or None
        In `unit`, if a file without the key gets a fixed value.
    """

    section: str = ""
    meaning: str = ""
    range: str = ""
    default: float | None = None


def design_keys() -> list[DesignKey]:
    """List the keys of a design, in the order of ``lostmotion/design_key_list.h``."""
    c = core()
    lib, row = c.lib, c.ffi.new("lm_design_key *")
    kinds: dict[int, tuple[Kind, tuple[str, ...]]] = {
        lib.LM_KIND_REAL: ("real", ()),
        lib.LM_KIND_COUNT: ("integer", ()),
        lib.LM_KIND_SWITCH: ("switch", ()),
        lib.LM_KIND_DEFORMATION: ("choice", DEFORMATIONS),
        lib.LM_KIND_GENERATOR: ("choice", GENERATORS),
        lib.LM_KIND_FLANK: ("choice", FLANKS),
    }
    found = []
    for index in range(lib.LM_DESIGN_KEY_COUNT):
        c.check(lib.lm_describe_design_key(index, row, c.ffi.NULL))
        section, stem, suffix, meaning = (
            c.ffi.string(text).decode() for text in (row.section, row.stem, row.suffix, row.meaning)
        )
        kind, choices = kinds[row.kind]
        measure = MEASURES[row.per]
        found.append(
            DesignKey(
                stem,
                suffix.removeprefix("_"),
                kind,
                required=row.file == lib.LM_FILE_REQUIRED,
                choices=choices,
                section="" if section == "drive" else section,
                meaning=meaning,
                range=f"{row.low:g} to {row.high:g}{measure and ' ' + measure}",
                default=row.usual if row.file == lib.LM_FILE_DEFAULT else None,
            )
        )
    return found


FIELDS: dict[str, tuple[DesignKey, ...]] = {
    section: tuple(keys)
    for section, keys in itertools.groupby(design_keys(), lambda key: key.section)
}
"""Tables under [design] and their keys, named as in `lm_drive`; "" is [design] itself."""

TORSION_DEFAULTS = ("cup wall", "diaphragm", "input shaft", "output shaft")
"""Members of the torsion chain that the library fills in, in its order."""

ARGUMENTS = ("phase_rad", "torque_Nm", "angle_rad", "nodes", "count", "steps_per_pitch")
"""Arguments of library calls besides the design."""

SHARE = Key("share")
PRELOAD = Key("preload", "N")

RADIAL_KINDS: dict[str, tuple[Key, ...]] = {
    "ball": (
        Key("ball_diameter", "mm", required=True),
        Key("contact_angle", "rad"),
        Key("conformity"),
        Key("bearing", kind="choice", choices=("deep_groove", "self_aligning", "thrust")),
        Key("balls", kind="integer"),
        Key("balls_in_lobe"),
        Key("clearance", kind="switch"),
        SHARE,
        PRELOAD,
    ),
    "roller": (
        Key("roller_length", "mm", required=True),
        Key("crowned", kind="switch"),
        Key("rollers", kind="integer"),
        SHARE,
        PRELOAD,
    ),
    "spring": (Key("stiffness", "N_per_mm", required=True), SHARE),
    "power": (
        Key("deflection", "mm", required=True, low=0),
        Key("force", "N", required=True, above=0, high=1e9),
        Key("exponent", required=True, low=0.25, high=2),
        SHARE,
        PRELOAD,
    ),
    "shaft": (
        Key("diameter", "mm", required=True),
        Key("a", "mm", required=True),
        Key("b", "mm", required=True),
    ),
    "ring": (
        Key("mean_radius", "mm", required=True),
        Key("thickness", "mm", required=True),
        Key("width", "mm", required=True),
        Key("patch_half_angle", "rad"),
        Key("housing_factor"),
    ),
    "ring_widening": (
        Key("inner_radius", "mm", required=True),
        Key("outer_radius", "mm", required=True),
        Key("width", "mm", required=True),
    ),
}
"""Members of [[design.radial_chain]] by their `kind`."""

AT = Key("at", kind="choice", choices=("input", "output"))
RATIO = Key("ratio")

TORSION_KINDS: dict[str, tuple[Key, ...]] = {
    "shaft": (
        Key("outer_diameter", "mm", required=True),
        Key("bore", "mm"),
        Key("length", "mm", required=True),
        AT,
        RATIO,
    ),
    "shell": (
        Key("mean_radius", "mm", required=True),
        Key("wall", "mm", required=True),
        Key("length", "mm", required=True),
    ),
    "diaphragm": (
        Key("hub_radius", "mm", required=True),
        Key("outer_radius", "mm", required=True),
        Key("thickness", "mm", required=True),
    ),
    "lock": (Key("stiffness", "Nm_per_rad", required=True),),
    "stiffness": (Key("stiffness", "Nm_per_rad", required=True), AT, RATIO),
}
"""Members of [[design.torsion_chain]] by their `kind`."""

TOLERANCE_KINDS: dict[str, tuple[Key, ...]] = {
    kind: (
        Key("zone", kind="choice", choices=ZONES, required=True),
        Key("lower", "mm"),
        Key("upper", "mm"),
        Key("it_grade", kind="integer"),
        Key("nominal", "mm"),
        Key("fundamental_deviation", "mm"),
        Key("distribution", kind="choice", choices=DISTRIBUTIONS),
        Key("cost_weight", above=0, high=1e6),
        *extra,
    )
    for kind, extra in {
        "hole": (Key("tolerance_class", kind="text"), Key("diameter", kind="switch")),
        "shaft": (Key("tolerance_class", kind="text"), Key("diameter", kind="switch")),
        "link": (Key("influence", required=True),),
    }.items()
}
"""Entries of [[design.tolerance]] by their `kind`."""


@dataclass(frozen=True)
class Entry:
    """One member of a chain."""

    kind: str
    place: str
    values: Mapping[str, TableEntry]

    def get(self, name: str, default: Any = None) -> Any:
        """Value of a key, or the default."""
        return self.values[name].value if name in self.values else default

    @property
    def label(self) -> str:
        """Name in the file, or the place there."""
        return str(self.get("name", self.place.removeprefix("design.")))


@dataclass(frozen=True)
class Design:
    """Design data of a drive, in the units of `lm_drive`.

    Attributes
    ----------
    values : dict
        Values of the file by path in `lm_drive` (``teeth.module_mm``).
    radial_chain, torsion_chain, tolerances : sequence of Entry or None
        None if the file has none.
    points, rigid_points : tuple of pairs or None
        Points of the flanks.
    remarks : tuple of str
        What was done to the points of the files.
    """

    file: str
    ratio: float
    rated_torque_Nm: float
    values: dict[str, TableEntry]
    radial_chain: Sequence[Entry] | None = None
    torsion_chain: Sequence[Entry] | None = None
    tolerances: Sequence[Entry] | None = None
    points: Points | None = None
    rigid_points: Points | None = None
    remarks: tuple[str, ...] = ()


def field_path(section: str, key: Key) -> str:
    """Path of a key in `lm_drive`."""
    return f"{section}.{key.written}" if section else key.written


CHOICES = {field_path(key.section, key): key.choices for key in design_keys() if key.choices}
"""Names of the values of a choice, by the path of its key."""

OWN_FLANK = "teeth.flexspline_flank"


def make_drive(design: Design, bits: Bits = 64) -> Any:
    """Fill an `lm_drive` from a design: given values, and defaults in proportion to size.

    Returns
    -------
    cdata
        An owned ``lm_drive *``, checked.

    Raises
    ------
    InputError
        Names the key of the drive file whose value the library refuses.
    """
    c = core(bits)
    design = _with_generated_flexspline(design)
    # Values that the library refuses are named before any default is derived from them.
    trial = _given(design, c, _paths("teeth", "generator"))
    call_for(design, c, c.lib.lm_complete_drive, trial)
    _set_all(trial, design, design.values)
    call_for(design, c, c.lib.lm_check_drive, trial)
    drive = _given(design, c, design.values)
    call_for(design, c, c.lib.lm_complete_drive, drive)
    _set_all(drive, design, design.values)  # a zero that the file states is not a missing value
    if design.radial_chain is not None:
        _fill(design, c, drive, "radial_law", design.radial_chain, _radial_law)
    if design.torsion_chain is not None:
        _fill(design, c, drive, "torsion", design.torsion_chain, _torsion_element)
    if design.tolerances is not None:
        _fill(design, c, drive, "tolerance", design.tolerances, _tolerance_link)
    call_for(design, c, c.lib.lm_check_drive, drive)
    return drive


def _with_generated_flexspline(design: Design) -> Design:
    """Replace a flexspline that the circular spline generates by its points."""
    kind = design.values.get(OWN_FLANK)
    stated = design.rigid_points
    if kind is None or kind.value != "conjugate" or stated is None:
        return design

    def as_kind(name: str) -> dict[str, TableEntry]:
        return {**design.values, OWN_FLANK: replace(kind, value=name)}

    drive = make_drive(replace(design, values=as_kind("involute")))
    try:
        points = generated_points(drive, stated)
    except LibraryError as error:
        raise _refused(design, error) from None
    low, height = min(points)
    if not low > 0:
        raise InputError(
            design.file,
            "design.flank.rigid_points",
            f"a tooth with a half thickness of {low:.6g} mm at y = {height:.6g} mm",
            "a circular spline that leaves a tooth up to the tip (teeth.tooth_height)",
        )
    return replace(design, values=as_kind("points"), points=points)


def _given(design: Design, c: Core, paths: Iterable[str]) -> Any:
    """Make an `lm_drive` with the values of the file at `paths`, and zeros."""
    drive = c.ffi.new("lm_drive *")
    drive.ratio = design.ratio
    drive.rated_torque_Nm = design.rated_torque_Nm
    for key in itertools.chain.from_iterable(FIELDS.values()):
        if key.default is not None:
            value = key.default if key.kind == "real" else int(key.default)
            _set(drive, field_path(key.section, key), value)
    _set_all(drive, design, paths)
    if design.points is not None:
        drive.flank.points = flank_points(design.points, c.bits)
    if design.rigid_points is not None:
        drive.flank.rigid_points = flank_points(design.rigid_points, c.bits)
    return drive


def _set_all(drive: Any, design: Design, paths: Iterable[str]) -> None:
    for path in paths:
        if path in design.values:
            value = design.values[path].value
            _set(drive, path, CHOICES[path].index(value) if path in CHOICES else value)


def stated_defaults(design: Design, drive: Any) -> dict[str, Any]:
    """List the default values of keys that the file does not state, by dotted key.

    Keys that do not apply are left out: the contact of a cam, the cam of discs, the arcs of an
    involute.
    """
    defaults: dict[str, Any] = {}
    generator = design.values["generator.type"].value
    unused = {
        "generator.contact_half_angle_rad": generator not in WITH_CONTACT_ARC,
        "generator.cam_offset_mm": generator not in WITH_CAM_OFFSET,
        "generator.eccentricity_angle_rad": drive.generator.eccentricity_mm == 0,
    }
    unused.update(_unused_flank_keys(drive))
    for section, keys in FIELDS.items():
        for key in keys:
            path = field_path(section, key)
            if path not in design.values and not unused.get(path):
                value = attrgetter(path)(drive)
                if key.choices:
                    value = key.choices[value]
                defaults[f"design.{path}"] = bool(value) if key.kind == "switch" else value
    if design.radial_chain is None:
        soft = drive.radial_laws[0].coefficient_mm_per_Nn
        defaults["design.radial_chain"] = (
            f"N/mm on a lobe: ovalisation of the rigid gear {units.plain_number(1 / soft)}, "
            "in proportion to size"
        )
    if design.torsion_chain is None:
        members = ", ".join(
            f"{name} {units.plain_number(element.stiffness_Nm_per_rad * element.ratio**2)}"
            for name, element in zip(TORSION_DEFAULTS, drive.torsion, strict=False)
        )
        defaults["design.torsion_chain"] = f"Nm/rad at the output: {members}, in proportion to size"
    if design.tolerances is None:
        defaults["design.tolerance"] = "none"
    return defaults


WITH_CONTACT_ARC = ("discs", "rollers", "ring")
"""Wave generators that have a contact half angle."""

WITH_CAM_OFFSET = ("ellipse",)
"""Wave generators whose cam may be offset from the neutral line."""


def unused_keys(design: Mapping[str, Any]) -> set[str]:
    """Dotted keys, without units, of a [design] that do not apply to its wave generator."""
    kind = design["generator"]["type"]
    return {
        *(() if kind in WITH_CONTACT_ARC else ("generator.contact_half_angle",)),
        *(() if kind in WITH_CAM_OFFSET else ("generator.cam_offset",)),
    }


def without_effect(design: Design, drive: Any) -> list[str]:
    """List the wave generator keys of the file that have no effect, one sentence each."""
    kind = design.values["generator.type"].value
    generator = drive.generator
    stated = {path for path, entry in design.values.items() if entry.value}
    found = []
    if "generator.contact_half_angle_rad" in stated and kind not in WITH_CONTACT_ARC:
        found.append(
            "generator.contact_half_angle has no effect: the shape of a wave generator of type "
            f"'{kind}' follows from its deflection; discs, rollers and ring have a contact arc."
        )
    if "generator.cam_offset_mm" in stated and kind not in WITH_CAM_OFFSET:
        found.append(
            f"generator.cam_offset has no effect: a wave generator of type '{kind}' is "
            "defined by the neutral line; only the cam of type 'ellipse' has an offset."
        )
    if generator.floating and generator.eccentricity_mm > 0:
        found.append(
            "generator.eccentricity has no effect: the wave generator floats and centres itself; "
            "floating = false fixes it."
        )
    return found


ARC_KEYS = ("rho_a", "l_a", "X_a", "rho_f")
CENTRE_KEYS = ("l_f", "X_f")
TANGENT_KEYS = ("delta_L_rad", "h_l")
S_KEYS = ("kappa", "X_M", "s_M")


def _unused_flank_keys(drive: Any) -> dict[str, bool]:
    """List the flank keys that do not apply to a drive."""
    involute = drive.teeth.flexspline_flank == core().lib.LM_FLANK_INVOLUTE
    generated = drive.teeth.rigid_flank == core().lib.LM_FLANK_CONJUGATE
    arcs = drive.teeth.flexspline_flank == core().lib.LM_FLANK_DOUBLE_ARC
    s_tooth = drive.teeth.flexspline_flank == core().lib.LM_FLANK_S_TOOTH
    stated_tangent = drive.flank.delta_L_rad > 0
    hidden = {
        **dict.fromkeys(ARC_KEYS, not arcs),
        **dict.fromkeys(CENTRE_KEYS, not arcs or stated_tangent),
        **dict.fromkeys(TANGENT_KEYS, not arcs or not stated_tangent),
        **dict.fromkeys(S_KEYS, not s_tooth),
        "tip_relief_mm": involute and not generated,
        "tip_relief_height": drive.flank.tip_relief_mm == 0,
        "backlash_mm": not generated,
    }
    return {f"flank.{name}": value for name, value in hidden.items()}


def call_for(design: Design, c: Core, function: Callable[..., int], *arguments: Any) -> None:
    """Call a function of the library that may refuse a value of the design, and report its key.

    Raises
    ------
    InputError
        When the library refuses a value of the design.
    LibraryError
        If it refuses something else, or cannot finish.
    """
    try:
        c.call(function, *arguments)
    except LibraryError as error:
        lib = c.lib
        of_design = (lib.LM_NOT_FINITE, lib.LM_OUT_OF_RANGE, lib.LM_INCONSISTENT, lib.LM_NO_CONTACT)
        if (error.status, error.key) == (lib.LM_TOO_SMALL, "LM_ACTIVE_MAX"):
            found = f"more than {lib.LM_ACTIVE_MAX} pairs of teeth that carry at one of the torques"
            expected = "a smaller torque, or fewer axial_sections"
            raise InputError(design.file, "design", found, expected) from None
        if error.status not in of_design or error.key in ARGUMENTS:
            raise
        raise _refused(design, error) from None


def _refused(design: Design, error: LibraryError) -> InputError:
    key = error.key.removeprefix("drive.")
    value = design.values.get(key)
    if error.status == core().lib.LM_NO_CONTACT:
        found, expected = "teeth that cannot touch", "teeth that overlap at some angle"
        return InputError(design.file, "design", found, expected)
    if error.key == NO_ROOT:
        shifts = " and ".join(f"{design.values[f'teeth.{gear}_shift'].value:g}" for gear in GEARS)
        found = f"shifts of {shifts} (flexspline, rigid gear)"
        expected = "shifts for which the teeth of both gears have thickness at the root"
        return InputError(design.file, "design.teeth", found, expected)
    if error.key in ARC_FAULTS:
        found, expected = ARC_FAULTS[error.key]
        place = " and ".join(f"design.{name}" for name in error.key.split(", "))
        return InputError(
            design.file, place, found.format(error.found), expected.format(error.low, error.high)
        )
    if value is None and not re.fullmatch(r"[\w.\[\]]+", error.key):
        found = f"{error.found:.6g} as the {error.key}"
        return InputError(design.file, "design", found, _range(error, 1.0))
    place = f"drive.{key}" if key in ("ratio", "rated_torque_Nm") else f"design.{key}"
    if value is not None:
        place = value.place
    if error.status == core().lib.LM_INCONSISTENT and key in CONTRADICTIONS:
        return InputError(design.file, place, *CONTRADICTIONS[key](design, error))
    scale = _scale(key, value) if value is not None else 1.0
    return InputError(design.file, place, f"{error.found * scale:.6g}", _range(error, scale))


def _odd_teeth(design: Design, error: LibraryError) -> tuple[str, str]:
    pair = f"{error.low:.0f} or {error.high:.0f}"
    return f"{error.found:.0f}", f"an even number, {pair}: both lobes need equal tooth positions"


def _planar_sections(design: Design, error: LibraryError) -> tuple[str, str]:
    sections = design.values["axial_sections"].value
    expected = "axial_sections = 1 with it, or planar_only = false"
    return f"true with axial_sections = {sections}", expected


def _difference(design: Design, error: LibraryError) -> tuple[str, str]:
    more = "more" if error.low > design.values["teeth.flexspline_teeth"].value else "less"
    return f"{error.found:.0f}", f"{error.low:.0f}, two {more} than the flexspline has"


def _other_ratio(design: Design, error: LibraryError) -> tuple[str, str]:
    flexspline, rigid = (design.values[f"teeth.{gear}_teeth"].value for gear in GEARS)
    return (
        f"{error.found:.6g}",
        f"{flexspline / 2:g} (the flexspline turns the output) or {rigid / 2:g} (the rigid gear "
        "does), of either sign",
    )


def _unfit_generator(design: Design, error: LibraryError) -> tuple[str, str]:
    fitting = ", ".join(f"'{name}'" for name in GENERATORS[int(error.low) : int(error.high) + 1])
    found = design.values["generator.type"].value
    return f"'{found}'", f"{fitting} for teeth of this deformation"


def _no_tip(design: Design, error: LibraryError) -> tuple[str, str]:
    """Describe a tip below the base circle, or above the point where the flanks meet."""
    found = f"{design.values[error.key].value:.6g}"
    if error.low > 0:
        return (
            f"{found}, which puts the tip at {error.found:.6g} mm from the gear's centre",
            f"a tip outside the base circle at {error.low:.6g} mm",
        )
    return (
        f"{found} and a tooth {error.found:.3g} mm thick below its tip",
        "lower teeth or a smaller shift: these run to a point",
    )


def _unfit_flank(design: Design, error: LibraryError) -> tuple[str, str]:
    found = design.values[error.key].value
    rigid = error.key == "teeth.rigid_flank"
    if found == "conjugate" and not rigid:
        return "'conjugate'", "teeth.rigid_flank = 'points', the flank that generates it"
    gear = "rigid gear" if rigid else "flexspline"
    fits = core().lib.lm_flank_fits
    others = [f"'{name}'" for kind, name in enumerate(FLANKS) if fits(kind, rigid)]
    return f"'{found}'", f"{', '.join(others[:-1])} or {others[-1]} for the {gear}"


def _no_reach(design: Design, error: LibraryError) -> tuple[str, str]:
    return (
        f"{error.found:.6g}, which moves the conjugate flank out of the mesh",
        f"{'more' if error.found <= error.low else 'less'} than "
        f"{error.low if error.found <= error.low else error.high:.6g}, its engagement depth being "
        f"{design.values['teeth.engagement_depth'].value:g}",
    )


GEARS = ("flexspline", "rigid")

NO_ROOT = "tooth thickness at root_radius_mm"
"""Name in the library of the fault that the flanks of a tooth meet below its root."""

ARC_FAULTS: dict[str, tuple[str, str]] = {
    "flank.rho_a, flank.rho_f": (
        "radii that together are {:.6g} mm",
        "less than {1:.6g} mm, the distance of the centres: no common tangent lies between arcs "
        "that overlap",
    ),
    "flank.rho_a, teeth.tooth_height": (
        "a convex arc of {:.6g} modules",
        "more than {0:.6g} modules, the height of the tip above its centre",
    ),
    "flank.rho_a, flank.X_a": (
        "a convex arc that begins {:.6g} modules above the neutral line",
        "below the tip at {1:.6g} modules: the tip lies on the straight part",
    ),
    "flank.rho_f, teeth.root_clearance": (
        "a concave arc of {:.6g} modules",
        "more than {0:.6g} modules, the depth of the root below its centre",
    ),
    "flank.rho_f, flank.X_f": (
        "a concave arc that ends {:.6g} modules above the neutral line",
        "above the root at {0:.6g} modules: the root lies on the straight part",
    ),
    "flank.rho_a, flank.l_a": (
        "half a tooth of {:.6g} modules at the tip",
        "a tooth that has thickness there",
    ),
    "flank.rho_f, flank.l_f": (
        "half a tooth of {:.6g} modules at the root",
        "less than {1:.6g} modules, half the pitch there: the teeth run into each other",
    ),
    "flank.kappa, teeth.tooth_height": (
        "an S tooth that reaches {:.6g} modules from its datum point",
        "more than {0:.6g} modules, where the tip lies",
    ),
    "flank.kappa, teeth.root_clearance": (
        "an S tooth that reaches {:.6g} modules from its datum point",
        "more than {0:.6g} modules, where the root lies",
    ),
    "flank.s_M, teeth.tooth_height": (
        "half a tooth of {:.6g} modules at the tip",
        "a tooth that has thickness there",
    ),
    "flank.s_M, teeth.root_clearance": (
        "half a tooth of {:.6g} modules at the root",
        "less than {1:.6g} modules, half the pitch there: the teeth run into each other",
    ),
    "flank.points, teeth.tooth_height": (
        "points that end at {:.6g} mm from the gear's centre",
        "the tip at {0:.6g} mm or beyond",
    ),
    "flank.rigid_points, teeth.engagement_depth": (
        "points between which {:.6g} mm from the gear's centre is the last or first one",
        "{0:.6g} to {1:.6g} mm there: from the tip of the rigid gear to that of the flexspline "
        "on the deformation axis",
    ),
    "flank.rigid_points": (
        "half a space or tooth of {:.6g} mm",
        "more than 0 and less than {1:.6g} mm, half the pitch there",
    ),
    "flank.points, teeth.root_clearance": (
        "points that begin at {:.6g} mm from the gear's centre",
        "the root at {1:.6g} mm or below",
    ),
    "flank.points, teeth.engagement_depth": (
        "points that begin at {:.6g} mm from the gear's centre",
        "the tip at {1:.6g} mm or below",
    ),
    "flank.points, generator.deflection_mm": (
        "points that end at {:.6g} mm from the gear's centre",
        "the root at {0:.6g} mm or beyond",
    ),
}
ARC_FAULTS |= {
    f"{name}, {inward}": ARC_FAULTS[f"{name}, {outward}"]
    for inward, outward, names in (
        ("teeth.engagement_depth", "teeth.tooth_height", ("rho_a", "kappa", "s_M")),
        ("generator.deflection_mm", "teeth.root_clearance", ("rho_f", "kappa", "s_M")),
    )
    for name in (f"flank.{end}" for end in names)
}
"""What was found and what was expected of arcs that make no flank, by the keys that disagree."""

CONTRADICTIONS: dict[str, Callable[[Design, LibraryError], tuple[str, str]]] = {
    "teeth.flexspline_teeth": _odd_teeth,
    "teeth.rigid_teeth": _difference,
    "teeth.tooth_height": _no_tip,
    "teeth.engagement_depth": _no_tip,
    "teeth.flexspline_flank": _unfit_flank,
    "teeth.rigid_flank": _unfit_flank,
    "teeth.rigid_shift": _no_reach,
    "generator.type": _unfit_generator,
    "ratio": _other_ratio,
    "planar_only": _planar_sections,
}
"""What was found and what was expected where a value contradicts others, by key."""


def _range(error: LibraryError, scale: float) -> str:
    low, high = error.low * scale, error.high * scale
    if (low, high) == (0.0, 0.0):
        return f"a value that fits the others ({error.sentence})"
    text = f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"
    if error.status == core().lib.LM_INCONSISTENT:
        text += f" ({error.sentence})"
    return text


def _scale(path: str, value: TableEntry) -> float:
    """Units of the file per unit of the library."""
    _, unit = units.split_unit(path)
    if unit is None or not value.unit:
        return 1.0
    return units.convert(1.0, unit.symbol, value.unit)


def _paths(*sections: str) -> list[str]:
    return [field_path(section, key) for section in sections for key in FIELDS[section]]


def _set(drive: Any, path: str, value: Any) -> None:
    section, _, name = path.rpartition(".")
    setattr(getattr(drive, section) if section else drive, name, value)


def _fill(
    design: Design,
    c: Core,
    drive: Any,
    name: str,
    entries: Sequence[Entry],
    build: Callable[[Design, Core, Any, Entry, Any], None],
) -> None:
    """Build the members of a chain by the functions of their kinds."""
    array = getattr(drive, {"radial_law": "radial_laws", "tolerance": "tolerances"}.get(name, name))
    capacity = len(array)
    if len(entries) > capacity:
        place = entries[0].place.rpartition("[")[0]
        raise InputError(design.file, place, f"{len(entries)} entries", f"at most {capacity}")
    for index, entry in enumerate(entries):
        try:
            build(design, c, drive, entry, c.ffi.addressof(array[index]))
        except LibraryError as error:
            raise _refused_entry(design, entry, error) from None
    setattr(drive, f"{name}_count", len(entries))


def _refused_entry(design: Design, entry: Entry, error: LibraryError) -> InputError:
    name = error.key.rpartition(".")[2]
    for key, value in entry.values.items():
        if name == key or name.startswith(f"{key}_"):
            scale = _scale(name, value)
            return InputError(
                design.file, value.place, f"{error.found * scale:.6g}", _range(error, scale)
            )
    return InputError(
        design.file, f"{entry.place}.{name}", f"{error.found:.6g}", _range(error, 1.0)
    )


BEARINGS = {
    "deep_groove": "LM_BALL_PALMGREN",
    "self_aligning": "LM_BALL_SELF_ALIGNING",
    "thrust": "LM_BALL_THRUST",
}
"""Coefficient of the contact of a ball, by the kind of bearing."""

UNSTATED = {
    "share": 1.0,
    "preload": 0.0,
    "contact_angle": 0.0,
    "patch_half_angle": 0.0,
    "housing_factor": 1.0,
    "bore": 0.0,
}
"""Values of optional keys of a chain that are not stated."""

MADE_BY: dict[str, tuple[str, str]] = {
    "radial spring": ("lm_make_spring_law", "stiffness share"),
    "radial shaft": ("lm_make_shaft_bending_law", "diameter a b youngs_modulus_MPa"),
    "radial ring": (
        "lm_make_rim_ovalisation_law",
        "mean_radius thickness width patch_half_angle youngs_modulus_MPa housing_factor",
    ),
    "radial ring_widening": (
        "lm_make_rim_widening_law",
        "inner_radius outer_radius width youngs_modulus_MPa poisson_ratio",
    ),
    "torsion shaft": (
        "lm_make_shaft_torsion",
        "outer_diameter bore length shear_modulus_MPa ratio",
    ),
    "torsion shell": ("lm_make_shell_torsion", "mean_radius wall length shear_modulus_MPa"),
    "torsion diaphragm": (
        "lm_make_diaphragm_torsion",
        "hub_radius outer_radius thickness shear_modulus_MPa",
    ),
    "torsion lock": ("lm_make_input_lock", "stiffness ratio"),
    "torsion stiffness": ("lm_make_input_lock", "stiffness ratio"),
}
"""Function of the library that makes a member, and its arguments: keys, or names of the material.

A stiffness at the input or output is a lock with the ratio of that place.
"""


def _make(what: str, c: Core, drive: Any, entry: Entry, made: Any, **more: float) -> None:
    """Make a member of a chain by the function of its kind."""
    function, names = MADE_BY[what]
    known = {**UNSTATED, **more, **{name: one.value for name, one in entry.values.items()}}
    values = (known[n] if n in known else getattr(drive.material, n) for n in names.split())
    c.call(getattr(c.lib, function), *values, made)


def _radial_law(design: Design, c: Core, drive: Any, entry: Entry, law: Any) -> None:
    lib = c.lib
    share, preload = (entry.get(name, UNSTATED[name]) for name in ("share", "preload"))
    if entry.kind == "ball":
        angle = entry.get("contact_angle", 0.0)
        coefficient = getattr(lib, BEARINGS[entry.get("bearing", "deep_groove")])
        if "conformity" in entry.values:
            coefficient = c.real_from(lib.lm_ball_hertz_coefficient, entry.get("conformity"))
        if "balls" in entry.values:
            loose = entry.get("clearance")
            kind = lib.LM_BEARING_BALLS_CLEARANCE if loose else lib.LM_BEARING_BALLS
            share *= c.real_from(lib.lm_bearing_share, kind, entry.get("balls"), angle)
        elif "balls_in_lobe" in entry.values:
            share *= c.real_from(lib.lm_cam_bearing_share, entry.get("balls_in_lobe"))
        size = entry.get("ball_diameter")
        c.call(lib.lm_make_ball_law, size, angle, coefficient, share, preload, law)
    elif entry.kind == "roller":
        if "rollers" in entry.values:
            kind = lib.LM_BEARING_ROLLERS
            share *= c.real_from(lib.lm_bearing_share, kind, entry.get("rollers"), 0.0)
        make = lib.lm_make_crowned_roller_law if entry.get("crowned") else lib.lm_make_roller_law
        c.call(make, entry.get("roller_length"), share, preload, law)
    elif entry.kind == "power":
        # deflection (F / force)^exponent; a force of 1 N keeps every bit of the coefficient
        law.exponent = exponent = entry.get("exponent")
        law.coefficient_mm_per_Nn = entry.get("deflection") / entry.get("force") ** exponent
        law.share, law.preload_N = share, preload
        c.call(lib.lm_check_radial_laws, law, 1)
    else:
        _make(f"radial {entry.kind}", c, drive, entry, law)


def _torsion_element(design: Design, c: Core, drive: Any, entry: Entry, element: Any) -> None:
    at_input = entry.kind == "lock" or entry.get("at") == "input"
    ratio = design.ratio if at_input else 1.0
    _make(f"torsion {entry.kind}", c, drive, entry, element, ratio=ratio)


def tolerance_links(file: str, entries: Sequence[Entry]) -> Any:
    """Make the links of a chain of tolerances, without the drive.

    Returns
    -------
    cdata
        An owned ``lm_tolerance_link[]``, checked.
    """
    c = core()
    links = c.ffi.new("lm_tolerance_link[]", max(1, len(entries)))
    for index, entry in enumerate(entries):
        _set_link(file, c, entry, c.ffi.addressof(links, index))
    return links


def _tolerance_link(design: Design, c: Core, drive: Any, entry: Entry, link: Any) -> None:
    _set_link(design.file, c, entry, link)


def _set_link(file: str, c: Core, entry: Entry, link: Any) -> None:
    sign = {"hole": 1.0, "shaft": -1.0}.get(entry.kind, 1.0)
    half = 0.5 if entry.kind != "link" and entry.get("diameter", True) else 1.0
    link.influence = entry.get("influence", sign * half)
    link.lower_mm, link.upper_mm = _deviations(file, c, entry)
    link.distribution = DISTRIBUTIONS.index(entry.get("distribution", "normal"))
    link.zone = ZONES.index(entry.get("zone"))
    c.call(c.lib.lm_check_tolerance_links, link, 1)


def _deviations(file: str, c: Core, entry: Entry) -> tuple[float, float]:
    """Lower and upper deviation in mm: as given, or from an ISO 286 grade.

    A grade alone means a basic hole (H), a basic shaft (h) or, for a link, plus and minus half of
    it; a fundamental deviation shifts the end next to zero. A tolerance class states both.
    """
    if "tolerance_class" in entry.values:
        return _class_deviations(file, entry)
    pair = [name for name in ("lower", "upper") if name in entry.values]
    grade = [name for name in ("it_grade", "nominal") if name in entry.values]
    if len(pair) == 2 and not grade and "fundamental_deviation" not in entry.values:
        return entry.get("lower"), entry.get("upper")
    if len(grade) == 2 and not pair:
        try:
            width = c.real_from(c.lib.lm_it_tolerance, entry.get("nominal"), entry.get("it_grade"))
        except LibraryError as error:
            error.key = {"grade": "it_grade"}.get(error.key, "nominal_mm")
            raise
        shift = entry.get("fundamental_deviation", 0.0)
        lower = {"hole": 0.0, "shaft": -width}.get(entry.kind, -width / 2)
        return shift + lower, shift + lower + width
    found = ", ".join(pair + grade) or "no deviations"
    expected = "lower_um and upper_um, or it_grade and nominal_mm"
    expected += ", or tolerance_class and nominal_mm" if entry.kind != "link" else ""
    raise InputError(file, entry.place, found, expected)


def _class_deviations(file: str, entry: Entry) -> tuple[float, float]:
    """Lower and upper deviation of a tolerance class in mm; a letter alone has its it_grade."""
    stated = entry.values["tolerance_class"]
    others = [name for name in ("lower", "upper", "fundamental_deviation") if name in entry.values]
    if others or "nominal" not in entry.values:
        found = ", ".join(others) + " beside it" if others else "no nominal_mm"
        raise InputError(
            file,
            stated.place,
            found,
            "a class such as H7 and nominal_mm give the deviations",
        )
    one = class_of(file, entry, stated)
    try:
        return limit_deviations(one, float(entry.get("nominal")))
    except ValueError as error:
        found = f"{as_in_file(stated.value)} at {entry.get('nominal'):g} mm"
        raise InputError(file, stated.place, found, str(error)) from None


def class_of(file: str, entry: Entry, stated: TableEntry) -> ToleranceClass:
    """Tolerance class of a hole or a shaft; a letter alone takes its grade from it_grade.

    Raises
    ------
    InputError
        For an invalid class, one of the other kind, or one with two grades.
    """
    try:
        one = read_class(stated.value)
    except ValueError as error:
        raise InputError(file, stated.place, as_in_file(stated.value), str(error)) from None
    if one.is_hole != (entry.kind == "hole"):
        expected = "a capital letter for a hole, a small one for a shaft"
        raise InputError(file, stated.place, as_in_file(stated.value), expected)
    if "it_grade" not in entry.values:
        return one
    if one.grade is not None:
        found = f"{as_in_file(stated.value)} beside it_grade"
        raise InputError(file, stated.place, found, "the grade once")
    return ToleranceClass(one.letter, int(entry.get("it_grade")))
