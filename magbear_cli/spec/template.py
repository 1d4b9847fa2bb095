"""The study that ``magbear new`` begins with: legal as it is, every section explained."""

from __future__ import annotations

import re
import textwrap
from typing import Final

from magbear_cli.errors import InputError
from magbear_cli.spec.grammar import method_names
from magbear_cli.spec.problems import quoted
from magbear_cli.spec.writing import inline

SCHEMA_FILE: Final = "magbear.schema.json"

_TEMPLATE: Final = """\
# yaml-language-server: $schema={schema}
# A magbear study. Check it with `magbear check`, list its cases with `magbear plan`, run it with `magbear run`.
# All values are in SI units; every key with a dimension ends in its unit.
magbear: 1
name: {name}
description: A rotor of unknown mass, the optimum over all controllers, and a first-order controller beside it.

# The electromagnets: a part of configs/bearings, a path to a .yaml file of your own, or the numbers in place:
# bearing: {{air_gap_m: 400.0e-6, force_constant_n_m2_per_a2: 4.0e-6, bias_current_a: 0.5, current_law: full}}
bearing: thesis_thrust

# One number for a known mass, or the uncertain range [low, high].
mass_kg: [3.0, 4.5]

# The bound W1 on the sensitivity S: dc_gain*corner/(s + corner), or {{num: [...], den: [...]}}, or a part's name.
performance: {{dc_gain: 10, corner_rad_s: 200}}

# The bound W3 = s^2/omega_c^2 on the complementary sensitivity T; leave it out for no limit.
bandwidth: {{omega_c_rad_s: 20000}}

# The synthesis method with its options:
{methods}
controller: {{method: mu_convex}}

# Responses to simulate with each controller; masses_kg left out: the lowest, the nominal and the highest.
simulate:
  - {{step_m: 10.0e-6, model: nonlinear, prefilter: {{omega_rad_s: 20000, zeta: 1.0}}}}

# Any dotted key with a list of values; the cases are the product.
sweep:
  controller:
    - {{method: mu_convex}}
    - {{method: fixed_order, order: 1}}

report: {{figures: [mu, sensitivity, controller_gain, step]}}
# run: {{timeout_s: 300, memory_gib: 4}}     # limits of one case
"""


def template(name: str) -> str:
    """The text of a new study of that name.

    Raises
    ------
    InputError
        When the name cannot be the name of a study.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,79}", name):
        raise InputError(f"{quoted(name)} cannot name a study: use letters, digits, '.', '_' and '-'")
    methods = textwrap.fill(", ".join(method_names()) + ".", 116, initial_indent="# ", subsequent_indent="# ")
    return _TEMPLATE.format(schema=SCHEMA_FILE, name=inline(name), methods=methods)
