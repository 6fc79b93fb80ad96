"""The table of sections: which links of a URDF bend, and how."""

from __future__ import annotations

import os
from typing import Any

from ...errors import InputError
from ...io import read_toml
from ...robot import Link

# keys of [[link]] that a table may have; with elements the link bends
KEYS = (
    "elements",
    "modes",
    "length_m",
    "section",
    "young_modulus_Pa",
    "density_kg_m3",
    "mass_per_length_kg_m",
    "bending_stiffness_N_m2",
    "damping",
    "mass",
    "sensor",
    "joint",
)


def read_sections(path: str | os.PathLike[str] | None) -> dict[str, dict[str, Any]]:
    """A file of sections: a table for each link, by its name in the URDF.

    Args:
        path: of the TOML file; None: no link bends.

    Returns:
        Keys of [[link]] by link.

    Raises:
        InputError: the file cannot be read, or has another key.
    """
    if path is None:
        return {}
    tables, file = read_toml(path), os.fspath(path)
    for link, table in tables.items():
        if not isinstance(table, dict):
            expected = "expected a table for each link, [NAME], with keys of [[link]]"
            raise InputError(expected, key=link, value=table, file=file)
        for key, value in table.items():
            if key not in KEYS:
                expected = f"expected one of {', '.join(KEYS)}"
                raise InputError(expected, key=f"{link}.{key}", value=value, file=file)
        joint = table.get("joint", {})
        if not isinstance(joint, dict) or "type" in joint:
            expected = "expected keys of [link.joint] but for type, which the URDF says"
            raise InputError(expected, key=f"{link}.joint", value=joint, file=file)
    return tables


def check_names(sections: dict[str, dict[str, Any]], links: list[str], file: str) -> None:
    """Raises InputError for a table whose link is not one of the chain's moving links."""
    for name in sections:
        if name not in links:
            expected = f"expected a link that moves: {', '.join(links)}"
            raise InputError(expected, key=name, file=file)


def bends(table: dict[str, Any]) -> bool:
    """Whether a link with this table has elements."""
    elements = table.get("elements", Link.model_fields["elements"].default)
    return isinstance(elements, int) and elements > 0
