"""The design model: a drawing becomes clearances, a torsion curve, checks and tolerance limits.

Thin objects over the C library; all loops over teeth, torques and axial sections are in C.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion import structs
from lostmotion.arrays import BoolArray, FloatArray
from lostmotion.catalogue import PARTS, REVERSAL_TORQUE_SHARE
from lostmotion.core import Bits, core
from lostmotion.drives import KNOT, SLOPE, Drive, numbered
from lostmotion.errors import InputError
from lostmotion.structs import Design
from lostmotion.torsion_curve import TorsionCurve
from lostmotion.units import ARCMIN

Array = npt.NDArray[Any]

TORSION_CURVE_TORQUES = 257
"""Number of torques at which a design is evaluated for a torsion curve."""

PROBABLE_T = 3.0
"""Half width of the probable limits in standard deviations: 0.27 % lie outside."""


@dataclass(frozen=True)
class Clearances:
    """Unloaded side clearances, one entry per tooth and axial section.

    Gaps are output rotations until contact: negative is interference, infinite is no overlap.
    """

    section: Array
    angle_rad: Array
    forward_rad: Array
    backward_rad: Array
    forward_radius_mm: Array
    backward_radius_mm: Array

    @property
    def overlap(self) -> BoolArray:
        """Whether the tooth overlaps the rigid gear's teeth at all."""
        return np.asarray(np.isfinite(self.forward_rad) | np.isfinite(self.backward_rad))


@dataclass(frozen=True)
class DesignCurve:
    """One-sided deflection by torque and its contributions, which add up to it."""

    torque_Nm: Array
    total_rad: Array
    parts_rad: dict[str, Array]
    stiffness_Nm_per_rad: Array
    forward_teeth: Array
    backward_teeth: Array
    friction_half_width_rad: Array

    @property
    def engaged_teeth(self) -> Array:
        """Teeth of one lobe that carry the torque."""
        return np.where(
            self.torque_Nm > 0,
            self.forward_teeth,
            np.where(
                self.torque_Nm < 0,
                self.backward_teeth,
                np.maximum(self.forward_teeth, self.backward_teeth),
            ),
        )


ADVICE = ("free_assembly",)
"""Checks that are recommendations: they do not decide whether a design is feasible."""


@dataclass(frozen=True)
class Check:
    """One check of a design; it passes when the margin is not negative.

    Attributes
    ----------
    meaning : str
        What is checked, by which rule, and what is idealised.
    """

    name: str
    unit: str
    value: float
    limit: float
    margin: float
    meaning: str = ""

    def shown(self) -> tuple[str, float, float, float]:
        """Unit for display, and value, limit and margin in it: angles in arc minutes."""
        unit, scale = ("arcmin", ARCMIN) if self.unit == "rad" else (self.unit.strip("-"), 1.0)
        return unit, self.value / scale, self.limit / scale, self.margin / scale


def check_meanings() -> dict[str, str]:
    """Describe each check, by its name."""
    c = core()
    rows = [
        (c.lib.lm_check_name(i), c.lib.lm_check_meaning(i)) for i in range(c.lib.LM_CHECK_COUNT)
    ]
    return {c.ffi.string(name).decode(): c.ffi.string(meaning).decode() for name, meaning in rows}


class DesignModel:
    """A design, ready to be evaluated. One object serves one thread at a time.

    Parameters
    ----------
    design : Design
        From ``read_drive(file).design``.
    bits : {64, 32}
        Precision of the library.

    Raises
    ------
    InputError
        When the library refuses a value of the design.
    """

    def __init__(self, design: Design, bits: Bits = 64) -> None:
        self.design = design
        self.core = core(bits)
        self.drive = structs.make_drive(design, bits)
        c = self.core
        self._workspace = c.ffi.new("lm_design_workspace *")
        nodes = c.lib.LM_NEUTRAL_LINE_NODES
        self._call(c.lib.lm_prepare_meshes, self.drive, nodes, self._workspace)

    def _call(self, function: Callable[..., int], *arguments: Any) -> None:
        """Call the library; errors refer to the design, except for arguments of the caller."""
        structs.call_for(self.design, self.core, function, *arguments)

    @property
    def sections(self) -> int:
        """Number of axial sections."""
        return int(self.drive.axial_sections)

    @property
    def rated_torque_Nm(self) -> float:
        """Rated torque."""
        return float(self.drive.rated_torque_Nm)

    def defaults(self) -> dict[str, Any]:
        """Default values of keys that the drive file does not state, by dotted key."""
        return structs.stated_defaults(self.design, self.drive)

    def clearances(
        self, phase_rad: float = 0.0, angles_rad: npt.ArrayLike | None = None
    ) -> Clearances:
        """Side clearances of every tooth of one lobe, or at stated angles.

        Parameters
        ----------
        phase_rad : float
            Tooth phase of the wave generator.
        angles_rad : array, optional
            Angles from the deformation axis at which a tooth is to be placed.
        """
        c = self.core
        rows, sections = [], []
        for section in range(self.sections):
            mesh = c.ffi.addressof(self._workspace.meshes[section])
            if angles_rad is None:
                capacity = c.lib.LM_LOBE_TEETH_MAX
                found = c.ffi.new("lm_clearance[]", capacity)
                count = c.ffi.new("int *")
                room = (found, capacity, count)
                self._call(c.lib.lm_lobe_clearances, mesh, phase_rad, *room)
                number = count[0]
            else:
                angles = np.atleast_1d(np.asarray(angles_rad, dtype=np.float64))
                number = angles.size
                found = c.ffi.new("lm_clearance[]", number)
                for i, angle in enumerate(angles):
                    found[i] = c.lib.lm_tooth_clearance(mesh, angle)
            rows.append(c.records(found, number).copy())
            sections.append(np.full(number, section))
        table = np.concatenate(rows)
        return Clearances(
            np.concatenate(sections),
            table["angle_rad"],
            table["forward"]["gap_rad"],
            table["backward"]["gap_rad"],
            table["forward"]["radius_mm"],
            table["backward"]["radius_mm"],
        )

    def torsion_curve(self, torque_Nm: npt.ArrayLike, phase_rad: float = 0.0) -> DesignCurve:
        """Deflection and contributions at rising torques.

        Raises
        ------
        InputError
            When the design's teeth cannot carry a torque.
        LibraryError
            When the torques do not rise.
        """
        c = self.core
        torque = c.array(np.atleast_1d(torque_Nm))
        pieces = np.array_split(torque, max(1, -(-torque.size // c.lib.LM_TORQUES_MAX)))
        table = np.concatenate([self._evaluate(piece, phase_rad) for piece in pieces])
        return DesignCurve(
            torque,
            table["total_rad"],
            {part: table[f"{part}_rad"] for part in PARTS},
            table["stiffness_Nm_per_rad"],
            table["forward_teeth"],
            table["backward_teeth"],
            table["friction_half_width_rad"],
        )

    def _evaluate(self, torque_Nm: Array, phase_rad: float, state: Any = None) -> Array:
        """Contributions for a number of torques that the library accepts in one call."""
        c = self.core
        torque = np.ascontiguousarray(torque_Nm)
        found = c.ffi.new("lm_contributions[]", max(1, torque.size))
        here = (self.drive, phase_rad, c.pointer(torque), torque.size)
        state = c.ffi.NULL if state is None else state
        self._call(c.lib.lm_evaluate_torsion_curve, *here, found, state, self._workspace)
        return c.records(found, torque.size).copy()

    def mesh_state(self, phase_rad: float = 0.0) -> dict[str, float]:
        """Return values that do not depend on the torque: free play, flank angle, radial gap ..."""
        state = self.core.ffi.new("lm_mesh_state *")
        self._evaluate(self.core.array([self.rated_torque_Nm]), phase_rad, state)
        return {name: getattr(state, name) for name in dir(state)}

    def reversal_lost_motion(
        self, torque_Nm: float, phase_rad: float = 0.0, gap_mm: float | None = None
    ) -> float:
        """Lost motion of a reversal at plus and minus a torque, in rad.

        Parameters
        ----------
        gap_mm : float, optional
            Radial gap to use instead of the mean of the drive and its tolerances.
        """
        c = self.core
        drive = self.drive
        if gap_mm is not None:
            drive = c.ffi.new("lm_drive *", self.drive[0])
            drive.tolerance_count = 0
            drive.gap.generator_mm, drive.gap.teeth_mm = 0.0, gap_mm
        one = c.ffi.new("lm_real *")
        where = (drive, phase_rad, torque_Nm, one, self._workspace)
        self._call(c.lib.lm_reversal_lost_motion, *where)
        return float(one[0])

    def checks(self) -> list[Check]:
        """Evaluate all checks with their margins.

        The grid is that of the certificate of a design, so that both agree to the last bit.
        """
        c = self.core
        fine = c.ffi.new("lm_design_workspace *")
        nodes, steps = c.lib.LM_CERTAIN_NODES, c.lib.LM_CERTAIN_STEPS
        smallest = c.ffi.new("lm_smallest_gap *")
        self._call(c.lib.lm_find_face_gap, self.drive, nodes, steps, fine.face, smallest)
        found = c.ffi.new("lm_check[]", c.lib.LM_CHECK_COUNT)
        load = self._rated_load(fine)
        where = (fine.face, c.lib.lm_face_places(self.drive))
        self._call(c.lib.lm_check_design, self.drive, *where, smallest, load, found)
        return [
            Check(
                c.ffi.string(c.lib.lm_check_name(i)).decode(),
                c.ffi.string(c.lib.lm_check_unit(i)).decode(),
                found[i].value,
                found[i].limit,
                found[i].margin,
                c.ffi.string(c.lib.lm_check_meaning(i)).decode(),
            )
            for i in range(c.lib.LM_CHECK_COUNT)
        ]

    def _rated_load(self, workspace: Any) -> Any:
        c = self.core
        load = c.ffi.new("lm_load *")
        phases = c.lib.LM_CERTAIN_PHASES
        self._call(c.lib.lm_find_rated_load, self.drive, phases, workspace, load)
        return load

    def section_share(self) -> float:
        """Largest share of one axial section of the checks in the load at rated torque."""
        return float(self._rated_load(self.core.ffi.new("lm_design_workspace *")).section_share)

    def tolerance_limits(self) -> dict[str, float]:
        """Limits of the radial gap in mm: worst case and probable.

        The nominal gaps of the drive are part of the chain.
        """
        c = self.core
        links, limits = self.tolerance_links(), c.ffi.new("lm_tolerance_limits *")
        result = {}
        self._call(c.lib.lm_worst_limits, links, len(links), limits)
        result["worst_min"], result["worst_max"] = limits.total_min_mm, limits.total_max_mm
        self._call(c.lib.lm_probable_limits, links, len(links), PROBABLE_T, limits)
        result["probable_min"], result["probable_max"] = limits.total_min_mm, limits.total_max_mm
        return result

    def tolerance_links(self) -> Any:
        """Make an array of the links of the chain: the tolerances, then the two nominal gaps."""
        drive = self.drive
        count = drive.tolerance_count
        links = self.core.ffi.new("lm_tolerance_link[]", count + 2)
        links[0:count] = list(drive.tolerances)[:count]
        for zone, gap in enumerate((drive.gap.generator_mm, drive.gap.teeth_mm)):
            nominal = links[count + zone]
            nominal.influence, nominal.zone = 1.0, zone
            nominal.lower_mm = nominal.upper_mm = gap
        return links

    def tolerance_budget(self) -> list[dict[str, Any]]:
        """List the tolerances, each with its share of the chain before a zone is clipped, in %.

        Shares are those of ``|A| tau`` for the worst case and of ``(A tau K)^2`` for the probable
        limits.
        """
        c, drive = self.core, self.drive
        entries = self.design.tolerances or ()
        worst, probable = c.zeros(len(entries)), c.zeros(len(entries))
        shares = (c.pointer(worst, write=True), c.pointer(probable, write=True))
        links = drive.tolerances
        self._call(c.lib.lm_tolerance_contributions, links, len(entries), *shares)
        return [
            {
                "name": entry.label,
                "zone": entry.get("zone"),
                "influence": float(links[i].influence),
                "lower_um": 1e3 * float(links[i].lower_mm),
                "upper_um": 1e3 * float(links[i].upper_mm),
                "worst_percent": float(worst[i]),
                "probable_percent": float(probable[i]),
            }
            for i, entry in enumerate(entries)
        ]

    def gap_angle(self, gap_mm: float) -> float:
        """Rotation in rad that closes a radial gap in one direction, equation (9)."""
        c = self.core
        state = self.mesh_state()
        one = c.ffi.new("lm_real *")
        where = (state["flank_angle_rad"], state["radius_mm"])
        self._call(c.lib.lm_radial_gap_angle, gap_mm, *where, one)
        return float(one[0])


def design_model(drive: Drive, bits: Bits = 64) -> DesignModel:
    """Make the design model of a drive that has a design.

    Raises
    ------
    InputError
        If the drive file has no [design].
    """
    if drive.design is None:
        raise InputError(drive.file, "design", "no such table", "[design]: this needs the geometry")
    return DesignModel(drive.design, bits)


def make_torsion_curve(drive: Drive, largest_torque_Nm: float) -> TorsionCurve:
    """Make the loss-free torsion curve of a drive for comparison with recordings.

    Parameters
    ----------
    drive : Drive
    largest_torque_Nm : float
        Largest torque of the recordings.
    """
    if drive.catalogue is not None:
        torque, angle = drive.catalogue.knots(largest_torque_Nm)
        return TorsionCurve(torque, angle)
    model = design_model(drive)
    reach = max(largest_torque_Nm, drive.rated_torque_Nm)
    torque = np.linspace(-reach, reach, TORSION_CURVE_TORQUES)
    torque[TORSION_CURVE_TORQUES // 2] = 0.0
    found = model.torsion_curve(torque)
    return TorsionCurve(torque, np.asarray(found.total_rad, dtype=np.float64))


def fit_values(drive: Drive, pattern: str) -> FloatArray:
    """Give the values of a row of a fit, one of `drives.NUMBERED`, in their order."""
    return np.array(numbered((drive.fit or {}).get("values", {}), pattern))


def fitted_torsion_curve(drive: Drive, reach_Nm: float) -> TorsionCurve | None:
    """Make the loss-free torsion curve of a fit; None if the file has none.

    Parameters
    ----------
    drive : Drive
        Its fit has knots, and the slope of the segment that ends at each.
    reach_Nm : float
        Torque up to which it is needed.
    """
    knots = fit_values(drive, KNOT)
    slopes = fit_values(drive, SLOPE)
    if knots.size == 0 or slopes.size != knots.size + 1:
        return None
    ends = np.append(knots, max(reach_Nm, 1.1 * knots[-1]))
    rise = np.cumsum(slopes * np.diff(ends, prepend=0.0))
    return TorsionCurve(
        np.concatenate((-ends[::-1], [0.0], ends)),
        np.concatenate((-rise[::-1], [0.0], rise)),
    )


def secant_stiffness(drive: Drive, torque_Nm: float | None = None) -> float:
    """Stiffness between a torque and the rated torque: the objective ``stiffness`` of a search.

    Parameters
    ----------
    torque_Nm : float, optional
        By default that of the reversal.

    Returns
    -------
    float
        In N m/rad, at tooth phase 0. It is continuous in the dimensions of a design, while the
        tangent of the torsion curve jumps when another pair of teeth touches.
    """
    rated, low = drive.rated_torque_Nm, reversal_torque(drive) if torque_Nm is None else torque_Nm
    if drive.catalogue is not None:
        turned = drive.catalogue.angle([low, rated])
    else:
        turned = design_model(drive).torsion_curve([low, rated]).total_rad
    return float((rated - low) / (turned[1] - turned[0]))


def reversal_torque(drive: Drive) -> float:
    """Torque at which manufacturers state lost motion: 4 % of the rated torque."""
    return REVERSAL_TORQUE_SHARE * drive.rated_torque_Nm
