"""One entry of ``simulate``: a step or a disturbance, and the world around the loop."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from magbear_cli.spec.section import Mass, NonNegative, Omega, PartName, Positive, Section, Signed, fault


class Prefilter(Section):
    """The filter of the step command, omega²/(s² + 2 zeta omega s + omega²) (thesis section 3.7)."""

    omega_rad_s: Omega = Field(description="Natural frequency (rad/s).")
    zeta: float = Field(ge=1e-6, le=1e6, description="Damping ratio.")


class Sensor(Section):
    """The position sensor, omega²/(s² + damping s + omega²) (thesis eq. 2.11)."""

    omega_rad_s: Omega = Field(description="Resonance (rad/s).")
    damping_rad_s: Positive = Field(description="Coefficient of s in the denominator (rad/s).")


class Rotor(Section):
    """An elastic rotor: the magnet pulls one mass, the sensor sees another (thesis section 4.7)."""

    sensor_mass_kg: Mass = Field(description="The part of the rotor's mass that the sensor sees (kg).")
    stiffness_n_per_m: Positive = Field(description="Spring between the two masses (N/m).")
    damping_n_s_per_m: NonNegative = Field(description="Damper between the two masses (N s/m).")


class Disturbance(Section):
    """A rectangular pulse of force on the rotor."""

    force_n: Signed = Field(description="Force (N).")
    start_s: NonNegative = Field(0.0, description="When it begins (s).")
    duration_s: float = Field(ge=1e-9, le=1e4, description="How long it lasts (s).")


def _distinct(masses: list[float]) -> list[float]:
    """The masses, unless one stands twice."""
    for index, mass in enumerate(masses):
        if mass in masses[:index]:
            raise fault("E113", f"holds {mass:g} twice", "remove one of the two", (str(index),))
    return masses


class Scenario(Section):
    """A simulated response of the closed loop, for each of some masses."""

    step_m: float | None = Field(None, ge=-1.0, le=1.0, description="Height of the step command (m).")
    masses_kg: Annotated[list[Mass], Field(min_length=1, max_length=100), AfterValidator(_distinct)] | None = Field(
        None, description="Masses to simulate (kg); left out: the lowest, the nominal and the highest."
    )
    model: Literal["nonlinear", "linear"] = Field("nonlinear", description="The force law, or its linearisation.")
    prefilter: Annotated[Prefilter, PartName("prefilters")] | None = Field(
        None, description="A filter of the step command; null for none."
    )
    sensor: Annotated[Sensor, PartName("sensors")] | None = Field(
        None, description="Dynamics of the position sensor; null for an ideal one."
    )
    rotor: Annotated[Rotor, PartName("rotors")] | None = Field(
        None, description="Elasticity of the rotor; null for a rigid one."
    )
    gravity_m_per_s2: float = Field(0.0, ge=-1000, le=1000, description="Gravity against the axis (m/s²).")
    gravity_compensation: bool = Field(
        default=False, description="Add the constant current that balances gravity at the operating point."
    )
    current_limit_a: float | None = Field(
        None, ge=1e-6, le=1e6, description="Largest control current (A); null for no limit."
    )
    disturbance: Disturbance | None = Field(None, description="A pulse of force; null for none.")
    duration_s: float | None = Field(
        None, ge=1e-9, le=1e4, description="Simulated time (s); null for long enough to settle."
    )
    samples: int = Field(1001, ge=2, le=100001, description="Stored points of each response.")

    @model_validator(mode="after")
    def _something_happens(self) -> Scenario:
        """Refuse an entry that neither steps nor disturbs."""
        if self.step_m is None and self.disturbance is None:
            raise fault("E103", "needs a step_m or a disturbance", "add for example step_m: 10.0e-6")
        pulse = self.disturbance
        if pulse and self.duration_s is not None and pulse.start_s >= self.duration_s:
            raise fault(
                "E114",
                f"begins at {pulse.start_s:g} s, when the simulation of {self.duration_s:g} s has ended",
                "begin it earlier, or simulate longer",
                ("disturbance", "start_s"),
            )
        return self
