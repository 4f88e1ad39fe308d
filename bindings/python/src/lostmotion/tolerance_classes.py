"""Fits of holes and shafts: limit deviations of tolerance classes such as H7 and g6, ISO 286.

The letter gives the end of the field next to zero (fundamental deviation, ISO 286-1:2010 tables 2
to 5), the number the grade, whose field is given by `lm_it_tolerance` (table 1). Up to 500 mm.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass

from lostmotion.core import core

MAIN_STEPS_MM = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""Upper ends of the main steps of nominal sizes."""

FINE_STEPS_MM = (
    *(3, 6, 10, 14, 18, 24, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280),
    *(315, 355, 400, 450, 500),
)
"""Upper ends of the intermediate steps."""

CLEARANCE_UM: dict[str, tuple[int, ...]] = {
    "a": (
        *(270, 270, 280, 290, 290, 300, 300, 310, 320, 340, 360, 380, 410, 460, 520, 580, 660),
        *(740, 820, 920, 1050, 1200, 1350, 1500, 1650),
    ),
    "b": (
        *(140, 140, 150, 150, 150, 160, 160, 170, 180, 190, 200, 220, 240, 260, 280, 310, 340),
        *(380, 420, 480, 540, 600, 680, 760, 840),
    ),
    "c": (
        *(60, 70, 80, 95, 95, 110, 110, 120, 130, 140, 150, 170, 180, 200, 210, 230, 240, 260),
        *(280, 300, 330, 360, 400, 440, 480),
    ),
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}
"""Distance of the field from zero on the side of clearance: -es of shafts, EI of holes; um."""

INTERFERENCE_UM: dict[str, tuple[int, ...]] = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
    "r": (
        *(10, 15, 19, 23, 23, 28, 28, 34, 34, 41, 43, 51, 54, 63, 65, 68, 77, 80, 84, 94, 98),
        *(108, 114, 126, 132),
    ),
    "s": (
        *(14, 19, 23, 28, 28, 35, 35, 43, 43, 53, 59, 71, 79, 92, 100, 108, 122, 130, 140, 158),
        *(170, 190, 208, 232, 252),
    ),
    "u": (
        *(18, 23, 28, 33, 33, 41, 48, 60, 70, 87, 102, 124, 144, 170, 190, 210, 236, 258, 284),
        *(315, 350, 390, 435, 490, 540),
    ),
}
"""Distance of the field from zero on the side of interference: ei of shafts; um. That of k holds
for IT4 to IT7; beyond them it is 0."""

BEARING_SEATS_UM: dict[str, tuple[int, ...]] = {
    "j5": (-2, -2, -2, -3, -4, -5, -7, -9, -11, -13, -16, -18, -20),
    "j6": (-2, -2, -2, -3, -4, -5, -7, -9, -11, -13, -16, -18, -20),
    "j7": (-4, -4, -5, -6, -8, -10, -12, -15, -18, -21, -26, -28, -32),
    "J6": (2, 5, 5, 6, 8, 10, 13, 16, 18, 22, 25, 29, 33),
    "J7": (4, 6, 8, 10, 12, 14, 18, 22, 26, 30, 36, 39, 43),
    "J8": (6, 10, 12, 15, 20, 24, 28, 34, 41, 47, 55, 60, 66),
}
"""Classes of the letter j, each with its own end: ei of shafts, ES of holes; um."""

GRADES = (3, 16)
"""Grades whose fields the library contains."""

LETTERS = (*CLEARANCE_UM, "j", "js", *INTERFERENCE_UM)
"""Letters of shafts; those of holes are their capitals."""

MIDDLE_GRADES_K = (4, 7)
"""Grades of a shaft k that does not lie at zero."""

DELTA_GRADE_MAX = {"k": 8, "m": 8, "n": 8}
"""Coarsest grade of a hole to which Delta is added; 7 for the letters after n."""

SMALLEST_STEP_MM = 3
"""Up to this nominal size Delta is 0."""


@dataclass(frozen=True)
class ToleranceClass:
    """Letter and grade of a hole (capital) or a shaft; grade None if only the letter is stated."""

    letter: str
    grade: int | None

    @property
    def is_hole(self) -> bool:
        """Whether the letter is a capital."""
        return self.letter.isupper()

    def __str__(self) -> str:
        """Write it as a drawing does."""
        return f"{self.letter}{'' if self.grade is None else self.grade}"


def read_class(text: str) -> ToleranceClass:
    """Read a tolerance class.

    Raises
    ------
    ValueError
        States what was expected.
    """
    match = re.fullmatch(r"([A-Z]+|[a-z]+)(\d{1,2})?", text.strip())
    if match is None or match[1].lower() not in LETTERS:
        shown = ", ".join(LETTERS)
        raise ValueError(f"a letter and a grade such as H7 or g6; letters of shafts: {shown}")
    grade = None if match[2] is None else int(match[2])
    if grade is not None and not GRADES[0] <= grade <= GRADES[1]:
        raise ValueError(f"a grade from {GRADES[0]} to {GRADES[1]}")
    return ToleranceClass(match[1], grade)


def read_fit(text: str) -> tuple[ToleranceClass, ToleranceClass]:
    """Read a fit, the hole first: ``H7/g6``.

    Raises
    ------
    ValueError
        States what was expected.
    """
    expected = "the class of the hole and that of the shaft, such as H7/g6"
    hole, slash, shaft = text.partition("/")
    if not slash:
        raise ValueError(expected)
    classes = read_class(hole), read_class(shaft)
    if not classes[0].is_hole or classes[1].is_hole:
        raise ValueError(expected)
    return classes


def limit_deviations(one: ToleranceClass, nominal_mm: float) -> tuple[float, float]:
    """Lower and upper limit deviation in mm: EI and ES of a hole, ei and es of a shaft.

    Parameters
    ----------
    one : ToleranceClass
        With a grade.
    nominal_mm : float
        0.001 to 500.

    Raises
    ------
    ValueError
        The standard has no such class, or not at this size; states what was expected.
    """
    if one.grade is None:
        raise ValueError("a grade after the letter")
    if not 0.001 <= nominal_mm <= MAIN_STEPS_MM[-1]:
        raise ValueError(f"a nominal size from 0.001 to {MAIN_STEPS_MM[-1]} mm")
    width = field_um(nominal_mm, one.grade)
    letter = one.letter.lower()
    if letter == "js":
        lower = -width / 2.0
    elif letter == "j":
        lower = at_seat(one, nominal_mm) - (width if one.is_hole else 0.0)
    elif letter in CLEARANCE_UM:
        gap = at_size(CLEARANCE_UM[letter], nominal_mm)
        lower = gap if one.is_hole else -gap - width
    elif one.is_hole:
        lower = tight_hole_um(letter, nominal_mm, one.grade) - width
    else:
        at_zero = letter == "k" and not MIDDLE_GRADES_K[0] <= one.grade <= MIDDLE_GRADES_K[1]
        lower = 0.0 if at_zero else float(at_size(INTERFERENCE_UM[letter], nominal_mm))
    return lower / 1e3, (lower + width) / 1e3


def tight_hole_um(letter: str, nominal_mm: float, grade: int) -> float:
    """ES of a hole K to U in um: that of the shaft with the other sign, plus Delta.

    Delta = IT(n) - IT(n-1) makes H7/p6 and P7/h6 the same fit; ISO 286-1:2010, 4.3.2.5.
    """
    base = -float(at_size(INTERFERENCE_UM[letter], nominal_mm))
    small = nominal_mm <= SMALLEST_STEP_MM
    if grade > DELTA_GRADE_MAX.get(letter, 7):
        if letter == "k" and not small:
            raise ValueError("K3 to K8: coarser ones are not in the standard beyond 3 mm")
        return 0.0 if letter == "n" and not small else base
    if letter == "m" and grade == 6 and 250 < nominal_mm <= 315:
        return -9.0  # the one exception of table 3
    if grade == GRADES[0] and not small:
        raise ValueError(f"a grade of {GRADES[0] + 1} or coarser for a hole {letter.upper()}")
    return base + (0.0 if small else field_um(nominal_mm, grade) - field_um(nominal_mm, grade - 1))


def at_seat(one: ToleranceClass, nominal_mm: float) -> float:
    """End of a class of the letter j that its table has, in um."""
    if str(one) not in BEARING_SEATS_UM:
        raise ValueError("one of " + ", ".join(BEARING_SEATS_UM) + " for this letter")
    return float(at_size(BEARING_SEATS_UM[str(one)], nominal_mm))


def at_size(values: tuple[int, ...], nominal_mm: float) -> int:
    """Value of the size step that contains a size; steps include their upper end."""
    steps = MAIN_STEPS_MM if len(values) == len(MAIN_STEPS_MM) else FINE_STEPS_MM
    return values[bisect_left(steps, nominal_mm)]


def field_um(nominal_mm: float, grade: int) -> float:
    """Width of the field of a grade, in um."""
    c = core()
    return round(1e3 * c.real_from(c.lib.lm_it_tolerance, nominal_mm, grade), 6)
