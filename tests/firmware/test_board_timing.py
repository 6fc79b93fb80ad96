"""Time on the emulated board, in cycles: control ticks, interrupts, step and encoder edges; memory;
that it repeats itself."""

import functools

import numpy as np
import pytest

from boards import BENCH, COMPILERS, TICK, Rigged, elf
from flexlab.benchmarks.problems import firmware_load
from flexlab.board.emulator.simulator import CLOCK_HZ
from flexlab.board.protocol.declaration import Fault, State

both = pytest.mark.parametrize("compiler", COMPILERS)
TEN_MICROSECONDS = CLOCK_HZ // 100_000


@functools.cache
def loaded(compiler: str, every_term: bool = False) -> firmware_load.Load:
    return firmware_load.measure(elf(compiler), BENCH, 2.0, every_term)


@both
def test_the_load_is_as_hard_as_it_says(compiler):
    found = loaded(compiler)
    assert 20_000 <= found.edges_most_per_s < 22_000
    assert found.steps_most_per_s == pytest.approx(4000, rel=0.03)


@both
def test_the_control_interrupt_takes_less_than_40_percent_of_its_period(compiler):
    """With the rig's controllers, whatever interrupts it included."""
    assert 0.01 < loaded(compiler).control_share < 0.40


@both
def test_with_every_term_of_the_controllers_on_it_takes_a_little_more(compiler):
    """All gains, both set-point filters, joint 2 by its encoder: still under 40 %."""
    found = loaded(compiler, every_term=True)
    assert 0.01 < found.control_share < 0.40
    assert (
        found.missed == 0 and 0.95 * TICK <= found.period_least <= found.period_most <= 1.05 * TICK
    )


@both
def test_no_control_tick_is_lost_or_late(compiler):
    """A tick begins when its timer says, but for what shuts interrupts out: 50 us of it at most."""
    found = loaded(compiler)
    assert 0.95 * TICK <= found.period_least <= found.period_most <= 1.05 * TICK


@both
def test_no_encoder_edge_is_missed_at_20_000_a_second(compiler):
    """Both encoders, every edge: the firmware's counts are the plant's when all stands still
    again."""
    with Rigged(compiler, **firmware_load.HARD) as r:
        r.go(r.back_and_forth(0.0398, 2.498, duration_s=1.0), 0.0)
        r.until(lambda: r.player.done, 1.5)
        r.run(0.3)
        assert r.state is State.running and r.fault is Fault.none
        newest, sensors = r.link.newest, r.board.sensors
        assert newest["missed"] == 0
        assert newest["position_1"] == np.floor(sensors.encoder_1) and newest[
            "position_2"
        ] == np.floor(sensors.encoder_2)
        assert newest["steps"] == r.board.simulator.window.steps
        assert abs(sensors.encoder_1) < 800 and loaded(compiler).missed == 0


@both
def test_step_edges_at_4000_a_second(compiler):
    """At a constant rate the edges lie within 10 us of an even grid; between start and stop none is
    lost, none is extra."""
    with Rigged(compiler, trace=("step",), **firmware_load.HARD) as r:
        rate = 4000 / r.settings["stepper_steps_per_rad"]
        r.board.simulator.edges()
        r.go(r.open_loop(6.0, rate, duration_s=0.35), 0.3)
        rising = np.array([cycle for cycle, _, level in r.board.simulator.edges() if level])
        even = rising[rising > r.cycle - 0.1 * CLOCK_HZ]
        assert len(even) == pytest.approx(400, abs=1)
        grid = np.arange(len(even)) * CLOCK_HZ / 4000
        off = even - even[0] - grid
        assert np.abs(off - (off.max() + off.min()) / 2).max() <= TEN_MICROSECONDS
        r.run(0.3)  # it brakes and stands
        edges = r.board.simulator.edges()
        total = len(rising) + sum(level for _, _, level in edges)
        assert r.link.newest["steps"] == total == r.board.simulator.window.steps > 800
        assert len(edges) and r.cycle - edges[-1][0] > 0.1 * CLOCK_HZ


@both
def test_a_trajectory_ends_at_its_last_set_point_to_the_microstep(compiler):
    with Rigged(compiler) as r:
        r.go(r.back_and_forth(0.02, 0.8, duration_s=1.5), 0.0)
        r.until(lambda: r.player.done, 2.0)
        r.run(0.5)
        assert r.link.newest["steps"] == round(0.8 * r.settings["stepper_steps_per_rad"])
        assert r.plant.positions[0] == pytest.approx(0.02, abs=2e-4)


@both
def test_memory(compiler):
    found = loaded(compiler)
    assert found.flash < firmware_load.FLASH_BYTES / 2
    assert 0 < found.ram_static and 50 < found.stack_most and found.ram_share < 0.60


def history(slice_cycles: int) -> tuple[bytes, list[tuple[int, int, int]]]:
    """All bytes from the board and all edges of its outputs during a motion and a fault."""
    outputs = (
        "motor_forward",
        "motor_reverse",
        "motor_enable",
        "step",
        "step_direction",
        "step_disable",
        "busy",
    )
    received = bytearray()
    with Rigged(trace=outputs, slice_cycles=slice_cycles) as r:
        read = r.board.read

        def remember() -> bytes:
            data = read()
            received.extend(data)
            return data

        r.board.read = remember
        r.go(r.back_and_forth(), 0.5)
        r.plant.emergency_stop = True
        r.player = None
        r.run(0.05)
        return bytes(received), r.board.simulator.edges()


def test_the_same_input_gives_the_same_bytes_and_edges():
    first, again = history(1000), history(1000)
    assert len(first[0]) > 10_000 and len(first[1]) > 10_000
    assert first == again


def test_the_simulators_slice_changes_nothing_but_the_speed():
    """simavr's default is to look up after every instruction; long slices give the same bytes and
    edges to the cycle."""
    assert history(1) == history(1000)
