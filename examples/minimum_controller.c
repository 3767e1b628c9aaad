/* The smallest robot controller that openpendant can drive; docs/minimum-controller.md says why.
 *   cc -std=c99 -O2 -D_POSIX_C_SOURCE=200809L -o minimum_controller minimum_controller.c -lm
 *   [ADDRESS=127.0.0.1] ./minimum_controller MOTION_PORT STATE_PORT JOINTS [START ...]
 * To port it, change the limits, and let control_period() speak to your drives and encoders.
 * SIGUSR1 is the emergency stop button, SIGUSR2 its reset. This is no safety device. */
#include <arpa/inet.h>
#include <fcntl.h>
#include <math.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define RANGE 6.2832        /* every joint: -RANGE to RANGE [rad] */
#define SPEED 3.1416        /* [rad/s] */
#define ACCELERATION 6.2832 /* [rad/s^2] */
#define SPEED_SLACK 1.001   /* what rounding to 4-byte reals may add to a speed ... */
#define SHARP_SLACK 1.05    /* ... and to an acceleration */
#define AT_START 0.001      /* a first point without duration says where the robot stands [rad] */
#define PERIOD 0.005        /* of the control loop [s]; the state port gets every second one */
#define START_DELAY 0.05    /* from the first point to the motion: others may join it [s] */

enum { DEPTH = 32, SLOTS = 10, PER_PORT = 8, LINKS = 2 * PER_PORT };
enum { PING = 1, JOINT_POSITION = 10, JOINT_TRAJ_PT = 11, STATUS = 13, STOP_SEQUENCE = -4 };
enum { TOPIC = 1, REQUEST, REPLY, WAITS = -1, NO_REPLY, SUCCESS, FAILURE, AUTOMATIC = 2 };
enum { HEADER_SIZE = 16, POINT_SIZE = 52, MOST_SIZE = 1023, WORDS = 15 + 11 };
enum { NO_ERROR = 0, NOT_FINITE = 101, OUT_OF_RANGE, TOO_FAST, TOO_SHARP, BAD_TIME, BAD_SEQUENCE,
       BAD_START, BUFFER_RAN_DRY = 109, LINK_LOST = 111 };

typedef struct { double to[SLOTS], slope[SLOTS], time; } Segment; /* straight, constant speed */
typedef struct { int fd; size_t used; uint8_t in[4096]; } Link;
union real { int32_t bits; float value; };

static int joints, count, is_moving, e_stopped, error_code; /* count: of buffered segments */
static int expected = -1;                         /* next sequence number; -1: no trajectory */
static double q[SLOTS], v[SLOTS];                 /* commanded positions and speeds */
static Segment buffer[DEPTH], tail, in, out;      /* tail: the last one accepted, or rest */
static double t, turn, turns[SLOTS], from[SLOTS]; /* the corner between in and out */
static uint8_t last_point[POINT_SIZE];
static Link links[LINKS], *owner;                 /* owner: who sends the points of the motion */
static volatile sig_atomic_t pressed[65];         /* by signal number */

static Segment rest_at(const double at[]) {
    Segment segment = {.time = INFINITY};
    memcpy(segment.to, at, sizeof segment.to);
    return segment;
}

static double corner_time(const double a[], const double b[]) {
    double longest = 0;
    for (int j = 0; j < joints; j++) longest = fmax(longest, fabs(b[j] - a[j]) / ACCELERATION);
    return longest;
}

static void on_signal(int number) { pressed[number == SIGINT ? SIGTERM : number] = 1; }
static int is_idle(void) { return !is_moving && count == 0; }

/* Ends the motion: empties the buffer and turns from the speed of now to rest, all joints in
 * proportion to stay on the way, but a joint that would leave its range sooner. */
static void break_off(int error) {
    if (error != NO_ERROR) error_code = error;
    count = 0, expected = -1, owner = NULL;
    in = out = tail = rest_at(q);
    turn = corner_time(v, out.slope), t = 0;
    for (int j = 0; j < joints; j++) {
        double room = v[j] > 0 ? RANGE - q[j] : RANGE + q[j];
        from[j] = q[j], in.slope[j] = v[j];
        turns[j] = v[j] == 0 ? 0 : fmin(turn, 2 * fmax(room, 0) / fabs(v[j]));
    }
}

static void next_corner(void) {
    t -= turn / 2 + out.time; /* from now on relative to the point that out leads to */
    in = out;
    out = count > 0 ? buffer[0] : rest_at(in.to);
    if (count > 0) memmove(buffer, buffer + 1, (size_t)--count * sizeof *buffer);
    else tail = out; /* what comes later begins at rest */
    double least = fmin(in.time, out.time);
    turn = corner_time(in.slope, out.slope);
    /* All accepted points fit, so this can only be the end, and it comes too fast. */
    if (turn > SHARP_SLACK * least) { break_off(BUFFER_RAN_DRY); return; }
    t += (turn = fmin(turn, least)) / 2;
    for (int j = 0; j < joints; j++) from[j] = in.to[j] - in.slope[j] * (turns[j] = turn) / 2;
}

/* A joint goes along in, from t = 0 to turns[j] its speed changes evenly, then it goes along out:
 * straight segments, their corners rounded by parabolas with the full acceleration. */
static void control_period(void) {
    static double waited;
    waited = is_moving || count == 0 ? 0 : waited + PERIOD;
    if (waited >= START_DELAY) out = rest_at(q), next_corner(), t = 0, is_moving = 1;
    if (!is_moving) return;
    while (t + PERIOD >= (turn + out.time) / 2) next_corner(); /* half way between two */
    t += PERIOD;
    for (int j = 0; j < joints; j++) {
        double after = fmin(fmax(t, 0), turns[j]), change = out.slope[j] - in.slope[j];
        double part = turns[j] > 0 ? after / turns[j] : t >= 0;
        q[j] = from[j] + in.slope[j] * fmin(t, turns[j]) + change * part * after / 2
             + out.slope[j] * fmax(t - turns[j], 0); /* to your drives */
        v[j] = in.slope[j] + change * part;
    }
    is_moving = !(out.time == INFINITY && t >= turn);
    if (is_idle()) tail = rest_at(q);
}

/* The wire is little-endian, whatever this computer is. */
static int32_t get_int(const uint8_t *at) {
    return (int32_t)(at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24);
}

static void put_ints(uint8_t *at, const int32_t *values, int number) {
    for (int i = 0; i < 4 * number; i++) at[i] = (uint8_t)((uint32_t)values[i / 4] >> i % 4 * 8);
}

/* Works out the segment to a point; returns the error, NO_ERROR where it may be taken. */
static int check_point(const uint8_t *point, Segment *segment) {
    double real[POINT_SIZE / 4], gap = 0, fastest = 0;
    for (int i = 1; i < POINT_SIZE / 4; i++) {
        real[i] = (double)(union real){.bits = get_int(point + 4 * i)}.value;
        if (!isfinite(real[i])) return NOT_FINITE;
    }
    double ratio = real[11], duration = segment->time = real[12];
    for (int j = 0; j < joints; j++) {
        segment->to[j] = real[1 + j];
        segment->slope[j] = (segment->to[j] - tail.to[j]) / duration;
        if (fabs(segment->to[j]) > RANGE) return OUT_OF_RANGE;
        gap = fmax(gap, fabs(segment->to[j] - tail.to[j]));
        fastest = fmax(fastest, fabs(segment->slope[j]));
    }
    if (duration == 0 && get_int(point) == 0) return gap <= AT_START ? NO_ERROR : BAD_START;
    if (duration <= 0) return BAD_TIME;
    if (fastest > SPEED * SPEED_SLACK || ratio < 0 || ratio > 1) return TOO_FAST;
    double fits = SHARP_SLACK * fmin(tail.time, duration);
    return corner_time(tail.slope, segment->slope) <= fits ? NO_ERROR : TOO_SHARP;
}

static int take_point(Link *link, const uint8_t *point) {
    int sequence = get_int(point), is_first = sequence == 0, error;
    Segment segment = {.time = 0};
    if (e_stopped || (owner && owner != link && !(is_first && is_idle()))) return FAILURE;
    if (expected > 0 && memcmp(point, last_point, POINT_SIZE) == 0)
        return owner = link, SUCCESS; /* sent once more after a reconnection: taken already */
    if (!is_first && expected < 0) return FAILURE; /* the rest of one that was broken off */
    if (is_first ? !is_idle() : count == DEPTH) return WAITS; /* a trajectory begins at rest */
    error = is_first || sequence == expected ? check_point(point, &segment) : BAD_SEQUENCE;
    if (error != NO_ERROR) return break_off(error), FAILURE;
    if (is_first) error_code = NO_ERROR;
    owner = link, expected = sequence + 1, memcpy(last_point, point, POINT_SIZE);
    if (segment.time > 0) buffer[count++] = tail = segment;
    return SUCCESS;
}

static void close_link(Link *link) {
    close(link->fd), link->fd = -1;
    if (link == owner && !is_idle()) break_off(LINK_LOST);
    if (link == owner) owner = NULL; /* at rest, its trajectory may go on over another link */
}

static int is_stop(const uint8_t *frame, int size) {
    return get_int(frame + 4) == JOINT_TRAJ_PT && get_int(frame + 8) != REPLY
        && size >= HEADER_SIZE + 4 && get_int(frame + HEADER_SIZE) == STOP_SEQUENCE;
}

/* Acts on a frame; returns its reply code, NO_REPLY, or WAITS where there is no room yet. */
static int act_on(Link *link, const uint8_t *frame, int size) {
    int type = get_int(frame + 4), is_point = type == JOINT_TRAJ_PT && link < links + PER_PORT;
    if (is_stop(frame, size)) break_off(NO_ERROR); /* anybody may, and at once */
    if (get_int(frame + 8) != REQUEST || type == 0) return NO_REPLY;
    if (type == PING) return SUCCESS;
    if (!is_point || size != HEADER_SIZE + POINT_SIZE || get_int(frame + 12) != 0) return FAILURE;
    return is_stop(frame, size) ? SUCCESS : take_point(link, frame + HEADER_SIZE);
}

/* Returns the size of the frame at a place, 0 where its end has not come, -1 where it is none. */
static int frame_at(const Link *link, size_t at) {
    if (link->used - at < 4) return 0;
    int length = get_int(link->in + at);
    if (length < HEADER_SIZE - 4 || length > MOST_SIZE - 4) return -1;
    return link->used - at < (size_t)length + 4 ? 0 : length + 4;
}

static int stop_follows(const Link *link, size_t at) {
    for (int size; (size = frame_at(link, at)) > 0; at += (size_t)size)
        if (is_stop(link->in + at, size)) return 1;
    return 0;
}

/* Handles the frames that a link has sent. One that waits for room stays where it is: its reply is
 * late, and the sender slows down. But a STOP behind it must not wait. */
static void handle_frames(Link *link) {
    size_t at = 0;
    for (int size; link->fd >= 0 && (size = frame_at(link, at)) > 0; at += (size_t)size) {
        uint8_t *frame = link->in + at;
        int code = act_on(link, frame, size);
        if (code == WAITS && !stop_follows(link, at + (size_t)size)) break;
        if (code == WAITS) break_off(NO_ERROR), code = FAILURE;
        if (code == NO_REPLY) continue;
        put_ints(frame, (int32_t[]){HEADER_SIZE - 4, get_int(frame + 4), REPLY, code}, 4);
        if (send(link->fd, frame, HEADER_SIZE, MSG_NOSIGNAL) != HEADER_SIZE) close_link(link);
    }
    if (link->fd >= 0 && frame_at(link, at) < 0) close_link(link); /* lost in the stream */
    link->used -= at;
    memmove(link->in, link->in + at, link->used);
}

static void receive_from(Link *link) {
    ssize_t got = recv(link->fd, link->in + link->used, sizeof link->in - link->used, 0);
    if (got > 0) link->used += (size_t)got, handle_frames(link);
    else close_link(link);
}

static void accept_on(int listener, Link *link) {
    const Link *end = link + PER_PORT;
    int fd = accept(listener, NULL, NULL), on = 1, unread = 4096;
    while (link < end && link->fd >= 0) link++;
    if (link == end) close(fd); /* too many */
    if (fd < 0 || link == end) return;
    *link = (Link){.fd = fd};
    fcntl(fd, F_SETFL, O_NONBLOCK);
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    if (link >= links + PER_PORT) setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &unread, sizeof unread);
}

/* Tells every listener where the joints are, then the status; drops one that does not keep up. */
static void report(void) {
    int moves = !is_idle(), stops = is_moving && expected < 0;
    int32_t words[WORDS] = {56, JOINT_POSITION, TOPIC, 0, 0, [15] = 40, STATUS, TOPIC, 0,
                            !e_stopped || moves, e_stopped, error_code, error_code != NO_ERROR,
                            moves, AUTOMATIC, !e_stopped && !stops}; /* -1 would say: unknown */
    uint8_t frames[4 * WORDS];
    for (int j = 0; j < joints; j++) words[5 + j] = (union real){.value = (float)q[j]}.bits;
    put_ints(frames, words, WORDS);
    for (Link *link = links + PER_PORT; link < links + LINKS; link++)
        if (link->fd >= 0 && send(link->fd, frames, sizeof frames, MSG_NOSIGNAL) != sizeof frames)
            close_link(link);
}

static int listen_on(const char *port, int *bound) {
    const char *host = getenv("ADDRESS");
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons((uint16_t)atoi(port))};
    int fd = socket(AF_INET, SOCK_STREAM, 0), on = 1;
    socklen_t size = sizeof address;
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (inet_pton(AF_INET, host ? host : "127.0.0.1", &address.sin_addr) != 1
        || bind(fd, (struct sockaddr *)&address, size) != 0 || listen(fd, SOMAXCONN) != 0
        || getsockname(fd, (struct sockaddr *)&address, &size) != 0)
        perror("minimum_controller: cannot listen"), exit(3);
    fcntl(fd, F_SETFL, O_NONBLOCK);
    *bound = ntohs(address.sin_port);
    return fd;
}

static double now(void) {
    struct timespec clock;
    clock_gettime(CLOCK_MONOTONIC, &clock);
    return (double)clock.tv_sec + (double)clock.tv_nsec * 1e-9;
}

int main(int argc, char **argv) {
    struct sigaction action = {.sa_handler = on_signal};
    struct pollfd polled[LINKS + 2];
    int ports[2], is_odd = 0, signals[] = {SIGUSR1, SIGUSR2, SIGTERM, SIGINT};
    joints = argc > 3 ? atoi(argv[3]) : 0;
    for (int j = 0; j < SLOTS && 4 + j < argc; j++)
        if (!(fabs(q[j] = atof(argv[4 + j])) <= RANGE)) joints = 0;
    if (joints < 1 || joints > SLOTS || argc > 4 + joints)
        return fputs("usage: minimum_controller MOTION STATE JOINTS [START ...]\n", stderr), 2;
    tail = rest_at(q);
    for (int i = 0; i < LINKS; i++) links[i].fd = -1;
    for (int i = 0; i < 4; i++) sigaction(signals[i], &action, NULL);
    for (int i = 0; i < 2; i++)
        polled[LINKS + i] = (struct pollfd){listen_on(argv[1 + i], &ports[i]), POLLIN, 0};
    printf("{\"event\": \"ready\", \"motion\": %d, \"state\": %d}\n", ports[0], ports[1]);
    fflush(stdout);
    for (double next = now(); !pressed[SIGTERM] || is_moving; is_odd = !is_odd) {
        next = fmax(next + PERIOD, now() - 20 * PERIOD); /* held up: do not hurry after it */
        do {
            for (int i = 0; i < LINKS; i++) {
                polled[i].fd = links[i].fd;
                polled[i].events = links[i].used < sizeof links[i].in ? POLLIN : 0;
            }
            if (poll(polled, LINKS + 2, (int)fmax(0, ceil((next - now()) * 1e3))) <= 0) continue;
            for (int i = 0; i < LINKS; i++) if (polled[i].revents) receive_from(links + i);
            if (polled[LINKS].revents) accept_on(polled[LINKS].fd, links);
            if (polled[LINKS + 1].revents) accept_on(polled[LINKS + 1].fd, links + PER_PORT);
        } while (now() < next);
        if (pressed[SIGUSR1] || pressed[SIGTERM]) e_stopped = 1, break_off(NO_ERROR), report();
        else if (pressed[SIGUSR2] && is_idle()) e_stopped = 0, error_code = NO_ERROR;
        pressed[SIGUSR1] = pressed[SIGUSR2] = 0;
        control_period();
        for (int i = 0; i < PER_PORT; i++) handle_frames(&links[i]);
        if (is_odd) report();
    }
}
