"""A controller as Python: an object of python-control, and a bearing element of ROSS."""

from __future__ import annotations

import numpy as np

from magbear_cli.errors import InputError
from magbear_cli.export.handover import Handover
from magbear_cli.lti.conversion import transfer_function
from magbear_cli.study.members import Uncertainty, uncertainty

_VACUUM_PERMEABILITY = 4.0e-7 * np.pi  # the value that ROSS takes
_WINDINGS = 100  # any number: only windings² times pole area matters

_KNOWN = "Its magnets are known."
_MIDDLE = "The magnets are uncertain: the element is one member of the family."

_PYTHON = '''\
"""{about}

``controller`` is an object of python-control: u = K y, position y in m, control current u in A, {time}.
{family}
Written by magbear.
"""

import control

A = {a}
B = {b}
C = {c}
D = {d}
MEMBERS = {members}  # of the family of plants: mass (kg), k_i (N/A), k_z (N/m)
controller = control.ss(A, B, C, D, {dt}, name="{name}", inputs="position_m", outputs="current_a")
'''

_ROSS = '''\
"""{about}

``element(n)`` is a magnetic bearing of ROSS at node n that has the stiffnesses k_s = -{k_z:.9g} N/m and
k_i = {k_i:.9g} N/A of this bearing, for {law}. ROSS feeds back the position with a minus sign, so its controller is -K.
Only windings^2 times pole area matters, and {windings} windings are assumed. {which}
{family}
Written by magbear.
"""

import control
import numpy as np
import ross

AIR_GAP_M = {gap!r}
BIAS_CURRENT_A = {bias!r}
WINDINGS = {windings}
POLE_AREA_M2 = {area!r}
MEMBERS = {members}  # of the family of plants: mass (kg), k_i (N/A), k_z (N/m)
AMPLIFIER_GAIN = {share!r}  # of the control current that reaches each coil
controller = control.tf({num}, {den})  # -K: A/m


def element(n, frequency=None, **options):
    """The bearing at node n; frequencies in rad/s."""
    omega = np.geomspace(1.0, 1.0e5, 200) if frequency is None else frequency
    return ross.MagneticBearingElement(
        n=n, g0=AIR_GAP_M, i0=BIAS_CURRENT_A, ag=POLE_AREA_M2, nw=WINDINGS, alpha=0.0, k_amp=AMPLIFIER_GAIN,
        k_sense=1.0, frequency=list(omega), controller_transfer_function=controller, **options,
    )
'''


def python_files(handover: Handover) -> dict[str, bytes]:
    """A script that makes the controller with python-control."""
    sampled = handover.sampled
    own = handover.controller if sampled is None else sampled.controller.shifted
    text = _PYTHON.format(
        about=_line(handover.summary),
        name=handover.name,
        a=own.a.tolist(),
        b=own.b.tolist(),
        c=own.c.tolist(),
        d=own.d.tolist(),
        dt=0 if sampled is None else repr(sampled.sampling.sample_time_s),
        family="\n".join(_plain(line) for line in handover.family),
        members=_members(handover),
        time="continuous time" if sampled is None else f"sampled every {sampled.sampling.sample_time_s} s",
    )
    return {f"{handover.name}.py": text.encode("ascii")}


def ross_files(handover: Handover) -> dict[str, bytes]:
    """A script that makes a magnetic bearing of ROSS with this controller.

    Raises
    ------
    InputError
        when the controller is sampled: ROSS takes a transfer function of continuous time.
    """
    if handover.sampled is not None:
        raise InputError("ROSS takes the controller in continuous time: leave --sample-time out")
    num, den = transfer_function(handover.controller)
    nominal, bearing = handover.problem.nominal, handover.bearing
    share = bearing.current_share
    # the centred bearing with the stiffnesses of the operating point; at the origin it is the bearing itself
    bias = nominal.negative_stiffness_n_per_m * bearing.air_gap_m * share / nominal.current_stiffness_n_per_a
    constant = nominal.current_stiffness_n_per_a / share * bearing.air_gap_m**2 / (4.0 * bias)
    text = _ROSS.format(
        about=_line(handover.summary),
        k_z=nominal.negative_stiffness_n_per_m,
        k_i=nominal.current_stiffness_n_per_a,
        which=_MIDDLE if uncertainty(handover.outcome.inputs) is not Uncertainty.MASS else _KNOWN,
        family="\n".join(_plain(line) for line in handover.family),
        members=_members(handover),
        law=f"{bearing.current_law.value} coil currents",
        gap=bearing.air_gap_m,
        bias=float(bias),
        windings=_WINDINGS,
        area=float(4.0 * constant / (_VACUUM_PERMEABILITY * _WINDINGS**2)),
        share=float(share),
        num=(-num).tolist(),
        den=den.tolist(),
    )
    return {f"{handover.name}_ross.py": text.encode("ascii")}


def _members(handover: Handover) -> list[tuple[float, float, float]]:
    return [(one.mass_kg, one.current_stiffness_n_per_a, one.negative_stiffness_n_per_m) for one in handover.members]


def _line(text: str) -> str:
    """The text in one ASCII line that can stand in a docstring, with a full stop."""
    return _plain(text) + "."


def _plain(text: str) -> str:
    """The text in one ASCII line that can stand in a docstring."""
    plain = " ".join(text.split()).encode("ascii", "replace").decode("ascii")
    return plain.replace("\\", "/").replace('"', "'")
