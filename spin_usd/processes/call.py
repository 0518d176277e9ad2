"""A call that a child process answers: where its function is, and the types of its request and its answer."""

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from msgspec import convert, to_builtins

Request = TypeVar("Request")
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Call(Generic[Request, Answer]):
    """A function in the child, named as text: the parent loads nothing of it, a child only the module of its call.

    It takes one request, and `progress` if it has a parameter of that name. A class is opened by its call and kept for
    the calls of its methods; the answer is its attribute `opened`, None without one.
    """

    place: str
    """Module and name: "module:function", "module:Class" or "module:Class.method"."""
    request: type[Request]
    """Type of the request; NoneType for a function that takes none."""
    answer: type[Answer]
    """Type of the answer."""

    @property
    def module(self) -> str:
        """The module that a child loads to answer."""
        return self.place.partition(":")[0]

    def encoded(self, request: Request) -> Any:
        """Return the request as JSON."""
        return to_builtins(request)

    def decoded(self, answer: object) -> Answer:
        """Return the answer that JSON contains. Raises msgspec.ValidationError for a defect of ours."""
        return convert(answer, self.answer)
