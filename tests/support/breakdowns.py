"""What no control tick detects: a host silent or drowned out, hangs, resets, a damaged memory; and
what is measured then."""

from __future__ import annotations

import functools
import random
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from boards import TICK, Rigged
from faults import Case, Row, begins, nothing, only_by_hand
from flexlab.board.base import BoardError
from flexlab.board.protocol import messages
from flexlab.board.protocol.declaration import CONFIG, Fault, Result, State
from flexlab.board.protocol.frames import encode
from flexlab.board.protocol.session import Refused
from flexlab.experiment.flash import settings_crc


def restarted(r: Rigged, seconds: float = 0.3) -> None:
    """Let time pass until the board announces itself anew."""
    begin = r.board.now()
    r.player = None
    while r.link.alive:
        assert r.board.now() - begin < seconds, "no announcement"
        r.link.run(0.001)
    r.link.run(0.02)


def off_until_armed(r: Rigged, state: State, fault: Fault) -> int:
    """After a reset: the reason, outputs off, nothing moves before reference and arm. Returns the
    last driven cycle."""
    who = r.link.connect()
    assert (who.state, who.fault) == (state, fault)
    off_since = r.last_driven
    r.link.run(0.05)
    assert not r.driven and r.last_driven == off_since
    with pytest.raises(Refused) as refused:
        r.link.command("arm", mode=1)
    assert refused.value.result is (
        Result.wrong_state if state is State.fault else Result.not_referenced
    )
    if fault is not Fault.none:
        r.link.command("clear", fault=fault)
    r.link.command("reference", position_1=0, position_2=0, steps=0)
    r.link.command("arm", mode=1)
    r.link.run(0.01)
    assert r.state is State.armed and r.driven
    r.link.command("stop")
    return off_since


def resets(cause: str, fault: Fault) -> Callable[[str], Row]:
    def measured(compiler: str) -> Row:
        with Rigged(compiler) as r:
            r.go(r.back_and_forth())
            assert r.driven
            caused = r.cycle
            r.board.simulator.reset(cause)
            restarted(r)
            off = off_until_armed(r, State.fault if fault is not Fault.none else State.idle, fault)
            return Row(fault, off - caused, None)

    return measured


def hangs(symbol: str) -> Callable[[str], Row]:
    """The code at a symbol becomes an endless loop (in simavr's flash) and is put right again at
    the reset, which cures it."""

    def measured(compiler: str) -> Row:
        with Rigged(compiler) as r:
            r.go(r.back_and_forth())
            assert r.driven
            simulator = r.board.simulator
            at, caused = simulator.symbol(symbol), r.cycle
            before = simulator.flash[at] | simulator.flash[at + 1] << 8
            simulator.patch(at, [0xCFFF])  # rjmp to itself
            r.player = None
            while simulator.window.resets == 0:
                r.board.wait(0.001)
                assert r.cycle - caused < 300 * TICK, "no reset"
            simulator.patch(at, [before])
            restarted(r)
            assert r.link.identity.resets == ("watchdog",)
            off = off_until_armed(r, State.fault, Fault.watchdog)
            return Row(Fault.watchdog, off - caused, None)

    return measured


def silent(noise: Callable[[Rigged], bytes]) -> Callable[[str], Row]:
    """The host says nothing that the board could take; `noise` is what is on the line instead, anew
    every millisecond."""

    def measured(compiler: str) -> Row:
        with Rigged(compiler, trace=("busy",)) as r:
            r.go(
                r.back_and_forth(duration_s=1.0)
            )  # all of it fits the look-ahead twice over: no underrun comes first
            board = r.board
            r.link.command("keepalive")  # the last word, wherever those before it fell
            caused, asked = r.cycle, board.now()
            while r.driven:
                board.write(noise(r))
                board.wait(0.001)
                assert board.now() - asked < 1.0
            board.wait(0.01)
            r.link.run(0.02)
            r.until(lambda: r.fault is not Fault.none, 0.5, feed=False)
            assert r.fault is Fault.host_silent and r.state is State.fault
            ticks = begins(board.simulator.edges())
            row = Row(
                Fault.host_silent,
                r.last_driven - caused,
                r.last_driven - ticks[r.link.newest["fault_tick"] - 1],
            )
            r.player = None
            only_by_hand(r, Case(Fault.host_silent, "", nothing, 0.0))
            return row

    return measured


def flipped(compiler: str, bits: slice) -> int:
    """Boots a board for each flipped bit of the stored configuration: all in Fault, with safe
    defaults. Returns how many."""
    with Rigged(compiler) as r:
        good = r.board.simulator.read_eeprom(0, 4096)
        used = [at for at in range(4096) if good[at] != 0xFF]
    defaults = settings_crc({name: item.default for name, item in CONFIG.items()})
    tried = 0
    for bit in range(8 * used[0], 8 * (used[-1] + 1))[bits]:
        spoilt = bytearray(good)
        spoilt[bit // 8] ^= 1 << bit % 8
        with Rigged(compiler, blank=True, eeprom=bytes(spoilt)) as r:
            who = r.link.identity
            assert (who.state, who.fault, who.configuration_crc) == (
                State.fault,
                Fault.bad_configuration,
                defaults,
            ), bit
            with pytest.raises(BoardError):
                r.link.command("arm", mode=1)
            assert not r.driven and r.last_driven == 0
        tried += 1
    return tried


def garbage(r: Rigged) -> bytes:
    return bytes(NOISE.randrange(256) for _ in range(45))  # a millisecond of a full line


def strangers(r: Rigged) -> bytes:
    """Good frames with numbers that nobody waits for; each is answered."""
    return encode(messages.pack("keepalive", 0xAAAA)) * 5


@dataclass(frozen=True)
class Other:
    """Like a case, with a measurement of its own."""

    fault: Fault
    what: str
    measure: Callable[[str], Row]
    within_s: float


NOISE = random.Random(5)
BITE_S = 0.064  # of the watchdog; twice that to its reset
OTHERS = {
    name: Other(fault, what, functools.cache(how), within_s)
    for name, fault, what, how, within_s in (
        ("silent host", Fault.host_silent, "host silent", silent(lambda r: b""), 0.2),
        ("flood", Fault.host_silent, "line flooded with garbage", silent(garbage), 0.2),
        (
            "strangers",
            Fault.host_silent,
            "line flooded with good frames out of sequence",
            silent(strangers),
            0.2,
        ),
        ("hung loop", Fault.watchdog, "main loop hangs", hangs("loop"), BITE_S + 0.01),
        (
            "hung interrupt",
            Fault.watchdog,
            "control interrupt hangs, no other runs",
            hangs("__vector_47"),
            2 * BITE_S + 0.02,
        ),
        (
            "reset",
            Fault.none,
            "reset in mid-motion: button, or a program opens the port",
            resets("external", Fault.none),
            0.0,
        ),
        (
            "brown-out",
            Fault.brown_out,
            "dip of the board's supply (its flag set)",
            resets("brown-out", Fault.brown_out),
            0.0,
        ),
    )
}
