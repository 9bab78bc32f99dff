"""What can go wrong by name: wrong input, a theory that does not apply, a run that found no answer.

All are ``ValueError`` too, so that a caller may catch them together; code that goes on after a refusal catches
:class:`NotApplicable` alone, or :class:`NotConverged` where no answer is an answer, and a mistake elsewhere then stays
visible. ``limitmason.ContactError`` is wrong input, ``dem.UnstableError`` a run that did not converge.
"""


class InputError(ValueError):
    """A value that a user gave is wrong.

    The message names the block, joint, field or option and what to do.
    """


class NotApplicable(ValueError):
    """A theory refuses this structure, joint law or load: another one may take it.

    The message says why.
    """


class NotConverged(ValueError):
    """A run ended without an answer that could be certified.

    The message says what was tried.
    """
