"""What a key that comes up may do: take motion away, never begin one."""

from rigs.cells.keypad_rig import KeypadRig

from openpendant.tools.pendants.panel import commands as do


def test_a_key_that_comes_up_begins_nothing_where_the_jog_is_over() -> None:
    rig = KeypadRig()
    rig.press("15")
    # The press has ended, and the line has not heard of it: no key was let go since.
    rig.keypad._is_pressing = False
    rig.asked.clear()
    rig.let_go("1")
    rig.let_go()
    assert [each for each in rig.moves if isinstance(each, do.PressJog)] == []
