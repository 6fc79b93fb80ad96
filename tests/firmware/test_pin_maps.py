"""[pins] of protocol.toml: what is declared is what is read and driven, or the build stops with a
sentence that names pin and function."""

import json
import os
import random
import subprocess
import sys

import pytest

from pin_maps import ROOT, build, checkout, declare, declared, illegal, legal, pins, place, protocol

SLOW = pytest.mark.slow
pytestmark = pytest.mark.timeout(1200)  # ten seconds of a processor, minutes of a busy one


def switches_on_ports_that_no_instruction_reaches():
    """Stop and limits at ports H, K and G: read by other instructions than at port A. An output
    beside the PWM's: written a thousand times a second."""
    out = declared()
    for name, port in {
        "emergency_stop": "PH6",
        "limit_low": "PK7",
        "limit_high": "PG5",
        "busy": "PH0",
    }.items():
        place(out[name], port)
    return out


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return checkout(tmp_path_factory.mktemp("checkout"))


def works(copy, wanted):
    """Declared, built and used: every function does what it is for, the stop within a tick."""
    declare(copy, wanted)
    done = build(copy)
    assert done.returncode == 0, done.stderr
    paths = [copy / "model", copy / "analysis", copy / "tests" / "support"]
    probe = subprocess.run(
        [sys.executable, copy / "tests" / "support" / "pin_map_probe.py"],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(map(str, paths))},
    )
    assert probe.returncode == 0, probe.stderr
    found = json.loads(probe.stdout)
    motion, broken = found["motion"], found["broken"]
    assert found["duty"] == pytest.approx([0.5, -0.5], abs=2e-3)
    assert motion["carriage_m"] == pytest.approx([0.02, 0.0], abs=2e-3)
    assert motion["joint_rad"] == pytest.approx([0.8, 0.0], abs=0.02)
    assert motion["encoders"] == pytest.approx([0.0, 0.0], abs=0.02)
    assert motion["flex_V"] == pytest.approx(0.0, abs=0.02)
    assert motion["supply_V"] == pytest.approx(0.0, abs=0.1)
    assert motion["lamp"] == [False, True]
    assert motion["busy_1_s"] == pytest.approx(1000, rel=0.02)
    for name in ("emergency stop", "emergency wire", "limit low", "limit high"):
        assert 0 < broken[name]["ticks"] < 1.15, name  # the tick's own work is the rest
    assert [row["fault"] for row in broken.values()] == [
        *("emergency_stop", "emergency_stop", "limit_low", "limit_high"),
        *("encoder_1", "encoder_1", "encoder_2", "encoder_2", "runaway_1", "runaway_2"),
        *("flex_low", "supply_low"),
    ]


def test_switches_work_on_any_port(copy):
    works(copy, switches_on_ports_that_no_instruction_reaches())


@SLOW
@pytest.mark.parametrize("seed", range(10))
def test_a_random_legal_map_works(copy, seed):
    works(copy, legal(random.Random(seed)))


def test_random_legal_maps_are_accepted():
    for seed in range(500):
        pins.check(legal(random.Random(seed)))


def test_an_illegal_map_is_refused_with_pin_and_function():
    """400 maps with one mistake each: the sentence names the pin and a function."""
    refused = 0
    for seed in range(400):
        wanted, functions, pin = illegal(random.Random(seed))
        with pytest.raises(pins.Mistake) as mistake:
            pins.check(wanted)
        said = str(mistake.value)
        assert any(f"pins.{name}:" in said for name in functions), said
        assert pin in said and "\n" not in said and len(said) < 250, said
        refused += 1
    assert refused == 400


def test_outputs_of_two_timers_are_refused():
    wanted = declared()
    place(wanted["motor_reverse"], "PB5")
    with pytest.raises(pins.Mistake, match=r"pins\.motor_reverse: OC1A belongs to timer 1, .*OC4A"):
        pins.check(wanted)


def test_a_function_that_is_missing_or_unknown_is_named():
    wanted = declared()
    del wanted["limit_low"]
    with pytest.raises(pins.Mistake, match=r"pins\.limit_low: missing"):
        pins.check(wanted)
    wanted = declared() | {"limit_left": {"port": "A", "bit": 0, "text": ""}}
    with pytest.raises(pins.Mistake, match=r"pins\.limit_left: no such function"):
        pins.check(wanted)


LAMP = 'lamp = { pin = "13", port = "B", bit = 7, text = "off Idle'
IDLE = 'idle = { code = 0, text = "Outputs off.'
WRONG = {
    "a list for a port": (LAMP, LAMP.replace('"B"', '["B"]'), "pins.lamp: port ['B']"),
    "a list for a pin": (LAMP, LAMP.replace('"13"', "[13]"), "pins.lamp: pin [13]: expected"),
    "pin 0 elsewhere": (LAMP, LAMP.replace('"13"', "0"), "pins.lamp: pin 0 is PE0, not PB7"),
    "no pin": (LAMP, LAMP.replace('"13"', '""'), "pins.lamp: the Mega 2560 has no pin ''"),
    "pin false": (LAMP, LAMP.replace('"13"', "false"), "pins.lamp: pin False: expected"),
    "two lines": (LAMP, LAMP.replace("off Idle", r"a\nint x;"), "pins.lamp: text = "),
    "a backslash": (LAMP, LAMP.replace("off Idle", r"a\\ "), "pins.lamp: text = "),
    "a tab": (IDLE, IDLE.replace("Outputs", r"\t"), "states.idle.text = "),
    "a number for a text": (IDLE, IDLE.replace('"Outputs off.', '5 } # "'), "states.idle.text = 5"),
    "a text for a code": (IDLE, IDLE.replace("0", '"0"'), "states.idle.code = '0': expected a wh"),
    "no code": (IDLE, IDLE.replace("code = 0, ", ""), "states.idle.code: missing"),
    "a list of pins": ("[pins]\n", "[[pins]]\n", "pins = [{'motor_forward'"),
    "a list of a table": ("[faults]\n", "[[faults]]\n", "faults = [{'none'"),
    "a number for a table": (IDLE, f"idle = 3 # {IDLE}", "states.idle = 3: expected a table"),
    "a text for a constant": (
        "duty_full = 800",
        'duty_full = "800"',
        "constants.duty_full = '800'",
    ),
    "no list of fields": ("fields = [", "fields = 3 #[", "message[1].fields = 3"),
    "no length": ('"u8[3]"', '"u8[x]"', "type 'u8[x]': expected one of"),
    "a name that is none": ("idle = {", '"a b" = {', "states.a b: the name 'a b': expected"),
}


@pytest.mark.parametrize(("old", "new", "said"), WRONG.values(), ids=WRONG)
def test_a_wrong_declaration_is_one_sentence(old, new, said, tmp_path, monkeypatch, capsys):
    text = protocol.SOURCE.read_text(encoding="utf-8")
    assert old in text
    text = text.replace(old, new, 1)
    if new == "fields = 3 #[":
        begin = text.index(new)
        text = text[: begin + len("fields = 3")] + text[text.index("]\n\n", begin) + 1 :]
    monkeypatch.setattr(protocol, "SOURCE", tmp_path / "protocol.toml")
    protocol.SOURCE.write_text(text, encoding="utf-8")
    assert protocol.main(["--check"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("protocol.toml: ") and said in err and err.count("\n") == 1, err


def test_a_port_without_a_header_is_said(tmp_path, monkeypatch, capsys):
    """A chip on another board than the Mega may serve: it is a note."""
    text = protocol.SOURCE.read_text(encoding="utf-8")
    monkeypatch.setattr(protocol, "SOURCE", tmp_path / "protocol.toml")
    new = LAMP.replace('pin = "13", port = "B"', 'port = "J"')
    protocol.SOURCE.write_text(text.replace(LAMP, new), encoding="utf-8")
    assert protocol.main(["--check"]) == 1
    assert "pins.lamp: PJ7 has no header on the Mega 2560" in capsys.readouterr().err


def test_any_letter_is_the_same_in_the_generated_module():
    wanted = protocol.tomllib.loads(protocol.SOURCE.read_text(encoding="utf-8"))
    wanted["pins"]["lamp"]["text"] = text = "手 \U0001f4a1"
    made = {}
    exec(protocol.python_module.module(wanted, 1, ""), made)
    assert made["PINS"]["lamp"].text == text


def test_texts_break_no_table():
    table = pins.table({"lamp": {"port": "B", "bit": 7, "text": "on | off <!-- pins: end -->"}})
    assert table[-1].endswith(r"on \| off &lt;!-- pins: end --> |")


@pytest.mark.parametrize("seed", range(3))
def test_the_build_stops_and_leaves_everything_as_it_was(copy, seed):
    """No ELF file is named, nothing made of the declaration has changed."""
    made = (
        "firmware/src/pins.h",
        "firmware/README.md",
        "analysis/flexlab/board/protocol/declaration.py",
    )
    before = [(copy / name).read_bytes() for name in made]
    wanted, functions, _ = illegal(random.Random(1000 + seed))
    declare(copy, wanted)
    done = build(copy)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("protocol.toml: pins.") and done.stderr.count("\n") == 1
    assert any(name in done.stderr for name in functions)
    assert [(copy / name).read_bytes() for name in made] == before


def test_plain_platformio_stops_too(copy):
    """`pio run`, without build.py's own look at the declaration."""
    wanted, *_ = illegal(random.Random(2000))
    declare(copy, wanted)
    script = "import build; build.pio(['run'], build.surroundings('debian'), quiet=True)"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=copy / "firmware", capture_output=True, text=True
    )
    assert done.returncode != 0 and "protocol.toml: pins." in done.stderr


def test_the_shipped_files_are_those_of_the_declaration():
    check = [sys.executable, ROOT / "firmware" / "protocol.py", "--check"]
    assert subprocess.run(check).returncode == 0
