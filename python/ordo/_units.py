"""SI units of what runs write (docs/output.md)."""

import re

FIELDS = {"position": "m", "displacement": "m", "velocity": "m/s", "stress": "Pa", "pressure": "Pa", "von_mises": "Pa", "density": "kg/m³",
          "energy_density": "J/m³",
          # what particles carry with built-in laws (docs/materials.md); energies per initial volume
          "dissipated": "J/m³", "viscous_heat": "J/m³", "internal_energy": "J/m³", "preconsolidation": "Pa", "shock_pressure": "Pa", "temperature": "K"}
# Totals in 1D per square metre of section, in 2D per metre of depth, in 3D.
TOTALS = {"mass": ("kg/m²", "kg/m", "kg"), "volume": ("m", "m²", "m³"), "momentum": ("kg/(m s)", "kg/s", "kg m/s"),
          "angular_momentum": ("kg/s", "kg m/s", "kg m²/s"), "force": ("N/m²", "N/m", "N"), "moment": ("N/m", "N", "N m"), "energy": ("J/m²", "J/m", "J")}
ENERGIES = {f"{name}_energy" for name in ("total", "kinetic", "strain", "potential", "dissipated", "damped", "nodal_kinetic", "unresolved_kinetic",
                                          "stress_update", "projection", "filter", "half_step", "stage")}
WORKS = {"boundary_work", "traction_work", "body_force_work", "artificial_viscosity_work"}
COMPONENT = r"_([xyz]{1,2})$"


def field_unit(name, dim):
    """The unit of an array of particle files, or of a column of a probe; empty if unknown."""
    stem = re.sub(COMPONENT, "", name)
    return TOTALS[stem][(dim or 3) - 1] if stem in ("mass", "volume") else FIELDS.get(stem, "s" if name == "time" else "")


def column_unit(name, dim):
    """The unit of a column of history.csv or of body_0.csv; empty if unknown."""
    stem = re.sub(r"_(before|after)$", "", name)
    stem = re.sub(COMPONENT, "", re.sub(r"^projection_(?=mass|momentum)", "", stem))
    total = None
    if name in ("time", "dt"):
        return "s"
    if stem in ("mass", "momentum", "angular_momentum"):
        total = stem
    elif stem == "center":
        return "m"
    elif name in WORKS or name in ENERGIES:
        total = "energy"
    else:  # of a boundary, contact or obstacle, behind its name
        end = re.search(r"_(force_[xyz]|moment_[xyz]|work|dissipation|velocity_[xyz]|rotation_[xyz]|[xyz])$", name)
        what = re.sub(COMPONENT, "", end[1]) if end else ""
        if what in ("velocity", "rotation", "x", "y", "z"):
            return {"velocity": "m/s", "rotation": "rad/s"}.get(what, "m")
        total = {"force": "force", "moment": "moment", "work": "energy", "dissipation": "energy"}.get(what)
    return TOTALS[total][(dim or 3) - 1] if total else ""
