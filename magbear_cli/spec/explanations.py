"""What each error code means at length: the sentence behind it, and a line of a study that is wrong, mended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from magbear_cli.spec.problems import CODES


@dataclass(frozen=True)
class Explanation:
    """A code with its meaning, an example of what brings it about, and what to do."""

    code: str
    meaning: str
    wrong: str = ""
    right: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        """The whole of it, in lines."""
        lines = [f"{self.code}: {self.meaning}"]
        lines += [f"  wrong:  {line}" for line in self.wrong.splitlines()]
        lines += [f"  right:  {line}" for line in self.right.splitlines()]
        return "\n".join([*lines, *([f"  {self.remedy}"] if self.remedy else [])])


_EXAMPLES: Final[dict[str, tuple[str, str]]] = {  # wrong, and what it should be
    "E101": ("mass_kg: [3.0, 4.5", "mass_kg: [3.0, 4.5]"),
    "E102": ("mas_kg: [3.0, 4.5]", "mass_kg: [3.0, 4.5]"),
    "E103": ("performance: {dc_gain: 10}", "performance: {dc_gain: 10, corner_rad_s: 200}"),
    "E104": ("mass_kg: heavy", "mass_kg: [3.0, 4.5]"),
    "E105": ("mass_kg: -3.0", "mass_kg: [3.0, 4.5]"),
    "E106": ("controller: {method: mu_convexx}", "controller: {method: mu_convex}"),
    "E107": ("mass_kg: 3.0\nmass_kg: 4.5", "mass_kg: [3.0, 4.5]"),
    "E108": ("mass_kg: &range [3.0, 4.5]", "mass_kg: [3.0, 4.5]"),
    "E109": ("mass_kg: .inf", "mass_kg: [3.0, 4.5]"),
    "E112": ("magbear: 2", "magbear: 1"),
    "E113": ("sweep: {mass_kg: []}", "sweep: {mass_kg: [3.0, 4.0]}"),
    "E114": ("mass_kg: [4.5, 3.0]", "mass_kg: [3.0, 4.5]"),
    "E115": ("performance: {num: [1, 0, 0], den: [1, 200]}", "performance: {num: [2000], den: [1, 200]}"),
    "E117": ("sweep: {name: [one, two]}", "sweep: {mass_kg: [3.0, 4.0]}"),
    "E119": (
        "sweep: {controller: [{method: hinf}, {method: hinf, form: mended}]}",
        "sweep: {controller: [{method: hinf}, {method: hinf, form: as_printed}]}",
    ),
}
_REMEDIES: Final[dict[str, str]] = {
    "E100": "Look at the path, counted from where the command was typed; magbear new NAME writes a first study.",
    "E110": "A study is a page of text. Put measured data elsewhere; a grid of values goes into sweep.",
    "E111": "Save the file as UTF-8 in the editor.",
    "E116": "Sweep fewer values, or several studies: a study may have 100 000 cases.",
    "E118": "Write --set KEY=VALUE with a dotted key, as --set bandwidth.omega_c_rad_s=15000; quote it for the shell.",
}


def explain_code(code: str) -> Explanation | None:
    """What an error code of a study means; None for what is no code."""
    if code not in CODES:
        return None
    wrong, right = _EXAMPLES.get(code, ("", ""))
    return Explanation(code, CODES[code], wrong, right, _REMEDIES.get(code, ""))
