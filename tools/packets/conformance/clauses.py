"""Clauses: what each check says must hold, and what gives it reason, section by section.

Owns title and clause of every check by its number: section letter, role letter (S judges servers, C
judges clients) and two digits, never reused. A clause is a standard, a REP, or behaviour observed
of a named program. Knows nothing of how a check looks.
"""

from __future__ import annotations

from collections.abc import Iterator

_TABLE = """\
REP-I0006, prefix: the length says where a frame ends
    FS01 a frame in one piece is understood
    FS18 frames of different sizes in one piece are told apart
RFC 9293 3.8: TCP is a stream without message boundaries
    FS02 a frame cut in two at any byte is understood
    FS03 a frame that comes byte by byte is understood
    FS04 two frames in one piece are both answered
    FS05 twenty frames in one piece are all answered
    FS06 a frame is answered although half of the next one came with it
    FS07 a body may come in another segment than its header
    FS17 a frame that takes half a second to come is understood
industrial_core simple_socket.cpp: a length of 0 or less ends the connection
    FS08 a length of 0 blocks nothing
    FS09 a negative length blocks nothing
industrial_core simple_message.cpp: such a frame is consumed and rejected
    FS10 a length of less than a header blocks nothing
industrial_core simple_socket.cpp reads any length into 1,025 bytes; a receiver must bound it
    FS11 a length of two thousand million ends the link instead of waiting for them
industrial_core simple_socket.h: no frame has 1,024 bytes or more; a request is answered
    FS12 a point of 1,024 bytes or more is refused, or ends the link
REP-I0006: there is no mark to resynchronise by, so the link is to be closed
    FS13 what is no simple message at all harms nobody
docs/ros-i.md: each started frame must complete within 1 s; here 5 s are granted
    FS14 a frame that is never completed does not hold the link for ever
RFC 9293 3.6: the end of the stream says that nothing more will come
    FS15 a client that says no more is answered or left, not kept
RFC 9293 3.5.2: a reset may come at any time
    FS16 a client that disappears amid a frame harms nobody
REP-I0006, packet structure: the prefix counts header and body, not itself
    FC01 each frame has exactly the bytes that its length declares
REP-I0006: the header is 12 bytes; industrial_core simple_message.cpp rejects less
    FC02 each frame has at least a whole header
REP-I0006: a stream without marks cannot be resumed inside a frame
    FC03 no connection ends inside a frame
industrial_core simple_socket.h: sends of 1,024 bytes and more are refused, and a receiver of \
that library would be overrun; on the pendant port the announced 65,532
    FC04 no frame is longer than the receiver takes
REP-I0006, message bodies; industrial_core's load routines
    FC05 each body has the layout of its message type
motoman_driver MotionServer.c: a frame that comes in two reads is answered INVALID/3001 and \
thrown away
    FC06 each frame arrives in one piece
REP-I0006, header
    HS01 an answer is marked as a reply
    HS02 a reply says success or failure
    HS03 a reply has the type of its request
    HS05 what the state port says is marked as topics
REP-I0006, prefix: it does not count itself
    HS04 the length of a reply counts the bytes behind it
industrial_core simple_message.cpp, validateMessage: such a frame is dropped
    HS06 a frame of communication type 0 is not taken
    HS07 a frame of message type 0 is not taken
    HS08 a request with a reply code is not taken
REP-I0006: ignore a reply nobody asked for
    HS09 a reply that nobody asked for is ignored
REP-I0006: warn and ignore
    HS10 an unknown communication type is ignored
industrial_core ping_message.cpp: an empty body; REP-I0006 has forty zeros
    HS11 a reply that carries no data is sixteen bytes
REP-I0004, message identifiers; industrial_core simple_message.cpp, validateMessage
    HC01 no frame has the reserved message type 0
REP-I0006, communication types; industrial_core simple_message.cpp, validateMessage
    HC02 each frame is a topic, a request or a reply
REP-I0006, reply code: unused but in replies; simple_message.cpp, validateMessage
    HC03 topics and requests carry reply code 0
REP-I0006, reply code 1 or 2; simple_message.cpp drops a reply with code 0
    HC04 each reply says success or failure
REP-I0004: state and replies come from the controller; vendor types within their dialect
    HC05 a client asks only for what controllers have
industrial_core ping_message.cpp has no topic form of it
    HC06 PING is never a topic
industrial_core: three builds; the controller's order wins and the client adapts
    BS01 a reply has the byte order of its request
    BS02 the state port keeps to one byte order
industrial_robot_client: one build serves all ports of a controller
    BS03 motion port and state port speak the same byte order
industrial_core shared_types.h: reals of 4 bytes, of 8 in the FLOAT64 build
    BS04 reals have the byte order and the width of the rest
a length below 65,536 reads as more in the wrong order; so does the dissector decide
    BS05 a client of the other byte order is answered in it or cut off
    BS06 two clients of different byte order are each answered in their own
REP-I0006: once the place in the stream is lost, the link is to be closed
    BS07 a frame in another order than the first is not misread
REP-I0006: the controller's native order holds; industrial_core byte_array.cpp swaps all or \
nothing
    BC01 the byte order is the same over a whole connection
REP-I0006; industrial_robot_client: use_bswap is chosen by the controller
    BC02 the byte order is the controller's
industrial_robot_client: the motion and the state node are built for one order
    BC03 all connections of a client have the same byte order
REP-I0006, PING; industrial_core ping_handler.cpp
    RS01 a PING is answered with success
REP-I0006: a PING has a body of forty bytes; industrial_core: none. Accept both
    RS02 a PING with forty bytes of body is answered once
industrial_core tcp_socket: both ends send without delay (TCP_NODELAY)
    RS03 a PING is answered within 0.25 s
REP-I0006: topics are never answered; the real client's STOP would take the answer
    RS04 a PING as a topic is not answered
    RS13 STOP as a topic is not answered
REP-I0006: same type, communication type 3, reply code 2, no useful body
    RS05 an unknown request is answered with failure and its own type
REP-I0006: same type, communication type 3, reply code 2, no useful body; REP-I0004, ranges
    RS06 requests all over the number range are refused alike
industrial_core message_manager.cpp: refuses it and goes on
    RS07 an unknown request does not cost the link
REP-I0006: ignore unsupported topics
    RS08 an unknown topic is ignored
REP-I0006, GET_VERSION: three integers
    RS09 a request for the version is answered or refused
REP-I0006, STATUS: may be sent as a request; industrial_core status relay
    RS10 a request for STATUS is answered with STATUS
industrial_core: the PING handler serves every port
    RS11 the state port answers a PING and goes on reporting
observed, industrial_robot_client: STOP is sent at every end, and its reply waited for
    RS12 STOP at rest is answered with success
observed, industrial_robot_client: any frame is taken for the reply it waits for
    RS14 a request is answered once, not twice
    RS15 answers come in the order of the requests
    RS20 the motion port says nothing that nobody asked for
industrial_core simple_message.cpp: a short body fails
    RS16 a point whose body is too short is not taken
docs/simplemsg.md: a longer body gives every joint its neighbour's value
    RS17 a point whose body is too long is not taken
REP-I0006: a request is answered; STOP travels in type 14 too
    RS18 a full point (type 14) is answered, whatever it says
industrial_core joint_traj.cpp: the points, then their number
    RS19 a trajectory message (type 12) whose count is wrong is not taken
REP-I0006, PING; industrial_core ping_handler.cpp; docs/minimum-controller.md: each request is \
answered
    RS21 a PING is answered while the robot moves
REP-I0006, STATUS: may be sent as a request, and is true then too
    RS22 STATUS that is asked for in motion says that the robot moves
observed: motoman_driver's controller loses pipelined frames; industrial_core \
joint_trajectory_streamer waits; STOP alone may overtake (its stop_motion service does)
    RC01 a request waits for the reply to the one before it
industrial_core robot_state_interface only listens there; vendors' servers do not read
    RC02 nothing but replies, and once IDENTIFY, is sent on the state port
REP-I0006: a service request has a reply; unsupported ones get FAILURE
    RC03 each request of the controller is answered within 1 s
REP-I0006: one reply to a request
    RC04 no request is answered twice
REP-I0006: topics have no reply; observed: a reply to a topic is later taken for another's
    RC05 topics are never answered
REP-I0006: replies answer requests
    RC06 a reply comes only after a request
REP-I0006: the reply repeats the message type, and a successful one has the body; \
industrial_core message_manager.cpp, simple_message.cpp toReply
    RC07 a reply has the type of its request, and where it succeeds its body
industrial_core ping_handler.cpp
    RC08 PING is answered with success
REP-I0006, unsupported requests; industrial_core message_manager.cpp
    RC09 an unknown request is answered FAILURE
REP-I0006: the body of a failure reply is meaningless; industrial_core sends none
    RC10 a failure reply has no body to rely on
REP-I0006: ignore unsupported topics, refuse unsupported requests
    RC11 a message of unknown type ends no connection
industrial_core joint_traj_pt_message: the reply is of type 11 (Fanuc: 10, Motoman: 2002)
    RC12 a reply of another type is not taken for the answer
industrial_core simple_message.cpp: a reply with code 0 is invalid
    RC13 an unreadable reply is not taken for success
REP-I0006, JOINT_TRAJ_PT; industrial_robot_client joint_trajectory_streamer.cpp
    MS01 a point where the robot stands is taken and moves nothing
    MS03 every point is answered as a point
    MS08 the joint goes towards its goal and not away
    MS10 ten points in a row are moved through
industrial_robot_client: a goal is reached within 0.005 rad of its last point
    MS02 the robot ends at the last point
    MS05 the motion begins within 3 s
observed, industrial_robot_client: it sends the next point when this one is answered
    MS04 points are answered in time: at once, or when the buffer has room
industrial_core joint_traj_pt.h: duration, the time allotted to the segment
    MS06 the motion is not much faster than asked
    MS07 the motion is not much slower than asked
observed, industrial_robot_client: a one-point trajectory is one packet, sequence 0
    MS09 a single point is moved to
REP-I0006: abort on a sequence that is neither the next nor 0
    MS11 a second trajectory counts from 0 again
    MS13 a gap in the sequence is refused
    MS14 a trajectory does not begin at 3
observed, industrial_robot_client: after a reconnection the same point comes again
    MS12 a point that comes twice is moved once
vendors stop, blend or queue: drivers' behaviour differs, but the last point is the goal
    MS15 a trajectory sent during another ends where the new one ends, or is refused
observed, industrial_robot_client download: -1, 1, 2, …, -3 as topics
    MS16 a downloaded trajectory is moved, and its topics are not answered
industrial_core joint_traj_pt_full.h
    MS17 a trajectory of full points (type 14) is moved
industrial_core joint_traj.h; deprecated, no vendor's server is known to take it
    MS18 a whole trajectory (type 12) is moved or refused
observed, abb_driver: the velocity field is always 0
    MS19 a point without a velocity is moved by its duration
industrial_core joint_traj_pt.h: duration, the time allotted to the segment; planners send dwells
    MS20 a dwell, the same position twice, is taken and takes its time
REP-I0006, sequence: 0 when streaming; industrial_core joint_traj_pt.h: -1 when downloading
    MC01 a trajectory begins with its first point
REP-I0006: a server aborts on a point out of order; industrial_core streams 0 to n-1
    MC02 sequence numbers increase by one
industrial_core joint_trajectory_downloader; abb_driver moves on -3 only
    MC03 a downloaded trajectory ends with sequence -3
industrial_core joint_trajectory_streamer, joint_trajectory_downloader
    MC04 streamed points are requests, downloaded ones topics
observed: the stock client repeats after a lost link; motoman_driver after BUSY
    MC05 a point is sent again only where its answer was lost or said so
observed: the stock client repeats the message as it was
    MC06 a point that is sent again is unchanged
industrial_core joint_data.h: ten slots, unused ones are 0
    MC07 unused joint slots are zero
REP-I0006, JOINT_TRAJ_PT: a fraction of the largest joint speed; observed: staubli_val3_driver \
drops a point of ratio 0, industrial_core never sends one
    MC08 the speed ratio is above 0, up to 1
industrial_core joint_trajectory_interface.cpp, calc_velocity
    MC09 the speed ratio says how fast the joints move
REP-I0006, JOINT_TRAJ_PT: the time allotted to the segment
    MC10 durations are positive and short, but 0 for a first point where the robot stands
REP-I0006, JOINT_TRAJ_PT_FULL: time from the start; observed: motoman's controller silently \
skips a point that is not later
    MC11 the time of full points increases, and begins where the motion begins
industrial_core joint_traj_pt_full.h: time 1, position 2, velocity 4, acceleration 8
    MC12 valid_fields has no bits but the four that are defined
REP-I0006, JOINT_TRAJ_PT_FULL; motoman_driver: INVALID/3015 without
    MC13 a full point has a position
REP-I0006, JOINT_TRAJ_PT_FULL: invalid fields travel as zeros
    MC14 fields that are not valid are zero
REP-I0006, JOINT_TRAJ_PT_FULL: robot_id names the robot; motoman_driver: groups 0 to 3
    MC15 all points of a trajectory are for the same groups, which the controller reports
industrial_core joint_trajectory_streamer: one message class a client
    MC16 all points of a trajectory are of one message type
REP-I0006: failure means that the request was not taken; what follows would jump
    MC17 a refused point ends its trajectory
observed: industrial_robot_client waits without limit for a reply; then STOP waits, too
    MC18 a streamed trajectory is not left in its middle in silence
industrial_core joint_traj_pt.h, STOP_TRAJECTORY; industrial_robot_client sends it
    SS01 STOP in motion is answered with success
    SS02 after STOP the robot stands within 0.5 s
    SS03 a stopped motion does not go on
    SS04 STOP leaves the robot on its way
observed, industrial_robot_client: STOP, then a new trajectory from 0
    SS05 after STOP a new trajectory is moved
    SS09 a point of a stopped trajectory moves nothing
REP-I0006: -4 stops whatever is going on, in every phase
    SS06 STOP behind the last point at once prevents the motion
    SS07 STOP during a trajectory of many points ends it
    SS08 STOP twice is answered twice
    SS11 STOP as a topic stops too
    SS12 STOP in one piece with a point wins
    SS13 STOP that comes in two pieces stops
    SS14 STOP amid a download forgets its points
    SS15 STOP in a full point (type 14) stops
docs/ros-i.md: anyone may stop
    SS10 STOP from another connection stops too
industrial_core joint_trajectory_streamer.cpp, trajectoryStop; it waits for the reply
    SC01 STOP is a request
industrial_core joint_trajectory_interface.cpp: an empty point with sequence -4
    SC02 STOP carries zeros
REP-I0006, sequence -4; industrial_core: the next point has sequence 0
    SC03 after STOP nothing of the stopped trajectory follows
industrial_core joint_traj_pt.h names -1 to -4
    SC04 no sequence number lies below -4
industrial_core joint_trajectory_streamer destructor: STOP before the link closes
    SC05 a client does not leave a moving robot behind without STOP
docs/simplemsg.md: every real must be finite; no vendor's server checks it
    LS01 a position that is no number is not moved to
    LS02 an infinite position is not moved to
    LS03 a velocity that is no number is refused
    LS04 a duration that is no number is refused
    LS12 a full point with any value that is no number is refused
    LS16 no joint of no point may be no number
docs/emulator.md and docs/ros-i.md: times advance, durations are 0 or more
    LS05 a negative duration is refused
    LS14 a full point whose time does not advance is refused
industrial_core: a fraction, 0 to 1
    LS06 a velocity above 1 is refused
a controller's own soft limits; observed: Stäubli and Fanuc refuse, ABB does not check
    LS07 a position above the range is refused
    LS08 a position below the range is refused
    LS17 the range is checked for every joint of every point
MotoROS refuses it (3013); docs/ros-i.md: never faster than the limits allow
    LS09 a segment that is too fast is refused or moved within the limits
docs/ros-i.md: the trajectory is discarded and the rest of its points refused
    LS10 behind a refused point the rest is not moved
industrial_core joint_traj_pt_full.h, valid_fields; MotoROS: 3015
    LS11 a full point without a position is refused
industrial_core joint_traj_pt_full.h, robot_id; MotoROS: 3004
    LS13 a full point for another robot is refused
docs/emulator.md: does not start where the robot stands; docs/ros-i.md: approached slowly
    LS15 a point where the robot is not, at once, is no jump
observed: no vendor's server looks for NaN; a joint would be sent anywhere
    LC01 every number is finite
observed: staubli_val3_driver drops such a point, motoman_driver does not look
    LC02 positions keep to the joint limits
industrial_core joint_trajectory_interface.cpp, is_valid; motoman_driver: INVALID/3013
    LC03 velocities keep to the joint limits
industrial_core joint_traj_pt_full.h: what is sent as valid is meant
    LC04 accelerations keep to the joint limits
observed: no vendor's server checks it; a controller that follows would jump
    LC05 no joint has to move faster than it can from one point to the next
motoman_driver joint_trajectory_streamer.cpp and its controller (INVALID/3011); industrial_core \
does not look (industrial_core#187)
    LC06 the first point is where the robot stands
observed: motoman_driver's controller starts at once with the velocity of the first point
    LC07 the first point of a full trajectory is at rest
REP-I0006: JOINT_TRAJ is deprecated; no vendor's server takes it
    LC08 no whole trajectory is sent in one message
REP-I0006, JOINT_TRAJ_PT_FULL; motoman_driver's controller interpolates with both
    LC09 velocities of full points lead from one position to the next
observed: motoman_driver's controller stands at once behind the last point
    LC10 a full trajectory that was sent to its end ends at rest
industrial_robot_client: /joint_states and /robot_status come from types 10 and 13
    TS01 the state port speaks without being asked
    TS04 STATUS comes once a second
    TS08 topics have their declared sizes
industrial_robot_client: a goal is aborted after 1 s without joint values
    TS02 joint values come ten times a second
    TS03 joint values come without long pauses
    TS14 a listener that comes again is told at once
    TS16 joint values keep their pace in motion
observed, ABB, Fanuc, Stäubli, Motoman: joint values first, STATUS after them
    TS05 joint values come before STATUS
industrial_core joint_data.h: unused slots are 0
    TS06 slots without a joint are zero
REP-I0006, JOINT_POSITION: 0 when reporting state
    TS07 the sequence of reported joint values is 0
    TS20 the sequence of reported joint values is 0 in motion too
industrial_robot_client: it has no handler for type 15
    TS09 a generic client finds its joint values (type 10)
joint_states is what planners start from: REP-I0006, JOINT_POSITION
    TS10 a resting robot's joint values stand still
    TS11 reported joint values are inside the range
    TS17 reported joint values do not jump
    TS18 joints that were not moved stay
industrial_core joint_feedback.h: bits 1, 2, 4, 8; fields that are not valid are zero
    TS12 type 15 agrees with type 10 and says what is valid
docs/ros-i.md; industrial_core tcp_server.cpp takes one client a port
    TS13 two listeners are told the same
TCP: a full window must not stop the others
    TS15 a listener that does not read holds nobody up
industrial_core joint_feedback.h; MotoROS sends velocities where it has them
    TS19 reported velocities are those of the positions
REP-I0006, STATUS: each is -1 unknown, 0 or 1
    QS01 tri-states are -1, 0 or 1
    QS06 STATUS knows what it reports
    QS07 STATUS at rest does not flicker
industrial_msgs RobotMode; REP-I0006, STATUS
    QS02 the mode is -1, 1 or 2
observed, ABB: error_code is the number of the error while in_error, else 0
    QS03 an error has a number, and a number an error
industrial_robot_client: a goal has succeeded when in_motion is 0 at the goal
    QS04 a resting robot is not in motion
    QS08 a moving robot is in motion
    QS10 in_motion is 0 soon after the robot stands
REP-I0006, STATUS: motion_possible, a new trajectory would start now
    QS05 no motion is possible in emergency stop or without power
    QS11 a robot that moves had said that it can
industrial_robot_simulator says 0 in the last segment, which ends goals too early
    QS09 it is in motion until it stands
docs/ros-i.md: a stop that was asked for
    QS12 STOP is no error
docs/emulator.md: STATUS shows the error until the next trajectory that is accepted
    QS13 an error that a point caused is over with the next good trajectory
docs/emulator.md: OPERATOR_EVENT (type 65100) plays the operator of an emulator; REP-I0006, STATUS
    QS14 an emergency stop shows, forbids motion, and its reset moves nothing
docs/emulator.md: OPERATOR_EVENT (type 65100) plays the operator of an emulator; \
docs/minimum-controller.md: nothing ever resumes
    QS15 an emergency stop ends a motion, and its reset does not resume it
REP-I0006, STATUS: each is -1 unknown, 0 or 1; docs/minimum-controller.md: each of them aborts a \
motion
    QS16 a motion without incident shows power, automatic mode, no error and no emergency stop
REP-I0006, STATUS e_stopped; industrial_core#271
    QC01 no point follows once an emergency stop was reported
REP-I0006, STATUS motion_possible: whether a trajectory would start now
    QC02 no trajectory begins while motion is not possible
REP-I0006, STATUS drives_powered
    QC03 no trajectory begins while the drives have no power
industrial_core joint_trajectory_action.cpp: without feedback for 1 s it stops the robot
    QC04 points stop when the reports do
industrial_core joint_trajectory_action.cpp; observed: staubli_val3_driver stops then, too
    QC05 a trajectory ends when the state connection is lost
industrial_core joint_trajectory_action.cpp rejects goals until a feedback arrived
    QC06 no trajectory begins before the first report
docs/ros-i.md: silence is legal; the real client says nothing between trajectories
    KS01 an idle link stays open
    KS17 a link that is idle all the run stays open and is answered at its end
    KS18 a listener is told joint values all the run long
observed, industrial_robot_client: it connects again after 10 ms, or 5 s
    KS02 a client may leave and come again
    KS03 a client may leave by a reset
    KS07 a lost motion link leaves the state link alone
    KS13 after a lost link a new trajectory is moved
industrial_core tcp_server.cpp: one client a port
    KS04 many silent clients do not lock out the next for ever
industrial_core tcp_server.cpp: one client a port; a second waits, is refused or served
    KS05 a second client does not disturb the first
industrial_robot_client: three processes connect independently, in no fixed order
    KS06 the motion port works before anybody listens to the state port
TCP: what was acknowledged was received
    KS08 five hundred PINGs in one piece are all answered
TCP: a full window must not stop the others
    KS09 a client that reads no answers holds nobody up
a robot nobody commands must stand: ISO 10218-1 5.4; ABB does not stop
    KS10 the robot stops when its client leaves
    KS11 the robot stops when its client disappears
    KS16 a link that is lost before the motion began prevents it
docs/architecture.md: reconnecting restores neither control nor motion
    KS12 a new link does not set an old motion going again
observed, industrial_robot_client: the unanswered point comes again, with its sequence
    KS14 a point repeated on a new link is answered once and moves once at most
docs/emulator.md: only the connection that began a motion may send its points
    KS15 points of a second client do not mix with those of the first
observed: industrial_core connects after 10 to 20 ms, then pauses 250 ms; five attempts
    KC01 a client does not connect more than ten times a second
observed: the stock client sends the unanswered point again, with the same sequence
    KC02 after a lost connection no point is skipped
REP-I0006, sequence: the index in the trajectory, whatever connection carries it
    KC03 a lost connection does not shift the trajectory
observed: vendors' servers take one motion client; a second one may carry STOP only
    KC04 points travel on one connection at a time
observed: a restarted controller has lost its buffer; industrial_robot_client resumes blindly
    KC05 no trajectory goes on at a controller that was restarted
REP-I0006, sequence; observed: five attempts, then the trajectory is dropped
    KC06 after a lost connection a trajectory is resumed where it was or begun anew
ros-industrial/motoman MotoPlus, MotionServer.c: CHECK_MOTION_READY
    YS01 whether motion is ready is answered with 0, or with 2 and the reason
ros-industrial/motoman MotoPlus, SimpleMessage.c: Ros_SimpleMsg_MotionReply
    YS02 a reply quotes group, sequence and command
ros-industrial/motoman MotoPlus, SimpleMessage.c: the verdict is in the body
    YS03 the header of type 2002 always says success
ros-industrial/motoman MotoPlus, MotionServer.c: SimpleMsgProcess
    YS04 an unknown type is answered with 3/3003 and keeps the link
ros-industrial/motoman MotoPlus, MotionServer.c: subcode 3006
    YS05 an unknown command is refused
ros-industrial/motoman MotoPlus, MotionServer.c: CHECK_QUEUE_CNT
    YS06 the length of the queue is told, and refused for a group that is none
ros-industrial/motoman MotoPlus, MotionServer.c: STOP_MOTION
    YS07 STOP_MOTION at rest succeeds
ros-industrial/motoman MotoPlus, MotionServer.c: time, position and velocity are required
    YS08 a point without velocity is refused with 3015
ros-industrial/motoman MotoPlus, MotionServer.c: invalid group
    YS09 a point for a group that is none is refused with 3004
ros-industrial/motoman MotoPlus, MotionServer.c: STOP (-4) is not understood, 200111 is
    YS10 a negative sequence is refused with 3005
ros-industrial/motoman MotoPlus, MotionServer.c: time
    YS11 a point four hours ahead is refused with 3016
ros-industrial/motoman MotoPlus, SimpleMessage.h: four groups of eight links
    YS12 Denavit-Hartenberg parameters come as 512 bytes
ros-industrial/motoman MotoPlus, IoServer.c: 1001 on failure
    YS13 a bit is read with its value and a code
ros-industrial/motoman MotoPlus, MotionServer.c: 2012 and 2013 are unknown there
    YS14 a register is no business of the motion port
ros-industrial/motoman MotoPlus, MotionServer.c: tool
    YS15 a tool file beyond 63 is refused with 3017
ros-industrial/motoman MotoPlus, SimpleMessage.h
    YS16 GET_VERSION is listed and not known
ros-industrial/motoman MotoPlus, StateServer.c
    YS17 the state port sends type 15 and STATUS every 25 ms
motoman_driver joint_trajectory_streamer.cpp: 200101 first; MotionServer.c
    YC01 readiness is asked for before each trajectory
motoman_driver: 200101 must be answered with result 0; MotionServer.c answers 5xxx
    YC02 no trajectory follows where the controller is not ready
motoman_driver joint_trajectory_streamer.cpp: result 1 means later
    YC03 after BUSY the same point comes again
observed: motoman_driver pauses 5 ms
    YC04 a point that met BUSY is not repeated within 2 ms
motoman_driver joint_trajectory_streamer.cpp: aborts; MotionServer.c: 3xxx, 5xxx
    YC05 any other result than success and busy ends the trajectory
MotionServer.c: type 11 is unknown there and sequence -4 is refused (INVALID/3005)
    YC06 the robot is stopped with command 200111
MotionServer.c: INVALID/3015 without
    YC07 points have time, position and velocity
MotionServer.c: type 11 is unknown (INVALID/3003)
    YC08 points are of type 14 or 2016
MotionServer.c: INVALID/3016 from 14,400 s on
    YC09 no point lies four hours or more after the first
MotionServer.c takes a record for each group, or four; motoman_driver sends no padding
    YC10 a point of several groups is padded with zeros, if at all
MotionServer.c: INVALID/3004; a controller has groups 0 to 3
    YC11 each group is named once and exists
REP-I0006: the reply code says whether the request was taken
    YC12 a failure in the header of a reply is not overlooked
motoman_driver motion_ctrl.h; MotionServer.c leaves an unknown command without a new reply
    YC13 motion control uses commands that exist, with empty data
motoman_driver IoServer.c: 1001 to 1003 otherwise; SELECT_TOOL: INVALID/3017
    YC14 I/O, register and tool requests name what can exist
MotionServer.c: 200111 empties the queues; the interpolation needs a new sequence 0
    YC15 no point follows STOP before readiness was asked for again
docs/simplemsg.md, dialect pendant: hello first, with version, capabilities and limits
    PS01 hello is answered with version, limits and names
    PS02 sessions have numbers of their own
    PS03 a request before hello is refused
    PS04 another version is refused and the link closed
    PS05 an unknown cell is refused and the link closed
    PS06 a second hello is refused and the link kept
    PS14 a frame beyond the announced size ends the link
docs/configuration.md: hello_deadline
    PS07 who says no hello is left
docs/architecture.md: unknown messages are skipped by length, unknown requests refused
    PS08 an unknown request is refused with its own type
    PS09 an unknown topic is skipped by its length
docs/simplemsg.md, dialect pendant
    PS10 a PING is answered before hello and after it
    PS21 management answers JSON with JSON, and nonsense with failure
docs/architecture.md: every request is accepted or refused, once, with its id
    PS11 a malformed request is refused and the link kept
    PS20 a request is answered once
RFC 9293 3.8: TCP is a stream
    PS12 requests that come byte by byte are understood
docs/simplemsg.md, byte order
    PS13 a big-endian pendant is understood
docs/ros-i.md: ten within ten seconds close the link
    PS15 a client that only sends nonsense is cut off
docs/architecture.md: listeners choose their rate; state carries sequence, time and age
    PS16 state comes at the rate that was asked for
    PS17 state carries rising sequence and time, and its age
    PS18 state ends when it is no longer asked for
    PS19 a rate that cannot be is refused
    PS23 the state of a robot at rest shows rest
docs/architecture.md: one cell behind both faces
    PS22 state shows the joints as the ROS-Industrial port does
server/endpoints/pendant/management.py: snapshot, everything a pendant needs to know once
    PS24 a snapshot is given, and is the cell that hello named
docs/architecture.md: one motion authority, a lease that expires without beats
    PS30 motion without authority is refused
    PS31 the authority is granted and announced
    PS32 the authority has one holder
    PS33 the authority expires without beats and not with them
    PS34 the authority ends with its connection
    PS43 a motion ends when its lease expires
    PS44 only the holder's beats prolong the authority
docs/architecture.md: nothing is clipped silently, nothing succeeds silently
    PS35 targets that are none are refused with their reason
docs/architecture.md: accepted, then completed or aborted, once
    PS36 an accepted motion is moved, shown and completed
    PS39 a second motion during the first is refused
docs/architecture.md: anyone may stop; only the authority may reset
    PS37 a stop by another pendant aborts the motion and latches
    PS41 a stop is not reset while nobody holds the authority
docs/architecture.md: on FIN or RST the stop leaves within a tick
    PS38 a motion ends when its pendant disappears
    PS42 a motion ends with the end of its pendant's stream
docs/architecture.md: better a stop without an answer than none
    PS40 a stop that comes as a topic is obeyed
"""
"""Each clause, and below it number and title of the checks that it gives reason to."""


def _read(table: str) -> Iterator[tuple[str, tuple[str, str]]]:
    """Yield number, title and clause of each check."""
    clause = ""
    for line in table.splitlines():
        if line.startswith(" "):
            number, title = line.strip().split(" ", maxsplit=1)
            yield number, (title, clause)
        else:
            clause = line


CLAUSES = tuple(_read(_TABLE))
"""Number of each check with its title and clause, section by section."""

_BY_NUMBER = dict(CLAUSES)


def clause_of(number: str) -> tuple[str, str]:
    """Return title and clause of a check; raise ValueError for a number that there is not."""
    try:
        return _BY_NUMBER[number]
    except KeyError:
        raise ValueError(f"{number} stands in no table of clauses") from None
