from magbear_cli.errors import InputError as InputError
from magbear_cli.errors import MagbearError as MagbearError
from magbear_cli.errors import NumericsError as NumericsError
from magbear_cli.errors import ResumableError as ResumableError
from magbear_cli.errors import Status as Status
from magbear_cli.library.scripting import design as design
from magbear_cli.library.scripting import limit as limit
from magbear_cli.library.scripting import load_study as load_study
from magbear_cli.library.scripting import open_results as open_results
from magbear_cli.library.scripting import read_results as read_results
from magbear_cli.library.scripting import run as run
from magbear_cli.library.scripting import sample as sample
from magbear_cli.library.scripting import to_control as to_control
from magbear_cli.lti.state_space import StateSpace as StateSpace
from magbear_cli.spec import Study as Study
from magbear_cli.spec import StudyError as StudyError
from magbear_cli.study.outcome import CaseOutcome as CaseOutcome
from magbear_cli.study.outcome import StudyResults as StudyResults
from magbear_cli.study.outcome import Summary as Summary
from magbear_cli.study.sampling import SampledDesign as SampledDesign

__version__: str
_PLACES: dict[str, str]
__all__ = [
    "CaseOutcome",
    "InputError",
    "MagbearError",
    "NumericsError",
    "ResumableError",
    "SampledDesign",
    "StateSpace",
    "Status",
    "Study",
    "StudyError",
    "StudyResults",
    "Summary",
    "__version__",
    "design",
    "limit",
    "load_study",
    "open_results",
    "read_results",
    "run",
    "sample",
    "to_control",
]
