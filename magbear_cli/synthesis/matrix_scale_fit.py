"""Rational matrix scales for repeated blocks: a spectrum fitted to DᴴD on a grid, and its minimum-phase factor.

Only P = DᴴD matters to σ(D M D⁻¹). With poles held, P(jω) ≈ R + Σ_k (C_k φ_k + C_kᵀ φ̄_k), φ_k = p_k/(jω + p_k), is
linear in the real matrices R = Rᵀ and C_k, and its factor has the same poles, r of each. A fit that is not positive
definite at every frequency has no factor and is dropped; a diagonal D is always there to fall back on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from magbear_cli.errors import NumericsError
from magbear_cli.kernels.spectral_factor import spectral_factor
from magbear_cli.lti.balancing import with_balanced_states
from magbear_cli.lti.connection import append
from magbear_cli.lti.state_space import StateSpace
from magbear_cli.synthesis.block_scale import MatrixScale
from magbear_cli.synthesis.scale_fit import fit_scale

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

_BEST_FITS = 2  # of each diagonal entry, whose poles are tried
_SPREADS = (0.0, 0.15, 0.3)  # of the logarithmic grid, left free at both ends by poles that are evenly spread


def fit_matrix_scale(omega_rad_s: Floats, spectra: Complexes, weights: Floats, order: int) -> list[MatrixScale]:
    """Fits of D with DᴴD near the spectra, those of the least weighted relative error of any kind first.

    Parameters
    ----------
    omega_rad_s : (w,) positive ascending grid
    spectra : (w, r, r) Hermitian positive definite array, P(jω)
    weights : (w,) nonnegative array: how much a relative error costs at each frequency
    order : states for each of the r channels
    """
    fits = [_constant(spectra, weights), _diagonal(omega_rad_s, spectra, weights, order)]
    whitener = _power(spectra, -0.5)
    for poles in _pole_sets(omega_rad_s, spectra, weights, order):
        try:
            fits.append(_of_poles(omega_rad_s, spectra, whitener, poles, weights))
        except NumericsError:
            continue
    errors = [_error(fit, omega_rad_s, whitener, weights) for fit in fits]
    return [fits[place] for place in np.argsort(errors, kind="stable")]


def _error(fit: MatrixScale, omega: Floats, whitener: Complexes, weights: Floats) -> float:
    d = fit.response(omega)[0]
    relative = whitener @ (d.conj().swapaxes(1, 2) @ d) @ whitener - np.eye(d.shape[1])
    return float((weights[:, None, None] ** 2 * np.abs(relative) ** 2).sum())


def _constant(spectra: Complexes, weights: Floats) -> MatrixScale:
    """The real matrix nearest in the mean of the logarithm."""
    value, vector = np.linalg.eigh(spectra)
    logs = (vector * np.log(value)[:, None, :]) @ vector.conj().swapaxes(1, 2)
    mean = np.average(logs.real, axis=0, weights=weights**2)
    value, vector = np.linalg.eigh(mean)
    return MatrixScale(StateSpace.gain((vector * np.exp(value / 2.0)) @ vector.T))


def _diagonal(omega: Floats, spectra: Complexes, weights: Floats, order: int) -> MatrixScale:
    """A scale for each channel: d² between the diagonal of P and the inverse of the diagonal of P⁻¹."""
    of_inverse = np.diagonal(np.linalg.inv(spectra), axis1=1, axis2=2).real
    logs = 0.25 * np.log(np.diagonal(spectra, axis1=1, axis2=2).real / of_inverse)
    systems = [fit_scale(omega, log_d, weights, order)[0].system() for log_d in logs.T]
    return MatrixScale(reduce(append, systems))


def _pole_sets(omega: Floats, spectra: Complexes, weights: Floats, order: int) -> Iterator[Floats]:
    """Those of scalar fits of the diagonal entries and of the determinant, and poles spread evenly."""
    if order == 0:
        return
    diagonal = 0.5 * np.log(np.diagonal(spectra, axis1=1, axis2=2).real)
    for log_d in [*diagonal.T, diagonal.mean(axis=1), 0.5 * np.linalg.slogdet(spectra)[1] / spectra.shape[1]]:
        for fit in fit_scale(omega, log_d, weights, order)[:_BEST_FITS]:
            yield _apart(fit.poles_rad_s)
    low, high = np.log(omega[0]), np.log(omega[-1])
    for spread in _SPREADS:
        margin = spread * (high - low)
        yield np.exp(np.linspace(low + margin, high - margin, order + 2)[1:-1])


def _apart(poles: Floats) -> Floats:
    """The poles in ascending order, those that coincide moved apart: their functions must not be the same."""
    apart = np.sort(poles)
    for place in range(1, apart.size):
        apart[place] = max(apart[place], 1.2 * apart[place - 1])
    return apart


def _of_poles(omega: Floats, spectra: Complexes, whitener: Complexes, poles: Floats, weights: Floats) -> MatrixScale:
    """The factor of the spectrum with these poles and the least weighted relative error."""
    r = spectra.shape[1]
    columns = []
    symmetric = [(i, j) for i in range(r) for j in range(i + 1)]
    for i, j in symmetric:
        unit = np.zeros((r, r))
        unit[i, j] = unit[j, i] = 1.0
        columns.append(np.broadcast_to(unit.astype(complex), spectra.shape))
    for pole in poles:
        phi = (pole / (1j * omega + pole))[:, None, None]
        for i, j in np.ndindex(r, r):
            unit = np.zeros((r, r))
            unit[i, j] = 1.0
            columns.append(unit * phi + unit.T * phi.conj())
    matrix = np.stack([_weighed(whitener @ column @ whitener, weights) for column in columns], axis=1)
    target = _weighed(np.broadcast_to(np.eye(r, dtype=complex), spectra.shape), weights)
    size = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    solution = np.linalg.lstsq(matrix / size, target, rcond=1e-10)[0] / size
    direct = np.zeros((r, r))
    for (i, j), value in zip(symmetric, solution, strict=False):
        direct[i, j] = direct[j, i] = value
    return _factored(direct, solution[len(symmetric) :].reshape(poles.size, r, r), poles)


def _factored(direct: Floats, residues: Sequence[Floats] | Floats, poles: Floats) -> MatrixScale:
    r = direct.shape[0]
    a = np.asarray(-np.kron(np.diag(poles), np.eye(r)), dtype=float)
    b = np.asarray(np.kron(np.sqrt(poles)[:, None], np.eye(r)), dtype=float)
    c = np.hstack([np.sqrt(pole) * residue for pole, residue in zip(poles, residues, strict=True)])
    c_w, d_w = spectral_factor(a, b, c, direct)
    return MatrixScale(with_balanced_states(StateSpace(a, b, c_w, d_w)))


def _weighed(matrices: Complexes, weights: Floats) -> Floats:
    flat = (weights[:, None, None] * matrices).reshape(-1)
    return np.concatenate([flat.real, flat.imag])


def _power(spectra: Complexes, exponent: float) -> Complexes:
    value, vector = np.linalg.eigh(spectra)
    return np.asarray((vector * value[:, None, :] ** exponent) @ vector.conj().swapaxes(1, 2))
