"""Where the checkout is that the laboratory runs from; an installed package has no firmware."""

from pathlib import Path

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
