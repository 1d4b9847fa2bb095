"""The methods of thesis sections 4.4 to 4.7: the adaptive law, how large its gain may become, and an elastic rotor."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from magbear_cli.spec.section import Mass, NonNegative, Omega, Positive, Section, Signed

Gain = Annotated[list[Signed], Field(min_length=2, max_length=2)]
SphereLength = Annotated[float, Field(ge=1e-12, le=0.1)]


class AdaptiveLaw(Section):
    """What the adaptive law has beside its adaptation gain; the defaults are the thesis's Table 4.2."""

    rho_m: SphereLength = Field(1e-6, description="Radius of the sphere around the reference (m).")
    sigma_m: Annotated[float, Field(ge=0, le=0.1)] = Field(
        0.5e-6, description="Half the hysteresis (m): adapting begins at rho + sigma and ends at rho - sigma."
    )
    gain: Gain | None = Field(
        [1.71e4, 52.8], description="State feedback (A/m, A s/m); null places the poles of the reference model."
    )
    design_mass_kg: Mass | None = Field(
        None, description="The rotor whose poles are placed (kg); null: the lightest of the range."
    )
    input_gain_m_per_s2_a: Positive | None = Field(
        None, description="The b of the law (m/s² per A); null: 2 zeta omega over the gain on the speed."
    )
    adaptation_input_gain_m_per_s2_a: Positive | None = Field(
        None, description="The b of the adaptation's rate (m/s² per A); null: that of the law, as eq. 4.10 has it."
    )
    reference_omega_rad_s: Omega = Field(600.0, description="Natural frequency of the reference model (rad/s).")
    reference_zeta: float = Field(1.0, ge=1e-3, le=1e3, description="Its damping ratio.")
    taylor_order: Literal[0, 1] = Field(1, description="The estimate: 0 a constant, 1 a constant and its slopes.")
    trigger: Literal["position", "state"] = Field(
        "position", description="The error that leaves the sphere: of the position, or of position and speed."
    )


class AdaptiveLfe(AdaptiveLaw):
    """Adaptive control by local function estimation: nonlinear, simulated, and proven of nothing (section 4.4)."""

    method: Literal["adaptive_lfe"]
    gamma: NonNegative = Field(2e9, description="Adaptation gain.")


class AdaptiveLimit(AdaptiveLaw):
    """The largest adaptation gain with which every run of simulate stays bounded, by bisection."""

    method: Literal["adaptive_limit"]
    low: Positive = Field(1e4, description="Where the search for the largest gain begins.")
    high: Positive = Field(1e11, description="Where it ends.")
    tolerance: float = Field(0.05, ge=1e-3, le=1.0, description="Relative width of the bracket to reach.")


class RotorIdentification(Section):
    """The elastic rotor that has some known facts, and how well they pin it; no controller (thesis section 4.7)."""

    method: Literal["rotor_identification"]
    resonance_rad_s: Omega = Field(4000.0, description="Resonance of the rotor (rad/s).")
    touching_damping_n_s_per_m: Positive = Field(
        170.0, description="Damping at which the elasticity just touches |W3| (N s/m)."
    )
    growing_damping_n_s_per_m: Positive = Field(
        100.0, description="Damping with which a linear loop for the rigid rotor is unstable (N s/m)."
    )
    pole_real_rad_s: Signed = Field(90.0, description="Real part of its growing pole (rad/s).")
    pole_imag_rad_s: Positive = Field(3666.0, description="Imaginary part of it (rad/s).")
