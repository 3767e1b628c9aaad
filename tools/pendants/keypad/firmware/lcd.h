/* The display: an HD44780 with four rows of twenty, written only. */
#ifndef LCD_H
#define LCD_H

#include <stdbool.h>
#include <stdint.h>

/* Starts the display from whatever state it is in; all of it is written again. */
void lcd_start(uint16_t now);

/* Puts text at a place, 0 to 79, row by row; what is not printable ASCII becomes a question mark. */
void lcd_put(uint8_t place, const uint8_t *text, uint8_t length);

/* Writes one character or command where the display is ready for it; never waits for it. */
void lcd_pass(uint16_t now);

/* Returns true while something remains to be written. */
bool lcd_has_work(void);

#endif
