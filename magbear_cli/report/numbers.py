"""Numbers as a reader wants them: few digits, thin spaces, powers of ten, and a dash for what is not there."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

THIN_SPACE = "\u202f"
MISSING = "–"
MICROMETRES = 1e6
MILLISECONDS = 1e3

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN_FROM, _PLAIN_TO = 1e-3, 1e6  # outside of these a power of ten reads better


def significant(value: float | None, digits: int = 3) -> str:
    """A number with this many significant digits: ``0.512``, ``20 000``, ``6.2 × 10⁻⁷``; a dash for None and NaN."""
    if value is None or math.isnan(value):
        return MISSING
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if not _PLAIN_FROM <= 10.0**exponent < _PLAIN_TO:
        mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
        return f"{mantissa} × 10{str(int(power)).translate(SUPERSCRIPTS)}".replace("-", "−")
    rounded = round(value, digits - 1 - exponent)
    text = f"{rounded:,.{max(0, digits - 1 - exponent)}f}"
    return _grouped(text)


def at_least(value: float | None, digits: int = 3) -> str:
    """A proven lower bound, rounded down: as it is printed it is proven too."""
    return significant(_to_unit(value, digits, math.floor), digits)


def at_most(value: float | None, digits: int = 3) -> str:
    """A proven upper bound, rounded up."""
    return significant(_to_unit(value, digits, math.ceil), digits)


def _to_unit(value: float | None, digits: int, to_whole: Callable[[float], int]) -> float | None:
    if value is None or not math.isfinite(value) or value == 0:
        return value
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - digits + 1)
    return to_whole(value / unit) * unit


def shortest(value: float) -> str:
    """A number that a user wrote, with the digits it needs and no more: ``4.5``, ``20 000``."""
    text = f"{value:.6g}"
    if "e" in text:
        mantissa, _, power = text.partition("e")
        return f"{mantissa} × 10{str(int(power)).translate(SUPERSCRIPTS)}".replace("-", "−")
    return _grouped(f"{value:,.{len(text.partition('.')[2])}f}")


def _grouped(text: str) -> str:
    """Thin spaces between thousands, from five digits on, and a minus sign that is one."""
    whole, point, fraction = text.partition(".")
    digits = whole.replace(",", "")
    if len(digits.lstrip("-")) < 5:
        whole = digits
    return (whole.replace(",", THIN_SPACE) + point + fraction).replace("-", "−")


def kilograms(mass_kg: float) -> str:
    """A mass with four digits at most: the middle of a range has no end."""
    return shortest(float(f"{mass_kg:.4g}"))


def with_unit(value: float | None, unit: str, digits: int = 3) -> str:
    """A number and its unit, or a dash."""
    text = significant(value, digits)
    return text if text == MISSING else f"{text} {unit}"


def mass_text(mass_kg: float | Sequence[float]) -> str:
    """A mass or its range: ``2 kg``, ``3–4.5 kg``."""
    if isinstance(mass_kg, int | float):
        return f"{kilograms(float(mass_kg))} kg"
    return f"{kilograms(float(mass_kg[0]))}–{kilograms(float(mass_kg[-1]))} kg"


def omega_text(omega_rad_s: float | None) -> str:
    """A bandwidth limit, or that there is none."""
    return "no limit" if omega_rad_s is None else f"{shortest(omega_rad_s)} rad/s"


def count_text(count: int, noun: str) -> str:
    """``1 case``, ``3 cases``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
