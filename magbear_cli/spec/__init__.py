"""A study file, believed or refused."""

from magbear_cli.spec.grid import compile_limits, compile_sweep, parse_grid, parse_mass
from magbear_cli.spec.problems import CODES, Problem, StudyError
from magbear_cli.spec.schema import json_schema
from magbear_cli.spec.study import RunLimits, Study, read_study, read_study_text
from magbear_cli.spec.template import template

__all__ = [
    "CODES",
    "Problem",
    "RunLimits",
    "Study",
    "StudyError",
    "compile_limits",
    "compile_sweep",
    "json_schema",
    "parse_grid",
    "parse_mass",
    "read_study",
    "read_study_text",
    "template",
]
