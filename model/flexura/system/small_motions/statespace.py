"""The robot linearised: state-space matrices, poles and zeros about an equilibrium or a steady
rotation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import FlexuraError, InputError, guarded
from ...io import choice, summary
from ...optional import Optional
from ..statics import static
from ..system import RobotLike, System, assemble, jacobian

INFINITE = 1e5  # times the fastest pole: a zero beyond is one at infinity, and round-off
control = Optional("control")


@dataclass(frozen=True, repr=False)
class StateSpace:
    """Small motions x = (dq, d dq/dt) about q, qd (n,): x' = A x + B u, y = C x + D u, with u, y as
    deviations too.

    From M dq'' + G dq' + K dq = E u, of which the fields are the matrices (m, m), (m, inputs): bias
    and gravity are in G and K. `states`, `inputs`, `outputs` are names, `units` their units: inputs
    `joint/i/drive`, outputs `joint/i/position` (behind a transmission also
    `joint/i/motor_position`), `link/i/tip_deflection`, `tip/x`, `tip/y`, as in a Run. `hold` (N,):
    the drives [N or N m] that keep the robot there. Coulomb friction is left out.
    """

    M: np.ndarray
    G: np.ndarray
    K: np.ndarray
    E: np.ndarray
    outlook: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str]
    q: np.ndarray
    qd: np.ndarray
    hold: np.ndarray

    def __repr__(self) -> str:
        return summary.text(*self._summary())

    def _repr_html_(self) -> str:
        return summary.html(*self._summary())

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        m, moving = len(self.M), "in steady motion" if self.qd.any() else "at rest"
        shapes = f"A ({2 * m}, {2 * m}), B ({2 * m}, {len(self.inputs)})"
        shapes += f", C ({len(self.outputs)}, {2 * m}), D ({len(self.outputs)}, {len(self.inputs)})"
        hold = [f"{value:.4g}" for value in self.hold]
        rows = [
            ("matrices", shapes),
            ("states", summary.listed(self.states)),
            ("inputs", summary.listed(f"{name} [{self.units[name]}]" for name in self.inputs)),
            ("outputs", summary.listed(f"{name} [{self.units[name]}]" for name in self.outputs)),
            ("hold", f"{summary.listed(hold, 30)}, drives that keep the robot there"),
        ]
        return f"StateSpace about a robot {moving}", rows

    @property
    def A(self) -> np.ndarray:
        """(2m, 2m) (53)."""
        m = len(self.M)
        return np.block(
            [[np.zeros((m, m)), np.eye(m)], [-np.linalg.solve(self.M, np.hstack([self.K, self.G]))]]
        )

    @property
    def B(self) -> np.ndarray:
        """(2m, inputs) (53)."""
        return np.vstack([np.zeros_like(self.E), np.linalg.solve(self.M, self.E)])

    @property
    def C(self) -> np.ndarray:
        """(outputs, 2m) (53)."""
        return np.hstack([self.outlook, np.zeros_like(self.outlook)])

    @property
    def D(self) -> np.ndarray:
        """(outputs, inputs), zero: forces act through the masses."""
        return np.zeros((len(self.outputs), len(self.inputs)))

    @property
    def poles(self) -> np.ndarray:
        """Eigenvalues of A (2m,) [1/s], by magnitude."""
        R = self._root
        return _roots(np.eye(len(self.M)), _scaled(R, self.G), _scaled(R, self.K))

    @property
    def _root(self) -> np.ndarray:
        """R (m, m), M = R^T R. Raises FlexuraError: M is singular to double precision."""
        from scipy.linalg import cholesky

        try:
            return np.asarray(cholesky(self.M))
        except np.linalg.LinAlgError:
            raise FlexuraError(
                "M is singular to double precision: a link has almost no mass beside what it "
                "carries; fewer of its modes, as modes = 2, leave the rest out"
            ) from None

    def zeros(self, drive: str, output: str) -> np.ndarray:
        """Transmission zeros from an input to an output, by magnitude: where the output stays 0
        while the drive acts.

        Motions with c dq = 0 in the directions that the drive does not push, L^T (s^2 M + s G + K)
        N z = 0, N = ker c, L = ker b (56): the finite invariant zeros of the pencil
        [[A - s, B], [C, 0]], without its infinite ones. Those with a positive real part
        (non-minimum phase) bound what feedback of that output can do.

        Args:
            drive: name of the input, for example "joint/1/drive".
            output: name of the output, for example "tip/x".

        Returns:
            Zeros (k,) [1/s], complex.

        Raises:
            InputError: unknown names, or an output that the drive does not move.
        """
        from scipy.linalg import null_space, solve_triangular

        b = self.E[:, _find(drive, self.inputs, "drive")]
        c = self.outlook[_find(output, self.outputs, "output")]
        R = self._root  # coordinates in which M = 1
        b, c = solve_triangular(R, b, trans="T"), solve_triangular(R, c, trans="T")
        G, K, one = _scaled(R, self.G), _scaled(R, self.K), np.eye(len(self.M))
        for s in (
            1 + 1j,
            37 + 5j,
        ):  # anywhere: only a transfer function that is zero is zero at both
            moved = np.linalg.solve(s * s * one + s * G + K, b)
            if abs(c @ moved) <= 1e-10 * float(np.linalg.norm(moved)) * max(
                float(np.linalg.norm(c)), 1e-9
            ):
                raise InputError(
                    f"expected an output that {drive} moves about this position",
                    key="output",
                    value=output,
                )
        N, L = null_space(c[None]), null_space(b[None])
        found = _roots(L.T @ N, L.T @ G @ N, L.T @ K @ N)
        return found[np.abs(found) < INFINITE * max(1.0, np.abs(self.poles).max())]

    def to_control(self) -> object:
        """This system as a `control.StateSpace` of python-control, with the names of states, inputs
        and outputs. Raises Missing where python-control is not installed."""
        return control.ss(
            self.A,
            self.B,
            self.C,
            self.D,
            states=[name.replace(".", "_") for name in self.states],
            inputs=list(self.inputs),
            outputs=list(self.outputs),
        )

    def transfer(self, s: complex) -> np.ndarray:
        """The transfer matrix C (s - A)^-1 B.

        Args:
            s: complex frequency [1/s].

        Returns:
            (outputs, inputs), complex.
        """
        return self.outlook @ np.linalg.solve(s * s * self.M + s * self.G + self.K, self.E)


@guarded("the linear equations")
def linearize(
    robot: RobotLike, q: ArrayLike | None = None, qd: ArrayLike | None = None, joints: str = "free"
) -> StateSpace:
    """The robot linearised about an equilibrium, or about a steady motion (52).

    Args:
        robot: a System, a Robot, or the path or name of a robot file.
        q: equilibrium (n,); None: the static one at the start.
        qd: joint rates (n,) of a steady motion, a rotation or translation of the whole robot, whose
            elastic equilibrium is found where q is not given. `tip/x`, `tip/y` are then along axes
            that turn with it.
        joints: "free", or "locked": only the elastic unknowns move, and there are no inputs.

    Returns:
        The StateSpace A, B, C, D with the names of states, inputs and outputs.

    Raises:
        InputError: q, qd are no equilibrium.
        FlexuraError: none is found.
    """
    system = assemble(robot)
    choice(joints, "joints", ("free", "locked"))
    rates = np.zeros(system.n) if qd is None else system.check(qd, "qd")
    at = _steady(system, rates) if q is None else system.check(q)
    _check_steady(system, at, rates)
    rows = system.free_rows if joints == "free" else system.elastic_rows
    pick = np.ix_(rows, rows)
    moved = [i for i, row in enumerate(system.joint_rows) if row in rows]
    K = system.tangent(at, rates if rates.any() else None)
    K = K if rates.any() else (K + K.T) / 2
    outputs_at, outputs, units = _outputs(system, at)
    kept = [
        k
        for k, name in enumerate(outputs)
        if not name.startswith("joint") or _number(name) in moved
    ]
    labels = [system.labels[row] for row in rows]
    drives = [f"joint/{i + 1}/drive" for i in moved]
    turns = [link.joint.type == "R" for link in system.robot.links]
    units |= {name: "N m" if turns[i] else "N" for name, i in zip(drives, moved, strict=True)}
    return StateSpace(
        M=system.mass(at)[pick],
        G=system.rate(at, rates)[pick],
        K=K[pick],
        E=(np.arange(system.n)[rows, None] == system.joint_rows[moved]).astype(float),
        outlook=outputs_at[np.ix_(np.array(kept), rows)],
        states=(*labels, *(f"rate of {label.replace(']', '/s]')}" for label in labels)),
        inputs=tuple(drives),
        outputs=tuple(outputs[k] for k in kept),
        units=units,
        q=at,
        qd=rates,
        hold=system.forces(at, rates, np.zeros(system.n))[system.joint_rows],
    )


def _number(name: str) -> int:
    """The joint or link of an output, from 0."""
    return int(name.split("/")[1]) - 1


def _steady(system: System, rates: np.ndarray) -> np.ndarray:
    """The elastic equilibrium at the start, turning with the rates (n,), by Newton's method."""
    q = static(system)
    rows, size = system.elastic_rows, _sizes(system)
    if len(rows) == 0 or not rates.any():
        return q
    pick = np.ix_(rows, rows)
    for _ in range(30):
        step = np.linalg.solve(system.tangent(q, rates)[pick], _balance(system, q, rates)[rows])
        q[rows] -= step
        if not np.all(np.isfinite(q)):
            break
        if np.linalg.norm(step * size) <= 1e-11 * (np.linalg.norm(q[rows] * size) + 1e-9):
            return q
    raise FlexuraError(
        "no equilibrium found at these rates: the rotation bends a link ever further"
    )


def _balance(system: System, q: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """What does not balance at rates (n,) that do not change: bias, elastic and gravity forces
    (n,)."""
    return system.elastic(q) + system.gravity(q) + (system.bias(q, rates) if rates.any() else 0.0)


def _sizes(system: System) -> np.ndarray:
    """Roots of the elastic rows' stiffness at the start: times q, roots of energies."""
    return np.sqrt(np.diag(system.stiffness())[system.elastic_rows])


def _check_steady(system: System, q: np.ndarray, rates: np.ndarray) -> None:
    """Refuse what is no equilibrium: elastic rows out of balance, or a motion along which the
    robot's equations change."""
    rows = system.elastic_rows
    if len(rows):
        force, size = _balance(system, q, rates)[rows], _sizes(system)
        if np.linalg.norm(force / size) > 1e-5 * np.linalg.norm(q[rows] * size) + 1e-8:
            raise InputError(
                "expected an equilibrium, as from fx.static(system, joints=...): elastic forces do "
                "not balance",
                key="q",
            )
    if not rates.any():
        return
    if rates[rows].any():
        raise InputError("expected rates of joints only", key="qd")
    later = q + rates / np.abs(rates).max()  # a radian or a metre on
    inertia = float(np.abs(system.mass(q)).max())
    for function, scale in (
        (lambda z: _balance(system, z, rates), inertia * float(rates @ rates)),
        (system.mass, inertia),
    ):
        now, then = function(q), function(later)
        if np.abs(then - now).max() > 1e-9 * scale:
            raise InputError(
                "expected a steady motion: rates of a first joint that turns or moves the whole "
                "robot, no gravity",
                key="qd",
            )


def _outputs(system: System, q: np.ndarray) -> tuple[np.ndarray, list[str], dict[str, str]]:
    """d (joint positions, tip deflections, tip x, tip y) / dq (outputs, n), their names and
    units."""
    links = system.robot.links
    flexible = [i for i, link in enumerate(links) if link.flexible]
    motors, rows = list(system.windup_rows), system.joint_rows
    names = [f"joint/{i + 1}/position" for i in range(len(links))]
    names += [f"joint/{i + 1}/motor_position" for i in motors]
    names += [f"link/{i + 1}/tip_deflection" for i in flexible]
    units = {
        name: "rad" if name.startswith("joint") and links[_number(name)].joint.type == "R" else "m"
        for name in names
    }

    def outputs_at(z: np.ndarray) -> np.ndarray:
        return np.concatenate([system.hub_positions(z), z[rows[motors]], *system.places(z)])

    slopes = jacobian(outputs_at, q, np.full(system.n, 1e-5) / np.maximum(_steep(system), 1e-300))
    return slopes, [*names, "tip/x", "tip/y"], units | {"tip/x": "m", "tip/y": "m"}


def _steep(system: System) -> np.ndarray:
    """How far a unit of each unknown turns a link [rad], (n,); 1 for joints."""
    out = np.ones(system.n)
    for owns, pieces in zip(
        system.assembly.structure.own, system.assembly.structure.links, strict=True
    ):
        for own, piece in zip(owns, pieces, strict=True):
            out[own] = np.abs(piece.B).max(axis=0, initial=0.0)
    return out


def _scaled(R: np.ndarray, X: np.ndarray) -> np.ndarray:
    """R^-T X R^-1."""
    from scipy.linalg import solve_triangular

    return solve_triangular(R, solve_triangular(R, X, trans="T").T, trans="T").T


def _roots(M: np.ndarray, G: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Finite s with det(s^2 M + s G + K) = 0, by magnitude; without G as the roots of s^2."""
    from scipy.linalg import eig, eigvals

    n = len(M)
    if n == 0:
        return np.zeros(0, dtype=complex)
    if not G.any():
        squares = eigvals(-K, M).astype(complex)
        found = np.concatenate([np.sqrt(squares), -np.sqrt(squares)])
    else:
        zero, one = np.zeros((n, n)), np.eye(n)
        found = eig(
            np.block([[zero, one], [-K, -G]]), np.block([[one, zero], [zero, M]]), right=False
        )
    found = found[np.isfinite(found)]
    return found[np.argsort(np.abs(found), kind="stable")]


def _find(name: str, names: tuple[str, ...], key: str) -> int:
    if name not in names:
        raise InputError(f"expected one of {', '.join(names)}", key=key, value=name)
    return names.index(name)
