"""magbear: proven limits of linear control for precision magnetic bearings, and the simplest controller at them.

The command is ``magbear``; the same from Python::

    import magbear_cli as magbear

    outcome = magbear.design("study.yaml")       # one controller, judged and verified
    results = magbear.run("study.yaml", "out")   # all cases, as the command runs them
    bracket = magbear.limit((3.0, 4.5))          # where linear control ends

Names are loaded when they are first used, so that importing the package costs nothing.
"""

from importlib import import_module

__version__ = "0.1.0"

_PLACES = {
    "load_study": "library.scripting",
    "run": "library.scripting",
    "read_results": "library.scripting",
    "open_results": "library.scripting",
    "design": "library.scripting",
    "limit": "library.scripting",
    "sample": "library.scripting",
    "to_control": "library.scripting",
    "CaseOutcome": "study.outcome",
    "StudyResults": "study.outcome",
    "Summary": "study.outcome",
    "StateSpace": "lti.state_space",
    "SampledDesign": "study.sampling",
    "Study": "spec",
    "StudyError": "spec",
    "Status": "errors",
    "MagbearError": "errors",
    "InputError": "errors",
    "ResumableError": "errors",
    "NumericsError": "errors",
}
__all__ = ["__version__", *_PLACES]  # noqa: PLE0604 - all are text


def __getattr__(name: str) -> object:
    """A name of the interface, imported from where it lives."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    """The names of the interface."""
    return sorted(__all__)
