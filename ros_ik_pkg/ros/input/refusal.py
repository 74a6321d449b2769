"""The refusal of a target."""


class RefusedError(Exception):
    """A target cannot be solved; `cause` is one word for counters, the text says why."""

    def __init__(self, status: str, text: str) -> None:
        super().__init__(text)
        self.status = status
