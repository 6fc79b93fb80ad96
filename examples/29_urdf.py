"""A double pendulum from a URDF file, rigid and with a link that bends.

Equation (1), frames of joints. The two links of the Acrobot have masses m, centres at c and
inertias I; the first is L long. Textbooks have its mass matrix at an angle q of the elbow,

    M11 = I1 + m1 c1^2 + I2 + m2 (L^2 + c2^2 + 2 L c2 cos q),
    M12 = I2 + m2 (c2^2 + L c2 cos q),     M22 = I2 + m2 c2^2,

and that it hangs with K = g [m1 c1 + m2 (L + c2), m2 c2; m2 c2, m2 c2], det(K - w^2 M) = 0.

A table of sections makes the first link a beam of the same mass: a stiff one changes nothing.
"""

import pathlib
import tempfile

import numpy as np

import flexura as fx
from comparison import Comparison
from flexura.interchange import read_urdf

m1, c1, I1, L, m2, c2, I2, g = 1.0, 0.5, 1 / 12, 1.0, 1.0, 1.0, 1 / 3, 9.81
body = """<link name="{}"><inertial><origin xyz="0 0 {}"/><mass value="{}"/>
  <inertia ixx="{}" iyy="{}" izz="1"/></inertial></link>"""
joint = """<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/>
  <origin xyz="0 0.1 {}"/><axis xyz="0 1 0"/></joint>"""
text = f"""<robot name="acrobot"><link name="base"/>
{body.format("upper", -c1, m1, I1, I1)} {body.format("lower", -c2, m2, I2, I2)}
{joint.format("shoulder", "base", "upper", 0)} {joint.format("elbow", "upper", "lower", -L)}
</robot>"""
beam = "[upper]\nelements = 2\nbending_stiffness_N_m2 = 1e7\n"

with tempfile.TemporaryDirectory() as folder:
    file, table = pathlib.Path(folder, "acrobot.urdf"), pathlib.Path(folder, "table.toml")
    file.write_text(text)
    table.write_text(beam)
    rigid, flexible = read_urdf(file).robot, read_urdf(file, table).robot

q = 0.7
coupling = I2 + m2 * (c2**2 + L * c2 * np.cos(q))
first = I1 + m1 * c1**2 + I2 + m2 * (L**2 + c2**2 + 2 * L * c2 * np.cos(q))
found = fx.assemble(rigid).mass(np.array([-np.pi / 2, q]))

far = I2 + m2 * (c2**2 + L * c2)
M = np.array([[I1 + m1 * c1**2 + m2 * L**2 + far + m2 * L * c2, far], [far, I2 + m2 * c2**2]])
K = g * np.array([[m1 * c1 + m2 * (L + c2), m2 * c2], [m2 * c2, m2 * c2]])
exact = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)) / (2 * np.pi)
slow = fx.frequencies(rigid, joints="free")
bent = fx.frequencies(flexible, joints="free", count=2)

show = Comparison(__doc__, bound=1e-4)
show.add("M11 [kg m^2]", found[0, 0], first)
show.add("M12 [kg m^2]", found[0, 1], coupling)
for k in range(2):
    show.add(f"frequency {k + 1} [Hz]", slow[k], exact[k])
show.add("frequency 1, a beam [Hz]", bent[0], exact[0])
if show.plot:
    axes = show.axes("angle of the elbow [rad]", "M11 [kg m^2]")
    angles = np.linspace(-np.pi, np.pi, 61)
    matrices = [fx.assemble(rigid).mass(np.array([0.0, angle])) for angle in angles]
    axes.plot(angles, [matrix[0, 0] for matrix in matrices], label="from the URDF")
show.end()
