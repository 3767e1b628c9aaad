/* The keypad's matrix: sixteen contacts, their bounce, and what the columns read through them. */
#ifndef CONTACTS_H
#define CONTACTS_H

#include <simavr/sim_avr.h>

void contacts_wire(avr_t *board);

/* Closes or opens a key, at once or after chattering for some microseconds. */
void contact_set(int key, int closed, unsigned bounce_us);
void contacts_seed(unsigned seed);

/* Connects an input pin to ground, as the button and the jumpers do. */
void switch_set(char port, int pin, int closed);
/* Puts every pin again to what its contacts say; a reset of the chip forgets it. */
void contacts_restore(void);

/* How often a driven row met one driven the other way, and a column floated while it was read. */
unsigned contacts_shorts(void), contacts_floating(void);

#endif
