#!/usr/bin/env python3
"""Write blobs.h: the parameters of six joints by `lostmotion export` from their data sheets.

    python firmware_examples/six_axes/make_blobs.py FILE

The data sheets are those of a small robot: three sizes, as in catalogues.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from lostmotion.cli import main

SHEETS = {
    # name: ratio, rated torque, T1, T2 [N m], K1, K2, K3 [1e3 N m/rad]
    "base": (100, 67, 14, 48, 31, 50, 57),
    "shoulder": (100, 67, 14, 48, 31, 50, 57),
    "elbow": (100, 40, 7, 25, 16, 25, 29),
    "forearm": (-80, 24, 3.9, 12, 10, 14, 16),
    "wrist": (100, 7.8, 2, 6.9, 4.7, 6.1, 7.1),
    "flange": (50, 7.8, 2, 6.9, 4.7, 6.1, 7.1),
}
TEMPLATE = """[drive]
name = "{name}"
ratio = {values[0]}
rated_torque_Nm = {values[1]}
[catalogue]
T1_Nm = {values[2]}
T2_Nm = {values[3]}
K1_Nm_per_rad = {values[4]}e3
K2_Nm_per_rad = {values[5]}e3
K3_Nm_per_rad = {values[6]}e3
hysteresis_arcmin = 1
lost_motion_arcmin = 1
"""
PERIOD = "period_us=500"
COLUMNS = 12


def blob_of(name: str, folder: Path) -> bytes:
    """Bytes of `lostmotion export` for one joint."""
    sheet, blob = folder / f"{name}.toml", folder / f"{name}.bin"
    sheet.write_text(TEMPLATE.format(name=name, values=SHEETS[name]))
    if main(["export", str(sheet), "-o", str(blob), "--set", PERIOD, "--quiet"]) != 0:
        raise SystemExit(f"{name}: the export failed")
    return blob.read_bytes()


def text_of(blobs: dict[str, bytes]) -> str:
    """Text of blobs.h."""
    lines = [
        "/* Parameters of six joints, written by make_blobs.py: in a robot they are in flash",
        " * or are received over the bus. */",
        "#ifndef SIX_AXES_BLOBS_H",
        "#define SIX_AXES_BLOBS_H",
        "",
        "#include <stdint.h>",
        "",
        "/* clang-format off */",
    ]
    for name, blob in blobs.items():
        lines.append(f"static const uint8_t {name}_blob[] = {{")
        for start in range(0, len(blob), COLUMNS):
            row = ", ".join(f"0x{byte:02x}" for byte in blob[start : start + COLUMNS])
            lines.append(f"    {row},")
        # The CRC at the end is the fingerprint.
        fingerprint = int.from_bytes(blob[-4:], "little")
        lines += ["};", f"#define {name.upper()}_FINGERPRINT 0x{fingerprint:08x}u", ""]
    return "\n".join([*lines, "/* clang-format on */", "#endif", ""])


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("usage: make_blobs.py FILE")
    with tempfile.TemporaryDirectory() as made:
        text = text_of({name: blob_of(name, Path(made)) for name in SHEETS})
    Path(sys.argv[1]).write_text(text)
