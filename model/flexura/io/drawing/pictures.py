"""What every picture shares: its letters, texts that are no mathematics, its bytes, and what
matplotlib says of it."""

from __future__ import annotations

import io
import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ...errors import FlexuraError, InputError, out_of_memory
from ...optional import Missing, load

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMS = ("pdf", "svg", "png")
# letters that DejaVu Sans lacks are taken from the first of the others that is installed
LETTERS: dict[str, Any] = {
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.sans-serif": [
        "Noto Sans CJK JP",
        "Noto Sans CJK SC",
        "Source Han Sans",
        "WenQuanYi Zen Hei",
        "Hiragino Sans",
        "Microsoft YaHei",
        "Yu Gothic",
        "Malgun Gothic",
        "Arial Unicode MS",
        "DejaVu Sans",
    ],
}
MISSING = re.compile(r"Glyph (\d+) .* missing from ")

log = logging.getLogger("flexura")


class NoPicture(FlexuraError):
    """A picture cannot be drawn; what it would show is whole."""


def plain(text: str) -> str:
    """A text of a user or a file for matplotlib, which shows it without mathematics.

    Args:
        text: the text.

    Returns:
        The text with its dollar signs marked.
    """
    return text.replace("$", r"\$")


@contextmanager
def attempted(name: str) -> Iterator[None]:
    """Draw a picture: what fails is a NoPicture, and warnings of matplotlib are lines of the log.

    Args:
        name: of its file.

    Yields:
        Nothing.

    Raises:
        NoPicture: it cannot be drawn.
    """
    try:
        with told(name):
            yield
    except MemoryError as error:
        raise NoPicture(f"{name} cannot be drawn: {out_of_memory(error)}") from None
    except (InputError, Missing):
        raise
    except Exception as error:
        kind = "" if isinstance(error, FlexuraError) else f"{type(error).__name__}: "
        why = " ".join(f"{kind}{error}".split())
        raise NoPicture(f"{name} cannot be drawn: {why}") from error


@contextmanager
def told(name: str = "the picture", *, letters: bool = True) -> Iterator[None]:
    """Say warnings of matplotlib as lines of the log, each once, without a place in its source.

    Args:
        name: of the picture.
        letters: that no font has are an empty box; in an SVG the reader's fonts decide.

    Yields:
        Nothing.
    """
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", UserWarning)
        yield
    texts = list(dict.fromkeys(str(each.message) for each in said))
    boxes = [chr(int(found[1])) for text in texts if (found := MISSING.match(text))]
    if boxes and letters:
        log.warning(
            "%s: no installed font that pictures use has %s; an empty box stands there",
            name,
            " ".join(boxes),
        )
    for text in texts:
        if not MISSING.match(text):
            log.warning("%s: %s", name, text)


def saved(drawing: Figure, form: str, *, dpi: float = 200, **metadata: str) -> bytes:
    """The bytes of a figure, the same for the same runs.

    Args:
        drawing: the figure.
        form: "pdf", "svg" or "png".
        dpi: dots per inch.
        metadata: kept in the file, such as Title.

    Returns:
        The content of the file.

    Raises:
        InputError: another form.
    """
    matplotlib = load("matplotlib")
    if form not in FORMS:
        raise InputError(
            f"expected a file that ends with .{', .'.join(FORMS)}", key="out", value=form
        )
    fixed: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(form, {})
    reproducible = {"svg.fonttype": "none", "pdf.fonttype": 42, "svg.hashsalt": "flexura"}
    buffer = io.BytesIO()
    with matplotlib.rc_context(LETTERS | reproducible), told(letters=form != "svg"):
        drawing.savefig(buffer, format=form, dpi=dpi, metadata=metadata | fixed)
    return buffer.getvalue()
