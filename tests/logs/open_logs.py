"""Logs that are not yet answered as they should be, and what is wrong with each.

The table names them as open. A log that is not listed must be right.
"""

from __future__ import annotations

BURST = "five wild samples in a row, each elsewhere, are not told from a motion"
MANY = "wild samples at six moments of a run are usual there"
STUCK = "is named as stuck, and its rows are kept"
BIT = "a step of six times the usual one, or of 34 arcsec at one sample, is not named"
AT_END = "at the end of a run only one side shows it"

OPEN: dict[str, str] = {
    "an encoder of the input that never moves though the output turns": "nothing refuses it",
    "torque_Nm: a burst of five wild values": BURST,
    "input_angle_rad: a burst of five wild values": BURST,
    "output_angle_rad: a burst of five wild values": BURST,
    "torque_Nm: every twentieth sample of a run is 0": MANY,
    "input_angle_rad: every twentieth sample of a run is 0": MANY,
    "output_angle_rad: every twentieth sample of a run is 0": MANY,
    "cycles: every twentieth sample of a run is 0": MANY,
    "temperature_C: every twentieth sample of a run is 0": MANY,
    "a run of one sample of zeros at the end": "it is left out, and nothing said",
    "torque_Nm: stuck for 60 samples": STUCK,
    "output_angle_rad: stuck for 60 samples": STUCK,
    "torque_Nm: bit 14 turned": BIT,
    "input_angle_rad: bit 14 turned": BIT,
    "output_angle_rad: bit 14 turned": BIT,
    "output_angle_rad: ten times too much": "named as a wrap of the input",
    "output_angle_rad: the first sample of a run is wild": AT_END,
    "output_angle_rad: the last sample of a run is wild": AT_END,
}
