"""Many robots under random torques in an environment for learning.

Equations (25), (40) and (41): M(q) q'' + h(q, q') = u, its mass matrix and its bias. For two
uniform rods textbooks have

    a = m1 l1^2 / 3 + m2 l1^2,    b = m2 l2^2 / 3,    c = m2 l1 l2 / 2,
    M11 = a + b + 2 c cos q2,    M12 = b + c cos q2,    M22 = b,
    h1 = -c sin q2 (2 q1' q2' + q2'^2),    h2 = c sin q2 q1'^2.

SciPy integrates these equations for each action of 20 ms. The environment is `flexura/Reach-v0`
with rigid links, and gives what an agent sees.
"""

import gymnasium
import numpy as np
from scipy.integrate import solve_ivp

import flexura as fx
import flexura.gym
from comparison import Comparison

(L1, L2), (M1, M2), TORQUES = (0.3, 0.3), (0.3, 0.2), np.array([0.1, 0.03])
a, b, c = M1 * L1**2 / 3 + M2 * L1**2, M2 * L2**2 / 3, M2 * L1 * L2 / 2
ACTIONS, ROBOTS = 25, 8


def slopes(t: float, z: np.ndarray, torque: np.ndarray) -> np.ndarray:
    cosine, sine = c * np.cos(z[1]), c * np.sin(z[1])
    mass = np.array([[a + b + 2 * cosine, b + cosine], [b + cosine, b]])
    bias = sine * np.array([-(2 * z[2] + z[3]) * z[3], z[2] ** 2])
    return np.concatenate([z[2:], np.linalg.solve(mass, torque - bias)])


def rod(length: float, mass: float) -> dict:
    link = {"length_m": length, "mass_kg": mass, "inertia_kg_m2": mass * length**2 / 12}
    return link | {"joint": {"type": "R"}}


robot = fx.Robot.from_dict({"link": [rod(L1, M1), rod(L2, M2)]})
options = {"robot": robot, "torque_N_m": TORQUES, "steps": 64}
env = gymnasium.make_vec(flexura.gym.ID, num_envs=ROBOTS, **options)
env.action_space.seed(1)
seen, _ = env.reset(seed=1)
first, path = seen[0], [seen[:, :2]]
actions = [env.action_space.sample() for _ in range(ACTIONS)]
for action in actions:
    seen, reward, *_ = env.step(action)
    path.append(seen[:, :2])
env.close()

z = np.concatenate([first[:2], np.zeros(2)]).astype(float)
angles = [z[:2]]
for action in actions:
    torque = np.clip(action[0].astype(float), -TORQUES, TORQUES)
    z = solve_ivp(slopes, (0, 0.02), z, "DOP853", args=(torque,), rtol=1e-11, atol=1e-12).y[:, -1]
    angles.append(z[:2])
shoulder, both = z[0], z[0] + z[1]
tip = np.array(
    [L1 * np.cos(shoulder) + L2 * np.cos(both), L1 * np.sin(shoulder) + L2 * np.sin(both)]
)
effort = 0.01 * np.mean((torque / TORQUES) ** 2)

show = Comparison(__doc__, bound=1e-5)
for k in (0, 1):
    show.add(f"angle {k + 1} after 0.5 s [rad]", seen[0, k], z[k])
    show.add(f"rate {k + 1} after 0.5 s [rad/s]", seen[0, k + 2], z[k + 2])
show.add("reward [m]", reward[0], -np.linalg.norm(tip - first[-2:]) - effort)

if show.plot:
    axes = show.axes("t [s]", "angle of the elbow [rad]")
    t = 0.02 * np.arange(ACTIONS + 1)
    for k in range(ROBOTS):
        axes.plot(t, [row[k, 1] for row in path], color="0.8" if k else "C0")
    axes.plot(t, [row[1] for row in angles], "o", markersize=4, label="textbook")
show.end()
