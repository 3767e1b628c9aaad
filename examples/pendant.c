/* A pendant in C: joint 1 is jogged for half a second, by hold-to-run. docs/pendant-apps.md.
 *   cc -std=c99 -D_POSIX_C_SOURCE=200809L -o pendant pendant.c && ./pendant [PORT [ADDRESS]]
 * The server answers in the byte order of the first frame, so the machine's own will do. */
#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

enum { HELLO = 65000, VERDICT = 65002, AUTHORITY = 65005, STOP = 65014, RESET, ENABLING,
       SET_MODE, STATE = 65020, JOG_ENDED = 65025, JOG_START = 65030, JOG_BEAT, JOG_RELEASE };
enum { IDLE, TOPIC, REQUEST, HEADER = 12, SUCCESS = 1, HELD = 1, REDUCED_SPEED = 1, JOINTS = 1 };
typedef union { int32_t i; float f; } Word;

static int server;
static Word in[1024], *const body = in + 3; /* what came last: type, kind, reply code, body */

static void await(int type) { /* skip what is not wanted; a refusal ends the program */
    do {
        uint32_t size = 0;
        if (recv(server, &size, 4, MSG_WAITALL) != 4 || size < HEADER || size > sizeof in
            || recv(server, in, size, MSG_WAITALL) != (ssize_t)size)
            exit((fputs("the connection was lost\n", stderr), 1));
        if (in[0].i == VERDICT && in[2].i != SUCCESS)
            exit((fprintf(stderr, "refused, code %d: %.160s\n", body[1].i, (char *)&body[5]), 1));
    } while (in[0].i != type);
}

/* Send a topic, or a request that is answered: by a VERDICT, or by what else `reply` says. */
static void say(int type, int reply, const Word *words, size_t count) {
    Word frame[64] = {{.i = HEADER + 4 * (int)count}, {.i = type}, {.i = reply ? REQUEST : TOPIC}};
    memcpy(frame + 4, words, 4 * count);
    if (send(server, frame, 16 + 4 * count, 0) < 0) exit((perror("send"), 1));
    if (reply) await(reply);
}

int main(int argc, char *argv[]) {
    struct sockaddr_in at = {.sin_family = AF_INET,
                             .sin_port = htons((uint16_t)(argc > 1 ? atoi(argv[1]) : 11010)),
                             .sin_addr.s_addr = inet_addr(argc > 2 ? argv[2] : "127.0.0.1")};
    server = socket(AF_INET, SOCK_STREAM, 0);
    setsockopt(server, IPPROTO_TCP, TCP_NODELAY, &(int){1}, sizeof(int));
    if (connect(server, (struct sockaddr *)&at, sizeof at)) exit((perror("connect"), 1));

    Word hello[18] = {{.i = 2}, {.f = 25}}; /* version, states per second, cell, our name */
    strcpy((char *)&hello[10], "C pendant");
    say(HELLO, HELLO, hello, 18);
    Word jog[24] = {{.i = 3}, {.i = 1}, {.i = 0}, {.f = 0.25F}, {.i = JOINTS}}; /* press 1 */
    jog[13] = body[4], jog[14].f = 0.5F; /* of so many joints the first, at half the jog speed */
    say(AUTHORITY, VERDICT, (Word[]){{.i = 1}, {.i = 1}}, 2);
    say(SET_MODE, VERDICT, (Word[]){{.i = 2}, {.i = REDUCED_SPEED}}, 2);
    say(ENABLING, 0, (Word[]){{.i = HELD}}, 1);
    await(STATE);
    jog[2] = body[0];        /* what we saw before we pressed */
    say(JOG_START, VERDICT, jog, 24);
    for (int beat = 1; beat <= 10; beat++) {
        poll(NULL, 0, 50);
        say(ENABLING, 0, (Word[]){{.i = HELD}}, 1);
        say(JOG_BEAT, 0, (Word[]){{.i = 1}, {.i = beat}}, 2);
    }
    say(JOG_RELEASE, JOG_ENDED, (Word[]){{.i = 4}, {.i = 1}}, 2);
    printf("joint 1 stands at %.4f, %.0f ms after the release\n", body[5].f, 1e3 * body[2].f);
    say(STOP, VERDICT, (Word[17]){{.i = 5}}, 17); /* latches, whoever asks for it */
    say(ENABLING, 0, (Word[]){{.i = 0}}, 1);      /* let go, then reset on purpose */
    do await(STATE); while (body[5].i != IDLE);   /* which is refused while it is stopping */
    say(RESET, VERDICT, (Word[]){{.i = 6}}, 1);
}
