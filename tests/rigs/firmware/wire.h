/* The board's serial line: bytes at the speed of the line, to and from a pseudo-terminal. */
#ifndef WIRE_H
#define WIRE_H

#include <simavr/sim_avr.h>
#include <stdio.h>

void wire_attach(avr_t *board, unsigned baud);

/* Chooses which USART is wired to the line: 0 or 1. */
void wire_choose(int uart);

/* Opens a pseudo-terminal and returns its name; the cable is in. Pulling it closes that. */
const char *wire_plug(void);
void wire_pull(void);

/* Passes on what came from the pseudo-terminal; returns true where its other end was just opened,
 * which resets a Mega. */
int wire_poll(void);

/* Queues bytes as if they came from the pseudo-terminal. */
void wire_send(const unsigned char *bytes, size_t count);
size_t wire_unsent(void);
/* Goes on after a reset of the chip, which forgets its timers. */
void wire_restart(void);
/* Loses what is on its way in, as a board without power does. */
void wire_drop(void);

/* Writes what the board sent since the last call as JSON: hexadecimal, and when each byte was
 * whole [us]. */
void wire_print(FILE *out);

#endif
