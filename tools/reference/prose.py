"""Prose of the reference page, for what no declaration can express.

Numbers come from the code that enforces them.
"""

from __future__ import annotations

from openpendant.server.endpoints.frame_faults import FAULT_WINDOW_NS, MOST_FAULTS
from openpendant.server.endpoints.pendant.lobby import LOBBY_PERIOD_NS
from openpendant.server.endpoints.pendant.notifications import LOBBY_STAY_NS
from openpendant.server.settings.cell_settings import Pendants
from openpendant.server.shell.clients import READ_AHEAD, STRANGERS_READ_AHEAD
from openpendant.server.shell.first_frames import FIRST_FRAME_NS
from openpendant.simplemsg import MAX_REFERENCE_FRAME
from openpendant.simplemsg.framing import HEADER_SIZE, MAX_DETECTABLE_LENGTH, PREFIX_SIZE
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, PROTOCOL_VERSIONS

_PENDANTS = Pendants()

INTRODUCTION = """\
# Protocol reference

Every message that openpendant knows, to the byte. [simplemsg.md](simplemsg.md) says how
openpendant treats what is wrong, and where it differs from the C++ library;
[pendant-apps.md](pendant-apps.md) shows how to write a pendant.

Beside this page the same declarations give a [Wireshark dissector](generated/openpendant.lua),
[test vectors](generated/vectors/README.md). What the bodies of `management` hold is said in
[operations.md](generated/operations.md), and in a [JSON Schema](generated/schemas/) of each.

## Messages
"""

FRAMING = f"""\
## Framing

A frame is a length, a header and a body, one after the other on a TCP connection. Integers
(`int32`) are signed. Reals are IEEE 754 of 4 bytes, or of 8 where both ends agreed on that
beforehand; offsets on this page are for 4. Texts (`text[32]`, the number in bytes) are UTF-8,
padded with zero bytes; what stands behind the first zero byte is ignored. Nothing is aligned or
padded otherwise.

| offset | type | field | meaning |
| --- | --- | --- | --- |
| 0 | int32 | length | bytes that follow this field, {HEADER_SIZE - PREFIX_SIZE} or more |
| 4 | int32 | message type | see the table above; never 0 |
| 8 | int32 | communication type | 1 topic, 2 request, 3 reply; never 0 |
| 12 | int32 | reply code | 0 unless this is a reply; then 1 success, 2 failure |
| {HEADER_SIZE} | | body | as the message type says; may be empty |

- **Byte order**: all integers and reals of a connection have one order. The protocol fixes none.
  The length tells: read in the right order it lies between {HEADER_SIZE - PREFIX_SIZE} and
  {MAX_DETECTABLE_LENGTH:,}, read in the wrong one it never does.
- **Size**: a frame has at most {MAX_REFERENCE_FRAME:,} bytes with its length,
  {MAX_PENDANT_FRAME:,} on the pendant port. A length outside the bounds ends the connection, since
  no mark tells where the next frame begins.
- **Requests** are answered once, **topics** never. A reply has the type of its request unless the
  message says otherwise; any request may be answered by a bare header with reply code 2.
- A reply whose body is not the declared one is no fault: vendors answer one request with several
  layouts.
- An `i` in an offset counts the records of an array from 0, an `n` is their number.
"""

_VERSIONS = " and ".join(map(str, PROTOCOL_VERSIONS))

PENDANT_RULES = f"""\
## Rules of the pendant messages

Versions {_VERSIONS}. They use ids 65000 to 65535, which REP-I0004 leaves free, on TCP port
11010.

- **Before hello.** A gateway that the server's configuration names sends `forwarded` as its very
  first frame, within {FIRST_FRAME_NS / 1e9:g} s, and is answered by a bare header; from then on the
  address that it states counts. A `forwarded` that is not believed, or that comes later, is refused
  by a bare header and ends the connection. Where only gateways come from, whatever else comes first
  is refused with FORWARD_FIRST. `lobby` is answered before hello and after it, once in
  {LOBBY_PERIOD_NS / 1e9:g} s, then refused with TOO_OFTEN; after an answer hello may take
  {LOBBY_STAY_NS / 1e9:g} s.
- **Hello first.** The first other message is a `hello` request, within
  {_PENDANTS.hello_deadline:g} s, with the version that the pendant speaks, in which it is answered.
  Another version is refused with VERSION, and the connection is closed. Any other request before
  it is refused with HELLO_FIRST; only `ping` is answered, and a `lobby`, which has no version yet.
- **Version 2** is spoken with whoever says it in the hello: such a connection is sent no message
  and offered no capability that came later, does not know later requests and operations, and is
  told a code that it knows in place of a later one, with the same text. What came later says so.
- **Limits.** The reply to hello says the largest frame, the rates, the number of joints and what
  the server can do. Within one protocol version a message keeps its layout.
- **Unknown messages** are skipped by their length. An unknown request is refused by a bare header
  with reply code 2; an unknown topic or reply is ignored.
- **Malformed messages**: a request whose body is not as declared is refused with MALFORMED, under
  its request id where the frame reaches that far, else under 0.
  {MOST_FAULTS} unknown requests or malformed messages within {FAULT_WINDOW_NS / 1e9:g} s end the
  connection.
- **Outcomes.** A motion request carries a request id of the pendant's choice and is refused (a
  failure `verdict`), or accepted (a success `verdict`) and then completed or aborted (an
  `outcome`). Request ids of what can move the robot count up on each connection: one that is not
  higher than the last is refused with REQUEST_REPEATED. Nothing is clipped silently. Replies and
  outcomes are never dropped; of `state` a slow reader gets the newest only.
- **Authority.** One connection at a time may move the robot. It asks with `authority`, sends an
  `authority_beat` each second, and loses the authority {_PENDANTS.authority_timeout:g} s after the
  last, or with its connection. Nothing resumes by itself. Outputs, the selected tool, what the
  robot carries, and changes of the scene while it moves need the authority as a motion does:
  HELD_BY_OTHER or NOT_IN_CONTROL without it. A stop never needs it.
- **Sent away.** A connection whose login or pairing ends, and which may not look on without, is
  told by an `outcome` of request id 0 with LOGIN_NEEDED and the reason. Nothing of the cell is sent
  to it until it logs in again; it may still stop.
- **Stop.** Any connection may send `software_stop`, as a request or a topic; it latches. Only the
  holder of the authority may `reset_stop`, which moves nothing. It is no safety device.
- **Stop first.** A `software_stop` acts when its last byte is read, before all that its connection
  sent in front of it and the server has not handled, and is answered first. A whole frame of its
  type is one however short; one inside another frame's body is none. What stood in front and could
  move, reset, grant authority, or change the mode, an output, the selected tool or what the robot
  carries is refused with OVERTAKEN_BY_STOP; anything else is handled as usual.
  {READ_AHEAD >> 10} KiB are read ahead, {STRANGERS_READ_AHEAD >> 10} KiB of a connection that has
  not logged in.
- **Silence**: a connection that sends nothing for {_PENDANTS.idle_timeout:g} s is closed; a `ping`
  keeps it.
- **Units** are SI: metres, radians, seconds. Quaternions are x, y, z, w. Poses name their frame.
"""

PROSE_OF_DIALECTS = {
    "standard": """\
Any communication type may carry any of these. Types 20 `read_input` and 21 `write_output` have a
number and no layout anywhere. Joint arrays have ten slots, base to tip, unused ones 0.
""",
    "motoman": """\
MotoROS for ROS 1, beside the standard messages: motion on port 50240, state on 50241, I/O on
50242. The verdict on motion is `result` and `subcode` of 2002; the header of that reply always
says success. With CHECK_QUEUE_CNT a `subcode` is no reason but the number of queued increments.
I/O replies say failure in the header too. A faulty I/O request is answered by a 2002 whose first
two integers are result and subcode.
""",
    "pendant": """\
Beside the standard messages. The rules stand [above](#rules-of-the-pendant-messages).
""",
}
