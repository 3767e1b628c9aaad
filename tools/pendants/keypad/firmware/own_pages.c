/* Pages that the firmware makes itself, since nobody else does: no bridge, plain characters. */
#include "own_pages.h"

#include <avr/pgmspace.h>
#include <string.h>

#include "board.h"
#include "lcd.h"

enum { BAUD_ENDS = 19 }; /* the column after its last digit */

static void put_row(uint8_t row, PGM_P text) {
    uint8_t cells[LCD_COLUMNS];
    memset(cells, ' ', sizeof cells);
    memcpy_P(cells, text, strlen_P(text));
    lcd_put(row * LCD_COLUMNS, cells, sizeof cells);
}

static void put_version(uint8_t row) {
    uint8_t cells[LCD_COLUMNS] = "keypad 0.0          ";
    cells[7] += FIRMWARE_MAJOR;
    cells[9] += FIRMWARE_MINOR;
    uint8_t column = BAUD_ENDS;
    for (uint32_t rest = LINE_BAUD; rest; rest /= 10) cells[--column] = '0' + rest % 10;
    lcd_put(row * LCD_COLUMNS, cells, sizeof cells);
}

void show_no_bridge(void) {
    put_row(0, PSTR("NO BRIDGE"));
    put_row(1, PSTR("USE THE ROBOT'S OWN"));
    put_row(2, PSTR("STOP BUTTON"));
    put_version(3);
}

void show_plain_characters(void) {
    put_row(0, PSTR("PLAIN CHARACTERS"));
    put_version(1);
    put_row(2, PSTR(""));
    put_row(3, PSTR(""));
}
