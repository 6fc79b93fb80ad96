"""When a command is repeated: after the measured round trip, so that a bad line ends no run."""

import random

import pytest

from boards import BENCH, Rigged
from experiments import SETTINGS, board, experiment
from flexlab.board.protocol.round_trip import LEAST_S, RoundTrip
from flexlab.experiment import plan as plans
from flexlab.experiment.run_experiment import OpenBoard

SLOW = pytest.mark.slow


def test_mean_and_deviation_are_those_of_rfc_6298():
    """By hand: samples of 10, 10 and 18 ms."""
    trip = RoundTrip(0.05)
    assert trip.repeat_s == 0.05
    trip.measured(0.010)
    assert trip.repeat_s == pytest.approx(0.010 + 4 * 0.005)
    trip.measured(0.010)
    assert trip.repeat_s == pytest.approx(0.010 + 4 * 0.00375)
    trip.measured(0.018)
    assert trip.mean_s == pytest.approx(0.011)
    assert trip.repeat_s == pytest.approx(0.011 + 4 * (0.75 * 0.00375 + 0.25 * 0.008))
    for _ in range(100):
        trip.measured(0.002)
    assert trip.repeat_s == pytest.approx(0.002 + LEAST_S, rel=1e-3)
    for _ in range(100):
        trip.measured(0.5)
    assert trip.repeat_s == 0.05  # the board gives up after 0.2 s


def test_an_emulated_board_answers_in_milliseconds_and_is_asked_again_soon():
    with Rigged() as r:
        r.link.run(1.0)
        assert 0.0005 < r.link.round_trip.mean_s < 0.004
        assert r.link.round_trip.repeat_s < 0.01 and r.link.counts.repeated == 0


@pytest.mark.parametrize("late_s", [0.012, 0.03])
def test_a_line_that_is_suddenly_slower_is_measured_anew(late_s):
    """Answers come later than a command is repeated: twice the same answer says so."""
    with Rigged() as r:
        r.link.run(0.5)
        read, held = r.board.read, []

        def late():
            held.append((r.board.now() + late_s, read()))
            out = b""
            while held and held[0][0] <= r.board.now():
                out += held.pop(0)[1]
            return out

        r.board.read = late
        for _ in range(30):
            r.link.command("keepalive")
        assert r.link.round_trip.repeat_s > late_s
        before = r.link.counts.repeated
        for _ in range(10):
            r.link.command("keepalive")
        assert r.link.counts.repeated == before
        del r.board.read


class Wrong:
    """A board at a line on which some of the bytes are changed, both ways, from the first on."""

    def __init__(self, inner, rate, seed):
        self.inner, self.rate, self.random = inner, rate, random.Random(seed)
        self.label, self.emulated, self.changed = inner.label, inner.emulated, 0

    def _spoilt(self, data):
        out = bytearray(data)
        for k in range(len(out)):
            if self.random.random() < self.rate:
                out[k] ^= self.random.randrange(1, 256)
                self.changed += 1
        return bytes(out)

    def read(self):
        return self._spoilt(self.inner.read())

    def write(self, data):
        self.inner.write(self._spoilt(data))

    def close(self):
        """The host is gone. Whatever state it left, the outputs are off when the board has noticed;
        nothing reset it."""
        self.inner.wait(0.3)
        window = self.inner.simulator.window
        self.safe = not any(window.motor_on) and window.stepper_on == window.resets == 0
        self.inner.close()

    def __getattr__(self, name):
        return getattr(self.inner, name)


def ended(rate, seed, folder, duration_s):
    """How a whole experiment through such a line ends, the self-test with it; safe in any case."""
    wrong = Wrong(board(), rate, seed)
    plan = plans.free_vibration(BENCH, SETTINGS, 0.3, duration_s)
    done = experiment(plan, folder, opened=OpenBoard(wrong, 0, {}, None))
    assert wrong.safe, (seed, done.ended.text)
    if done.ended.complete:
        assert wrong.changed > 100 * duration_s * rate / 0.01
        assert done.run["joint/2/position"][-1] == pytest.approx(0.3, abs=0.01)
    return done.ended


def test_a_run_goes_on_at_one_wrong_byte_in_a_hundred(tmp_path):
    end = ended(0.01, 100, tmp_path / "run", 2.0)
    assert end.complete, end.text


@SLOW
@pytest.mark.timeout(3000)
@pytest.mark.parametrize(("rate", "least"), [(0.003, 20), (0.01, 18)])
def test_twenty_runs_of_eight_seconds_at_a_bad_line(rate, least, tmp_path, capsys):
    """At three wrong bytes in a thousand all end well; at ten most do, and each is safe."""
    ends = [ended(rate, seed, tmp_path / f"{seed}", 8.0) for seed in range(20)]
    well = sum(end.complete for end in ends)
    with capsys.disabled():
        print(f"{well} of 20 runs end well at {100 * rate} % of wrong bytes")
    assert well >= least, [end.text for end in ends if not end.complete]
