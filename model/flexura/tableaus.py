"""Coefficients of the time loop's methods: A, C of the stages, E of the error estimates, and what the dense output takes.

DOP853 (Dormand and Prince 8(5,3); `dop853.py`), ESDIRK4(3)6L[2]SA (Kennedy and Carpenter 2003, Appl. Numer. Math. 44), and two
pairs for sampled controllers: Ralston's third order with a member of second order, and 5(4) of Cash and Karp (1990, ACM Trans.
Math. Softw. 16, 201-222).
"""

import numpy as np

from . import dop853

_A, _C, _E3, _E5, _AX, _CX, _D = dop853.A, dop853.C, dop853.E3, dop853.E5, dop853.AX, dop853.CX, dop853.D

GAMMA = 0.25
_EA = np.array([
    [0, 0, 0, 0, 0, 0],
    [1 / 4, 1 / 4, 0, 0, 0, 0],
    [8611 / 62500, -1743 / 31250, 1 / 4, 0, 0, 0],
    [5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 1 / 4, 0, 0],
    [15267082809 / 155376265600, -71443401 / 120774400, 730878875 / 902184768, 2285395 / 8070912, 1 / 4, 0],
    [82889 / 524892, 0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4],
])  # fmt: skip
_EC = np.array([0, 1 / 2, 83 / 250, 31 / 50, 17 / 20, 1])
_EE = _EA[5] - np.array(
    [4586570599 / 29645900160, 0, 178811875 / 945068544, 814220225 / 1159782912, -3700637 / 11593932, 61727 / 225920]
)

_PA, _PC, _PE = np.zeros((2, 7, 6)), np.zeros((2, 7)), np.zeros((2, 6))  # of the pairs; the row after the last stage: the end
_PA[0, 1:4, :3] = [[1 / 2, 0, 0], [0, 3 / 4, 0], [2 / 9, 1 / 3, 4 / 9]]
_PC[0, :4] = 0, 1 / 2, 3 / 4, 1
_PE[0, :3] = np.array([1, -3, 2]) / 36  # a member of second order, off by z^3 / 48 for y' = z y
_PA[1, 1:] = [
    [1 / 5, 0, 0, 0, 0, 0],
    [3 / 40, 9 / 40, 0, 0, 0, 0],
    [3 / 10, -9 / 10, 6 / 5, 0, 0, 0],
    [-11 / 54, 5 / 2, -70 / 27, 35 / 27, 0, 0],
    [1631 / 55296, 175 / 512, 575 / 13824, 44275 / 110592, 253 / 4096, 0],
    [37 / 378, 0, 250 / 621, 125 / 594, 0, 512 / 1771],
]
_PC[1] = 0, 1 / 5, 3 / 10, 3 / 5, 1, 7 / 8, 1
_PE[1] = _PA[1, 6] - np.array([2825 / 27648, 0, 18575 / 48384, 13525 / 55296, 277 / 14336, 1 / 4])
