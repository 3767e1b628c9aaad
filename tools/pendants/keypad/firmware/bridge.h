/* The conversation with the bridge: who is here, keys, beats, pages, and what was understood. */
#ifndef BRIDGE_H
#define BRIDGE_H

#include <stdint.h>

/* Begins; `reset_cause` is MCUSR as it was at the start. */
void bridge_start(uint16_t now, uint8_t reset_cause);

/* Obeys what came, and sends what is due. */
void bridge_pass(uint16_t now);

#endif
