/* Plain characters: one for each pressed key, in place of frames. */
#ifndef LEGACY_H
#define LEGACY_H

#include <stdint.h>

void legacy_start(void);
void legacy_pass(uint16_t now);

#endif
