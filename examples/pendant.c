/* A pendant in C: joint 1 is jogged for half a second, by hold-to-run. docs/pendant-apps.md.
 *   cc -std=c99 -D_POSIX_C_SOURCE=200809L -o pendant pendant.c && ./pendant [PORT [ADDRESS]]
 * The server answers in the byte order of the first frame, so the machine's own will do. */
#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { HELLO = 65000, VERDICT = 65002, OUTCOME, AUTHORITY = 65005, STOP = 65014, RESET, ENABLING,
       SET_MODE, STATE = 65020, JOG_ENDED = 65025, JOG_START = 65030, JOG_BEAT, JOG_RELEASE };
enum { TOPIC = 1, REQUEST, HEADER = 12, SUCCESS = 1, HELD = 1, REDUCED_SPEED = 1, JOINTS = 1 };
typedef union { int32_t i; float f; } Word;

static int server;
static Word in[1024], *const body = in + 3; /* what came last: type, kind, reply code, body */

static void put(int type, int kind, const Word *words, size_t count) {
    Word frame[64] = {{.i = HEADER + 4 * (int32_t)count}, {.i = type}, {.i = kind}};
    memcpy(frame + 4, words, 4 * count);
    if (write(server, frame, 16 + 4 * count) < 0) exit((perror("write"), 1));
}

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

static void ask(int type, const Word *words, size_t count) {
    put(type, REQUEST, words, count);
    await(VERDICT);
}

int main(int argc, char *argv[]) {
    struct sockaddr_in at = {.sin_family = AF_INET,
                             .sin_port = htons((uint16_t)(argc > 1 ? atoi(argv[1]) : 11010)),
                             .sin_addr.s_addr = inet_addr(argc > 2 ? argv[2] : "127.0.0.1")};
    int at_once = 1;
    server = socket(AF_INET, SOCK_STREAM, 0);
    setsockopt(server, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
    if (connect(server, (struct sockaddr *)&at, sizeof at)) exit((perror("connect"), 1));

    Word hello[18] = {{.i = 2}, {.f = 25}}; /* version, states per second, cell, our name */
    strcpy((char *)&hello[10], "C pendant");
    put(HELLO, REQUEST, hello, 18);
    await(HELLO);
    int joints = body[4].i;
    ask(AUTHORITY, (Word[]){{.i = 1}, {.i = 1}}, 2);
    ask(SET_MODE, (Word[]){{.i = 2}, {.i = REDUCED_SPEED}}, 2);
    put(ENABLING, TOPIC, (Word[]){{.i = HELD}}, 1);
    await(STATE);
    Word jog[24] = {{.i = 3}, {.i = 1}, body[0], {.f = 0.25F}, {.i = JOINTS}}; /* press 1 */
    jog[13].i = joints;
    jog[14].f = 0.5F; /* joint 1, at half the jog speed */
    ask(JOG_START, jog, 24);
    for (int beat = 1; beat <= 10; beat++) {
        nanosleep(&(struct timespec){.tv_nsec = 50000000}, NULL);
        put(ENABLING, TOPIC, (Word[]){{.i = HELD}}, 1);
        put(JOG_BEAT, TOPIC, (Word[]){{.i = 1}, {.i = beat}}, 2);
    }
    put(JOG_RELEASE, REQUEST, (Word[]){{.i = 4}, {.i = 1}}, 2);
    await(JOG_ENDED);
    printf("joint 1 stands at %.4f, %.0f ms after the release\n", body[5].f, 1e3 * body[2].f);
    ask(STOP, (Word[18]){{.i = 5}}, 17); /* the software stop latches until it is reset */
    return 0;
}
