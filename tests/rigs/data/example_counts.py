"""How many random examples a test tries: few in `make test`, more in `make soak`.

Owns that a number chosen for `make test` does not hold in the soak: one that is given to `settings`
of hypothesis by itself would be that of every profile.
"""

import pytest
from hypothesis import settings


def examples(few: int, *, in_soak: int) -> int:
    """Return how many examples of hypothesis a test may take in the run that is under way."""
    return in_soak if settings.get_current_profile_name() == "soak" else few


def few(count: int, soak: int | None = None) -> settings:
    """Settings for a test: so many examples, and in the soak as many as are said or its profile's.

    Args:
        count: in `make test` and `make mutants`.
        soak: in `make soak`.
    """
    in_soak = settings.get_profile("soak").max_examples if soak is None else soak
    return settings(max_examples=examples(count, in_soak=in_soak))


def counts(few: int, soak: int) -> list[object]:
    """Return the parameters of a test that counts its examples itself."""
    return [few, pytest.param(soak, marks=pytest.mark.soak)]
