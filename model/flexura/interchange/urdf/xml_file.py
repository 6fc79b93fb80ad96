"""Reading a URDF file's XML: one clear error for whatever is wrong, and no entities."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from typing import Any, NoReturn
from xml.parsers import expat

from ...errors import InputError

MOST_BYTES = 20_000_000
MOST_DEPTH = 64  # elements within elements


def read_xml(path: str | os.PathLike[str]) -> ET.Element:
    """The root of an XML file.

    A document type is refused: its entities may stand for gigabytes or for other files.

    Args:
        path: of the file.

    Returns:
        The root element; prefixes of names stay.

    Raises:
        InputError: it cannot be read or is not XML; the message names the file and the line.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError("expected the path of a URDF file", key="path", value=path)
    name = os.fspath(path)
    try:
        with open(path, "rb") as stream:
            raw = stream.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or error
        raise InputError(f"cannot be read ({said}): expected a URDF file", file=name) from None
    if len(raw) > MOST_BYTES:
        raise InputError(f"more than {MOST_BYTES // 10**6} MB: expected a URDF file", file=name)
    return _Tree(name).parse(raw)


class _Tree:
    """The elements of one file while it is read."""

    def __init__(self, name: str) -> None:
        self.name, self.depth, self.builder = name, 0, ET.TreeBuilder()
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._begin
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self.builder.data
        self.parser.StartDoctypeDeclHandler = self._document_type

    def parse(self, raw: bytes) -> ET.Element:
        try:
            self.parser.Parse(raw, True)
            return self.builder.close()
        except expat.ExpatError as error:
            expected = f"line {error.lineno}: not XML ({expat.ErrorString(error.code)})"
            raise InputError(f"{expected}: expected a URDF file", file=self.name) from None
        except (ValueError, LookupError) as error:  # an encoding that is not known
            raise InputError(f"not XML ({error}): expected a URDF file", file=self.name) from None

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        if self.depth > MOST_DEPTH:
            self._refuse("elements are nested too deeply")
        self.builder.start(tag, attributes)

    def _end(self, tag: str) -> None:
        self.depth -= 1
        self.builder.end(tag)

    def _document_type(self, *_: Any) -> None:
        self._refuse("a document type (<!DOCTYPE) is not read: its entities are not safe")

    def _refuse(self, why: str) -> NoReturn:
        line = self.parser.CurrentLineNumber
        raise InputError(f"line {line}: {why}", file=self.name)
