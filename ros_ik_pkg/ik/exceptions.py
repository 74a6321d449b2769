"""What can be wrong with a model, an option or an argument; a pose out of reach is not an error."""


class IkError(ValueError):
    """Base of every error that `ros_ik_pkg.ik` raises on purpose; the text says what was got and expected."""


class ModelError(IkError):
    """The robot cannot be loaded: malformed file, unknown frame, unsupported joint, bad limits."""


class OptionError(IkError):
    """An option is unknown or outside its range."""


class ArgumentError(IkError):
    """A target, seed or reference has the wrong shape, or is not finite, or is not a pose."""
