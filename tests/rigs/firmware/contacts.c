/* The keypad's matrix: sixteen contacts, their bounce, and what the columns read through them.
 *
 * Current goes where closed contacts lead, through other keys too, so ghosts are real. */
#include "contacts.h"

#include <simavr/avr_ioport.h>
#include <simavr/sim_time.h>
#include <stddef.h>
#include <stdint.h>

enum { ROWS = 4, COLUMNS = 4, KEYS = ROWS * COLUMNS, SWITCHES = 8 };
enum { LEAST_CHATTER_US = 40, MORE_CHATTER_US = 400 };

typedef struct {
    char port;
    int pin, closed;
} Switch;

static avr_t *avr;
static int is_closed[KEYS], wanted[KEYS];
static avr_cycle_count_t settles_at[KEYS];
static uint32_t state = 1;
static unsigned shorts, floating;
static Switch switches[SWITCHES];
static int switch_count;

static avr_irq_t *pin_irq(char port, int pin) {
    return avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), pin);
}

static uint8_t reached_rows(uint8_t rows) {
    for (int pass = 0; pass < ROWS; pass++) {
        for (int a = 0; a < KEYS; a++) {
            for (int b = 0; b < KEYS; b++) {
                int is_same_column = a % COLUMNS == b % COLUMNS;
                if (is_closed[a] && is_closed[b] && is_same_column && rows & 1 << a / COLUMNS)
                    rows |= 1 << b / COLUMNS;
            }
        }
    }
    return rows;
}

/* The chip's model writes its own pull-ups over an input whenever a direction changes, unless the
 * level from outside is declared to it. */
static void set_levels(uint8_t directions, uint8_t outputs) {
    uint8_t driven = directions & 0x0F, low = reached_rows(driven & ~outputs), levels = 0;
    if (low & driven & outputs) shorts++;
    for (int column = 0; column < COLUMNS; column++) {
        uint8_t bit = 1 << (ROWS + column);
        int is_low = 0;
        for (int row = 0; row < ROWS; row++)
            is_low |= is_closed[row * COLUMNS + column] && low & 1 << row;
        if (!is_low) levels |= bit;
        if (driven && !is_low && (directions & bit || !(outputs & bit))) floating++;
    }
    avr_ioport_external_t outside = {.name = 'K', .mask = 0xF0, .value = levels};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('K'), &outside);
    for (int column = 0; column < COLUMNS; column++)
        avr_raise_irq(pin_irq('K', ROWS + column), levels >> (ROWS + column) & 1);
}

static void set_columns(void) {
    avr_ioport_state_t port;
    avr_ioctl(avr, AVR_IOCTL_IOPORT_GETSTATE('K'), &port);
    set_levels(port.ddr, port.port);
}

/* Called before the register has the new value. */
static void on_directions(struct avr_irq_t *irq, uint32_t value, void *param) {
    (void)irq, (void)param;
    avr_ioport_state_t port;
    avr_ioctl(avr, AVR_IOCTL_IOPORT_GETSTATE('K'), &port);
    set_levels(value, port.port);
}

static uint32_t drawn(uint32_t below) {
    state = state * 1664525u + 1013904223u;
    return (state >> 8) % below;
}

static avr_cycle_count_t chatter(avr_t *board, avr_cycle_count_t when, void *param) {
    int key = (int)(intptr_t)param;
    if (when >= settles_at[key]) {
        is_closed[key] = wanted[key];
        set_columns();
        return 0;
    }
    is_closed[key] ^= 1;
    set_columns();
    avr_cycle_count_t next =
        when + avr_usec_to_cycles(board, LEAST_CHATTER_US + drawn(MORE_CHATTER_US));
    return next < settles_at[key] ? next : settles_at[key];
}

void contact_set(int key, int closed, unsigned bounce_us) {
    void *param = (void *)(intptr_t)key;
    avr_cycle_timer_cancel(avr, chatter, param);
    wanted[key] = is_closed[key] = closed;
    set_columns();
    settles_at[key] = avr->cycle + avr_usec_to_cycles(avr, bounce_us);
    if (bounce_us) {
        avr_cycle_timer_register_usec(avr, LEAST_CHATTER_US + drawn(MORE_CHATTER_US), chatter, param);
    }
}

void contacts_seed(unsigned seed) {
    state = seed;
}

/* Declares the levels of a port's switches, and has its pins change, since equal ones are no news. */
static void set_switches(char port) {
    avr_ioport_external_t outside = {.name = port, .mask = 0, .value = 0};
    for (int at = 0; at < switch_count; at++) {
        if (switches[at].port != port) continue;
        outside.mask |= 1 << switches[at].pin;
        outside.value |= !switches[at].closed << switches[at].pin;
    }
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &outside);
    for (int at = 0; at < switch_count; at++) {
        if (switches[at].port != port) continue;
        avr_raise_irq(pin_irq(port, switches[at].pin), switches[at].closed);
        avr_raise_irq(pin_irq(port, switches[at].pin), !switches[at].closed);
    }
}

void switch_set(char port, int pin, int closed) {
    int at = 0;
    while (at < switch_count && (switches[at].port != port || switches[at].pin != pin)) at++;
    if (at == switch_count) switch_count++;
    switches[at] = (Switch){port, pin, closed};
    set_switches(port);
}

void contacts_restore(void) {
    for (int at = 0; at < switch_count; at++) set_switches(switches[at].port);
    for (int key = 0; key < KEYS; key++) is_closed[key] = wanted[key];
    for (int pin = ROWS; pin < ROWS + COLUMNS; pin++) avr_raise_irq(pin_irq('K', pin), 0);
    set_columns();
}

void contacts_wire(avr_t *board) {
    avr = board;
    avr_irq_register_notify(pin_irq('K', IOPORT_IRQ_DIRECTION_ALL), on_directions, NULL);
}

unsigned contacts_shorts(void) {
    return shorts;
}

unsigned contacts_floating(void) {
    return floating;
}
