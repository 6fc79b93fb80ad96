"""The wiring picture (SVG), made from the pins of protocol.toml."""

from __future__ import annotations

from html import escape
from typing import Any

from pins import number_of

Box = tuple[str, list[tuple[str, str]], str]
# Boxes of each side: title, lines (function, words), remark. {flex} stands for that pin's number.
LEFT: list[Box] = [
    (
        "Motor bridge of joint 1 (BTS7960 or L298N)",
        [
            ("motor_forward", "RPWM / IN1"),
            ("motor_reverse", "LPWM / IN2"),
            ("motor_enable", "R_EN + L_EN / ENA, 10 k to ground"),
        ],
        "motor GB37-3530, 12 V",
    ),
    (
        "Stepper driver (A4988)",
        [
            ("step", "STEP, 10 k to ground"),
            ("step_direction", "DIR"),
            ("step_disable", "ENABLE, 10 k to 5 V"),
        ],
        "NEMA 17",
    ),
    (
        "Second bridge, where joint 2 has a motor",
        [
            ("motor_2_forward", "RPWM / IN1"),
            ("motor_2_reverse", "LPWM / IN2"),
            ("motor_2_enable", "R_EN + L_EN / ENA, 10 k to ground"),
        ],
        "",
    ),
    (
        "Encoder of joint 1, 5 V",
        [("encoder_1_a", "A"), ("encoder_1_b", "B")],
        "on the motor's shaft",
    ),
    ("Encoder of joint 2, 5 V", [("encoder_2_a", "A"), ("encoder_2_b", "B")], "on the joint"),
]
RIGHT: list[Box] = [
    (
        "Switches to ground, normally closed",
        [
            ("emergency_stop", "emergency stop"),
            ("limit_low", "joint 1, low end"),
            ("limit_high", "joint 1, high end"),
        ],
        "opened = hit, pressed or broken",
    ),
    (
        "Flex sensor",
        [("flex", "5 V - sensor - {flex} - 47 k - ground")],
        "100 nF {flex} to ground; on the strip",
    ),
    (
        "Motor supply, 12 V",
        [("supply", "12 V - 39 k - {supply} - 10 k - ground")],
        "100 nF {supply} to ground; grounds joined",
    ),
    (
        "Test point and lamp",
        [
            ("busy", "oscilloscope: control interrupt"),
            ("lamp", "lamp; pin 13 has one on the board"),
        ],
        "",
    ),
]
TOP, LINE, GAP = 80, 26, 14


def _line(y: int, left: bool, number: str, words: str) -> str:
    """A wire between the board (400 to 600) and a box, with the pin's number and its end."""
    ends, inside, outside = ((310, 400), 408, 300) if left else ((600, 690), 592, 700)
    anchors = ("", ' text-anchor="end"')
    return (
        f'<line x1="{ends[0]}" y1="{y}" x2="{ends[1]}" y2="{y}" stroke="#333"/>'
        f'<text x="{inside}" y="{y + 4}"{anchors[not left]}>{escape(number)}</text>'
        f'<text x="{outside}" y="{y + 4}"{anchors[left]}>{escape(words)}</text>'
    )


def _boxes(boxes: list[Box], left: bool, numbers: dict[str, str]) -> list[str]:
    out, y = [], TOP
    x = 20 if left else 690
    for title, lines, remark in boxes:
        if lines[0][0] not in numbers:  # a map without a second motor
            continue
        height = 24 + LINE * (len(lines) + bool(remark))
        middle = x + 145
        out.append(
            f'<rect x="{x}" y="{y}" width="290" height="{height}" rx="8" fill="#faf6ee" '
            'stroke="#b08d57"/>'
        )
        out.append(
            f'<text x="{middle}" y="{y + 19}" text-anchor="middle" font-weight="bold">'
            f"{escape(title)}</text>"
        )
        for place, (name, words) in enumerate(lines):
            out.append(_line(y + 40 + LINE * place, left, numbers[name], words.format(**numbers)))
        if remark:
            out.append(
                f'<text x="{middle}" y="{y + height - 8}" text-anchor="middle" fill="#555">'
                f"{escape(remark.format(**numbers))}</text>"
            )
        y += height + GAP
    return out


def picture(pins: dict[str, Any], said: str) -> str:
    """The whole SVG file.

    Args:
        pins: the checked [pins] table.
        said: what a reader of the file must know: where it comes from.

    Returns:
        The text of the file.
    """
    numbers = {name: number_of(entry) for name, entry in pins.items()}
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1000 740" '
        'font-family="sans-serif" font-size="13">',
        f"<!-- {said} -->",
        "<title>Wiring of the rig: Arduino Mega 2560 between drives and sensors</title>",
        '<rect width="1000" height="740" fill="#fff"/>',
        '<rect x="400" y="30" width="200" height="680" rx="10" fill="#e6f1f5" stroke="#1c6e8c"/>',
        '<text x="500" y="56" text-anchor="middle" font-weight="bold">Arduino Mega 2560</text>',
        '<text x="500" y="698" text-anchor="middle" fill="#555">USB: host, 500 kbit/s</text>',
        *_boxes(LEFT, True, numbers),
        *_boxes(RIGHT, False, numbers),
        "</svg>",
    ]
    return "\n".join([*parts, ""])
