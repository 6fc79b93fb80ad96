"""The model description of an FMU: modelDescription.xml of FMI 2.0 and 3.0."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass

from .variables import Variable

# exponents of kg, m, s and rad
UNITS: dict[str, dict[str, int]] = {
    "m": {"m": 1},
    "rad": {"rad": 1},
    "m/s": {"m": 1, "s": -1},
    "rad/s": {"rad": 1, "s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "s": {"s": 1},
    "1": {},
}


@dataclass(frozen=True)
class Model:
    """What a model description says of the whole.

    Attributes:
        name: of the model.
        identifier: of the library, a name of C.
        token: that the library checks.
        text: a sentence.
        rtol: relative tolerance of the default experiment.
    """

    name: str
    identifier: str
    token: str
    text: str
    rtol: float


def description(fmi: int, model: Model, variables: Sequence[Variable]) -> bytes:
    """The file modelDescription.xml.

    Args:
        fmi: 2 or 3.
        model: name, token and the like.
        variables: but for the time, which comes first.

    Returns:
        Its content.
    """
    root = _root(fmi, model)
    units = ET.SubElement(root, "UnitDefinitions")
    for unit in dict.fromkeys(["s", *(v.unit for v in variables if v.unit)]):
        one = ET.SubElement(units, "Unit", name=unit)
        ET.SubElement(one, "BaseUnit", {k: str(n) for k, n in UNITS[unit].items()})
    known = {"startTime": "0", "stopTime": "1", "tolerance": repr(model.rtol)}
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", name="logStatusError")
    ET.SubElement(root, "DefaultExperiment", known)
    listed = ET.SubElement(root, "ModelVariables")
    (_second if fmi == 2 else _third)(listed, variables)
    root.append(_structure(fmi, variables))
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _root(fmi: int, model: Model) -> ET.Element:
    about = {"modelName": model.name, "description": model.text, "generationTool": "flexura"}
    can = {
        "modelIdentifier": model.identifier,
        "canHandleVariableCommunicationStepSize": "true",
    }
    if fmi == 2:
        naming = {"fmiVersion": "2.0", "guid": model.token, "variableNamingConvention": "flat"}
        root = ET.Element("fmiModelDescription", naming | about)
        can |= {"canInterpolateInputs": "true", "canGetAndSetFMUstate": "true"}
    else:
        naming = {"fmiVersion": "3.0", "instantiationToken": model.token}
        root = ET.Element("fmiModelDescription", naming | about)
        can |= {"canGetAndSetFMUState": "true"}
    ET.SubElement(root, "CoSimulation", can)
    return root


def _common(variable: Variable) -> dict[str, str]:
    """Attributes of a variable that both versions have."""
    out = {"name": variable.name, "valueReference": str(variable.reference)}
    out["causality"] = variable.causality
    if variable.text:
        out["description"] = variable.text
    out["variability"] = "fixed" if variable.causality == "parameter" else "continuous"
    if variable.causality == "output":
        out["initial"] = "calculated" if variable.start is None else "exact"
    return out


def _value(variable: Variable) -> dict[str, str]:
    out = {"unit": variable.unit} if variable.unit else {}
    return out if variable.start is None else out | {"start": repr(float(variable.start))}


def _second(listed: ET.Element, variables: Sequence[Variable]) -> None:
    time = {"name": "time", "valueReference": "0", "causality": "independent"}
    one = ET.SubElement(listed, "ScalarVariable", time | {"variability": "continuous"})
    ET.SubElement(one, "Real", unit="s")
    for variable in variables:
        one = ET.SubElement(listed, "ScalarVariable", _common(variable))
        ET.SubElement(one, "Real", _value(variable))


def _third(listed: ET.Element, variables: Sequence[Variable]) -> None:
    time = {"name": "time", "valueReference": "0", "causality": "independent", "unit": "s"}
    ET.SubElement(listed, "Float64", time | {"variability": "continuous"})
    for variable in variables:
        ET.SubElement(listed, "Float64", _common(variable) | _value(variable))


def _structure(fmi: int, variables: Sequence[Variable]) -> ET.Element:
    """Outputs, and those that are unknown at the start. None depends on an input at the same
    instant."""
    root, none = ET.Element("ModelStructure"), {"dependencies": ""}
    outputs = [(k, v) for k, v in enumerate(variables, 2) if v.causality == "output"]
    unknown = [(k, v) for k, v in outputs if v.start is None]
    if fmi == 3:
        for _, v in outputs:
            ET.SubElement(root, "Output", {"valueReference": str(v.reference)} | none)
        for _, v in unknown:
            ET.SubElement(root, "InitialUnknown", valueReference=str(v.reference))
        return root
    listed = ET.SubElement(root, "Outputs")
    for k, _ in outputs:
        ET.SubElement(listed, "Unknown", {"index": str(k)} | none)
    listed = ET.SubElement(root, "InitialUnknowns")
    for k, _ in unknown:
        ET.SubElement(listed, "Unknown", index=str(k))
    return root
