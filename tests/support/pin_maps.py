"""Random pin maps for protocol.toml, legal ones and illegal ones, and a checkout to build in."""

from __future__ import annotations

import random
import shutil
import subprocess
import sys
from copy import deepcopy
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
sys.path.insert(0, str(FIRMWARE))  # its modules are a program's, not a package's

import pins  # noqa: E402
import protocol  # noqa: E402

Map = dict[str, dict[str, Any]]
PLACES = [f"P{port}{bit}" for port, bits in pins.BITS.items() for bit in range(bits)]
FREE = [place for place in PLACES if place not in pins.SERIAL]
TIMERS = "134"


def declared() -> Map:
    """The shipped map."""
    return deepcopy(protocol.tomllib.loads(protocol.SOURCE.read_text(encoding="utf-8"))["pins"])


def place(entry: dict[str, Any], port: str) -> None:
    """Move an entry to PA4 or the like."""
    entry.pop("pin", None)
    entry |= {"port": port[1], "bit": int(port[2:])}


def legal(chance: random.Random) -> Map:
    """Every function at a random pin that can serve it: by the data sheet, not by pins.py."""
    out, left = declared(), set(FREE)
    timer = chance.choice(TIMERS)
    compare = {"1": ["PB5", "PB6", "PB7"], "3": ["PE3", "PE4", "PE5"], "4": ["PH3", "PH4", "PH5"]}
    interrupts = [f"PD{n}" for n in range(4)] + [f"PE{n}" for n in range(4, 8)]
    needs = {
        "motor_forward": compare[timer],
        "motor_reverse": compare[timer],
        "step": ["PL4", "PL5"],
        **{f"encoder_{joint}_{line}": interrupts for joint in "12" for line in "ab"},
        "flex": [f"PF{n}" for n in range(8)],
        "supply": [f"PF{n}" for n in range(8)],
    }
    for name in [*needs, *(name for name in out if name not in needs)]:
        port = chance.choice(sorted(left & set(needs.get(name, FREE))))
        left.remove(port)
        place(out[name], port)
    return out


def _moved(chance: random.Random, names: list[str], ports: list[str]) -> tuple[Map, str, str]:
    """One function to a pin that nobody has and that cannot serve it."""
    out = declared()
    used = {pins.port_of(entry) for entry in out.values()}
    name, port = chance.choice(names), chance.choice([port for port in ports if port not in used])
    place(out[name], port)
    return out, name, port


def illegal(chance: random.Random) -> tuple[Map, set[str], str]:
    """A map with one mistake, the functions that it is about, and the pin (or what is said to be
    one)."""
    encoders = [f"encoder_{joint}_{line}" for joint in "12" for line in "ab"]
    without = lambda served: [port for port in FREE if port not in served]
    kind = chance.randrange(8)
    if kind == 0:  # two functions at one pin
        out = declared()
        one, two = chance.sample(list(out), 2)
        place(out[one], pins.port_of(out[two]))
        return out, {one, two}, pins.port_of(out[two])
    if kind == 1:
        out = declared()
        name, port = chance.choice(list(out)), chance.choice(sorted(pins.SERIAL))
        place(out[name], port)
        return out, {name}, port
    if kind == 2:  # a pin that the chip does not have
        out = declared()
        name = chance.choice(list(out))
        port, bit = chance.choice([("I", 0), ("G", 6), ("G", 7), ("A", 8), ("C", -1), ("Z", 3)])
        out[name] = {"port": port, "bit": bit, "text": ""}
        return out, {name}, repr(port)
    if kind == 3:  # number and port contradict each other
        out = declared()
        name = chance.choice([name for name in out if out[name].get("pin")])
        number = chance.choice([n for n in pins.MEGA if pins.MEGA[n] != pins.port_of(out[name])])
        out[name]["pin"] = number
        return out, {name}, number
    pwm = ["PB5", "PB6", "PB7", "PE3", "PE4", "PE5", "PH3", "PH4", "PH5"]
    if kind == 4:
        made, name, port = _moved(chance, ["motor_forward", "motor_reverse"], without(pwm))
    elif kind == 5:
        made, name, port = _moved(chance, ["step"], without(["PL4", "PL5"]))
    elif kind == 6:
        edges = [f"PD{n}" for n in range(4)] + [f"PE{n}" for n in range(4, 8)]
        made, name, port = _moved(chance, encoders, without(edges))
    else:
        made, name, port = _moved(chance, ["flex", "supply"], without([f"PF{n}" for n in range(8)]))
    return made, {name}, port


def checkout(folder: Path) -> Path:
    """The firmware, its tools and the laboratory at another place; the model is where it was."""
    unwanted = shutil.ignore_patterns(".pio", "__pycache__")
    for part in ("firmware", "tools", "analysis", "tests"):
        shutil.copytree(ROOT / part, folder / part, ignore=unwanted)
    (folder / "model").symlink_to(ROOT / "model")
    return folder


def declare(folder: Path, wanted: Map) -> None:
    """Write a map into the checkout's protocol.toml."""
    path = folder / "firmware" / "protocol.toml"
    head, _, rest = path.read_text(encoding="utf-8").partition("[pins]\n")
    rows = []
    for name, entry in wanted.items():
        pin = f'pin = "{entry["pin"]}", ' if "pin" in entry else ""
        where = f'{pin}port = "{entry["port"]}", bit = {entry["bit"]}'
        rows.append(f'{name} = {{ {where}, text = "{entry["text"]}" }}\n')
    tail = rest[rest.index("\n# Codes from 128") :]
    path.write_text(head + "[pins]\n" + "".join(rows) + tail, encoding="utf-8")


def build(folder: Path) -> subprocess.CompletedProcess[str]:
    """The checkout's own build, and nothing before it."""
    command = [sys.executable, folder / "firmware" / "build.py", "--compiler", "debian"]
    return subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
