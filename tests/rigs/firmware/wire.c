/* The board's serial line: bytes at the speed of the line, to and from a pseudo-terminal.
 *
 * Own code in place of simavr's uart_pty: no thread, so that a run is the same every time, a byte
 * has the time at which it was whole, and what nobody reads is lost, as on a real line. */
#define _GNU_SOURCE
#include "wire.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <simavr/avr_uart.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

enum { BITS = 10, IN = 4 << 20, OUT = 1 << 20, UARTS = 2 };

static avr_t *avr;
static unsigned byte_cycles;
static int chosen, has_room[UARTS] = {1, 1}, is_pacing;
static int terminal = -1, is_read;
static char terminal_name[64];
static uint8_t in[IN], out[OUT];
static double out_at[OUT];
static size_t in_begin, in_end, out_count;

static void on_sent(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    if ((intptr_t)param != chosen) return;
    uint8_t byte = value;
    if (out_count < OUT) {
        out_at[out_count] = (double)(avr->cycle + byte_cycles) * 1e6 / avr->frequency;
        out[out_count++] = byte;
    }
    if (terminal >= 0 && is_read && write(terminal, &byte, 1) < 0 && errno != EAGAIN) wire_pull();
}

static void on_room(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)value;
    has_room[(intptr_t)param] = 1;
}

static void on_full(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq;
    if (value) has_room[(intptr_t)param] = 0;
}

static avr_irq_t *uart_irq(int uart, int which) {
    return avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0' + uart), which);
}

static avr_cycle_count_t pace(avr_t *board, avr_cycle_count_t when, void *param) {
    (void)board, (void)param;
    if (in_begin == in_end) {
        in_begin = in_end = 0;
        is_pacing = 0;
        return 0;
    }
    if (has_room[chosen]) avr_raise_irq(uart_irq(chosen, UART_IRQ_INPUT), in[in_begin++]);
    return when + byte_cycles;
}

static void start_pacing(void) {
    if (is_pacing || in_begin == in_end) return;
    is_pacing = 1;
    avr_cycle_timer_register(avr, byte_cycles, pace, NULL);
}

void wire_attach(avr_t *board, unsigned baud) {
    avr = board;
    byte_cycles = avr->frequency / baud * BITS;
    for (intptr_t uart = 0; uart < UARTS; uart++) {
        uint32_t flags = 0;
        avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0' + uart), &flags);
        avr_irq_register_notify(uart_irq(uart, UART_IRQ_OUTPUT), on_sent, (void *)uart);
        avr_irq_register_notify(uart_irq(uart, UART_IRQ_OUT_XON), on_room, (void *)uart);
        avr_irq_register_notify(uart_irq(uart, UART_IRQ_OUT_XOFF), on_full, (void *)uart);
    }
}

void wire_choose(int uart) {
    chosen = uart;
}

static void set_raw(int fd) {
    struct termios settings;
    if (tcgetattr(fd, &settings)) return;
    cfmakeraw(&settings);
    tcsetattr(fd, TCSANOW, &settings);
}

const char *wire_plug(void) {
    wire_pull();
    terminal = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (terminal < 0 || grantpt(terminal) || unlockpt(terminal)) return NULL;
    ptsname_r(terminal, terminal_name, sizeof terminal_name);
    int other_end = open(terminal_name, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (other_end < 0) return NULL;
    set_raw(other_end);
    close(other_end); /* from here on poll() says POLLHUP until somebody opens it */
    return terminal_name;
}

void wire_pull(void) {
    if (terminal >= 0) close(terminal);
    terminal = -1;
    is_read = 0;
}

int wire_poll(void) {
    if (terminal < 0) return 0;
    struct pollfd asked = {.fd = terminal, .events = POLLIN};
    poll(&asked, 1, 0);
    int was_read = is_read;
    is_read = !(asked.revents & POLLHUP);
    if (asked.revents & POLLIN && in_end < IN) {
        ssize_t got = read(terminal, in + in_end, IN - in_end);
        if (got > 0) in_end += got;
        start_pacing();
    }
    return is_read && !was_read;
}

void wire_send(const unsigned char *bytes, size_t count) {
    if (count > IN - in_end) abort();
    memcpy(in + in_end, bytes, count);
    in_end += count;
    start_pacing();
}

size_t wire_unsent(void) {
    return in_end - in_begin;
}

void wire_restart(void) {
    avr_cycle_timer_cancel(avr, pace, NULL);
    is_pacing = 0;
    has_room[0] = has_room[1] = 1;
    start_pacing();
}

void wire_drop(void) {
    in_begin = in_end = 0;
    wire_restart();
}

void wire_print(FILE *file) {
    fputs("\"bytes\": \"", file);
    for (size_t i = 0; i < out_count; i++) fprintf(file, "%02x", out[i]);
    fputs("\", \"at_us\": [", file);
    for (size_t i = 0; i < out_count; i++) fprintf(file, "%s%.1f", i ? ", " : "", out_at[i]);
    fputs("]", file);
    out_count = 0;
}
