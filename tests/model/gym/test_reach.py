"""flexura/Reach-v0: Gymnasium's own checks, and the same motion as `simulate`."""

import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import flexura as fx
from flexura import gym
from flexura.errors import InputError

MODEL = Path(fx.__file__).resolve().parents[1]


@pytest.fixture
def many():
    env = gymnasium.make_vec("flexura/Reach-v0", num_envs=6)
    yield env
    env.close()


def test_gymnasium_checks_the_environment():
    from gymnasium.utils.env_checker import check_env

    check_env(gymnasium.make("flexura/Reach-v0").unwrapped)


def test_robots_move_as_simulate_moves_them():
    """Six robots, ten actions: with twice the steps a fourth of the error (86)."""
    random = np.random.default_rng(3)
    start = random.uniform(-1.0, 1.0, (6, 2))
    torque = random.uniform(-1.0, 1.0, (10, 6, 2)) * [0.5, 0.05]

    def after(steps):
        motion = gym.Motion("type-1-rr", 6, steps=steps)
        motion.start(np.arange(6), start)
        for action in torque:
            assert motion.step(action).all()
        return np.hstack([motion.position, motion.bent, motion.tip]), motion

    coarse, fine, finest = (after(steps)[0] for steps in (64, 128, 256))
    change = np.linalg.norm(coarse - fine) / np.linalg.norm(fine - finest)
    assert change == pytest.approx(4.0, abs=0.2)
    limit, motion = (4 * finest - fine) / 3, after(4)[1]
    t = np.linspace(0.0, 0.2, 11)
    for k in (0, 5):
        q0 = np.zeros(motion.system.n)
        q0[motion.system.joint_rows] = start[k]
        drive = fx.Sampled(lambda now, k=k: torque[round(now * 50.0), k], 50.0)
        run = fx.simulate("type-1-rr", t, drive, q0, rtol=1e-9)
        names = "joint/1/position joint/2/position link/1/tip_deflection link/2/tip_deflection"
        right = [run[name][-1] for name in (*names.split(), "tip/x", "tip/y")]
        assert limit[k] == pytest.approx(right, abs=2e-5)
        assert motion.tip[k] == pytest.approx(right[-2:], abs=0.01)  # four steps an action


def test_one_and_many_are_the_same_environment(many):
    """A robot's digits do not depend on those beside it."""
    seen, _ = many.reset(seed=4)
    one = gymnasium.make("flexura/Reach-v0").unwrapped
    one.reset(seed=0)
    inside = many.unwrapped.task
    position, target = inside.motion.position[2].copy(), inside.target[2].copy()
    one.task.motion.start(np.arange(1), position[None])
    one.task.target[0] = target
    assert np.array_equal(one.task.observation()[0], seen[2])
    many.action_space.seed(5)
    for _ in range(3):
        actions = many.action_space.sample()
        rows, rewards, *_ = many.step(actions)
        row, reward, *_ = one.step(actions[2])
        assert np.array_equal(row, rows[2]) and reward == rewards[2]


def test_the_reward_is_the_distance_and_the_effort(many):
    many.reset(seed=1)
    action = np.tile(many.single_action_space.high, (6, 1))
    _, reward, *_, about = many.step(action)
    task = many.unwrapped.task
    distance = np.hypot(*(task.motion.tip - task.target).T)
    assert about["distance_m"] == pytest.approx(distance)
    assert reward == pytest.approx(-distance - 0.01)


def test_an_episode_ends_and_the_next_begins():
    env = gymnasium.make_vec("flexura/Reach-v0", num_envs=2, max_episode_steps=3)
    env.reset(seed=1)
    still = np.zeros((2, 2), dtype=np.float32)
    ends = [env.step(still)[3].all() for _ in range(3)]
    assert ends == [False, False, True]
    rows, reward, failed, over, _ = env.step(still)
    assert not over.any() and not failed.any() and not reward.any()
    assert not rows[:, 2:6].any() and rows[:, :2].any()  # at rest, straight, somewhere
    env.close()


def test_a_limit_ends_an_episode():
    robot = fx.load("type-1-rr").replace({"link.1.joint.limits_rad": [-0.1, 0.1]})
    env = gymnasium.make("flexura/Reach-v0", robot=robot)
    seen, _ = env.reset(seed=2)
    for _ in range(50):
        assert abs(seen[0]) <= 0.1 + 1e-6
        seen, reward, failed, _, _ = env.step(env.action_space.high)
        if failed:
            break
    assert failed and reward < -100.0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"robot": "rig"}, "RR"),
        ({"torque_N_m": [1.0]}, "torque_N_m"),
        ({"rate_Hz": 0.0}, "rate_Hz"),
        ({"count": 0}, "count"),
        ({"steps": 0}, "steps"),
    ],
)
def test_what_the_task_cannot_have_is_refused(options, said):
    with pytest.raises(InputError, match=said):
        gym.Task(**options)


@pytest.mark.parametrize("action", [np.full((6, 2), np.nan), np.zeros((5, 2)), "ab", None])
def test_what_is_no_torque_of_each_robot_is_refused(many, action):
    many.reset(seed=1)
    with pytest.raises(InputError, match="action"):
        many.step(action)


def test_without_gymnasium_one_sentence_says_what_to_install():
    code = f"import sys; sys.path.insert(0, {str(MODEL)!r}); sys.modules['gymnasium'] = None"
    code += "; import flexura.gym"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert ran.returncode == 1
    assert 'pip install "flexura[gym]"' in ran.stderr.splitlines()[-1]
