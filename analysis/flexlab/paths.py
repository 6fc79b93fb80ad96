"""Where the checkout is that the laboratory runs from."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
ROBOTS = ROOT / "model" / "robots"
MANOEUVRES = ROOT / "model" / "manoeuvres"
