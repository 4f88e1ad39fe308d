"""modelDescription.xml of an FMU, by FMI 2.0 and 3.0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from lostmotion import __version__
from lostmotion.simulators.variables import UNITS, Variable

Version = Literal[2, 3]


@dataclass(frozen=True)
class Description:
    """Content of a modelDescription.xml.

    Attributes
    ----------
    name, title : str
        The model identifier, a name in C, and its purpose.
    token : str
        GUID, in FMI 3 the instantiation token.
    units : sequence of str
        Source files that a tool compiles.
    derivatives : bool
        Whether the FMU provides directional derivatives.
    step_s : float or None
        Intended step.
    """

    name: str
    title: str
    token: str
    variables: Sequence[Variable]
    units: Sequence[str]
    derivatives: bool
    step_s: float | None = None

    def xml(self, version: Version) -> bytes:
        """Text of the file."""
        root = self._fmi2() if version == 2 else self._fmi3()
        ElementTree.indent(root)
        return bytes(ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"

    def _root(self, version: str) -> Element:
        return Element(
            "fmiModelDescription",
            {
                "fmiVersion": version,
                "modelName": self.name,
                "description": self.title,
                "license": "MIT",
                "generationTool": f"lostmotion {__version__}",
                "variableNamingConvention": "structured",
            },
        )

    def _units(self, root: Element) -> None:
        table = SubElement(root, "UnitDefinitions")
        used = {variable.unit for variable in self.shown().values()}
        for name, exponents in UNITS.items():
            if name in used:
                unit = SubElement(table, "Unit", {"name": name})
                SubElement(unit, "BaseUnit", {key: f"{v:g}" for key, v in exponents.items()})

    def shown(self) -> dict[int, Variable]:
        """Variables that the FMU has, by their value references."""
        return {i: v for i, v in enumerate(self.variables) if v.access != "none"}

    def _fmi2(self) -> Element:
        root = self._root("2.0")
        root.set("guid", self.token)
        ability = {
            "modelIdentifier": self.name,
            "canHandleVariableCommunicationStepSize": "true",
            "canNotUseMemoryManagementFunctions": "true",
            "canGetAndSetFMUstate": "true",
            "canSerializeFMUstate": "true",
            "providesDirectionalDerivative": str(self.derivatives).lower(),
        }
        files = SubElement(SubElement(root, "CoSimulation", ability), "SourceFiles")
        for unit in self.units:
            SubElement(files, "File", {"name": unit})
        self._units(root)
        self._log_categories(root)
        if self.step_s is not None:
            SubElement(root, "DefaultExperiment", {"stepSize": _number(self.step_s)})
        table = SubElement(root, "ModelVariables")
        outputs = []
        for index, (reference, variable) in enumerate(self.shown().items(), start=1):
            entry = SubElement(table, "ScalarVariable", _common(variable, reference))
            SubElement(entry, "Integer" if variable.whole else "Real", _values(variable))
            if variable.access == "output":
                outputs.append(index)
        structure = SubElement(root, "ModelStructure")
        for name in ("Outputs", "InitialUnknowns"):
            listed = SubElement(structure, name)
            for index in outputs:
                SubElement(listed, "Unknown", {"index": str(index)})
        return root

    def _fmi3(self) -> Element:
        root = self._root("3.0")
        root.set("instantiationToken", self.token)
        SubElement(
            root,
            "CoSimulation",
            {
                "modelIdentifier": self.name,
                "canHandleVariableCommunicationStepSize": "true",
                "canGetAndSetFMUState": "true",
                "canSerializeFMUState": "true",
                "providesDirectionalDerivatives": str(self.derivatives).lower(),
            },
        )
        self._units(root)
        self._log_categories(root)
        if self.step_s is not None:
            SubElement(root, "DefaultExperiment", {"stepSize": _number(self.step_s)})
        table = SubElement(root, "ModelVariables")
        shown = self.shown()
        for reference, variable in shown.items():
            attributes = _common(variable, reference) | _values(variable)
            SubElement(table, "UInt32" if variable.whole else "Float64", attributes)
        structure = SubElement(root, "ModelStructure")
        for name in ("Output", "InitialUnknown"):
            for reference, variable in shown.items():
                if variable.access == "output":
                    SubElement(structure, name, {"valueReference": str(reference)})
        return root

    def _log_categories(self, root: Element) -> None:
        category = {"name": "logStatusError", "description": "why a call was refused"}
        SubElement(SubElement(root, "LogCategories"), "Category", category)

    def build_xml(self) -> bytes:
        """Text of sources/buildDescription.xml of FMI 3."""
        root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
        build = SubElement(root, "BuildConfiguration", {"modelIdentifier": self.name})
        files = SubElement(build, "SourceFileSet", {"language": "C99"})
        for unit in self.units:
            SubElement(files, "SourceFile", {"name": unit})
        ElementTree.indent(root)
        return bytes(ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"


def _number(value: float) -> str:
    """Write a double so that it reads back with the same bits."""
    return repr(float(value))


def _common(variable: Variable, reference: int) -> dict[str, str]:
    """Attributes of both versions."""
    parameter = variable.access in ("tunable", "fixed")
    found = {
        "name": variable.name,
        "valueReference": str(reference),
        "causality": "parameter" if parameter else variable.access,
    }
    if variable.meaning:
        found["description"] = variable.meaning
    if parameter:
        found["variability"] = variable.access
    elif variable.whole:
        found["variability"] = "discrete"
    return found


def _values(variable: Variable) -> dict[str, str]:
    """Start value, unit and range."""
    write = (lambda value: str(int(value))) if variable.whole else _number
    found = {}
    if variable.unit:
        found["unit"] = variable.unit
    if variable.low is not None:
        found["min"] = write(variable.low)
    if variable.high is not None:
        found["max"] = write(variable.high)
    if variable.access not in ("output", "independent"):
        found["start"] = write(variable.start)
    return found
