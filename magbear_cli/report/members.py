"""How the members of a case's family are told apart in figures and tables: by the parameter that is uncertain."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from magbear_cli.report.numbers import kilograms, mass_text, significant
from magbear_cli.report.series import uncertain_text
from magbear_cli.study.members import Floats, Uncertainty, member_values, uncertainty
from magbear_cli.study.outcome import CaseOutcome

_K0 = "k₀"


@dataclass(frozen=True)
class _Words:
    noun: str
    plural: str
    axis: str
    column: str


_WORDS = {
    Uncertainty.MASS: _Words("mass", "masses", "mass (kg)", "mass_kg"),
    Uncertainty.NEGATIVE_STIFFNESS: _Words(
        "negative stiffness",
        "negative stiffnesses",
        "negative stiffness k_z (N/m)",
        "negative_stiffness_n_per_m",
    ),
    Uncertainty.FORCE_CONSTANT: _Words(
        "force constant", "force constants", "force constant over the bearing's own", "force_constant_factor"
    ),
    Uncertainty.MASS_AND_FORCE_CONSTANT: _Words(
        "equivalent mass", "equivalent masses", f"mass over factor of {_K0} (kg)", "equivalent_mass_kg"
    ),
}


@dataclass(frozen=True)
class Members:
    """The words and numbers for the members of one case."""

    outcome: CaseOutcome

    @property
    def noun(self) -> str:
        """What the members differ in."""
        return self._words.noun

    @property
    def plural(self) -> str:
        """The same of several members."""
        return self._words.plural

    @property
    def axis(self) -> str:
        """The same with its unit, beside an axis."""
        return self._words.axis

    def values(self, masses_kg: ArrayLike) -> Floats:
        """The values of members that are stored under these masses."""
        return member_values(self.outcome.inputs, masses_kg)

    def name(self, mass_kg: float) -> str:
        """The member that is stored under a mass, for a legend: ``3.6 kg``, ``k_z = 62 500 N/m``, ``k₀ × 1.2``."""
        value = float(self.values(mass_kg))
        kind = uncertainty(self.outcome.inputs)
        if kind is Uncertainty.NEGATIVE_STIFFNESS:
            return f"k_z = {significant(value, 4)} N/m"
        if kind is Uncertainty.FORCE_CONSTANT:
            return f"{_K0} × {kilograms(value)}"
        return f"{kilograms(value)} kg" if kind is Uncertainty.MASS else f"m/f = {kilograms(value)} kg"

    def span(self, masses_kg: ArrayLike) -> str:
        """From the least to the largest of these members: ``3–4.5 kg``, ``k_z = 25 000–100 000 N/m``."""
        values = self.values(masses_kg)
        low, high, kind = float(values.min()), float(values.max()), uncertainty(self.outcome.inputs)
        if kind is Uncertainty.NEGATIVE_STIFFNESS:
            return f"k_z = {significant(low, 4)}–{significant(high, 4)} N/m"
        if kind is Uncertainty.FORCE_CONSTANT:
            return f"{_K0} × {kilograms(low)}–{kilograms(high)}"
        return mass_text([low, high]) if kind is Uncertainty.MASS else f"m/f = {mass_text([low, high])}"

    @property
    def family(self) -> str:
        """The rotor's mass and what else is uncertain, as they were asked for."""
        return f"{mass_text(self.outcome.mass_kg)}{uncertain_text(self.outcome)}"

    def columns(self, mass_kg: float, rows: int) -> dict[str, list[object]]:
        """Columns of the numbers behind a figure that say which member it is; the rotor's mass where it has one."""
        own: dict[str, list[object]] = {self._words.column: [float(self.values(mass_kg))] * rows}
        if self._words.column in {"mass_kg", "equivalent_mass_kg"}:
            return own
        mass: list[object] = [self.outcome.mass_kg] * rows
        return {"mass_kg": mass, **own}

    @property
    def _words(self) -> _Words:
        return _WORDS[uncertainty(self.outcome.inputs)]
