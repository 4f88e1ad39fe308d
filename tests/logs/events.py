"""Real events that are fast: they must not be set aside as sensor faults."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .clean import Array, Sheet, clean

RUN, PLACE, AT_S = "14", 70, 35.0
ARCSEC = np.pi / 648_000
STIFFNESS_NM_PER_RAD = 12_000.0
"""Approximately that of the clean campaign's loops at half their torque."""


@dataclass(frozen=True)
class Event:
    """A fast physical event.

    Attributes
    ----------
    name : str
        Description of the event.
    text : str
        The file.
    step_arcsec : float
        Step of the lost motion that it causes; 0 for none.
    """

    name: str
    text: str
    step_arcsec: float = 0.0


def _after(sheet: Sheet) -> tuple[Array, int]:
    rows = np.flatnonzero(np.array(sheet.cells("run")) == RUN)
    at = int(rows[PLACE])
    return ((np.arange(len(sheet)) >= at) & (np.arange(len(sheet)) <= rows[-1])).astype(float), at


def _shifted(sheet: Sheet, name: str, by: Array, form: str) -> Sheet:
    return sheet.put(name, [form % value for value in sheet.values(name) + by])


def all_events() -> list[Event]:
    """Return all events."""
    sheet = clean()
    after, at = _after(sheet)
    rows = np.arange(len(sheet))
    events = []
    for what, size in (("slips by 60 arcsec", 60.0), ("slips by 5 arcmin", 300.0)):
        moved = _shifted(sheet, "output_angle_rad", size * ARCSEC * after, "%.8f")
        events.append(Event(f"the output {what} and stays", moved.text(), size))
    # Three samples: an impact in torque sensor and both encoders.
    blow = 8.0 * np.exp(-0.5 * ((rows - at) / 0.8) ** 2)
    blown = _shifted(sheet, "torque_Nm", blow, "%.5g")
    blown = _shifted(blown, "output_angle_rad", blow / STIFFNESS_NM_PER_RAD, "%.8f")
    events.append(Event("a blow that all sensors see", blown.text()))
    # The input is turned by hand by a tenth of a turn and the output follows.
    turned = _shifted(sheet, "input_angle_rad", 0.6 * after, "%.6f")
    turned = _shifted(turned, "output_angle_rad", 0.006 * after, "%.8f")
    events.append(Event("both angles step together", turned.text()))
    warm = _shifted(sheet, "temperature_C", 3.0 * after, "%.2f")
    events.append(Event("the drive warms by 3 K between two samples", warm.text()))
    return events
