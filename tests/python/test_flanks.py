"""Double arcs and conjugate flanks against polygons that share no formula with the library.

The rigid flank is swept by the tooth itself (tests/brute_force/arcs.py), then both are turned until
they touch, as in test_clearances_against_polygons.py. Limit: 0.005 arcmin in float64, 0.01 arcmin
more in float32. CI tests a few drives, among them those that once failed; `./dev check` sets
`LM_FLANK_DRIVES` to 200, 50 of each wave generator and each kind of flank.
"""

from __future__ import annotations

import copy
import dataclasses
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq

from conftest import NO_SEARCH
from lostmotion import design
from lostmotion.drawing.measures import drawing_table
from lostmotion.drives import parse_drive, read_drive
from lostmotion.errors import InputError
from lostmotion.model import DesignModel
from lostmotion.report.gear_profiles import gear_profiles

sys.path.insert(0, str(Path(__file__).parents[1]))
from brute_force import arcs, polygons

ARCMIN = math.pi / 180 / 60
BAR_ARCMIN = 0.005
BAR_FLOAT32_ARCMIN = 0.01
BAR_MODULES = 1e-6
"""Error of a conjugate flank relative to the swept one."""
BAR_SPLINE_MODULES = 2e-5
"""Error of the cubics of a table relative to a spline through 60 to 120 points, which may round an
edge: 1.3e-5 found, 3 nm with a module of 0.25 mm."""
BAR_RACK_MODULES = 5e-5
"""Residual of 0.04 modules after two steps of extrapolation: 2e-5 found."""
BAR_DENSE_RAD = 1e-10
"""Error of the least of 20 001 points: 3e-12 found."""
DRIVES = int(os.environ.get("LM_FLANK_DRIVES", "0"))
SEEDS = range(DRIVES) if DRIVES else (0, 1, 2, 43, 126, 159)
"""By default a cam, an ellipse, discs; two minima beside a joint of the flank; a zone of contact
that moves fast; one between two nodes of the table."""
GENERATORS = ("cosine", "discs", "rollers", "ellipse")


def drawn_document(rng: np.random.Generator, kind: str) -> dict[str, Any]:
    """Draw a double arc near those of the literature, with its conjugate."""
    ring = kind == "ring"
    module = float(rng.choice([0.16, 0.25, 0.4, 0.5, 1.0]))
    teeth = int(2 * rng.integers(40, 121))
    rho_a, x_a = rng.uniform(0.9, 2.0), rng.uniform(0.0, 0.5)
    beta = {"discs": rng.uniform(20, 40), "rollers": rng.uniform(15, 33)}
    beta["ring"] = beta["discs"]
    drawn: dict[str, Any] = {
        "teeth": {
            "module_mm": module,
            "flexspline_teeth": teeth,
            "rigid_teeth": teeth - 2 if ring else teeth + 2,
            "deformation": "external" if ring else "internal",
            "flexspline_shift": rng.uniform(-0.1, 0.4),
            "rigid_shift": 0.0,
            "rack_addendum": 0.6,
            "root_clearance": rng.uniform(0.1, 0.25),
            "tooth_height": rng.uniform(1.2, 1.5),
            "engagement_depth": rng.uniform(0.8, 1.0),
            "face_width_mm": max(0.2 * teeth * module, 0.5),
            "flexspline_flank": "double_arc",
            "rigid_flank": "conjugate",
        },
        "generator": {
            "type": kind,
            "deflection_mm": rng.uniform(0.85, 1.15) * module,
            "contact_half_angle_deg": float(beta.get(kind, 0.0)),
        },
        "flexspline": {"rim_thickness_mm": rng.uniform(0.009, 0.016) * module * teeth},
        "flank": {
            "rho_a": rho_a,
            "X_a": x_a,
            "l_a": math.sqrt(rho_a**2 - x_a**2) - rng.uniform(0.55, 0.72),
            "rho_f": rng.uniform(1.0, 2.0),
            "delta_L_deg": rng.uniform(8, 20),
            "h_l": rng.uniform(0.05, 0.35),
            "backlash_mm": float(rng.choice([0.0, 0.004])) * module,
        },
    }
    return {
        "drive": {"name": "random", "ratio": teeth // 2, "rated_torque_Nm": 10.0},
        "design": drawn,
    }


def with_s_teeth(rng: np.random.Generator, document: dict[str, Any]) -> dict[str, Any]:
    """Draw S teeth in place of the arcs."""
    design = document["design"]
    design["teeth"]["flexspline_flank"] = "s_tooth"
    design["flank"] = {
        "kappa": rng.uniform(0.75, 0.995),
        "X_M": rng.uniform(-0.15, 0.1),
        "s_M": rng.uniform(1.3, 1.6),
        "backlash_mm": design["flank"]["backlash_mm"],
    }
    return document


def with_points(rng: np.random.Generator, document: dict[str, Any]) -> dict[str, Any]:
    """Replace the arcs by a spline through points beside them, from below the root at the edges of
    the face to above the tip."""
    teeth, flank = document["design"]["teeth"], document["design"]["flank"]
    m = teeth["module_mm"]
    drawn = drawn_arcs(document)
    ends = {"inner_mm": drawn.inner_mm - 0.35 * m, "outer_mm": drawn.outer_mm + 0.01 * m}
    line = arcs.upper_flank(dataclasses.replace(drawn, **ends), 30_000)
    height = np.linspace(line.real[0], line.real[-1], int(rng.integers(40, 130)))
    wave = np.sin(rng.uniform(0, 2 * math.pi) + rng.uniform(1, 4) * (height - drawn.inner_mm) / m)
    x = np.interp(height, line.real, line.imag) + 0.005 * m * wave
    y = np.abs(height) - teeth["flexspline_shift"] * m
    teeth["flexspline_flank"] = "points"
    document["design"]["flank"] = {
        "points": [[float(a), float(b)] for a, b in zip(x, y, strict=True)],
        "backlash_mm": flank["backlash_mm"],
    }
    return document


def with_rigid_points(rng: np.random.Generator, document: dict[str, Any]) -> dict[str, Any]:
    """Replace the conjugate by a spline through points beside it, and displace its tool."""
    teeth, flank = document["design"]["teeth"], document["design"]["flank"]
    m = teeth["module_mm"]
    flank.pop("backlash_mm")
    brute = brute_design(document)
    sense = 1.0 if brute.is_internal else -1.0
    tip = rigid_tip_mm(brute) - sense * 0.05 * m
    line = arcs.swept_flank(brute, drawn_flank(document, 2 * polygons.FLANK_POINTS), tip)
    made = line[:-1] if brute.is_internal else line[:0:-1]  # without the land, from the tip
    made = made[np.unique(np.linspace(0, len(made) - 1, int(rng.integers(60, 120))).astype(int))]
    made = np.append(made, made[-1] + 0.01 * m * (made[-1] - made[-2]) / abs(made[-1] - made[-2]))
    made = made if brute.is_internal else made[::-1]
    wave = np.sin(rng.uniform(0, 2 * math.pi) + rng.uniform(1, 4) * (made.real - tip) / m)
    x = made.imag + m * sense * (0.004 + 0.004 * wave)
    teeth.update(rigid_flank="points", rigid_shift=float(rng.uniform(0, 0.04)) * sense)
    flank["rigid_points"] = [[float(a), float(b)] for a, b in zip(x, made.real, strict=True)]
    return document


def rigid_tip_mm(brute: polygons.Design) -> float:
    """Tip radius of the rigid gear."""
    size = polygons.radii(brute)
    return size.rigid_inner_mm if brute.is_internal else size.rigid_outer_mm


def random_document(seed: int, flank: str = "double_arc", generator: str = "") -> dict[str, Any]:
    """Return the first drawn drive whose flanks make a tooth."""
    rng = np.random.default_rng(seed)
    for _ in range(40):
        document = drawn_document(rng, generator or GENERATORS[seed % len(GENERATORS)])
        if flank == "s_tooth":
            document = with_s_teeth(rng, document)
        elif flank == "points":
            document = with_points(rng, document)
        elif flank == "rigid_points":
            document = with_rigid_points(rng, document)
        try:
            DesignModel(parse_drive(document).design)
        except InputError:
            continue
        return document
    pytest.fail(f"seed {seed} drew no tooth")


def brute_design(document: dict[str, Any]) -> polygons.Design:
    """Return the same motion for the polygons."""
    t, g = document["design"]["teeth"], document["design"]["generator"]
    cut = polygons.ADDENDUM_MODULES - t["rack_addendum"]
    return polygons.Design(
        deformation=t.get("deformation", "internal"),
        module_mm=t["module_mm"],
        flexspline_teeth=t["flexspline_teeth"],
        rigid_teeth=t["rigid_teeth"],
        pressure_angle_deg=20.0,
        flexspline_shift=t["flexspline_shift"] + cut,
        rigid_shift=t["rigid_shift"] + cut,
        tooth_height=t["tooth_height"],
        engagement_depth=t["engagement_depth"],
        root_clearance=t["root_clearance"],
        rim_thickness_mm=document["design"]["flexspline"]["rim_thickness_mm"],
        generator_type=g["type"],
        deflection_mm=g["deflection_mm"],
        contact_half_angle_deg=g["contact_half_angle_deg"],
    )


def drawn_ends(document: dict[str, Any]) -> tuple[float, float, float]:
    """Reference circle, root and tip [mm]. Those of an internal gear are negative, so that they
    rise from root to tip, too."""
    t = document["design"]["teeth"]
    reference = t["module_mm"] * (t["flexspline_teeth"] / 2 + t["flexspline_shift"])
    brute = brute_design(document)
    size = polygons.radii(brute)
    if brute.is_internal:
        return reference, size.flexspline_inner_mm, size.flexspline_outer_mm
    return -reference, -size.flexspline_outer_mm, -size.flexspline_inner_mm


def drawn_arcs(document: dict[str, Any]) -> arcs.Arcs:
    """Draw the arcs of a document: the concave one depends on the end of the tangent."""
    t, f = document["design"]["teeth"], document["design"]["flank"]
    m = t["module_mm"]
    reference, root, tip = drawn_ends(document)
    convex = complex(reference - f["X_a"] * m, -f["l_a"] * m)
    if "delta_L_deg" in f:
        angle = math.radians(f["delta_L_deg"])
        normal = complex(math.sin(angle), math.cos(angle))
        down = complex(-math.cos(angle), math.sin(angle))
        concave = (
            convex + (f["rho_a"] + f["rho_f"]) * m * normal + f["h_l"] * m / math.cos(angle) * down
        )
    else:
        concave = complex(reference + f["X_f"] * m, (math.pi / 2 + f["l_f"]) * m)
    return arcs.Arcs(f["rho_a"] * m, convex, f["rho_f"] * m, concave, root, tip)


def beside_space(document: dict[str, Any], tooth: np.ndarray) -> np.ndarray:
    """Turn the flank of an internal tooth by half a pitch: the flank of the space beside it."""
    half_pitch = math.pi / document["design"]["teeth"]["flexspline_teeth"]
    return np.conj(tooth) * np.exp(1j * half_pitch)


def drawn_flank(document: dict[str, Any], points: int = polygons.FLANK_POINTS) -> np.ndarray:
    """Draw the upper flank of what moves from root to tip: the tooth of the flexspline, or the
    space of an internal gear."""
    t, f = document["design"]["teeth"], document["design"]["flank"]
    m = t["module_mm"]
    reference, root, tip = drawn_ends(document)
    if t["flexspline_flank"] == "points":
        y, x = np.array(sorted([b, a] for a, b in f["points"])).T
        height = np.linspace(root, tip, points)
        shifted = np.abs(height) - t["flexspline_shift"] * m
        tooth = height + 1j * make_interp_spline(y, x, k=3)(shifted)
    elif t["flexspline_flank"] == "s_tooth":
        datum = complex(reference + f["X_M"] * m, f["s_M"] * m / 2)
        tooth = arcs.upper_s_flank(arcs.STooth(f["kappa"], m, datum, root, tip), points)
    else:
        tooth = arcs.upper_flank(drawn_arcs(document), points)
    if brute_design(document).is_internal:
        return tooth
    return beside_space(document, np.abs(tooth.real) + 1j * tooth.imag)


def swept_flank(document: dict[str, Any]) -> np.ndarray:
    """Sweep the rigid flank with a tool of 16 times the usual points, whose chords are within 1e-7
    modules of it."""
    brute = brute_design(document)
    tool = drawn_flank(document, 16 * polygons.FLANK_POINTS)
    rigid = arcs.swept_flank(brute, tool, rigid_tip_mm(brute))
    wider = document["design"]["flank"].get("backlash_mm", 0.0)
    wider = wider if brute.is_internal else -wider
    return rigid * np.exp(1j * wider / np.abs(rigid))


def splined_flank(document: dict[str, Any]) -> np.ndarray:
    """Draw the rigid flank through its points, and a point on the land beyond them."""
    brute = brute_design(document)
    m, flank = brute.module_mm, document["design"]["flank"]
    x, y = np.array(flank["rigid_points"]).T
    spline, shift = make_interp_spline(y, x, k=3), document["design"]["teeth"]["rigid_shift"] * m
    height = np.linspace(y[0], y[-1], 8 * polygons.FLANK_POINTS)
    line = height + shift + 1j * spline(height)
    tip = rigid_tip_mm(brute)
    share = np.interp(tip, np.abs(line), np.arange(len(line)))
    corner = tip * np.exp(1j * np.interp(share, np.arange(len(line)), np.angle(line)))
    if brute.is_internal:
        made = np.append(corner, line[np.abs(line) > tip])
        return np.append(made, made[-1] * (1 + 0.1 * m / abs(made[-1])))
    made = np.append(line[np.abs(line) < tip], corner)
    return np.append(made[0] * (1 - 0.1 * m / abs(made[0])), made)


def table_error_modules(document: dict[str, Any], swept: np.ndarray) -> float:
    """Largest distance of the conjugate flank from the swept one, along the circumference."""
    model, mesh = made_mesh(document)
    made = swept[:-1] if brute_design(document).is_internal else swept[1:]  # without the land
    radii, angles = np.abs(made), np.angle(made)
    found = [model.core.lib.lm_rigid_flank_at(mesh, float(r)).half_angle_rad for r in radii]
    worst = float(np.max(np.abs(np.array(found) - angles) * radii))
    return worst / float(document["design"]["teeth"]["module_mm"])


def largest_error_arcmin(document: dict[str, Any], angles_deg: np.ndarray) -> float:
    brute, tooth = brute_design(document), drawn_flank(document)
    if not brute.is_internal:
        tooth = tooth[::-1]  # from the inner end
    stated = document["design"]["teeth"]["rigid_flank"] == "points"
    rigid = splined_flank(document) if stated else swept_flank(document)
    assert table_error_modules(document, rigid) < (BAR_SPLINE_MODULES if stated else BAR_MODULES)
    model = DesignModel(parse_drive(document).design)
    single = DesignModel(parse_drive(document).design, 32)
    found = model.clearances(angles_rad=np.radians(angles_deg))
    rough = single.clearances(angles_rad=np.radians(angles_deg))
    worst = 0.0
    for flank in ("forward", "backward"):
        gaps = getattr(found, f"{flank}_rad")
        for i, angle in enumerate(angles_deg):
            turned = polygons.turned_contact(brute, tooth, rigid, float(angle), flank)
            assert (turned is not None) == math.isfinite(gaps[i]), (angle, flank)
            if turned is not None:
                worst = max(worst, abs(float(gaps[i]) - turned.gap_rad) / ARCMIN)
        both = np.isfinite(gaps) & np.isfinite(getattr(rough, f"{flank}_rad"))
        difference = np.abs(getattr(rough, f"{flank}_rad")[both] - gaps[both]) / ARCMIN
        assert np.all(difference < BAR_FLOAT32_ARCMIN)
    return worst


@pytest.mark.parametrize("seed", SEEDS)
def test_double_arcs_agree_with_swept_and_turned_polygons(seed: int) -> None:
    angles = np.random.default_rng(20_000 + seed).uniform(-20, 50, 6)
    assert largest_error_arcmin(random_document(seed), angles) < BAR_ARCMIN


@pytest.mark.parametrize("seed", range(DRIVES) if DRIVES else (0, 96))
def test_s_teeth_agree_with_swept_and_turned_polygons(seed: int) -> None:
    angles = np.random.default_rng(30_000 + seed).uniform(-20, 50, 6)
    assert largest_error_arcmin(random_document(seed, "s_tooth"), angles) < BAR_ARCMIN


@pytest.mark.parametrize("seed", range(DRIVES // 4) if DRIVES else (0,))
@pytest.mark.parametrize("generator", [*GENERATORS, "ring"] if DRIVES else ["discs", "ring"])
@pytest.mark.parametrize("flank", ["points", "rigid_points"])
def test_points_agree_with_swept_and_turned_polygons(flank: str, generator: str, seed: int) -> None:
    """Points beside random arcs with their conjugate, and points beside a conjugate."""
    angles = np.random.default_rng(50_000 + seed).uniform(-20, 50, 6)
    assert largest_error_arcmin(random_document(seed, flank, generator), angles) < BAR_ARCMIN


@pytest.mark.parametrize("seed", range(DRIVES // 4) if DRIVES else (0,))
@pytest.mark.parametrize("flank", ["double_arc", "s_tooth"])
def test_the_teeth_of_a_ring_agree_with_swept_and_turned_polygons(flank: str, seed: int) -> None:
    """The spaces of the flexspline move, and leave the external teeth of the rigid gear."""
    angles = np.random.default_rng(40_000 + seed).uniform(-20, 50, 6)
    assert largest_error_arcmin(random_document(seed, flank, "ring"), angles) < BAR_ARCMIN


@pytest.mark.parametrize(
    ("flank", "seed", "generator"),
    [
        ("double_arc", 17, ""),
        ("double_arc", 28, ""),
        ("double_arc", 37, ""),
        ("double_arc", 93, ""),
        ("s_tooth", 23, ""),
        ("s_tooth", 148, ""),
        ("s_tooth", 165, ""),
        ("s_tooth", 17, "ring"),
        ("s_tooth", 28, "ring"),
    ],
)
def test_conjugate_flanks_are_the_swept_ones_where_zones_and_pieces_change(
    flank: str, seed: int, generator: str
) -> None:
    """A zone that is the greatest only between two nodes, two maxima close together, a jump of the
    curvature within one piece, a part between two corners, and corners with equal slopes on both
    sides. With a ring: a piece between two zones, and a joint that is no maximum."""
    document = random_document(seed, flank, generator)
    assert table_error_modules(document, swept_flank(document)) < BAR_MODULES


def densest_gap_rad(document: dict[str, Any], angle_rad: float, flank: str) -> float:
    """Least gap of 20 001 points of the flank against the rigid one, without any search."""
    model, mesh = made_mesh(document)
    core, sense, c_flank = model.core.lib, mesh.line.sense, model.core.ffi.addressof(mesh, "flank")
    place = core.lm_place_tooth(model.core.ffi.addressof(mesh, "line"), angle_rad)
    lead = place.lead_rad + angle_rad * mesh.geometry.lead_per_angle
    side = sense if flank == "forward" else -sense
    least = math.inf
    for parameter in np.linspace(mesh.flank.low_mm, mesh.flank.high_mm, 20_001):
        foot = core.lm_evaluate_flank(c_flank, float(parameter))
        x = side * foot.across_mm
        along = place.radius_mm + foot.along_mm * place.tilt_cos - x * place.tilt_sin
        across = foot.along_mm * place.tilt_sin + x * place.tilt_cos
        radius = math.hypot(along, across)
        if mesh.polar_low_mm < radius < mesh.polar_high_mm:
            half = core.lm_rigid_flank_at(mesh, radius).half_angle_rad
            least = min(least, sense * (half - side * (math.atan2(across, along) + lead)))
    return least


@pytest.mark.parametrize(
    ("flank", "angle_rad"), [("points", -0.15642610), ("rigid_points", -0.03490659)]
)
def test_no_nearer_point_is_omitted_beside_a_corner_of_the_rigid_flank(
    flank: str, angle_rad: float
) -> None:
    """The gap falls faster beside the corner than at the samples around it."""
    document = random_document(4, flank, "ring")
    dense = densest_gap_rad(document, angle_rad, "backward")
    found = DesignModel(parse_drive(document).design).clearances(angles_rad=np.array([angle_rad]))
    assert abs(float(found.backward_rad[0]) - dense) < BAR_DENSE_RAD


@pytest.mark.parametrize(("flank", "seed"), [("double_arc", 64), ("s_tooth", 75)])
def test_a_point_beyond_the_tip_makes_no_flank_in_float32_either(flank: str, seed: int) -> None:
    """A search that ended where the tip does not reach the radius was continued along its tangent,
    with an error of up to 0.09 arcmin."""
    document = random_document(seed, flank)
    (wide, found), (narrow, rough) = made_mesh(document), made_mesh(document, 32)
    for radius in np.linspace(found.conjugate.low_mm, found.conjugate.land_mm, 99)[1:-1]:
        exact = wide.core.lib.lm_rigid_flank_at(found, float(radius)).half_angle_rad
        single = narrow.core.lib.lm_rigid_flank_at(rough, float(radius)).half_angle_rad
        assert abs(single - exact) < 0.002 * ARCMIN


def s_document(**flank: Any) -> dict[str, Any]:
    document = published_document()
    document["design"]["teeth"]["flexspline_flank"] = "s_tooth"
    document["design"]["flank"] = {"kappa": 0.9, "s_M": 1.5, **flank}
    return document


def pointed_document(points: list[list[float]] | None, **flank: Any) -> dict[str, Any]:
    document = published_document()
    document["design"]["teeth"]["flexspline_flank"] = "points"
    document["design"]["flank"] = flank if points is None else {"points": points, **flank}
    return document


def points_of_the_published_arcs() -> list[list[float]]:
    model, mesh = made_mesh(published_document())
    flank = model.core.ffi.addressof(mesh, "flank")
    heights = np.linspace(flank.low_mm, flank.high_mm, 101)
    return [[model.core.lib.lm_evaluate_flank(flank, y).across_mm, float(y)] for y in heights]


def test_points_of_arcs_have_the_clearances_of_the_arcs(tmp_path: Path) -> None:
    arcs_rad = DesignModel(parse_drive(published_document()).design).clearances().forward_rad
    points = points_of_the_published_arcs()
    rows = "\n".join(f"{x!r},{y!r}" for x, y in reversed(points))
    (tmp_path / "tooth.csv").write_text(f"x_mm,y_mm\n{rows}\n")
    vertices = "".join(f"  0\nVERTEX\n 10\n{x!r}\n 20\n{y!r}\n" for x, y in points)
    (tmp_path / "tooth.dxf").write_text(f"  0\nSECTION\n  0\nPOLYLINE\n{vertices}  0\nSEQEND\n")
    for document in (
        pointed_document(points),
        pointed_document(None, points_file="tooth.csv"),
        pointed_document(None, points_file="tooth.dxf"),
    ):
        model = DesignModel(parse_drive(document, str(tmp_path / "drive.toml")).design)
        found = model.clearances().forward_rad
        assert np.array_equal(np.isfinite(found), np.isfinite(arcs_rad))
        met = np.isfinite(found)
        # a spline is smooth where the arcs' curvature jumps
        assert np.allclose(found[met], arcs_rad[met], rtol=0, atol=5e-4 * ARCMIN)
        assert model.torsion_curve([-5.0, 5.0]) is not None


def space_of(document: dict[str, Any]) -> list[list[float]]:
    """Points of the circular spline that arcs generate, from below its tip to its land."""
    model, mesh = made_mesh(document)
    table = mesh.conjugate
    radii = np.linspace(table.low_mm - 0.02, table.land_mm, 129)
    half = [model.core.lib.lm_rigid_flank_at(mesh, float(r)).half_angle_rad for r in radii]
    return [[r * math.sin(a), r * math.cos(a)] for r, a in zip(radii.tolist(), half, strict=True)]


def spaced_document(own: str, **flank: Any) -> dict[str, Any]:
    """The published joint with a circular spline of points."""
    document = published_document()
    document["design"]["teeth"].update(flexspline_flank=own, rigid_flank="points")
    document["design"]["flank"] = {
        "rigid_points": space_of(published_document()),
        **flank,
    }
    return document


def test_a_circular_spline_of_points_has_the_clearances_of_the_generated_one() -> None:
    generated = DesignModel(parse_drive(published_document()).design).clearances().forward_rad
    stated = spaced_document("double_arc", **PUBLISHED)
    found = DesignModel(parse_drive(stated).design).clearances().forward_rad
    met = np.isfinite(generated)
    assert np.array_equal(met, np.isfinite(found))
    assert np.allclose(found[met], generated[met], rtol=0, atol=1e-3 * ARCMIN)


def test_a_circular_spline_generates_the_flexspline_that_generated_it() -> None:
    """Within 1e-6 modules where the two are conjugate, a few points away from the land at the tip;
    below, where its tip cuts, it leaves less. It is what a swept polygon leaves."""
    document = spaced_document("conjugate")
    model, mesh = made_mesh(document)
    lib, flank = model.core.lib, model.core.ffi.addressof(mesh, "flank")
    arcs_model, arcs_mesh = made_mesh(published_document())
    arcs_flank = arcs_model.core.ffi.addressof(arcs_mesh, "flank")
    heights = np.linspace(flank.low_mm, flank.high_mm, 129)  # its points
    heights = heights[(heights > 24.81) & (heights < 25.25)]
    found = np.array([lib.lm_evaluate_flank(flank, y).across_mm for y in heights])
    drawn = np.array([lib.lm_evaluate_flank(arcs_flank, y).across_mm for y in heights])
    missed = np.abs(found - drawn) / 0.5
    # a spline rounds the corner between the two conjugate zones of the circular spline
    assert np.quantile(missed, 0.9) < 1e-6
    assert np.max(missed) < 1e-5
    lower = np.linspace(24.64, 24.77, 9)
    assert all(
        lib.lm_evaluate_flank(flank, y).across_mm < lib.lm_evaluate_flank(arcs_flank, y).across_mm
        for y in lower
    )
    table = mesh.conjugate
    brute, neutral = brute_design(published_document()), mesh.geometry.neutral_mm
    share = np.linspace(1.0, 0.0, 4 * polygons.FLANK_POINTS)
    radii = table.low_mm + (table.land_mm - table.low_mm) * (1 - share**2)
    half = [lib.lm_rigid_flank_at(mesh, float(r)).half_angle_rad for r in radii]
    space = np.append(radii, radii[-1] + 0.2) * np.exp(1j * np.append(half, half[-1]))
    swept = arcs.swept_tooth(brute, space, heights - neutral)
    assert np.max(np.abs(found - swept)) < BAR_MODULES * 0.5


def test_a_circular_spline_generates_the_flexspline_at_the_shifts_of_both() -> None:
    """The tool of the circular spline is displaced by what its points lack. On the deformation axis
    the corner of its tip cuts deeper than the arcs."""
    document = published_document()
    document["design"]["teeth"]["flexspline_shift"] = 0.2
    arcs_drive = DesignModel(parse_drive(document).design).clearances()
    lower = [[x, y - 0.05] for x, y in space_of(document)]
    document = spaced_document("conjugate", rigid_points=lower)
    document["design"]["teeth"].update(flexspline_shift=0.2, rigid_shift=0.1)
    found = DesignModel(parse_drive(document).design).clearances().forward_rad
    met = np.isfinite(arcs_drive.forward_rad)
    assert np.array_equal(met, np.isfinite(found))
    met &= np.abs(arcs_drive.angle_rad) > math.radians(5)
    assert np.allclose(found[met], arcs_drive.forward_rad[met], rtol=0, atol=1e-3 * ARCMIN)


def test_a_circular_spline_of_points_that_makes_no_mesh_is_refused() -> None:
    points = space_of(published_document())
    for document, said in (
        (
            spaced_document("conjugate", rigid_points=points[:90]),
            "rigid_points and design.teeth",
        ),
        (
            spaced_document("conjugate", rigid_points=points[20:]),
            "rigid_points and design.teeth",
        ),
        (
            spaced_document("conjugate", rigid_points=moved(points, 9, 0.9, points[9][1])),
            "pitch",
        ),
        (spaced_document("conjugate", rigid_points_file="space.csv"), "one of them"),
    ):
        with pytest.raises(InputError, match=said):
            DesignModel(parse_drive(document).design)
    without = published_document()
    without["design"]["teeth"]["flexspline_flank"] = "conjugate"
    with pytest.raises(InputError, match="rigid_flank = 'points'"):
        DesignModel(parse_drive(without).design)


def moved(points: list[list[float]], index: int, x: float, y: float) -> list[list[float]]:
    return [*points[:index], [x, y], *points[index + 1 :]]


def test_points_that_make_no_flank_are_refused() -> None:
    points = points_of_the_published_arcs()
    for document, said in (
        (pointed_document(points[:3]), "4 or more"),
        (pointed_document(points[10:]), "design.teeth.root_clearance"),
        (pointed_document(points[:-10]), "design.teeth.tooth_height"),
        (pointed_document(moved(points, 50, *points[49])), "y only rises"),
        (pointed_document(moved(points, 50, -0.1, points[50][1])), "half a thickness"),
        (pointed_document(points, points_file="tooth.csv"), "one of them"),
        (pointed_document(None), "points_file"),
        (s_document(points=points), "flexspline_flank = 'points'"),
    ):
        with pytest.raises(InputError, match=said):
            DesignModel(parse_drive(document).design)


@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        ({"kappa": 0.7}, "flank.kappa and design.teeth.root_clearance"),
        ({"kappa": 0.6, "X_M": -0.4}, "flank.kappa and design.teeth.tooth_height"),
        ({"s_M": 0.5, "X_M": -0.3}, "flank.s_M and design.teeth.tooth_height"),
        ({"s_M": 2.4}, "flank.s_M and design.teeth.root_clearance"),
    ],
)
def test_s_teeth_that_make_no_flank_are_refused_by_both_keys(
    changes: dict[str, float], keys: str
) -> None:
    with pytest.raises(InputError) as refusal:
        DesignModel(parse_drive(s_document(**changes)).design)
    assert keys in str(refusal.value)


def beside_the_rack_modules(teeth: int, kappa: float) -> np.ndarray:
    """Space of a generated circular spline minus that of the published rack, at the same depths."""
    document = s_document(kappa=kappa, s_M=1.5)
    design = document["design"]
    module = design["teeth"]["module_mm"]
    design["teeth"].update(
        flexspline_teeth=teeth,
        rigid_teeth=teeth + 2,
        face_width_mm=0.2 * module * teeth,
    )
    document["drive"]["ratio"] = teeth // 2
    design["generator"]["deflection_mm"] = kappa * module
    lib, mesh = (made := made_mesh(document))[0].core.lib, made[1]
    angle = np.linspace(1.1, 1.5, 7)  # beyond the tangent, short of the tip
    drawn = (angle - kappa * np.sin(angle)) / 4
    depth = kappa / 2 * (1 - np.cos(angle))
    radii = module * (teeth / 2 + kappa - depth)
    assert mesh.conjugate.low_mm < radii.min() < radii.max() < mesh.conjugate.land_mm
    half = [lib.lm_rigid_flank_at(mesh, float(r)).half_angle_rad * r / module for r in radii]
    return np.array(half) - (0.75 + drawn)


@pytest.mark.parametrize("kappa", [0.9, 0.95])
def test_s_teeth_generate_the_rack_that_their_inventor_published(kappa: float) -> None:
    """Ishikawa, EP 0 266 972 B1: half the movement locus touches its point reflection on the other
    gear, exactly so for racks. The generated flank approaches this as 1 / z: extrapolated from 80,
    160 and 320 teeth at the same rim."""
    few, more, most = (beside_the_rack_modules(teeth, kappa) for teeth in (80, 160, 320))
    once, twice = 2 * more - few, 2 * most - more
    assert np.all(np.abs(most) < 0.012)
    assert np.all(np.abs((4 * twice - once) / 3) < BAR_RACK_MODULES)


def test_the_published_ellipse_has_the_perimeter_of_the_neutral_line() -> None:
    """Yao et al., Actuators 2025, 14, 187, equation (8): minor semi-axis of an ellipse of the
    perimeter of a circle. A public re-implementation of the paper, of module 1.25 mm, 100 teeth and
    a deflection of one module, states twice the largest tilt of its teeth: 4.6 deg."""
    radius, deflection = 62.5, 1.25
    major = radius + deflection
    minor = (12 * radius - 7 * major + 4 * math.sqrt(major * (3 * radius - 2 * major))) / 9
    core = DesignModel(parse_drive(s_document()).design).core
    line = core.ffi.new("lm_neutral_line *")
    generator = core.ffi.new("lm_generator *", {"type": core.lib.LM_ELLIPSE})
    fault = core.fault()
    status = core.lib.lm_make_neutral_line(
        generator, core.lib.LM_INTERNAL, radius, deflection, 256, line, fault
    )
    core.check(status, fault)
    places = [core.lib.lm_place_tooth(line, angle) for angle in np.linspace(0, math.pi / 2, 91)]
    assert math.isclose(places[-1].radius_mm, minor, abs_tol=1e-6)
    tilt = max(abs(math.atan2(place.tilt_sin, place.tilt_cos)) for place in places)
    assert round(2 * math.degrees(tilt), 1) == 4.6


def contact_deg(teeth: int, kappa: float, angle: float) -> float:
    """Material angle at which the point `angle` of an S tooth touches in the second zone."""
    document = s_document(kappa=kappa, s_M=1.5)
    module = document["design"]["teeth"]["module_mm"]
    document["design"]["teeth"].update(
        flexspline_teeth=teeth,
        rigid_teeth=teeth + 2,
        face_width_mm=0.2 * module * teeth,
    )
    document["drive"]["ratio"] = teeth // 2
    document["design"]["generator"].update(type="ellipse", deflection_mm=kappa * module)
    model, mesh = made_mesh(document)
    c = model.core
    flank, geometry, line = (c.ffi.addressof(mesh, name) for name in ("flank", "geometry", "line"))
    contacts, count = c.ffi.new("lm_conjugate_contact[8]"), c.ffi.new("int *")
    height = flank.neutral_mm + flank.s.datum_mm + kappa * module / 2 * (1 - math.cos(angle))
    status = c.lib.lm_find_conjugate_contacts(
        flank, geometry, line, height, contacts, 8, count, c.ffi.NULL
    )
    assert status == c.lib.LM_OK
    return max(math.degrees(contact.angle_rad) for contact in list(contacts)[: count[0]])


@pytest.mark.parametrize("angle_deg", [70.0, 90.0])
def test_the_published_cycloid_touches_at_half_its_angle(angle_deg: float) -> None:
    """Yao et al., equations (11) and (12): half a cycloid, the S tooth of kappa = 1, is conjugate
    to its point reflection. Extrapolated from 80, 160 and 320 teeth as the published rack."""
    few, more, most = (contact_deg(z, 0.995, math.radians(angle_deg)) for z in (80, 160, 320))
    once, twice = 2 * more - few, 2 * most - more
    assert angle_deg / 2 - 5 < few < more < most < angle_deg / 2
    assert math.isclose((4 * twice - once) / 3, angle_deg / 2, abs_tol=0.05)


PUBLISHED = {
    # Liu et al., Machines 2025, 13, 535, section 3.5, over its module of 0.5 mm. Addendum and
    # dedendum are not printed there: 0.275 and 0.375 mm, as a public re-implementation takes them.
    "rho_a": 0.685 / 0.5,
    "l_a": 0.332 / 0.5,
    "X_a": 0.155 / 0.5,
    "rho_f": 0.785 / 0.5,
    "l_f": 0.330 / 0.5,
    "X_f": 0.134 / 0.5,
}


def published_document(**flank: Any) -> dict[str, Any]:
    return {
        "drive": {"name": "published", "ratio": 50, "rated_torque_Nm": 10.0},
        "design": {
            "teeth": {
                "module_mm": 0.5,
                "flexspline_teeth": 100,
                "rigid_teeth": 102,
                "flexspline_shift": 0.0,
                "rigid_shift": 0.0,
                "rack_addendum": 0.6,
                "root_clearance": 0.15,
                "tooth_height": 1.3,
                "engagement_depth": 1.0,
                "face_width_mm": 10.0,
                "flexspline_flank": "double_arc",
                "rigid_flank": "conjugate",
            },
            "generator": {
                "type": "cosine",
                "deflection_mm": 0.5,
                "contact_half_angle_deg": 0.0,
            },
            # s - t / 2 = 0.35 mm from root to neutral line: s = 0.01 m z, t = 0.6 s
            "flexspline": {"rim_thickness_mm": 0.7},
            "flank": {**PUBLISHED, **flank},
        },
    }


def made_mesh(document: dict[str, Any], bits: int = 64) -> tuple[DesignModel, Any]:
    model = DesignModel(parse_drive(document).design, bits)
    mesh = model.core.ffi.new("lm_mesh *")
    fault = model.core.fault()
    status = model.core.lib.lm_make_mesh(model.drive, 1.0, 256, mesh, fault)
    model.core.check(status, fault)
    return model, mesh


def test_the_published_arcs_have_the_tangent_of_their_own_formulas() -> None:
    """Formulas of the paper (and of theory/flanks.md): eps, sigma, delta, height of the tangent."""
    arc = made_mesh(published_document())[1].flank.arc
    across = math.pi * 0.5 / 2 + 0.330 + 0.332
    apart = math.hypot(across, 0.155 + 0.134)
    delta = math.acos((0.685 + 0.785) / apart) + math.atan2(0.155 + 0.134, across)
    assert math.isclose(arc.inclination_rad, delta, rel_tol=1e-12)
    assert math.isclose(arc.inclination_rad, math.radians(16.446), abs_tol=1e-5)
    height = apart * math.sin(math.acos((0.685 + 0.785) / apart)) * math.cos(delta)
    assert math.isclose(arc.upper_mm - arc.lower_mm, height, rel_tol=1e-12)


def test_a_stated_tangent_is_the_same_flank_as_its_centres() -> None:
    model, mesh = made_mesh(published_document())
    arc = mesh.flank.arc
    stated = published_document(
        delta_L_deg=math.degrees(arc.inclination_rad),
        h_l=(arc.upper_mm - arc.lower_mm) / 0.5,
    )
    other = DesignModel(parse_drive(stated).design).clearances().forward_rad
    assert np.allclose(model.clearances().forward_rad, other, rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", range(3))
def test_the_flank_has_the_tangent_and_curvature_of_its_points(kind: int) -> None:
    points = points_of_the_published_arcs()
    documents = (published_document(), s_document(), pointed_document(points))
    model, mesh = made_mesh(documents[kind])
    lib, flank = model.core.lib, model.core.ffi.addressof(mesh, "flank")
    for parameter in np.linspace(flank.low_mm + 0.003, flank.high_mm - 0.003, 11):
        before, at, after = (
            lib.lm_evaluate_flank(flank, parameter + step) for step in (-1e-4, 0.0, 1e-4)
        )
        slope = (after.across_mm - before.across_mm) / 2e-4
        bend = (after.across_mm - 2 * at.across_mm + before.across_mm) / 1e-8
        assert math.isclose(at.across_slope, slope, abs_tol=1e-6)
        curvature = -bend / (1 + slope**2) ** 1.5
        assert math.isclose(lib.lm_flank_curvature(flank, parameter), curvature, abs_tol=2e-5)


def made_outline(model: DesignModel, mesh: Any, rigid: bool) -> Any:
    outline = model.core.ffi.new("lm_tooth_outline *")
    model.core.lib.lm_make_tooth_outline(model.drive, mesh, int(rigid), outline)
    return outline


@pytest.mark.parametrize(
    "kind", ["arcs", "s_teeth", "points", "rigid_points", "full_fillet", "ring"]
)
def test_the_outline_that_bends_is_the_one_that_is_drawn(kind: str) -> None:
    """The drawing finds its fillet with a root finder, on the same flanks."""
    drawn = {
        "s_teeth": lambda: s_document(s_M=1.6),
        "points": lambda: pointed_document(points_of_the_published_arcs()),
        "rigid_points": lambda: spaced_document("double_arc", **PUBLISHED),
        "ring": ring_document,
    }
    document = drawn.get(kind, published_document)()
    if kind == "full_fillet":  # the rack's tip radius is too large for the width of the space
        document["design"]["teeth"].update(root_clearance=0.4, tooth_height=1.6)
    model, mesh = made_mesh(document)
    teeth, module = (
        document["design"]["teeth"],
        document["design"]["teeth"]["module_mm"],
    )
    rack_mm = teeth["root_clearance"] * module / (1 - math.sin(math.radians(20)))
    profiles = gear_profiles(model)
    smallest = min(profile.fillet_radius_mm for profile in profiles)
    assert (smallest < 0.9 * rack_mm) == (kind == "full_fillet")
    for profile in profiles:
        rigid = profile.name == "rigid"
        outline = made_outline(model, mesh, rigid)
        assert math.isclose(outline.fillet_mm, profile.fillet_radius_mm, rel_tol=1e-5)
        x, y = profile.half_pitch.T
        radius, angle = np.hypot(x, y), np.arctan2(x, y)
        height, across = y - profile.root_mm, x
        if rigid or profile.internal:  # along the radius and the circumference
            height = np.abs(radius - profile.root_mm)
            across = radius * (math.pi / profile.teeth - angle if profile.internal else angle)
        below_tip = np.abs(np.hypot(x, y) - profile.tip_mm) > 1e-4 * module
        places = np.flatnonzero((height > 1e-3 * module) & below_tip)
        found = [model.core.lib.lm_outline_half(outline, height[i]) for i in places]
        assert len(places) > 25
        assert np.allclose(found, across[places], rtol=0, atol=2e-6 * module)


def test_random_teeth_have_an_outline_from_root_to_tip() -> None:
    """The flank of an S tooth may end flatter at the root than its fillet."""
    for kind in ("double_arc", "s_tooth"):
        for seed in range(12):
            document = random_document(seed, kind)
            model, mesh = made_mesh(document)
            module = document["design"]["teeth"]["module_mm"]
            for rigid in (False, True):
                outline = made_outline(model, mesh, rigid)
                assert 0 <= outline.form_height_mm < 0.5 * module
                heights = np.linspace(0.01, 1.0, 40) * module
                half = [model.core.lib.lm_outline_half(outline, y) for y in heights]
                assert np.all(np.diff(half) < 1e-3 * module)
            assert model.torsion_curve([-5.0, 5.0]) is not None


def test_the_gear_table_states_no_measures_of_involutes_for_other_flanks() -> None:
    document = published_document()
    rows = {row.key: row for row in drawing_table(DesignModel(parse_drive(document).design))}
    for key in ("alpha", "d_b", "k", "W_k", "D_M", "M_d"):
        assert math.isnan(rows[key].flexspline), key
        assert math.isnan(rows[key].rigid), key
    assert rows["rho_f"].flexspline > 0


@pytest.mark.parametrize("rigid", [False, True])
def test_a_tooth_bends_and_is_stressed_as_its_sections_state(rigid: bool) -> None:
    """Equation (6) and the largest 6 M / (b s^2) over 4 000 sections of the outline."""
    model, mesh = made_mesh(published_document())
    outline = made_outline(model, mesh, rigid)
    c, load = model.core, 0.4
    fine = load * np.linspace(0.0, 1.0, 4_000) ** 2
    half = np.array([c.lib.lm_outline_half(outline, y) for y in fine])
    material = c.ffi.new("lm_tooth_material *", c.lib.lm_steel_tooth_material())
    finely, found = (c.ffi.new("lm_tooth_compliance *") for _ in range(2))
    c.check(
        c.lib.lm_tooth_profile_compliance(
            list(fine),
            list(half),
            len(fine),
            load,
            10.0,
            0.3,
            material,
            finely,
            c.ffi.NULL,
        )
    )
    share = outline.form_height_mm / load
    samples = [
        c.lib.lm_outline_half(outline, load * c.lib.lm_tooth_sample_height(i, share))
        for i in range(c.lib.LM_TOOTH_SAMPLES)
    ]
    status = c.lib.lm_tooth_outline_compliance(
        samples, share, load, 10.0, 0.3, material, found, c.ffi.NULL
    )
    assert status == c.lib.LM_OK
    assert math.isclose(found.total_mm_per_N, finely.total_mm_per_N, rel_tol=2e-4)
    largest = float(np.max((load - fine) / (2 * half) ** 2))
    leverage = c.lib.lm_outline_leverage(outline, load)
    assert 0.995 * largest < leverage <= largest * (1 + 1e-9)


def test_a_conjugate_flank_touches_over_its_zone() -> None:
    """Every envelope point that no other position crosses lies on the table, within 1e-6 modules;
    where a point meets it twice there are two zones."""
    model, mesh = made_mesh(published_document())
    c = model.core
    flank, conjugate = (
        c.ffi.addressof(mesh, "flank"),
        c.ffi.addressof(mesh, "conjugate"),
    )
    contacts, count = c.ffi.new("lm_conjugate_contact[8]"), c.ffi.new("int *")
    touched = twice = 0
    for parameter in np.linspace(flank.low_mm, flank.high_mm, 60):
        status = c.lib.lm_find_conjugate_contacts(
            flank,
            c.ffi.addressof(mesh, "geometry"),
            c.ffi.addressof(mesh, "line"),
            parameter,
            contacts,
            8,
            count,
            c.ffi.NULL,
        )
        assert status == c.lib.LM_OK
        twice += count[0] > 1
        for contact in list(contacts)[: count[0]]:
            made = conjugate.low_mm < contact.radius_mm < conjugate.land_mm
            if made and abs(contact.beyond_mm) < 1e-9:
                half = c.lib.lm_rigid_flank_at(mesh, contact.radius_mm).half_angle_rad
                gap_mm = (half - contact.half_angle_rad) * contact.radius_mm
                assert abs(gap_mm) < 1e-6 * 0.5
                touched += 1
    assert touched > 15
    assert twice > 0


def paper_frame(angle: float) -> tuple[complex, complex]:
    """Foot and direction of a tooth in the circular spline's space: Liu et al., equations (14) to
    (27), of first order in w0 / r_m."""
    neutral, w0 = 24.275, 0.5
    lead = angle - w0 * math.sin(2 * angle) / (2 * neutral) - 100 / 102 * angle
    turn = 2 * w0 / neutral * math.sin(2 * angle) + lead
    radius = neutral + w0 * math.cos(2 * angle)
    return radius * np.exp(1j * lead), np.exp(1j * turn)


def exact_frame(angle: float) -> tuple[complex, complex]:
    """The same at exact arc length and tilt, of the polygons."""
    brute = brute_design(published_document())
    foot, end = polygons.on_line(brute, polygons.frame_points(brute), angle)
    turned = np.exp(-1j * polygons.rigid_axis_rad(brute, angle))
    return foot * turned, (end - foot) / abs(end - foot) * turned


def conjugate_point(
    frame: Callable[[float], tuple[complex, complex]],
    point: complex,
    slope: complex,
    near: float,
) -> tuple[float, complex]:
    """Solve equation (30), the condition of the envelope, for the angle; and the point there."""

    def moved(angle: float) -> complex:
        foot, direction = frame(angle)
        return foot + point * direction

    def across(angle: float) -> float:
        step = 1e-4
        velocity = (moved(angle + step) - moved(angle - step)) / (2 * step)
        return float((velocity * np.conj(slope * frame(angle)[1])).imag)

    angle = float(brentq(across, near - 0.05, near + 0.05, xtol=1e-12))
    return angle, moved(angle)


def test_the_published_motion_has_the_conjugate_zones_but_for_its_first_order() -> None:
    """Section 2.2 of the paper for its own example: first order shifts its zones by up to 2 deg and
    its circular spline by 0.6 um in the first and 11 um in the second zone. With the exact motion
    its equations give ours."""
    model, mesh = made_mesh(published_document())
    c = model.core
    flank, geometry, line = (c.ffi.addressof(mesh, name) for name in ("flank", "geometry", "line"))
    contacts, count = c.ffi.new("lm_conjugate_contact[8]"), c.ffi.new("int *")
    apart_mm, exactly_mm, turned = [], [], []
    for parameter in np.linspace(flank.low_mm + 0.05, flank.high_mm - 0.05, 5):
        status = c.lib.lm_find_conjugate_contacts(
            flank, geometry, line, parameter, contacts, 8, count, c.ffi.NULL
        )
        assert status == c.lib.LM_OK
        foot = c.lib.lm_evaluate_flank(flank, parameter)
        point, slope = (
            complex(foot.along_mm, foot.across_mm),
            complex(1.0, foot.across_slope),
        )
        for contact in list(contacts)[: count[0]]:
            ours = contact.radius_mm * np.exp(1j * contact.half_angle_rad)
            angle, theirs = conjugate_point(paper_frame, point, slope, contact.angle_rad)
            turned.append(abs(angle - contact.angle_rad))
            normal = 1j * slope / abs(slope)
            apart_mm.append(abs(((theirs - ours) * np.conj(normal)).real))
            exact = conjugate_point(exact_frame, point, slope, contact.angle_rad)[1]
            exactly_mm.append(abs(((exact - ours) * np.conj(normal)).real))
    assert len(turned) == 10  # both zones
    assert 1.0 < np.degrees(max(turned)) < 2.0
    assert max(apart_mm[::2]) < 0.0006
    assert 0.002 < max(apart_mm[1::2]) < 0.011
    assert max(exactly_mm) < 1e-7 * 0.5


def test_backlash_and_relief_open_the_clearance_by_what_they_state() -> None:
    tight = DesignModel(parse_drive(published_document()).design).clearances()
    wide = DesignModel(parse_drive(published_document(backlash_mm=0.002)).design).clearances()
    near = (np.abs(tight.angle_rad) < math.radians(40)) & np.isfinite(tight.forward_rad)
    turned = wide.forward_rad[near] - tight.forward_rad[near]
    opened = turned * tight.forward_radius_mm[near]
    assert np.allclose(opened, 0.002, rtol=0, atol=1e-5)
    relieved = DesignModel(
        parse_drive(published_document(tip_relief_mm=0.003, tip_relief_height=0.4)).design
    ).clearances()
    more_mm = (relieved.forward_rad[near] - tight.forward_rad[near]) * 26
    assert more_mm.min() > -1e-9
    assert 0.0005 < more_mm.max() < 0.0035


@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        ({"rho_a": 1.6, "rho_f": 1.6}, "flank.rho_a and design.flank.rho_f"),
        (
            {"rho_a": 0.84, "delta_L_deg": 15.0},
            "flank.rho_a and design.teeth.tooth_height",
        ),
        ({"delta_L_deg": 55.0}, "flank.rho_a and design.flank.X_a"),
        ({"delta_L_deg": 12.0, "h_l": 1.2}, "flank.rho_f and design.flank.X_f"),
        ({"l_a": 1.4, "delta_L_deg": 15.0}, "flank.rho_a and design.flank.l_a"),
    ],
)
def test_arcs_that_make_no_flank_are_refused_by_both_keys(
    changes: dict[str, float], keys: str
) -> None:
    with pytest.raises(InputError) as refusal:
        DesignModel(parse_drive(published_document(**changes)).design)
    assert keys in str(refusal.value)


def ring_document(**flank: Any) -> dict[str, Any]:
    """The published arcs on teeth that point inwards, with the rigid gear that they generate."""
    document = published_document(**flank)
    document["design"]["teeth"].update(
        deformation="external",
        rigid_teeth=98,
        engagement_depth=0.9,
        flexspline_shift=0.1,
    )
    document["design"]["generator"].update(type="ring", contact_half_angle_deg=30.0)
    return document


@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        (
            {"rho_f": 0.8, "delta_L_deg": 15.0},
            "flank.rho_f and design.generator.deflection_mm",
        ),
        (
            {"rho_a": 0.75, "delta_L_deg": 15.0},
            "flank.rho_a and design.teeth.engagement_depth",
        ),
    ],
)
def test_teeth_that_point_inwards_are_refused_by_the_keys_of_their_ends(
    changes: dict[str, float], keys: str
) -> None:
    with pytest.raises(InputError) as refusal:
        DesignModel(parse_drive(ring_document(**changes)).design)
    assert keys in str(refusal.value)


def test_an_involute_of_a_ring_has_one_clearance_with_and_without_relief() -> None:
    """A pair of involutes keeps its closed forms; any other pair moves the same spaces."""
    document = ring_document()
    document["design"]["teeth"].update(
        flexspline_flank="involute", rigid_flank="involute", rigid_shift=-0.1, flexspline_shift=0.5
    )
    document["design"]["flank"] = {}
    exact = DesignModel(parse_drive(document).design).clearances().forward_rad
    document["design"]["flank"] = {"tip_relief_mm": 1e-12}
    found = DesignModel(parse_drive(document).design).clearances().forward_rad
    met = np.isfinite(exact)
    assert met.sum() > 20
    assert np.array_equal(met, np.isfinite(found))
    assert np.allclose(found[met], exact[met], rtol=0, atol=1e-6 * ARCMIN)
    document["design"]["flank"] = {"tip_relief_mm": 0.003}
    relieved = DesignModel(parse_drive(document).design).clearances()
    met &= np.isfinite(relieved.forward_rad)
    more_mm = (relieved.forward_rad[met] - exact[met]) * relieved.forward_radius_mm[met]
    assert more_mm.min() > -1e-9
    assert 0.0025 < more_mm.max() < 0.0035


def test_a_rigid_gear_generates_the_spaces_of_the_ring_that_generated_it() -> None:
    """As the circular spline does its flexspline, except near both tips."""
    generated = ring_document()
    model, mesh = made_mesh(generated)
    table, lib = mesh.conjugate, model.core.lib
    radii = np.linspace(table.land_mm - 0.002, table.low_mm + 0.02, 129)
    half = [lib.lm_rigid_flank_at(mesh, float(r)).half_angle_rad for r in radii]
    # the flank continues beyond the land: a spline through its edge would oscillate beside it
    half[0] = float(
        np.polyval(np.polyfit(radii[1:5] - radii[1], half[1:5], 3), radii[0] - radii[1])
    )
    points = [[r * math.sin(a), r * math.cos(a)] for r, a in zip(radii, half, strict=True)]
    stated = ring_document(rigid_points=points)
    stated["design"]["teeth"]["rigid_flank"] = "points"
    turned = copy.deepcopy(stated)
    turned["design"]["teeth"]["flexspline_flank"] = "conjugate"
    exact, found, back = (
        DesignModel(parse_drive(document).design).clearances()
        for document in (generated, stated, turned)
    )
    met = np.isfinite(exact.forward_rad)
    assert met.sum() > 20
    assert np.array_equal(met, np.isfinite(found.forward_rad))
    assert np.allclose(found.forward_rad[met], exact.forward_rad[met], rtol=0, atol=1e-3 * ARCMIN)
    assert back.forward_rad.min() > -1e-3 * ARCMIN
    more = np.abs(back.forward_rad[met] - exact.forward_rad[met]) / ARCMIN
    assert np.median(more) < 1e-4


def test_a_search_varies_the_arcs_and_certifies_the_whole_face(tmp_path: Path) -> None:
    pytest.importorskip("lostmotion._search", reason=NO_SEARCH)
    spec = tmp_path / "arcs.toml"
    spec.write_text(ARC_SPEC)
    result = design.search(spec, tmp_path / "arcs", workers=1)
    found = read_drive(tmp_path / "arcs" / "best.toml").design
    assert found is not None
    assert found.values["teeth.rigid_flank"].value == "conjugate"
    assert 9 <= math.degrees(found.values["flank.delta_L_rad"].value) <= 15
    assert result.certificate is not None
    assert result.certificate["holds"]
    model = DesignModel(found)
    c, meshes = model.core, model.core.ffi.new("lm_mesh[2]")
    c.check(c.lib.lm_make_face(model.drive, 1, 256, meshes, c.ffi.NULL))
    for place in np.linspace(0, 1, 15):
        where = (place, 256, meshes, meshes + 1, c.ffi.NULL)
        c.check(c.lib.lm_make_mesh_at(model.drive, *where))
        gap = c.ffi.new("lm_smallest_gap *")
        c.check(c.lib.lm_find_smallest_gap(meshes + 1, 1, 32, gap, c.ffi.NULL))
        assert gap.gap_rad > -1e-6 * ARCMIN, place


ARC_SPEC = """
[search]
objectives = ["lost_motion"]
evaluations = 150
[drive]
name = "arcs"
rated_torque_Nm = 20
[search.fixed]
"teeth.module_mm" = 0.25
"teeth.face_width_mm" = 10
"teeth.flexspline_flank" = "double_arc"
"teeth.rigid_flank" = "conjugate"
"teeth.flexspline_shift" = 0
"teeth.rigid_shift" = 0
"teeth.flexspline_teeth" = 200
"teeth.rack_addendum" = 0.6
"teeth.root_clearance" = 0.15
"teeth.tooth_height" = 1.4
"teeth.engagement_depth" = 0.9
"flexspline.rim_thickness_mm" = 0.6
"generator.type" = "discs"
"generator.contact_half_angle_deg" = 25
"generator.deflection_modules" = 1.0
"flank.rho_a" = 2.0
"flank.X_a" = 0.1
"flank.l_a" = 1.35
"flank.rho_f" = 1.5
"flank.h_l" = 0.3
[search.range]
"flank.delta_L_deg" = [9, 15]
"flank.backlash_mm" = [0.01, 0.03]
"""
