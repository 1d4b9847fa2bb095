"""Which cases belong together: what tells them apart, in words, and the view over frequency they share."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from magbear_cli.report.numbers import mass_text, omega_text, shortest
from magbear_cli.study.naming import NAMED_OPTIONS, controller_name
from magbear_cli.study.outcome import CaseOutcome, FrequencyStudy

Floats = NDArray[np.float64]
PROBLEM_KEYS = ("bearing", "operating_point", "mass_kg", "uncertain", "performance", "bandwidth")

_ALWAYS_IN_VIEW = 30.0  # how far the view reaches past the slowest and the fastest bound
_OPTION_LENGTH, _NAME_LENGTH = 28, 48


class Labels:
    """Names for controllers, with those options that tell them apart in this study and no others."""

    def __init__(self, outcomes: Iterable[CaseOutcome]) -> None:
        """Look at all controllers of the study."""
        self._varying: dict[str, list[str]] = {}
        seen: dict[str, dict[str, set[str]]] = {}
        for outcome in outcomes:
            options = seen.setdefault(outcome.method, {})
            for key, value in outcome.inputs["controller"].items():
                options.setdefault(key, set()).add(_key(value))
        for method, options in seen.items():
            self._varying[method] = sorted(key for key, values in options.items() if len(values) > 1)

    @property
    def distinctions(self) -> Mapping[str, Sequence[str]]:
        """By method, the options that tell its controllers apart; equal where all names would be."""
        return self._varying

    def controller(self, outcome: CaseOutcome) -> str:
        """Its name, with the further options in which this study's controllers of that method differ."""
        controller = outcome.inputs["controller"]
        told = [
            f"{_spoken(key)} {_short(controller[key])}"
            for key in self._varying.get(outcome.method, [])
            if key in controller and key not in NAMED_OPTIONS
        ]
        name = _short(controller_name(controller), _NAME_LENGTH)
        return f"{name} ({', '.join(told)})" if told else name

    def case(self, outcome: CaseOutcome) -> str:
        """A case in one line: controller, mass, bandwidth limit."""
        limit = f"ω_c = {omega_text(outcome.omega_c_rad_s)}" if outcome.omega_c_rad_s else "no bandwidth limit"
        return f"{self.controller(outcome)}, {self.problem(outcome)}, {limit}"

    def problem(self, outcome: CaseOutcome) -> str:
        """What is uncertain: the mass, and the magnets where they are."""
        return f"{mass_text(outcome.mass_kg)}{uncertain_text(outcome)}"


def uncertain_text(outcome: CaseOutcome) -> str:
    """What is uncertain beside the mass, after a comma; empty where nothing is."""
    uncertain = outcome.inputs.get("uncertain")
    if uncertain is None:
        return ""
    spans = ((_spoken(name), shortest(low), shortest(high)) for name, (low, high) in uncertain.items())
    return "".join(f", {name} × {low} to {high}" for name, low, high in spans)


def problem_key(outcome: CaseOutcome, without: str = "") -> str:
    """The same text for cases that ask the same of their controllers, but for one key."""
    return _key({key: outcome.inputs.get(key) for key in PROBLEM_KEYS if key != without})


def controller_key(outcome: CaseOutcome) -> str:
    """The same text for cases with the same method and options."""
    return _key(outcome.inputs["controller"])


def file_stem(outcome: CaseOutcome, outcomes: Sequence[CaseOutcome]) -> str:
    """A name for the files of a case: its id, made safe, and its place where two have the same."""
    safe = re.sub(r"[^A-Za-z0-9]", "_", outcome.case_id)[:64] or "case"
    twins = sum(other.case_id == outcome.case_id for other in outcomes)
    return safe if twins == 1 else f"{safe}_{outcome.index}"


def mass_ends_kg(outcome: CaseOutcome) -> tuple[float, float]:
    """The lightest and the heaviest rotor of a case."""
    mass = outcome.mass_kg
    return (float(mass[0]), float(mass[-1])) if isinstance(mass, list) else (float(mass), float(mass))


def frequency_view(study: FrequencyStudy) -> tuple[float, float]:
    """The decades around the bounds, within the frequencies that were computed."""
    omega = study.omega_rad_s[study.omega_rad_s > 0]
    if omega.size < 2:
        return (1.0, 10.0)
    inside = study.omega_rad_s > 0
    marks = []
    w1, w3 = study.performance_bound[inside], study.bandwidth_bound[inside]
    if np.isfinite(w1).all() and w1.max() > 0:
        marks.append(omega[min(int(np.argmax(w1 < w1[0] / np.sqrt(2.0))) or 0, omega.size - 1)])
    if (w3 >= 1.0).any():
        marks.append(omega[int(np.argmax(w3 >= 1.0))])
    shape = np.abs(study.complementary_sensitivity[:, inside])
    falling = np.flatnonzero((shape < 0.5).all(axis=0))
    if falling.size:
        marks.append(omega[falling[0]])
    if not marks:
        return float(omega[0]), float(omega[-1])
    low = 10.0 ** np.floor(np.log10(max(min(marks) / _ALWAYS_IN_VIEW, omega[0])))
    high = 10.0 ** np.ceil(np.log10(min(max(marks) * _ALWAYS_IN_VIEW, omega[-1])))
    return max(float(low), float(omega[0])), min(float(high), float(omega[-1]))


def _key(value: Any) -> str:  # noqa: ANN401 - any resolved input
    return json.dumps(value, sort_keys=True, default=str)


def _spoken(key: str) -> str:
    return key.replace("_", " ")


def _short(value: Any, length: int = _OPTION_LENGTH) -> str:  # noqa: ANN401 - any option
    if isinstance(value, bool) or value is None:
        return {True: "on", False: "off", None: "none"}[value]
    if isinstance(value, int | float):
        return shortest(float(value))
    text = " ".join(str(value).split()) if not isinstance(value, list) else ", ".join(_short(item) for item in value)
    return text if len(text) <= length else text[: length - 1] + "…"
