"""The cross-section of a link: its shapes, with their areas and second moments of area."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from ..errors import WrongValue
from .table import Table, quantity


class Shape(NamedTuple):
    """A shape of sections: its dimensions, which of them lies in the plane of bending ("": none is
    given), its area [m^2] and its second moment of area [m^4] as functions of the dimensions."""

    keys: tuple[str, ...]
    depth: str
    area: Callable[..., Any]
    second_moment: Callable[..., Any]


def _hollow_moment(width: Any, height: Any, inner_width: Any, inner_height: Any) -> Any:
    """A rectangle less another one with the same axis."""
    outer = width * (height * height * height)
    return (outer - inner_width * (inner_height * inner_height * inner_height)) / 12


# (8); written with products alone, which give one number and an array of them the same digits
SHAPES = {
    "rectangle": Shape(
        ("width_m", "height_m"),
        "height_m",
        lambda b, h: b * h,
        lambda b, h: b * (h * h * h) / 12,
    ),
    "round": Shape(
        ("diameter_m",),
        "diameter_m",
        lambda d: math.pi / 4 * (d * d),
        lambda d: math.pi / 64 * ((d * d) * (d * d)),
    ),
    "tube": Shape(
        ("outer_diameter_m", "wall_m"),
        "outer_diameter_m",
        lambda d, t: math.pi * t * (d - t),
        lambda d, t: math.pi / 16 * t * (d - t) * (d * d + (d - 2 * t) * (d - 2 * t)),
    ),
    "box": Shape(
        ("width_m", "height_m", "wall_m"),
        "height_m",
        lambda b, h, t: 2 * t * (b + h - 2 * t),
        lambda b, h, t: _hollow_moment(b, h, b - 2 * t, h - 2 * t),
    ),
    "I": Shape(
        ("width_m", "height_m", "flange_m", "web_m"),
        "height_m",
        lambda b, h, f, w: 2 * b * f + w * (h - 2 * f),
        lambda b, h, f, w: _hollow_moment(b, h, b - w, h - 2 * f),
    ),
    "general": Shape(
        ("area_m2", "second_moment_m4"), "", lambda area, moment: area, lambda area, moment: moment
    ),
}

FORMS = (
    '{ shape = "round", diameter_m }, '
    '{ shape = "tube", outer_diameter_m, wall_m }, { shape = "box", width_m, height_m, wall_m }, '
    '{ shape = "I", width_m, height_m, flange_m, web_m } or { area_m2, second_moment_m4 }'
)

# Dimensions that leave a hole or a web: the first is below this share of the second.
_INSIDE = {
    "tube": (("wall_m", 0.5, "outer_diameter_m"),),
    "box": (("wall_m", 0.5, "width_m"), ("wall_m", 0.5, "height_m")),
    "I": (("flange_m", 0.5, "height_m"), ("web_m", 1.0, "width_m")),
}


class Section(Table):
    """A cross-section (8). Without `shape` it is a rectangle, or given by `area_m2` and
    `second_moment_m4`; `height_m` lies in the plane of bending."""

    shape: Literal["rectangle", "round", "tube", "box", "I"] | None = Field(
        None, description='the shape, "rectangle" (the default), "round", "tube", "box" or "I"'
    )
    width_m: float | None = quantity("width_m", "the section's width in metres", None)
    height_m: float | None = quantity(
        "height_m", "the section's height in the plane of bending in metres", None
    )
    diameter_m: float | None = quantity("diameter_m", "the diameter of a round in metres", None)
    outer_diameter_m: float | None = quantity(
        "outer_diameter_m", "the outer diameter of a tube in metres", None
    )
    wall_m: float | None = quantity("wall_m", "the wall of a tube or box in metres", None)
    flange_m: float | None = quantity("flange_m", "the thickness of an I's flanges in metres", None)
    web_m: float | None = quantity("web_m", "the thickness of an I's web in metres", None)
    area_m2: float | None = quantity("area_m2", "the section's area in square metres", None)
    second_moment_m4: float | None = quantity(
        "second_moment_m4",
        "the second moment of area about the axis across the plane of bending in m^4",
        None,
    )

    @model_validator(mode="before")
    @classmethod
    def _without_a_place(cls, given: Any) -> Any:
        if cls is Section and isinstance(given, dict) and "at_m" in given:
            expected = "none: sections with a place stand in a list, one from 0 and one at the end"
            raise WrongValue("at_m", given["at_m"], expected)
        return given

    @model_validator(mode="after")
    def _has_its_dimensions(self) -> Section:
        dimensions = {key for shape in SHAPES.values() for key in shape.keys}
        given = [k for k in type(self).model_fields if k in dimensions and getattr(self, k)]
        for key in given:
            if key not in self.form.keys:
                own = "by its area" if self.kind == "general" else f'of shape "{self.kind}"'
                expected = (
                    f"none: a section {own} has {', '.join(self.form.keys)}; other shapes: {FORMS}"
                )
                raise WrongValue(key, getattr(self, key), expected)
        for key in self.form.keys:
            if getattr(self, key) is None:
                said = type(self).model_fields[key].description
                raise WrongValue(key, None, f"missing: expected {said}")
        for key, share, of in _INSIDE.get(self.kind, ()):
            if not getattr(self, key) < share * getattr(self, of):
                least = f"{'half of ' if share < 1 else ''}{of}, {share * getattr(self, of):g}"
                raise WrongValue(key, getattr(self, key), f"less than {least}")
        return self

    @property
    def kind(self) -> str:
        """The name of the shape; "general": it has an area and a second moment."""
        if self.shape is not None:
            return self.shape
        general = self.area_m2 is not None or self.second_moment_m4 is not None
        return "general" if general else "rectangle"

    @property
    def form(self) -> Shape:
        """The shape."""
        return SHAPES[self.kind]

    @property
    def dimensions(self) -> tuple[float, ...]:
        """The values of the shape's keys [m, m^2, m^4]."""
        return tuple(getattr(self, key) for key in self.form.keys)


class SectionAt(Section):
    """A cross-section at a place along a tapered link."""

    at_m: float = quantity("at_m", "the place of this section along the link in metres")


def dimensions_at(section: Section | list[SectionAt], x: Any) -> tuple[Any, ...]:
    """The dimensions of a link's section, linear between its entries.

    Args:
        section: one, or a list along the link.
        x: places from the link's origin [m].

    Returns:
        The values of the shape's keys, one number each or as many as places.
    """
    if isinstance(section, Section):
        return section.dimensions
    at = [each.at_m for each in section]
    rows = zip(*(each.dimensions for each in section), strict=True)
    return tuple(np.interp(x, at, row) for row in rows)


def form_of(section: Section | list[SectionAt]) -> Shape:
    """The shape of a link's section.

    Args:
        section: one, or a list along the link, all of one shape.

    Returns:
        The shape.
    """
    return (section if isinstance(section, Section) else section[0]).form


def fibre(section: Section | list[SectionAt], x: ArrayLike, distance: float | None = None) -> Any:
    """Distance of a fibre from the axis over the second moment of area, y / I (146).

    Args:
        section: one, or a list along the link.
        x: places from the link's origin [m].
        distance: of the fibre, to the left of the tangent [m]; None: the outer one, at half the
            height or diameter.

    Returns:
        As many values [1/m^3]; None: the section has no height, and no distance is given.
    """
    form, dimensions = form_of(section), dimensions_at(section, x)
    second = form.second_moment(*dimensions)
    if distance is not None:
        return distance / second
    return dimensions[form.keys.index(form.depth)] / 2 / second if form.depth else None


def check_sections(section: Section | list[SectionAt], length: float) -> None:
    """Refuse sections along one link that have several shapes, or are as high as the link is long.

    Args:
        section: one, or a list along the link.
        length: of the link [m]; 0: none.

    Raises:
        WrongValue: there is one; its key begins with `section`.
    """
    several = isinstance(section, list)
    entries = section if isinstance(section, list) else [section]
    for k, each in enumerate(entries, 1):
        key = f"section[{k}]" if several else "section"
        if each.kind != entries[0].kind:
            expected = f"the shape of the first entry, {entries[0].kind}: a link tapers in one"
            raise WrongValue(f"{key}.shape", each.kind, expected)
        depth = each.form.depth
        if depth and 0 < length <= getattr(each, depth):
            what = "height" if depth == "height_m" else "diameter"
            raise WrongValue(
                f"{key}.{depth}",
                getattr(each, depth),
                f"a {what} below the link's length, {length:g} (metres, not millimetres?)",
            )
