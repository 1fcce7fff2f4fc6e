"""The one exception that is meant for people."""


class InputError(Exception):
    """Something a person gave us cannot be used.

    The message is one line that names the file and the field and says what to do. Entry points
    print it without a traceback and exit with status 1; every other exception is a defect and keeps
    its traceback.
    """

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))
