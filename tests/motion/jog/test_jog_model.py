"""Of what robots there are jogs."""

from typing import cast

import pytest
from rigs.motion.jogged_robots import robot

from openpendant.motion.errors import BadArgument
from openpendant.motion.jog import jog_model
from openpendant.motion.paths.mechanism import Mechanism


@pytest.mark.parametrize("name", ["ur5", "stewart_classroom"])
def test_a_chain_and_a_platform_are_jogged_with_their_own_limits(name: str) -> None:
    assert jog_model(robot(name)).limits is robot(name).limits


def test_what_is_neither_is_refused_with_what_is_accepted() -> None:
    delta = type("DeltaMechanism", (), {})()
    accepted = "DeltaMechanism.*accepted: a SerialMechanism or a PlatformMechanism"
    with pytest.raises(BadArgument, match=accepted):
        jog_model(cast(Mechanism, delta))
