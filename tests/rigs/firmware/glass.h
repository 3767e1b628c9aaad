/* The display of the board: simavr's HD44780, and a check of the times that a real one needs. */
#ifndef GLASS_H
#define GLASS_H

#include <simavr/sim_avr.h>

void glass_wire(avr_t *board);
void glass_power_off(void);

/* Writes the four rows as a JSON list. */
void glass_print(FILE *out);

/* How often a byte came sooner than a real display would take it; how many bytes came in all. */
unsigned glass_too_fast(void), glass_bytes(void);

/* When the last byte came [us]. */
double glass_written_at(void);

#endif
