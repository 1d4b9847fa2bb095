"""How the members of a case's family are told apart in figures and tables: by the parameters that are uncertain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from magbear_cli.model.family import Plant
from magbear_cli.report.numbers import kilograms, mass_text, significant
from magbear_cli.report.series import uncertain_text
from magbear_cli.study.members import Floats, Uncertainty, end_members, member_values, uncertainty
from magbear_cli.study.outcome import CaseOutcome

_K0 = "k₀"


@dataclass(frozen=True)
class _Words:
    noun: str
    plural: str
    axis: str
    columns: tuple[str, ...]


_PARAMETERS = ("mass_kg", "negative_stiffness_n_per_m", "current_stiffness_n_per_a")
_WORDS = {
    Uncertainty.MASS: _Words("mass", "masses", "mass (kg)", ("mass_kg",)),
    Uncertainty.NEGATIVE_STIFFNESS: _Words(
        "negative stiffness", "negative stiffnesses", "negative stiffness k_z (N/m)", _PARAMETERS[:2]
    ),
    Uncertainty.CURRENT_STIFFNESS: _Words(
        "current stiffness", "current stiffnesses", "current stiffness k_i (N/A)", (_PARAMETERS[0], _PARAMETERS[2])
    ),
    Uncertainty.FORCE_CONSTANT: _Words(
        "force constant",
        "force constants",
        "force constant over the bearing's own",
        ("mass_kg", "force_constant_factor"),
    ),
    Uncertainty.SEVERAL: _Words("plant", "plants", "share of the way between the end plants", _PARAMETERS),
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

    def values(self, members: Sequence[Plant]) -> Floats:
        """The values (k,) that tell members apart."""
        return member_values(self.outcome.inputs, members)

    def name(self, member: Plant) -> str:
        """A member for a legend: ``3.6 kg``, ``k_z = 62 500 N/m``, ``k₀ × 1.2``; several parameters after another."""
        kind = self._kind
        if kind is Uncertainty.SEVERAL:
            return ", ".join(_parameters(member, self._ends))
        if kind is Uncertainty.FORCE_CONSTANT:
            return f"{_K0} × {kilograms(float(self.values([member])[0]))}"
        return _one(member, kind)

    def span(self, members: Sequence[Plant]) -> str:
        """From the least to the largest of these members: ``3–4.5 kg``, ``k_z = 25 000–100 000 N/m``."""
        kind = self._kind
        if kind is Uncertainty.SEVERAL:
            return f"{self.name(members[0])} to {self.name(members[-1])}"
        values = self.values(members)
        low, high = float(values.min()), float(values.max())
        if kind is Uncertainty.MASS:
            return mass_text([low, high])
        if kind is Uncertainty.FORCE_CONSTANT:
            return f"{_K0} × {kilograms(low)}–{kilograms(high)}"
        if kind is Uncertainty.CURRENT_STIFFNESS:
            return f"k_i = {kilograms(low)}–{kilograms(high)} N/A"
        return f"k_z = {significant(low, 4)}–{significant(high, 4)} N/m"

    @property
    def family(self) -> str:
        """The rotor's mass and what else is uncertain, as they were asked for."""
        return f"{mass_text(self.outcome.mass_kg)}{uncertain_text(self.outcome)}"

    def columns(self, member: Plant, rows: int) -> dict[str, list[object]]:
        """Columns of the numbers behind a figure that say which member it is."""
        known: dict[str, object] = {name: getattr(member, name) for name in _PARAMETERS}
        if self._kind is Uncertainty.FORCE_CONSTANT:
            known["force_constant_factor"] = float(self.values([member])[0])
        return {name: [known[name]] * rows for name in self._words.columns}

    @property
    def _kind(self) -> Uncertainty:
        return uncertainty(self.outcome.inputs)

    @property
    def _words(self) -> _Words:
        return _WORDS[self._kind]

    @property
    def _ends(self) -> tuple[Plant, ...]:
        return end_members(self.outcome.inputs)


def _one(member: Plant, kind: Uncertainty) -> str:
    """A member by one of its parameters."""
    if kind is Uncertainty.MASS:
        return f"{kilograms(member.mass_kg)} kg"
    if kind is Uncertainty.NEGATIVE_STIFFNESS:
        return f"k_z = {significant(member.negative_stiffness_n_per_m, 4)} N/m"
    return f"k_i = {kilograms(member.current_stiffness_n_per_a)} N/A"


def _parameters(member: Plant, ends: tuple[Plant, ...]) -> list[str]:
    """A member by those of its parameters that differ between the ends."""
    kinds = (Uncertainty.MASS, Uncertainty.NEGATIVE_STIFFNESS, Uncertainty.CURRENT_STIFFNESS)
    named = zip(kinds, _PARAMETERS, strict=True)
    return [_one(member, kind) for kind, name in named if getattr(ends[0], name) != getattr(ends[-1], name)]
