"""D-K iteration with several inputs and outputs: a published column, and blocks of every kind."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError, Status
from magbear_cli.kernels.block_perturbation import block_lower_bound
from magbear_cli.kernels.block_scaling import block_upper_bound
from magbear_cli.kernels.block_structure import Block, BlockStructure, FullBlock, RepeatedBlock
from magbear_cli.lti.frequency import frequency_response
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.model.generalized_plant import GeneralizedPlant
from magbear_cli.synthesis.dk_iteration import DkOptions, DkProblem, design_dk
from magbear_cli.synthesis.scaling_step import fit_scales, peak_mu

Matrix = NDArray[np.float64]

I2, O2 = np.eye(2), np.zeros((2, 2))
PERFORMANCE = FullBlock(4, 2)


def _named(system: StateSpace) -> GeneralizedPlant:
    """The plant with two measurements and two controls, its channels numbered."""
    inputs, outputs = (tuple(f"{n}" for n in range(count)) for count in (system.inputs, system.outputs))
    return GeneralizedPlant(system, inputs, outputs, controls=2, measurements=2)


def _column() -> GeneralizedPlant:
    """The distillation column of Skogestad, Morari and Doyle (IEEE T. Automatic Control 33, 1988), y = −(G u + w).

    G = [87.8, −86.4; 108.2, −109.6]/(75 s + 1), time in minutes; uncertainty of each input weighted by
    (s + 0.2)/(0.5 s + 1), performance by 0.5 (10 s + 1)/(10 s + 1e-5): Skogestad and Postlethwaite (2006, table 8.1).
    """
    gain, slow = np.array([[87.8, -86.4], [108.2, -109.6]]) / 75.0, 1e-6
    rise = 0.5 * (0.1 - slow)
    return _named(
        StateSpace(
            np.block([[-I2 / 75.0, O2, O2], [rise * gain, -slow * I2, O2], [O2, O2, -2.0 * I2]]),
            np.block([[I2, O2, I2], [O2, rise * I2, O2], [O2, O2, I2]]),
            np.block([[O2, O2, -3.6 * I2], [0.5 * gain, I2, O2], [-gain, O2, O2]]),
            np.block([[O2, O2, 2.0 * I2], [O2, 0.5 * I2, O2], [O2, -I2, O2]]),
        )
    )


def _rotor(spin: float, second_axis: float) -> GeneralizedPlant:
    """Two axes of a rotor on magnets, coupled gyroscopically, 1/m uncertain by 40 %; weights on y (4x2) and on u."""
    gyro, rise = spin * np.array([[0.0, 1.0], [-1.0, 0.0]]), 0.5 * np.diag([1.0, second_axis])
    return _named(
        StateSpace(
            np.block([[O2, I2, O2], [I2, gyro, O2], [rise, O2, -0.1 * I2]]),
            np.block([[O2, O2, O2], [I2, O2, I2], [O2, rise, O2]]),
            np.block([[0.4 * I2, O2, O2], [O2, O2, I2], [O2, O2, O2], [I2, O2, O2]]),
            np.block([[O2, O2, 0.4 * I2], [O2, O2, O2], [O2, O2, 0.1 * I2], [O2, I2, O2]]),
        )
    )


def test_the_distillation_column() -> None:
    """Peak mu comes below 1.036, and SLICOT's mu and a destabilising perturbation agree on a grid of their own."""
    slycot = pytest.importorskip("slycot")
    structure = BlockStructure((FullBlock(1, 1), FullBlock(1, 1), FullBlock(2, 2)))
    dense = np.concatenate([[0.0], np.geomspace(1e-7, 1e5, 120), [np.inf]])
    problem = DkProblem(_column(), structure, 1.0, np.geomspace(1e-3, 1e2, 60), dense)
    design = design_dk(problem, DkOptions(d_order=3, iterations=3))
    assert design.level <= 1.036
    assert design.status is Status.NOT_ACHIEVED
    assert design.controller is not None
    assert design.controller.order <= 18
    loop = _column().closed_by(design.controller)
    assert loop.poles().real.max() < 0
    matrices = frequency_response(loop, np.geomspace(1e-4, 1e3, 60))
    scale = np.array([30.0, 30.0, 1.0, 1.0])
    oracle = [slycot.ab13md(m * scale[:, None] / scale, np.array([1, 1, 2]), np.full(3, 2))[0] for m in matrices]
    assert max(oracle) <= design.level * (1.0 + 1e-6)
    assert max(oracle) > 0.98 * design.level
    lower, _ = block_lower_bound(matrices, structure)
    assert lower == pytest.approx(oracle, rel=1e-3)


@pytest.fixture(scope="module")
def levels() -> dict[str, tuple[float, float, int]]:
    """Least peak mu, that of the first controller and the order, for the rotor's mass as blocks of every kind."""
    kinds: dict[str, tuple[Block, ...]] = {
        "full": (FullBlock(2, 2), PERFORMANCE),
        "repeated": (RepeatedBlock(2), PERFORMANCE),
    }
    found, plant = {}, _rotor(3.0, 0.2)
    for name, blocks in kinds.items():
        structure, omega = BlockStructure(blocks), np.geomspace(1e-2, 1e2, 30)
        dense = np.concatenate([[0.0], np.geomspace(1e-5, 1e5, 80), [np.inf]])
        problem = DkProblem(plant, structure, 1.0, omega, dense)
        design = design_dk(problem, DkOptions(iterations=1, gamma_tolerance=5e-3))
        assert design.controller is not None
        loop = plant.closed_by(design.controller)
        assert loop.poles().real.max() < 0
        assert peak_mu(loop, structure, dense)[0] == pytest.approx(design.level, rel=1e-6)
        found[name] = design.level, design.statistics["first_peak_mu"], design.controller.order
    return found


def test_iterating_lowers_mu(levels: dict[str, tuple[float, float, int]]) -> None:
    """One step brings peak mu down for full, non-square and repeated blocks, with the order that the fits promise."""
    for level, first, order in levels.values():
        assert level < 0.9 * first
        assert order == 14


def test_knowing_that_both_axes_have_one_mass_helps(levels: dict[str, tuple[float, float, int]]) -> None:
    """Of a mass that is the same on both axes mu comes lower than of an arbitrary 2x2 uncertainty."""
    assert levels["repeated"][0] < levels["full"][0]


def test_matrix_scales_do_better_than_numbers() -> None:
    """The fitted scales of a repeated block prove a level that scalar ones cannot, and come near mu."""
    gain = -np.array([[2.0, 2.0], [-1.0, 5.0]])
    controller = StateSpace(-10.0 * I2, I2, 200.0 * I2, gain - 20.0 * I2)  # a lead on each axis
    loop = _rotor(1.0, 1.0).closed_by(controller)
    assert loop.poles().real.max() < 0
    omega = np.geomspace(1e-2, 1e2, 50)
    repeated, full = (BlockStructure((block, PERFORMANCE)) for block in (RepeatedBlock(2), FullBlock(2, 2)))
    fitted = fit_scales(loop, repeated, omega, 2, every_scale=False)[0]
    matrices = frequency_response(loop, omega)
    exact, coarse = (float(block_upper_bound(matrices, each).upper.max()) for each in (repeated, full))
    assert exact * (1.0 - 1e-6) <= fitted.level <= 1.01 * exact
    assert fitted.level < coarse
    assert fitted.norm(loop, omega) == pytest.approx(fitted.level)


def test_refuses_what_it_cannot_iterate_with() -> None:
    """Options out of range and blocks that do not fit the plant are refused; a free control fails in plain words."""
    for wrong in ({"gamma_tolerance": 0.0}, {"d_order": -1}, {"iterations": -1}):
        with pytest.raises(NumericsError):
            DkOptions(**wrong)
    omega = np.geomspace(1e-2, 1e2, 20)
    with pytest.raises(NumericsError, match="block structure"):
        DkProblem.over(_rotor(1.0, 1.0), BlockStructure((PERFORMANCE,)), omega)
    rotor = _rotor(1.0, 1.0).system
    free = _named(StateSpace(rotor.a, rotor.b, rotor.c, np.where(np.abs(rotor.d) < 0.9, 0.0, rotor.d)))
    design = design_dk(DkProblem.over(free, BlockStructure((RepeatedBlock(2), PERFORMANCE)), omega))
    assert design.status is Status.FAILED
    assert "control" in design.sentence
