"""What ordo raises, with the texts of the program."""


class InputError(ValueError):
    """The input cannot be used. The text says where, what, why and the remedy."""


class NumericalError(ArithmeticError):
    """A step failed. The text names step, time, particle and quantity. The state is not good any more."""


class OutputError(OSError):
    """A file cannot be written."""


class StaleView(RuntimeError):
    """A view of particles was used after the step for which it was good; take it from `sim.particles` again."""


class InstabilityWarning(UserWarning):
    """What `ordo run` warns of: the case goes on."""
