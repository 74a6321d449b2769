"""Why a target cannot be solved as it stands."""


class RefusedError(Exception):
    """A target cannot be solved as it stands; `cause` is one word for counters, the text says why."""

    def __init__(self, status: str, text: str) -> None:
        super().__init__(text)
        self.status = status
