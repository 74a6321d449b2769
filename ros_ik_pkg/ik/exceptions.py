"""Errors in a model, an option or an argument; a pose out of reach is not an error."""


MAX_TEXT = 4000  # characters


class IkError(ValueError):
    """Base of every error that `ros_ik_pkg.ik` raises on purpose; the text names the value and what was expected."""


class ModelError(IkError):
    """The robot cannot be loaded: malformed file, unknown frame, unsupported joint, bad limits."""

    def __init__(self, text: str) -> None:
        # The text may quote a file of any length.
        super().__init__(text if len(text) <= MAX_TEXT else f'{text[:MAX_TEXT]}... ({len(text)} characters)')


class OptionError(IkError):
    """An option is unknown or outside its range."""


class NotCompiledError(IkError):
    """A solve needs code that is still being compiled (see `compilation.Compilation`)."""


class ArgumentError(IkError):
    """A target, seed or reference has the wrong shape, or is not finite, or is not a pose."""
