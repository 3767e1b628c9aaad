"""The same calls without asyncio, as they would stand in the cells of a notebook.

python examples/sync_notebook_style.py [PORT]
"""

# %% Connect and take control.
import sys

from openpendant.tools.pendants.client import OperatingMode, PendantError
from openpendant.tools.pendants.sync_client import SyncPendantClient

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010
try:
    pendant = SyncPendantClient.connect("127.0.0.1", PORT, client="notebook")
    pendant.take_control()
except PendantError as error:
    sys.exit(error.explained)
print(pendant.hello.robot, "in mode", OperatingMode(pendant.next_state().operating_mode).name)

# %% Move.
pendant.set_mode(OperatingMode.AUTOMATIC)
pendant.next_state()
first, *others = pendant.joints()
motion = pendant.move_joints([first + 0.1, *others], speed=0.3)
print("arrived:", motion.done())

# %% Jog. It lets go by itself after 2 s without a call: a notebook that hangs is no finger.
pendant.set_mode(OperatingMode.MANUAL_REDUCED)
with pendant.enabling(), pendant.jog({0: -0.5}) as jog:
    jog.hold(0.3)
print("let go:", jog.account)

# %% Look on.
for number, state in enumerate(pendant.states()):
    print(state.sequence, [round(value, 3) for value in pendant.joints()])
    if number == 2:
        break

# %% Leave.
pendant.release_control()
pendant.close()
