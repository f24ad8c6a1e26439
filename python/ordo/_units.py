"""SI units of what runs write (docs/output.md)."""

UNITS = {"time": "s", "dt": "s", "displacement": "m", "position": "m", "center": "m", "velocity": "m/s", "rotation": "rad/s", "stress": "Pa",
         "density": "kg/m³", "pressure": "Pa", "von_mises": "Pa", "energy_density": "J/m³"}
# In 1D per square metre of section, in 2D per metre of depth, in 3D.
UNITS_OF_TOTALS = {"mass": ("kg/m²", "kg/m", "kg"), "volume": ("m", "m²", "m³"), "momentum": ("kg/(m s)", "kg/s", "kg m/s"),
                   "angular_momentum": ("kg/s", "kg m/s", "kg m²/s"), "force": ("N/m²", "N/m", "N"), "moment": ("N/m", "N", "N m"),
                   "energy": ("J/m²", "J/m", "J")}
ENERGIES = ("energy", "work", "dissipation")


def unit_of(name, dim=None):
    """The SI unit of a field, of a component or of a column of a run in 1D, 2D or 3D; empty if unknown."""
    words = name.split("_")
    while words[-1] in ("x", "y", "z", "xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz", "before", "after") and len(words) > 1:
        words.pop()
    for k in range(len(words)):  # the longest end of the name that is known
        end = "_".join(words[k:])
        if end in UNITS:
            return UNITS[end]
        if end in UNITS_OF_TOTALS or end in ENERGIES:
            return UNITS_OF_TOTALS["energy" if end in ENERGIES else end][(dim or 3) - 1]
    return ""
