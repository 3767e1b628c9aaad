/* The board: which pin does what on the Mega 2560, its clock and the speed of its line.
 *
 * The one file to change for another plug, another wiring or another baud. Port K holds the whole
 * keypad and port C the whole display, so a scan and a nibble are one access each. */
#ifndef BOARD_H
#define BOARD_H

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

#ifndef F_CPU
#define F_CPU 16000000UL
#endif

#ifndef LINE_BAUD
#define LINE_BAUD 115200UL /* or 9600, 19200, 38400, 57600: below 57600 increments only */
#endif

#ifndef ENABLING_BUTTON
#define ENABLING_BUTTON 0 /* 1 where the push button on D2 is fitted */
#endif

enum { FIRMWARE_MAJOR = 1, FIRMWARE_MINOR = 0 };

/* Keypad: rows R1 to R4 on A8 to A11 (PK0 to PK3), columns C1 to C4 on A12 to A15 (PK4 to PK7). */
enum { KEY_ROWS = 4, KEY_COLUMNS = 4, KEYS = KEY_ROWS * KEY_COLUMNS, STOP_KEY = 15 };
enum { ROW_SETTLES_US = 10 };

static inline void keypad_pins_start(void) {
    DDRK = 0;     /* no row is driven */
    PORTK = 0xF0; /* pull-ups on the columns; a driven row is low, since its bit is 0 here */
}

/* Drives one row low; all others are inputs without pull-up, so no two outputs meet in a key. */
static inline void keypad_drive_row(uint8_t row) {
    DDRK = (uint8_t)(1 << row);
}

static inline void keypad_drive_none(void) {
    DDRK = 0;
}

/* Returns one bit for each closed column of the driven row. */
static inline uint8_t keypad_closed_columns(void) {
    return (uint8_t)(~PINK) >> 4;
}

/* Display: RS on D35 (PC2), E on D34 (PC3), D4 to D7 on D33 to D30 (PC4 to PC7). */
enum { LCD_ROWS = 4, LCD_COLUMNS = 20, LCD_CELLS = LCD_ROWS * LCD_COLUMNS };
enum { LCD_RS = 1 << PC2, LCD_E = 1 << PC3, LCD_UNUSED = 1 << PC0 | 1 << PC1 };

static inline void lcd_pins_start(void) {
    PORTC &= LCD_UNUSED;
    DDRC |= (uint8_t)~LCD_UNUSED;
}

/* Enabling button on D2 (PE4), jumpers on D48 (PL1) and D49 (PL0); all close to ground. */
static inline void switch_pins_start(void) {
    PORTE |= 1 << PE4;
    PORTL |= 1 << PL0 | 1 << PL1;
}

static inline bool enabling_is_pressed(void) {
    return !(PINE & 1 << PE4);
}

static inline bool wants_plain_characters(void) {
    return !(PINL & 1 << PL1);
}

static inline bool wants_line_on_pins(void) {
    return !(PINL & 1 << PL0);
}

#endif
