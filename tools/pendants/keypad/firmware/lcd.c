/* The display: an HD44780 with four rows of twenty, written only.
 *
 * `wanted` is what should stand there, `shown` what was written; a pass of the loop writes one cell
 * that differs. Nothing is read back, so a display that is missing or broken holds up nothing. */
#include "lcd.h"

#include <avr/pgmspace.h>
#include <string.h>
#include <util/delay.h>

#include "board.h"

/* The slowest of the usual controllers need 53 us for a character. Half microseconds. */
enum { WRITE_TICKS = 2 * 60 };
enum { SET_ADDRESS = 0x80, NOWHERE = 0xFF };

typedef struct {
    uint8_t value;
    bool is_nibble;
    uint8_t wait; /* before it [ms] */
} StartStep;

/* Four nibbles lead from any state, half a byte included, to four bits; then two lines of memory
 * (four rows on the glass), off, clear, cursor to the right, on without cursor. */
static const StartStep STEPS[] PROGMEM = {
    {0x30, true, 50}, {0x30, true, 5}, {0x30, true, 2}, {0x20, true, 2},
    {0x28, false, 2}, {0x08, false, 2}, {0x01, false, 2}, {0x06, false, 4}, {0x0C, false, 2},
};
enum { STEP_COUNT = sizeof STEPS / sizeof STEPS[0] };

static const uint8_t ROW_ADDRESS[LCD_ROWS] PROGMEM = {0x00, 0x40, 0x14, 0x54};

static uint8_t wanted[LCD_CELLS], shown[LCD_CELLS];
static uint8_t next_cell, display_at; /* where to look next; where the display writes next */
static uint8_t step;
static bool differs;
static uint16_t step_began, written_at;

/* Timer 1 counts half microseconds and interrupts nobody. */
static void write_nibble(uint8_t high_bits, uint8_t rs) {
    PORTC = (PORTC & LCD_UNUSED) | high_bits | rs;
    PORTC |= LCD_E;
    _delay_us(1);
    PORTC &= (uint8_t)~LCD_E;
    _delay_us(1);
    written_at = TCNT1;
}

static void write_byte(uint8_t byte, uint8_t rs) {
    write_nibble(byte & 0xF0, rs);
    write_nibble((uint8_t)(byte << 4), rs);
}

void lcd_start(uint16_t now) {
    lcd_pins_start();
    TCCR1B = 1 << CS11;
    memset(shown, 0, sizeof shown); /* as no cell is, so that each is written */
    step = 0;
    step_began = now;
    display_at = NOWHERE;
    differs = true;
}

void lcd_put(uint8_t place, const uint8_t *text, uint8_t length) {
    for (uint8_t i = 0; i < length && place < LCD_CELLS; i++, place++) {
        wanted[place] = text[i] >= 0x20 && text[i] <= 0x7E ? text[i] : '?';
    }
    differs = true;
}

static void start_step(uint16_t now) {
    StartStep next;
    memcpy_P(&next, &STEPS[step], sizeof next);
    if ((uint16_t)(now - step_began) < next.wait) return;
    if (next.is_nibble) {
        write_nibble(next.value, 0);
    } else {
        write_byte(next.value, 0);
    }
    step_began = now;
    step++;
}

/* Finds a cell that differs, from next_cell on and round; returns false where none does. */
static bool find_cell(void) {
    for (uint8_t looked = 0; looked < LCD_CELLS; looked++) {
        if (wanted[next_cell] != shown[next_cell]) return true;
        next_cell = next_cell + 1 < LCD_CELLS ? next_cell + 1 : 0;
    }
    return false;
}

void lcd_pass(uint16_t now) {
    if (step < STEP_COUNT) {
        start_step(now);
        return;
    }
    if (!differs || (uint16_t)(TCNT1 - written_at) < WRITE_TICKS) return;
    if (!find_cell()) {
        differs = false;
        return;
    }
    if (display_at != next_cell) {
        uint8_t row = next_cell / LCD_COLUMNS, column = next_cell % LCD_COLUMNS;
        write_byte(SET_ADDRESS | (pgm_read_byte(&ROW_ADDRESS[row]) + column), 0);
        display_at = next_cell;
        return;
    }
    shown[next_cell] = wanted[next_cell];
    write_byte(shown[next_cell], LCD_RS);
    next_cell = next_cell + 1 < LCD_CELLS ? next_cell + 1 : 0;
    display_at = next_cell % LCD_COLUMNS ? next_cell : NOWHERE; /* memory is no page: rows jump */
}

bool lcd_has_work(void) {
    return differs && step >= STEP_COUNT;
}
