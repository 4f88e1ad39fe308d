"""``lostmotion export drive.toml -o drive.fmu``: the drive, or its compensator, as an FMU.

A co-simulation FMU (FMI 2.0 or 3.0) with C sources, including those of the library, and a binary
for this machine if there is a C compiler.
"""

from __future__ import annotations

import hashlib
import io
import platform
import re
import sys
import uuid
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lostmotion.condition_cards import CARDS
from lostmotion.core import NEEDS, core
from lostmotion.errors import InputError
from lostmotion.export import Controller, build, describe_export, known_effects
from lostmotion.files import write_whole
from lostmotion.simulators.compiler import (
    LIBRARY,
    compile_shared,
    find_compiler,
    read_source,
    shared_suffix,
)
from lostmotion.simulators.description import Description, Version
from lostmotion.simulators.variables import KINDS, TIME, Access, Kind, Variable, list_variables

ACCESS: dict[Access, int] = {
    "none": 0,
    "input": 4,
    "output": 0,
    "independent": 0,
    "tunable": 4,
    "fixed": 4,
}
"""Bit FMU_SETTABLE of ``c/fmu.h``. Fixed variables may be set before the initialization."""

KIND_MACROS: dict[Kind, str] = {
    "torque": "FMU_TORQUE_IN",
    "angles": "FMU_ANGLES_IN",
    "compensator": "FMU_COMPENSATOR",
}

EPOCH = (1980, 1, 1, 0, 0, 0)
"""Time stamp of every file in an FMU, so that the same drive gives the same bytes."""

MODEL = "model.c"
"""Translation unit with the model and FMI's functions."""


@dataclass(frozen=True)
class Sources:
    """C sources of an FMU: every text by its name, and those that are compiled."""

    texts: dict[str, str]
    units: list[str]


def model_identifier(file: Path) -> str:
    """Name in C of an FMU, from that of its file."""
    name = re.sub(r"\W", "_", file.stem, flags=re.ASCII)
    return name if re.match(r"[A-Za-z_]", name) else f"drive_{name}"


def export_fmu(
    controller: Controller,
    file: str | Path,
    *,
    kind: Kind,
    version: Version,
    ratio: float,
    title: str,
) -> dict[str, Any]:
    """Write an FMU atomically, and return the answer of the command.

    Parameters
    ----------
    controller : Controller
        From `make_controller`, of the profile "full" or "standard".
    file : str or Path
        Ends in .fmu.
    kind : {"torque", "angles", "compensator"}
    version : {2, 3}
        Of FMI.
    ratio : float
        Of the drive.
    title : str
        What it is for.

    Raises
    ------
    InputError
        When the library refuses the parameters, an effect of the user's own has no formula, or the
        compiler fails.
    """
    path = Path(file)
    build(controller, core(32 if kind == "compensator" else 64))
    name = model_identifier(path)
    variables = list_variables(controller, kind, 1.0 if kind == "compensator" else ratio)
    sources = make_sources(controller, kind, version, variables)
    description = Description(
        name,
        f"{title}: {KINDS[kind]}",
        _token(name, sources),
        variables,
        sources.units,
        derivatives=kind != "compensator",
        step_s=controller.limits.period_s if kind == "compensator" else None,
    )
    sources.texts["fmu_data.h"] = (
        f'#define FMU_TOKEN "{description.token}"\n{sources.texts["fmu_data.h"]}'
    )
    notes = list(controller.notes)
    compiler = find_compiler()
    files = {"modelDescription.xml": description.xml(version)}
    if compiler is None:
        notes.append(
            "No C compiler was found: the FMU contains its sources and no binary. Install one, or "
            "compile the sources on the target machine."
        )
    else:
        made = compile_shared(compiler, sources.texts, sources.units)
        files[f"binaries/{binary_folder(version)}/{name}{shared_suffix()}"] = made
    if version == 3:
        files["sources/buildDescription.xml"] = description.build_xml()
    files |= {f"sources/{source}": text.encode() for source, text in sources.texts.items()}
    write_whole(path, pack(files))
    shown = description.shown().values()
    return {
        **describe_export(controller, path),
        "fmi": f"{version}.0",
        "kind": kind,
        "binary": binary_folder(version) if compiler is not None else None,
        "inputs": [v.name for v in shown if v.access == "input"],
        "outputs": [v.name for v in shown if v.access == "output"],
        "tunable": sum(v.access == "tunable" for v in shown),
        "notes": notes,
    }


def pack(files: dict[str, bytes]) -> bytes:
    """Make a ZIP archive whose bytes depend on the files alone."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, content)
    return made.getvalue()


def binary_folder(version: Version) -> str:
    """Folder of this machine's binaries: FMI 3.0 section 2.5.1.3.1, FMI 2.0 section 2.3."""
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    system = {"darwin": "darwin", "win32": "windows"}.get(sys.platform, "linux")
    older = {"x86_64-linux": "linux64", "x86_64-windows": "win64", "x86_64-darwin": "darwin64"}
    tuple_name = f"{machine}-{system}"
    return older.get(tuple_name, tuple_name) if version == 2 else tuple_name


def _token(name: str, sources: Sources) -> str:
    """GUID of an FMU, derived from its content."""
    digest = hashlib.sha256()
    for text in (name, *(f"{file}\n{text}" for file, text in sources.texts.items())):
        digest.update(text.encode())
    return f"{{{uuid.UUID(bytes=digest.digest()[:16])}}}"


def make_sources(
    controller: Controller, kind: Kind, version: Version, variables: Sequence[Variable]
) -> Sources:
    """Put the C sources of an FMU together; ``fmu_data.h`` lacks the token.

    Raises
    ------
    InputError
        If a user effect has no formula, so that it cannot be written in C.
    """
    model = "compensator.c" if kind == "compensator" else "drive.c"
    interface = f"fmi{version}_interface.c"
    bits = 32 if kind == "compensator" else 64
    texts = {
        "library_config.h": (f"#define LM_REAL_BITS {bits}\n#define LM_PROFILE LM_PROFILE_FULL\n"),
        LIBRARY: '#include "library_config.h"\n\n#include "lostmotion.c"\n',
        MODEL: (
            '#include "library_config.h"\n\n#include "lostmotion.h"\n\n#include "fmu_data.h"\n\n'
            f'#include "{model}"\n#include "{interface}"\n'
        ),
        "fmu_data.h": data_header(controller, kind, variables),
    }
    names = ("lostmotion.c", "lostmotion.h", "fmu.h", model, interface, f"fmi{version}.h")
    texts |= {name: read_source(name) for name in names}
    units = [LIBRARY, MODEL]
    for name, text in own_sources(controller).items():
        texts[name] = text
        units.append(name)
    return Sources(texts, units)


def own_sources(controller: Controller) -> dict[str, str]:
    """C files of user effects, which must have a formula."""
    from lostmotion.effects.formula import write_c

    made = {}
    for effect in controller.own.values():
        if not effect.formula:
            found = "a shared object" if effect.symbol else "a Python function"
            raise InputError(
                "--effects", effect.name, found, "a formula: an FMU contains the source"
            )
        text = write_c(effect).replace('"lostmotion/effects.h"', '"lostmotion.h"')
        made[f"own_{effect.name}.c"] = f'#include "library_config.h"\n\n{text}'
    return made


def data_header(controller: Controller, kind: Kind, variables: Sequence[Variable]) -> str:
    """C header with the data of one drive for `c/fmu.h`, without the token."""
    known = known_effects(core(64), controller.own)
    effects = [(name, int(known[name].value_count)) for name, _ in controller.effects]
    parameters = variables[variables.index(TIME) + 1 :]
    access = [
        ACCESS[v.access] + (0 if v.access == "none" else 2 if v.whole else 1) for v in variables
    ]
    numbers = ",\n    ".join(float(variable.start).hex() for variable in parameters)
    own = "".join(f"extern const lm_effect lm_effect_{name};\n" for name in controller.own)
    cards = [CARDS[name] for name in NEEDS]
    usual = ", ".join(card.usual[1].hex() if card.drawn else "1" for card in cards)
    if kind != "compensator":  # which has no derivatives
        own += f"\nstatic const double fmu_unit[] = {{{usual}}};\n"
    pointers = ", ".join(f"&lm_effect_{name}" for name, _ in effects) or "0"
    return f"""#define FMU_KIND {list(KIND_MACROS).index(kind) + 1} /* {KIND_MACROS[kind]} */
#define FMU_KNOTS {controller.torque_Nm.size}
#define FMU_PLAYS {len(controller.plays)}
#define FMU_OUTSIDE {len(controller.outside)}
#define FMU_EFFECTS {len(effects)}
#define FMU_PARAMETERS {len(parameters)}

{own}static const lm_effect *const fmu_effect[] = {{{pointers}}};

static const unsigned char fmu_access[] = {{
    {", ".join(map(str, access))}}};

static const double fmu_parameter_start[] = {{
    {numbers}}};
"""
