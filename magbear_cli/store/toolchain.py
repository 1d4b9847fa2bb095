"""What computes here: the versions and the processor on which the last bits of a result depend."""

from __future__ import annotations

import hashlib
import json
import platform
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata

import numpy as np
from threadpoolctl import threadpool_info

import magbear_cli
from magbear_cli.study.plan import KERNEL_VERSION, SCHEMA_VERSION, canonical_json

COMPUTING = ("numpy", "scipy", "slycot", "clarabel")
BESIDE = ("control", "h5py")
FINGERPRINT_DIGITS = 16
SEED = "each case seeds every generator with the first 8 digits of its id"


@dataclass(frozen=True)
class Toolchain:
    """Named versions; two toolchains with the same ones give the same bits."""

    versions: Mapping[str, str]

    @property
    def fingerprint(self) -> str:
        """16 hex digits that stand for these versions."""
        return hashlib.sha256(canonical_json(dict(self.versions)).encode("ascii")).hexdigest()[:FINGERPRINT_DIGITS]

    @property
    def text(self) -> str:
        """The versions as JSON."""
        return canonical_json(dict(self.versions))

    def differences(self, other: Toolchain) -> str:
        """What changed from the other toolchain to this one, as in ``numpy 2.3.0 -> 2.4.6``."""
        names = sorted({*self.versions, *other.versions})
        pairs = ((name, other.versions.get(name, "none"), self.versions.get(name, "none")) for name in names)
        return ", ".join(f"{name} {before} -> {now}" for name, before, now in pairs if before != now)

    @classmethod
    def of_text(cls, text: str) -> Toolchain:
        """The toolchain whose ``text`` this is.

        Raises
        ------
        ValueError
            when it is no such text.
        """
        versions = json.loads(text)
        if not isinstance(versions, dict):
            raise ValueError("not a toolchain")  # noqa: TRY004 - the text is wrong, not the argument's type
        return cls(versions)


def this_toolchain() -> Toolchain:
    """The toolchain of this very process and of the workers it starts."""
    versions = {name: _version(name) for name in COMPUTING}
    return Toolchain(
        {
            "magbear": magbear_cli.__version__,
            "kernel": str(KERNEL_VERSION),
            "schema": str(SCHEMA_VERSION),
            **versions,
            "machine": platform.machine(),
            "blas_core": _blas_core(),
        }
    )


def toolchain_text() -> str:
    """What computes in this process, as text that can be compared with another machine's."""
    return this_toolchain().text


def difference_of(before: str, now: str) -> str:
    """What differs between the texts of two toolchains, in words."""
    return Toolchain.of_text(now).differences(Toolchain.of_text(before))


def provenance(toolchain: Toolchain) -> dict[str, str]:
    """Where results come from, for a results file: the toolchain and what stands beside it; no times, no hosts."""
    return {
        **toolchain.versions,
        **{name: _version(name) for name in BESIDE},
        "python": platform.python_version(),
        "system": sys.platform,
        "fingerprint": toolchain.fingerprint,
        "seed": SEED,
    }


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "none"


def _blas_core() -> str:
    """The processor family that numpy's BLAS chose its kernels for; other families round differently."""
    folder = str(np.__file__).rsplit("numpy", 1)[0]
    pools = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
    ours = [pool for pool in pools if pool["filepath"].startswith(folder + "numpy")] or pools
    return str(ours[0].get("architecture", "unknown")) if ours else "unknown"
