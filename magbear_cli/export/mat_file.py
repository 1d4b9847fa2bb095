"""A controller as a MAT-file of version 5, with the functions that load it in MATLAB and in Octave."""

from __future__ import annotations

import io
from importlib import resources

import numpy as np
from scipy.io import savemat

from magbear_cli.export.handover import Floats, Handover
from magbear_cli.study.building import mass_ends_kg

LOADERS = ("magbear_controller.m", "magbear_simulate.m")
_HEADER_BYTES = 116  # free text, in which the writer puts the time of writing


def mat_files(handover: Handover) -> dict[str, bytes]:
    """The MAT-file, the same bytes for the same controller, and the loaders."""
    buffer = io.BytesIO()
    savemat(buffer, _variables(handover), format="5", oned_as="column")
    header = f"MATLAB 5.0 MAT-file, written by magbear: {handover.name}"[:_HEADER_BYTES].ljust(_HEADER_BYTES)
    content = header.encode("ascii", "replace") + buffer.getvalue()[_HEADER_BYTES:]
    folder = resources.files("magbear_cli.export")
    return {f"{handover.name}.mat": content, **{name: folder.joinpath(name).read_bytes() for name in LOADERS}}


def _variables(handover: Handover) -> dict[str, object]:
    """A, B, C, D and Ts of what is to be run: the sampled controller where there is one; Ts = 0 is continuous time."""
    continuous, sampled = handover.controller, handover.sampled
    own = continuous if sampled is None else sampled.controller.shifted
    problem, worst = handover.problem, handover.outcome.summary.worst_case
    variables: dict[str, object] = {
        "A": own.a, "B": own.b, "C": own.c, "D": own.d,
        "Ts": 0.0 if sampled is None else sampled.sampling.sample_time_s,
        "name": handover.name, "about": handover.summary,
        "input_name": "position", "input_unit": "m", "output_name": "current", "output_unit": "A",
        "k_i": problem.nominal.current_stiffness_n_per_a, "k_z": problem.nominal.negative_stiffness_n_per_m,
        "mass_kg": np.array([mass_ends_kg(handover.outcome.inputs)]),
        "members_mass_kg": np.array([[one.mass_kg for one in handover.members]]),
        "members_k_i": np.array([[one.current_stiffness_n_per_a for one in handover.members]]),
        "members_k_z": np.array([[one.negative_stiffness_n_per_m for one in handover.members]]),
        "members_about": "\n".join(handover.family),
        "W1_num": np.array([problem.performance.num]), "W1_den": np.array([problem.performance.den]),
        "omega_c_rad_s": np.nan if problem.omega_c_rad_s is None else problem.omega_c_rad_s,
        "worst_case": np.nan if worst is None else worst,
    }  # fmt: skip
    if sampled is not None:
        chain = sampled.controller
        f, g, h, d = padded_sections(handover)
        variables |= {
            "sos": chain.second_order_sections(), "delay_s": sampled.sampling.delay_s,
            "F": np.moveaxis(f, 0, -1), "G": g.T, "H": h.T, "J": d[None, :],
            "A_continuous": continuous.a, "B_continuous": continuous.b,
            "C_continuous": continuous.c, "D_continuous": continuous.d,
            "test_positions_m": handover.test_positions_m, "test_currents_a": handover.test_currents_a,
        }  # fmt: skip
    return variables


def padded_sections(handover: Handover) -> tuple[Floats, Floats, Floats, Floats]:
    """The sections in increments, each with two states: A (n, 2, 2), B (n, 2), C (n, 2) and D (n,)."""
    if handover.sampled is None:
        raise ValueError("a continuous controller has no sections in increments")
    sections = handover.sampled.controller.sections
    f, g, h = np.zeros((len(sections), 2, 2)), np.zeros((len(sections), 2)), np.zeros((len(sections), 2))
    for place, section in enumerate(sections):
        n = section.order
        f[place, :n, :n], g[place, :n], h[place, :n] = section.a, section.b[:, 0], section.c[0]
    return f, g, h, np.array([section.d[0, 0] for section in sections])
